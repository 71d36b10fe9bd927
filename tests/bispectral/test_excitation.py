"""The wavelengths that excite are not those that an image holds: how far down a grid reaches.

Rationale
    A lamp of 330-400 nm on a brightener: an image that begins at 360 or 400 nm lost a third or more of its
    luminescence, because light that it did not hold excited nothing.
Expected
    What a flat sample gives out in 400-700 nm is the closed form D_L L on a fine grid, wherever the image begins.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from fluorspar.bispectral.excitation import excitation_grid
from fluorspar.bispectral.lamp_colour import colour_under_condition, colour_under_lamp
from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import ExtrapolationWarning, OptionError
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

LAMP = Spectrum(
    [300, 330, 340, 350, 360, 370, 380, 390, 400, 780],
    [0.02, 0.02, 0.1, 0.5, 0.9, 0.9, 0.4, 0.1, 0.02, 0.02],
    "a black light",
)
DYE = Fluorophore(
    Spectrum([400, 440, 520, 700], [0, 0.05, 0.03, 0]), Spectrum([310, 330, 370, 420], [0, 0.4, 1, 0])
)
BRIGHTENED = Material("brightened", Spectrum.constant(0.5), (DYE,))


def test_luminescence_does_not_depend_on_where_the_image_begins() -> None:
    """Against the integral of beta L by itself; all that excites is below the emission here."""

    def taken_up(step: float) -> float:
        w = np.arange(300, 430, step)
        beta, L = (np.interp(w, s.wavelengths, s.values, 0, 0) for s in (DYE.excitation, LAMP))
        return float(step * (beta * L).sum())

    for grid in (Wavelengths(430, 700, 10), Wavelengths(430, 700, 5), Wavelengths(430, 700, 1)):
        found = colour_under_lamp(BRIGHTENED, LAMP, wavelengths=grid)
        assert found.grid == grid
        # what excites 1e-4 of all may be left out; the sum converges with the square of the step
        rtol = 1.1e-4 if grid.step > 1 else 1e-3
        exact = taken_up(grid.step if grid.step > 1 else 0.01) * DYE.emission.on(grid)
        np.testing.assert_allclose(found.luminescent, exact, rtol=rtol)


@pytest.mark.parametrize("name", ["dye-stilbene", "paper-whitened", "poster-red"])
@pytest.mark.parametrize("step", [5, 10])
def test_a_visible_image_holds_what_one_from_300_nm_on_holds(name: str, step: float) -> None:
    visible, wide = (
        colour_under_lamp(material(name), LAMP, wavelengths=Wavelengths(start, 700, step))
        for start in (400, 300)
    )
    shared = wide.grid.values > 399
    scale = wide.luminescent.max()
    assert scale > 0
    np.testing.assert_allclose(visible.light, wide.light[shared], rtol=1e-12)
    np.testing.assert_allclose(visible.reflected, wide.reflected[shared], rtol=1e-12)
    # what excites 1e-4 of all may be left out
    np.testing.assert_allclose(visible.luminescent, wide.luminescent[shared], rtol=1.1e-4, atol=1e-9 * scale)


def test_excitation_can_be_restricted_to_the_grid() -> None:
    grid = Wavelengths(400, 700, 10)
    all_of_it, of_grid = (
        colour_under_lamp(BRIGHTENED, LAMP, wavelengths=grid, excitation=how) for how in ("full", "grid")
    )
    D, light = BRIGHTENED.on(grid), LAMP.on(grid)
    np.testing.assert_array_equal(of_grid.luminescent, D.apply_luminescent(light))
    assert of_grid.luminescent.sum() < 0.02 * all_of_it.luminescent.sum()
    m1, m1_of_grid = (
        colour_under_condition(BRIGHTENED, "M1", wavelengths=grid, excitation=how) for how in ("full", "grid")
    )
    assert m1.lab[2] < m1_of_grid.lab[2] - 0.5
    with pytest.raises(OptionError, match="no such excitation"):
        colour_under_lamp(BRIGHTENED, LAMP, excitation="all")


HELD = Wavelengths(400, 700, 10)


def test_no_further_than_both_the_lamp_and_the_dye_reach() -> None:
    def start(excitation: list[float], light: Spectrum, held: Wavelengths = HELD) -> float:
        beta = Spectrum(excitation, [0.0] + [1.0] * (len(excitation) - 2) + [0.0])
        dye = Fluorophore(Spectrum([400, 500, 700], [0, 0.1, 0]), beta)
        return excitation_grid(held, [Material("dyed", Spectrum.constant(0.5), (dye,))], [light]).start

    constant = Spectrum.constant(1.0)
    assert start([319, 350, 450], constant) == 320  # 319 itself is 0
    assert (
        start([250, 350, 450], Spectrum([331, 332, 700], [0, 1, 1])) == 330
    )  # a band that the lamp lights in part
    assert start([250, 350, 450], Spectrum([300, 340, 341, 700], [0, 0, 1, 1])) == 340  # 0 is no light
    assert start([250, 350, 390], Spectrum([395, 500], [1, 1])) == 400  # nothing in common
    assert start([420, 450, 500], constant) == 400
    assert start([320, 350, 450], constant, Wavelengths(300, 700, 10)) == 300
    assert start([50, 150, 450], constant) == 200  # no air lets through what is below
    assert (
        start([320, 350, 450], constant, Wavelengths(360, 760, 400)) == 360
    )  # a step further is no wavelength


def test_lights_and_dyes_count_in_pairs() -> None:
    """A strong lamp does not hide what another one excites; a dye that emits nothing takes up nothing."""
    red = Fluorophore(Spectrum([600, 650, 700], [0, 0.1, 0]), Spectrum([500, 550, 600], [0, 1, 0]))
    two = [BRIGHTENED, Material("red", Spectrum.constant(0.2), (red,))]
    lamps = [Spectrum.constant(1e6), Spectrum([320, 325, 330], [0, 1e-6, 0])]
    assert excitation_grid(Wavelengths(400, 700, 5), two[1:], lamps).start == 400
    assert excitation_grid(Wavelengths(400, 700, 5), two, lamps[1:]).start == 325
    assert excitation_grid(Wavelengths(400, 700, 5), two, lamps).start == 315
    dark = BRIGHTENED.with_concentration(0.0)
    assert excitation_grid(HELD, [dark], lamps) == HELD


def test_a_measured_matrix_excites_from_its_first_column_on_that_gives_out_light() -> None:
    w = np.arange(300.0, 701.0, 10.0)
    cells = np.diag(np.full(len(w), 0.5))
    cells[(w > 450), 4] = 0.005  # excited at 340 nm only, so from 330 nm on between the columns
    sheet = Material.from_matrix("sheet", MeasuredMatrix(w, w, cells))
    assert excitation_grid(HELD, [sheet], [illuminant("D65")]).start == 340
    assert excitation_grid(Wavelengths(400, 700, 5), [sheet], [illuminant("D65")]).start == 335
    plain = Material.from_matrix("plain", MeasuredMatrix(w, w, np.diag(np.full(len(w), 0.5))))
    assert excitation_grid(HELD, [plain], [illuminant("D65")]) == HELD
    found = colour_under_lamp(sheet, "D65", wavelengths=HELD)
    exact = 0.005 * illuminant("D65").at(340)
    np.testing.assert_allclose(found.luminescent[found.grid.values > 450], exact, rtol=1e-12)


def test_reflectance_that_is_not_known_where_light_excites_is_said() -> None:
    """In a scene, light of 310 nm may be reflected before it excites."""
    narrow = Material("narrow", Spectrum([400, 700], [0.5, 0.5]), (DYE,))
    with pytest.warns(ExtrapolationWarning, match=r"data for 400-700 nm, used on 320-700 nm"):
        colour_under_lamp(narrow, LAMP, wavelengths=HELD)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        colour_under_lamp(narrow, LAMP, wavelengths=HELD, excitation="grid")
