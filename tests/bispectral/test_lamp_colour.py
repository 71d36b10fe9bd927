"""The colour of a material under a lamp, against sums written out here.

Rationale
    No other program at hand computes colours of Donaldson matrices, so the test computes them by itself: with
    loops over wavelengths, the tables of colour-science and the formulas of CIE 15, and nothing of Fluorspar.
Expected
    The same to rounding. Shipped materials show what is known of their kind: a brightener makes paper bluer the
    more ultraviolet there is, and without ultraviolet it does nothing.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray

from fluorspar.bispectral.lamp import WIDE, lamp_on
from fluorspar.bispectral.lamp_colour import colour_under_condition, colour_under_lamp
from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.colour.whiteness import CIE_1964
from fluorspar.colour.xyz import CIE_1931, SRGB_FROM_XYZ
from fluorspar.errors import ApproximationWarning, ExtrapolationWarning, OptionError, SpectrumError
from fluorspar.spectral.colour_science import colour_science
from fluorspar.spectral.spectrum import Spectrum, trapezoid
from fluorspar.spectral.wavelengths import Wavelengths

Array = NDArray[np.float64]

W = np.arange(300.0, 781.0, 10.0)
S = 0.2 + 0.6 / (1 + np.exp(-(W - 480) / 15))
ALPHA = 0.5 * np.exp(-(((W - 540) / 30) ** 2))
BETA = np.exp(-(((W - 400) / 45) ** 2))
GRID = Wavelengths(300, 780, 10)
SAMPLE = Material("sample", Spectrum(W, S), (Fluorophore(Spectrum(W, ALPHA), Spectrum(W, BETA)),))
OBSERVERS = (CIE_1931, CIE_1964)


def table(kind: str, name: str) -> Array:
    """A table of colour-science on W, linear in between and 0 where it ends: (49,) or (49, 3)."""
    colour = colour_science()
    found = {"light": colour.SDS_ILLUMINANTS, "observer": colour.MSDS_CMFS}[kind][name]
    values = np.asarray(found.values, float).reshape(len(found.wavelengths), -1)
    columns = [np.interp(W, found.wavelengths, column, left=0, right=0) for column in values.T]
    return np.squeeze(np.array(columns).T)


def shown(light: Array) -> tuple[Array, Array]:
    """Reflected and luminescent radiance of SAMPLE, cell by cell: the trapezoid rule up to the emission itself."""
    beta = BETA / trapezoid(BETA, W)
    reflected, luminescent = np.zeros(len(W)), np.zeros(len(W))
    for i in range(len(W)):
        reflected[i] = S[i] * light[i]
        for j in range(i + 1):
            luminescent[i] += (0.5 if i == j else 1.0) * 10 * ALPHA[i] * beta[j] * light[j]
    return reflected, luminescent


def tristimulus(radiance: Array, white: Array, observer: str) -> Array:
    cmf = table("observer", observer)
    sums = [sum(radiance[i] * cmf[i, c] for i in range(len(W))) for c in range(3)]
    return 100 * np.array(sums) / sum(white[i] * cmf[i, 1] for i in range(len(W)))


def cielab(xyz: Array, white: Array) -> Array:
    fx, fy, fz = (
        t ** (1 / 3) if t > 216 / 24389 else (24389 / 27 * t + 16) / 116
        for t in (float(a / b) for a, b in zip(xyz, white, strict=True))
    )
    return np.array([116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)])


@pytest.mark.parametrize("observer", OBSERVERS)
@pytest.mark.parametrize(("lamp", "cut"), [("D65", None), ("A", None), ("D50", 400.0), ("D65", 420.0)])
def test_against_sums_written_out(lamp: str, cut: float | None, observer: str) -> None:
    light = np.where((cut or 0) > W, 0.0, table("light", lamp))
    reflected, luminescent = shown(light)
    found = colour_under_lamp(SAMPLE, lamp, uv_cut=cut, observer=observer, wavelengths=GRID)
    tight = {"rtol": 1e-9, "atol": 1e-9}
    np.testing.assert_allclose(found.light, light, **tight)
    np.testing.assert_allclose(found.reflected, reflected, **tight)
    np.testing.assert_allclose(found.luminescent, luminescent, **tight)
    lit = light > 0
    np.testing.assert_allclose(
        found.radiance_factor[lit], (reflected + luminescent)[lit] / light[lit], **tight
    )
    assert np.isnan(found.radiance_factor[~lit]).all()
    xyz, white = (tristimulus(y, light, observer) for y in (reflected + luminescent, light))
    np.testing.assert_allclose(found.xyz, xyz, **tight)
    np.testing.assert_allclose(found.white, white, **tight)
    np.testing.assert_allclose(found.xyz_reflected + found.xyz_luminescent, xyz, **tight)
    np.testing.assert_allclose(found.lab, cielab(xyz, white), rtol=1e-6)
    assert found.luminescent_share == pytest.approx(
        tristimulus(luminescent, light, observer)[1] / xyz[1], rel=1e-9
    )
    # the luminescence is no small thing here: without it the test would notice
    assert np.linalg.norm(found.lab - found.lab_reflected) > 3


def test_plain_srgb_is_the_matrix_and_the_curve_alone() -> None:
    """Of a grey under A: orange, as XYZ says; the adapted one is grey. Out of range values stay what they are."""
    seen = colour_under_lamp(Material("grey", Spectrum.constant(0.5)), "A")
    linear = SRGB_FROM_XYZ @ seen.xyz / 100
    assert seen.plain_srgb == pytest.approx(1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.ptp(seen.srgb) < 0.01 < np.ptp(seen.plain_srgb)
    neon = colour_under_lamp(material("poster-yellow"), "D65")
    assert neon.plain_srgb.min() < 0 < 1 < neon.plain_srgb.max()
    assert not neon.in_gamut


def test_noise_is_no_negative_share_of_the_luminance() -> None:
    w = np.arange(400.0, 701.0, 10.0)
    sheet = MeasuredMatrix(w, w, 0.3 * np.eye(31) - 0.001 * np.tri(31, k=-1))
    with pytest.warns(ExtrapolationWarning):
        seen = colour_under_lamp(Material.from_matrix("sheet", sheet))
    assert seen.xyz_luminescent[1] < 0
    assert seen.luminescent_share == 0


@pytest.mark.parametrize(("name", "source", "cut"), [("M0", "A", 0), ("M1", "D50", 0), ("M2", "D50", 400)])
def test_measurement_conditions(name: str, source: str, cut: float) -> None:
    """The radiance factor is that under the source; the sums multiply it with D50."""
    light, d50 = np.where(cut > W, 0.0, table("light", source)), table("light", "D50")
    factor = sum(shown(light)) / np.where(light > 0, light, np.inf)
    white = np.where(light > 0, d50, 0.0)
    found = colour_under_condition(SAMPLE, name, wavelengths=GRID)
    np.testing.assert_allclose(found.xyz, tristimulus(factor * d50, white, CIE_1931), rtol=1e-9)
    np.testing.assert_allclose(found.lab, cielab(found.xyz, tristimulus(white, white, CIE_1931)), rtol=1e-6)
    assert np.abs(found.white - [96.42, 100, 82.49]).max() < 0.2  # D50, as printed everywhere


def test_without_fluorescence_the_source_of_a_measurement_does_not_matter() -> None:
    plain = Material("plain", Spectrum(W, S))
    m0, m1 = (colour_under_condition(plain, name).lab for name in ("M0", "M1"))
    np.testing.assert_allclose(m0, m1, atol=1e-9)


def test_a_perfect_white_is_white_under_every_lamp() -> None:
    white = Material("white", Spectrum.constant(1.0))
    for lamp in ("D65", "D50", "A", "E"):
        found = colour_under_lamp(white, lamp)
        np.testing.assert_allclose(found.lab, [100, 0, 0], atol=1e-9)
        np.testing.assert_allclose(found.srgb, 1, atol=1e-3)
        assert found.in_gamut
        assert found.whiteness.whiteness == pytest.approx(100)


@pytest.mark.parametrize(("name", "gain"), [("paper-whitened", 2.0), ("dye-stilbene", 20.0)])
def test_brightener_needs_ultraviolet(name: str, gain: float) -> None:
    """The more ultraviolet, the bluer and the whiter: an index card by a little, a strong brightener by much."""
    paper = material(name)
    m0, m1, m2 = (colour_under_condition(paper, condition).lab[2] for condition in ("M0", "M1", "M2"))
    assert m1 < m0 < m2
    day, filtered = (
        colour_under_lamp(paper, "D65", uv_cut=cut, observer=CIE_1964).whiteness for cut in (None, 420)
    )
    assert day.valid
    assert filtered.valid
    assert day.whiteness > filtered.whiteness + gain


def test_fluorescent_paint_is_brighter_than_white_where_it_emits() -> None:
    """And brighter than sRGB can show: the swatch is dimmed, and stays yellow."""
    neon = colour_under_lamp(material("neon-yellow"), "D65")
    assert np.nanmax(neon.radiance_factor) > 1.1
    assert neon.xyz[1] > 100
    assert not neon.in_gamut
    red, green, blue = neon.srgb
    assert green > 0.99
    assert blue < 0.5 < red


def test_lamp_whose_data_end_is_dark_there_and_that_is_said() -> None:
    with pytest.warns(ExtrapolationWarning, match="FL11: data for 380-780 nm.*no light outside"):
        light, _ = lamp_on("FL11", WIDE)
    assert not light[WIDE.values < 380].any()
    light, words = lamp_on("FL11", WIDE, uv_cut=400)  # nothing is missing then, so nothing is said
    assert not light[WIDE.values < 400].any()
    assert "below 400 nm" in words


def test_ultraviolet_lamp_has_no_white_to_compare_with() -> None:
    lamp = Spectrum([310, 320, 330], [0, 1, 0], "black light")
    with pytest.raises(SpectrumError, match="this light is not visible"):
        colour_under_lamp(SAMPLE, lamp)


@pytest.mark.parametrize("cut", [float("nan"), -1.0, 900.0])
def test_impossible_cuts(cut: float) -> None:
    with pytest.raises(OptionError, match="cut"):
        lamp_on("D65", GRID, uv_cut=cut)


def test_negative_light_is_refused() -> None:
    with pytest.raises(SpectrumError, match="a light is negative"):
        lamp_on(Spectrum([300, 780], [1, -1], "odd lamp"), GRID)


@pytest.mark.parametrize(("name", "hint"), [("M3", "use M2"), ("D50", "M0, M1, M2")])
def test_unknown_condition(name: str, hint: str) -> None:
    with pytest.raises(OptionError, match=hint):
        colour_under_condition(SAMPLE, name)


LINE = Spectrum(
    np.arange(300.0, 781.0),
    np.where(np.arange(300, 781) == 546, 500.0, 0.0) + 1.0,
    "a tube with a line at 546 nm",
)


def test_a_lamp_with_lines_is_used_as_finely_as_it_is_tabulated() -> None:
    """A line at 546 nm lies between the samples of a 5 nm grid: the default grid follows the lamp, others average."""
    paint = material("poster-red")
    found = colour_under_lamp(paint, LINE)
    assert found.grid.step == 1
    written_out = colour_under_lamp(paint, LINE, wavelengths=Wavelengths(300, 780, 1))
    assert found.lab == pytest.approx(written_out.lab)
    with pytest.warns(
        ApproximationWarning, match=r"tabulated every 1 nm, used every 5 nm: \d+ % .*300:780:1"
    ):
        coarse = colour_under_lamp(paint, LINE, wavelengths=Wavelengths(300, 780, 5))
    assert np.abs(coarse.lab - found.lab).max() < 0.1  # and the line counts all the same


def test_a_smooth_lamp_of_a_fine_table_is_no_reason_for_a_warning() -> None:
    fine = np.arange(300.0, 781.0)
    smooth = Spectrum(fine, 1 + 0.5 * np.sin(fine / 60), "smooth")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        colour_under_lamp(material("poster-red"), smooth, wavelengths=Wavelengths(300, 780, 5))


def test_whiteness_says_that_it_is_meant_for_d65() -> None:
    white = material("white-85")
    assert not any("D65" in text for text in colour_under_lamp(white, "D65").whiteness.outside)
    for other in (colour_under_lamp(white, "A"), colour_under_condition(white, "M1")):
        assert "meant for D65" in other.whiteness.outside[-1]


def test_whiteness_is_defined_for_two_observers() -> None:
    white = Material("white", Spectrum.constant(1.0))
    assert colour_under_lamp(white, "D65", observer=10).whiteness.valid
    other = colour_under_lamp(white, "D65", observer="CIE 2015 10 Degree Standard Observer")
    assert other.lab == pytest.approx([100, 0, 0], abs=1e-6)
    assert "CIE 1964 only" in other.whiteness.outside[0]


def test_a_black_sample_has_no_whiteness() -> None:
    black = colour_under_lamp(Material("black", Spectrum.constant(0.0)), "D65").whiteness
    assert not black.valid
    assert black.outside == ("a black sample has none",)


def test_light_of_which_a_cone_sees_nothing_has_no_colour() -> None:
    """Above 770 nm the 2 degree observer has no Z: CIELAB would be nan."""
    with pytest.raises(SpectrumError, match="cannot be the white"):
        colour_under_lamp(material("poster-red"), "D65", uv_cut=770)
