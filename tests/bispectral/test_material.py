"""Materials: normalised once, sampled on any grid, mixed linearly."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fluorspar
from fluorspar.bispectral.material import Fluorophore, Material, mix
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import ExtrapolationWarning, MaterialError, PhotonYieldWarning, SpectrumError
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

FINE = np.arange(300.0, 781.0)
GRID = Wavelengths()


def bell(peak: float, width: float, height: float = 1.0) -> Spectrum:
    return Spectrum(FINE, height * np.exp(-0.5 * ((FINE - peak) / width) ** 2))


def dyed(name: str, peak: float, alpha: float, S: float = 0.1) -> Material:
    return Material(name, Spectrum.constant(S), (Fluorophore(bell(peak, 20, alpha), bell(peak - 60, 20)),))


def sheet(S: float = 0.3, strength: float = 0.02) -> Material:
    """Return a measured matrix, 300-780 nm by 10 nm, that shifts light from 400-450 nm to 500-600 nm."""
    w = np.arange(300.0, 781.0, 10.0)
    cells = np.diag(np.full(len(w), S))
    cells[20:31, 10:16] = strength
    return Material.from_matrix("sheet", MeasuredMatrix(w, w, cells))


class TestExcitationIsNormalisedOnce:
    @given(st.floats(1e-6, 1e6))
    def test_any_scale_gives_integral_1(self, scale: float) -> None:
        dye = Fluorophore(bell(560, 20), bell(500, 20).scaled(scale))
        assert dye.excitation.integral() == pytest.approx(1, rel=1e-12)
        assert dye.excitation.at(500) == pytest.approx(1 / (20 * np.sqrt(2 * np.pi)), rel=1e-6)

    def test_the_render_grid_does_not_matter(self) -> None:
        """A grid from 360 nm sees 340/400 of an excitation of 300-700 nm; beta is not stretched."""
        dye = Fluorophore(bell(650, 10, 0.1), Spectrum([300, 700], [5, 5]))
        for step in (2.5, 5, 10):
            beta = Material("m", Spectrum.constant(0), (dye,)).on(Wavelengths(360, 700, step)).excitation[0]
            assert beta == pytest.approx(np.full(len(beta), 1 / 400))

    def test_it_stays_put_when_done_again(self) -> None:
        dye = Fluorophore(bell(560, 20), bell(500, 20))
        assert Fluorophore(dye.emission, dye.excitation).excitation is dye.excitation

    def test_emission_is_left_alone(self) -> None:
        assert Fluorophore(bell(560, 20, 0.7), bell(500, 20).scaled(9)).emission.at(560) == 0.7

    def test_faults(self) -> None:
        with pytest.raises(SpectrumError, match=r"(?s)emission spectrum is negative.*500 nm"):
            Fluorophore(Spectrum([400, 500], [0, -1]), bell(500, 20))
        with pytest.raises(SpectrumError, match="excitation spectrum is negative"):
            Fluorophore(bell(500, 20), Spectrum([400, 500], [0, -1]))
        with pytest.raises(SpectrumError, match="0 everywhere"):
            Fluorophore(bell(500, 20), Spectrum([400, 500], [0, 0]))
        with pytest.raises(SpectrumError, match="no finite integral"):
            Fluorophore(bell(500, 20), Spectrum.constant(1))


class TestOnAGrid:
    def test_dye_spectra_are_0_outside_their_tables_without_a_warning(self) -> None:
        dye = Fluorophore(Spectrum([500, 600], [0.3, 0.3]), Spectrum([400, 500], [1, 1]))
        D = Material("m", Spectrum.constant(0), (dye,)).on(Wavelengths(350, 650, 50))
        assert D.emission.tolist() == [[0, 0, 0, 0.3, 0.3, 0.3, 0]]
        assert D.excitation.tolist() == [[0, 0.01, 0.01, 0.01, 0, 0, 0]]

    def test_reflectance_is_not_extrapolated_silently(self) -> None:
        paint = Material("paint", Spectrum([400, 700], [0.2, 0.6]))
        with pytest.warns(
            ExtrapolationWarning, match=r"reflectance of 'paint': data for 400-700 nm.*below 400 nm"
        ):
            assert paint.on(GRID).reflectance[0] == 0.2

    def test_an_impossible_material_is_refused_by_name(self) -> None:
        with pytest.raises(MaterialError, match=r"(?s)more photons.*'bright'"):
            dyed("bright", 560, alpha=0.05, S=0.5).with_concentration(50).on(GRID)
        with pytest.warns(PhotonYieldWarning, match="'paper'"):
            # 0.9 reflected, 0.011 x sqrt(2 pi) x 20 x (560/500) = 0.62 x 0.2 luminescent at the peak of beta
            Material("paper", Spectrum.constant(0.9), dyed("", 560, 0.12).fluorophores).on(GRID)

    def test_stokes_rule_reaches_the_matrix(self) -> None:
        material = dyed("m", 540, 0.1)
        half, strict = material.on(GRID), material.on(GRID, "strict")
        own_cells = np.diag(half.band()) - np.diag(strict.band())
        assert own_cells == pytest.approx(0.5 * 5 * half.emission[0] * half.excitation[0])
        assert own_cells.max() > 0

    def test_a_uv_grid_adds_only_what_uv_excites(self) -> None:
        material = dyed("m", 440, 0.1)  # excited at 380 nm
        wide, narrow = material.on(Wavelengths(300, 780, 5)), material.on(GRID)
        assert np.array_equal(wide.band()[12:81, 12:81], narrow.band())


@pytest.mark.parametrize(
    "material", [dyed("dye", 560, 0.1), sheet(), mix([(dyed("dye", 560, 0.1), 0.5), (sheet(), 0.5)])]
)
def test_concentration_scales_luminescence_alone(material: Material) -> None:
    D, double = material.on(GRID), material.with_concentration(2).on(GRID)
    assert double.density() == pytest.approx(2 * D.density())
    assert np.array_equal(double.reflectance, D.reflectance)
    assert not material.with_concentration(0).fluorescent
    assert material.with_concentration(1) is material


@pytest.mark.parametrize("factor", [-1, np.nan, np.inf])
def test_impossible_concentrations(factor: float) -> None:
    with pytest.raises(MaterialError, match="concentration"):
        dyed("dye", 560, 0.1).with_concentration(factor)


class TestMixtures:
    """D mixes linearly, whatever the ingredients are."""

    @pytest.mark.parametrize(
        "other", [dyed("b", 600, 0.08, 0.6), Material("b", Spectrum.constant(0.8)), sheet()]
    )
    def test_the_matrix_is_the_weighted_sum(self, other: Material) -> None:
        a = dyed("a", 520, 0.05)
        mixed = mix([(a, 0.3), (other, 0.7)])
        for grid in (GRID, Wavelengths(300, 780, 10)):
            assert mixed.on(grid).band() == pytest.approx(
                0.3 * a.on(grid).band() + 0.7 * other.on(grid).band()
            )

    def test_mixtures_of_mixtures(self) -> None:
        inner = mix([(sheet(), 0.5), (dyed("a", 520, 0.05), 0.5)])
        outer = mix([(inner, 0.5), (Material("white", Spectrum.constant(0.9)), 0.5)], "outer")
        expected = 0.25 * sheet().on(GRID).density() + 0.25 * dyed("a", 520, 0.05).on(GRID).density()
        assert outer.on(GRID).density() == pytest.approx(expected)
        assert (outer.name, outer.fluorescent) == ("outer", True)
        assert outer.reflectance.at(500) == pytest.approx(0.5 * (0.5 * 0.3 + 0.5 * 0.1) + 0.5 * 0.9)

    def test_factors_stay_factors(self) -> None:
        mixed = mix([(dyed("a", 520, 0.05), 0.25), (dyed("b", 600, 0.08), 0.75)])
        assert mixed.name == "a:0.25,b:0.75"
        assert mixed.on(GRID).rank == 2

    def test_credits_are_kept(self) -> None:
        a, b = (
            Material("a", Spectrum.constant(0), credit="me"),
            Material("b", Spectrum.constant(0), credit="you"),
        )
        assert mix([(a, 0.5), (b, 0.5)]).credit == "a: me\nb: you"

    def test_rounded_weights_are_completed(self) -> None:
        white = Material("w", Spectrum.constant(0.9))
        assert mix([(white, 0.333)] * 3).reflectance.at(500) == pytest.approx(0.9)

    @pytest.mark.parametrize("weights", [(0.5, 0.4), (1.5, -0.5), (1, 0), (np.nan, 0.5), ()])
    def test_weights_that_make_no_mixture(self, weights: tuple[float, ...]) -> None:
        with pytest.raises(MaterialError, match="add up to 1"):
            mix([(Material("w", Spectrum.constant(0.9)), weight) for weight in weights])


class TestReplacedSpectra:
    """`dataclasses.replace` with spectra: those take the place of what the material is a sum of."""

    def test_of_a_mixture(self) -> None:
        mixture = mix([(dyed("a", 520, 0.05, 0.1), 0.5), (dyed("b", 600, 0.08, 0.3), 0.5)])
        white = replace(mixture, reflectance=Spectrum.constant(0.8))
        assert np.array_equal(white.on(GRID).density(), mixture.on(GRID).density())
        assert white.on(GRID).reflectance == pytest.approx(0.8)
        assert replace(mixture, fluorophores=()).on(GRID).band() == pytest.approx(0.2 * np.eye(len(GRID)))

    def test_of_a_measured_matrix(self) -> None:
        """Without luminescence it is its reflectance; another reflectance alone would leave its cells to nobody."""
        plain = replace(sheet(), fluorophores=())
        assert (plain.fluorescent, plain.reflectance.at(500)) == (False, 0.3)
        with pytest.raises(MaterialError, match=r"(?s)reflectance of its own.*sheet.*fit it first"):
            replace(sheet(), reflectance=Spectrum.constant(0.1))

    def test_words_leave_it_alone(self) -> None:
        for material in (sheet(), mix([(sheet(), 0.5), (dyed("a", 520, 0.05), 0.5)])):
            renamed = replace(material, name="another", credit="me")
            assert (renamed.name, renamed.credit, renamed.terms) == ("another", "me", material.terms)


def test_a_material_needs_a_reflectance() -> None:
    with pytest.raises(MaterialError, match=r"(?s)no reflectance.*nothing"):
        Material("nothing")


def test_a_mixture_of_mixtures_is_one_sum() -> None:
    a, b = dyed("a", 520, 0.05), sheet()
    outer = mix([(mix([(a, 0.5), (b, 0.5)]), 0.5), (b, 0.5)])
    assert [(weight, term.name) for weight, term in outer.terms] == [
        (0.25, "a"),
        (0.25, "sheet"),
        (0.5, "sheet"),
    ]
    assert "yes, 0.25 of a and 0.25 of sheet and 0.5 of sheet" in repr(outer)


@pytest.mark.parametrize(
    "material", [dyed("a", 520, 0.05), sheet(), mix([(dyed("a", 520, 0.05), 0.5), (sheet(), 0.5)])]
)
def test_a_material_pickles(material: Material) -> None:
    copy = pickle.loads(pickle.dumps(material))
    assert np.array_equal(copy.on(GRID).band(), material.on(GRID).band())
    assert repr(copy) == repr(material)


def test_impossible_reflectance_is_named() -> None:
    with pytest.raises(SpectrumError, match=r"(?s)greater than 1.*reflectance of 'snow'"):
        Material("snow", Spectrum.constant(1.2))


def test_fluorescent_or_not() -> None:
    assert not Material("grey", Spectrum.constant(0.5)).fluorescent
    assert dyed("a", 520, 0.1).fluorescent
    assert sheet().fluorescent
    assert not sheet(strength=0.0).fluorescent


def test_a_mixture_keeps_data_that_only_one_ingredient_has() -> None:
    """A reaches from 300 nm, B from 400 nm: below, D is half of A's and half of B's end value, which is said."""
    wide = Material("wide", Spectrum([300, 400, 780], [0.1, 0.5, 0.5]))
    narrow = Material("narrow", Spectrum([400, 700], [0.3, 0.7]))
    mixture = mix([(wide, 0.5), (narrow, 0.5)])
    with pytest.warns(ExtrapolationWarning, match="'narrow'.*400-700 nm"):
        D = mixture.on(Wavelengths(300, 780, 20))
    with pytest.warns(ExtrapolationWarning):
        expected = [0.5 * (a.on(D.wavelengths).reflectance) for a in (wide, narrow)]
    assert D.reflectance == pytest.approx(expected[0] + expected[1])
    assert D.luminescent is None


def test_a_mixture_of_dyes_over_different_ranges_stays_in_factors() -> None:
    wide, narrow = dyed("wide", 560, 0.1), dyed("narrow", 600, 0.2)
    wide = replace(wide, reflectance=Spectrum([300, 780], [0.1, 0.1]))
    narrow = replace(narrow, reflectance=Spectrum([400, 700], [0.2, 0.2]))
    grid = Wavelengths(400, 700, 10)
    D = mix([(wide, 0.3), (narrow, 0.7)]).on(grid)
    assert len(D.emission) == 2
    assert D.band() == pytest.approx(0.3 * wide.on(grid).band() + 0.7 * narrow.on(grid).band())


def test_a_matrix_without_visible_wavelengths_is_described(tmp_path: Path) -> None:
    """Its colour is none, and no fault."""
    file = tmp_path / "ultraviolet.csv"
    rows = "300,0.5,0,0", "310,0.01,0.5,0", "320,0.02,0.01,0.5"
    file.write_text("\n".join(["# quantity: band", "# step: 10", "em\\ex,300,310,320", *rows]))
    assert "no colour" in str(fluorspar.material(file))
