"""Spectra: linear between samples, never extrapolated without a word."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fluorspar.errors import ExtrapolationWarning, SpectrumError
from fluorspar.spectral.spectrum import (
    Spectrum,
    as_spectrum,
    check_reflectance,
    read_spectrum,
    trapezoid,
    weighted_sum,
)
from fluorspar.spectral.wavelengths import Wavelengths

RAMP = Spectrum([400, 500, 600], [0.0, 1.0, 0.5], name="ramp")


def test_sampling_is_linear_and_exact_at_the_samples() -> None:
    assert RAMP.on(Wavelengths(400, 600, 25)).tolist() == [0, 0.25, 0.5, 0.75, 1, 0.875, 0.75, 0.625, 0.5]


class TestBeyondTheData:
    """A grid of 300-700 nm on data of 400-600 nm."""

    grid = Wavelengths(300, 700, 50)

    def test_warns_by_default_naming_spectrum_range_and_assumption(self) -> None:
        words = r"ramp: data for 400-600 nm.*300-700 nm by 50.*below 400 nm \(0\) and above 600 nm \(0.5\)"
        with pytest.warns(ExtrapolationWarning, match=words):
            held = RAMP.on(self.grid)
        assert held.tolist() == [0, 0, 0, 0.5, 1, 0.75, 0.5, 0.5, 0.5]

    def test_hold_and_zero_do_it_silently(self) -> None:
        assert RAMP.on(self.grid, outside="hold")[[0, -1]].tolist() == [0, 0.5]
        assert RAMP.on(self.grid, outside="zero")[[0, -1]].tolist() == [0, 0]

    def test_error_refuses(self) -> None:
        with pytest.raises(SpectrumError, match="ends too early"):
            RAMP.on(self.grid, outside="error")

    def test_one_side_only_is_named_alone(self) -> None:
        with pytest.warns(ExtrapolationWarning, match=r"held above 600 nm \(0.5\)$"):
            RAMP.on(Wavelengths(400, 650, 50))

    @pytest.mark.parametrize("outside", ["warn", "hold", "zero", "error"])
    @pytest.mark.parametrize("grid", [Wavelengths(300, 390, 10), Wavelengths(610, 700, 10)])
    def test_no_overlap_is_always_an_error(self, grid: Wavelengths, outside: str) -> None:
        with pytest.raises(SpectrumError, match="do not overlap"):
            RAMP.on(grid, outside=outside)

    def test_a_constant_has_no_end(self) -> None:
        assert Spectrum.constant(0.3).on(Wavelengths(1, 10001, 1000)).tolist() == [0.3] * 11


@pytest.mark.parametrize(
    ("wavelengths", "values", "complaint"),
    [
        ([400, 500], [1, np.nan], "not a finite number(.|\n)*500 nm"),
        ([400, 500], [np.inf, 1], "not a finite number(.|\n)*400 nm"),
        ([400, np.nan], [1, 1], "not a finite number"),
        ([500, 400], [1, 1], "do not ascend(.|\n)*500 nm, then 400 nm"),
        ([400, 400], [1, 1], "do not ascend"),
        ([400, 500], [1, 1, 1], "one length"),
        ([400], [1], "at least two"),
        ([-400, 500], [1, 1], "impossible"),
        ([400, np.inf], [1, 2], "impossible"),
    ],
)
def test_what_is_no_spectrum(wavelengths: list[float], values: list[float], complaint: str) -> None:
    with pytest.raises(SpectrumError, match=complaint):
        Spectrum(wavelengths, values, name="bad")


def test_nobody_can_change_a_spectrum() -> None:
    values = np.array([1.0, 2.0])
    spectrum = Spectrum(np.array([400.0, 500.0]), values)
    values[0] = 7
    assert spectrum.at(400) == 1
    with pytest.raises(ValueError, match="read-only"):
        spectrum.values[0] = 7


@pytest.mark.parametrize(
    ("value", "word"), [(-0.01, "negative"), (1.01, "greater than 1"), (85.0, "percent")]
)
def test_impossible_reflectances(value: float, word: str) -> None:
    with pytest.raises(SpectrumError, match=f"(?s){word}.*" if word != "percent" else "percent"):
        check_reflectance(Spectrum([400, 500], [0.5, value], name="paint"))


def test_reflectance_at_its_limits_passes() -> None:
    assert check_reflectance(Spectrum([400, 500], [0.0, 1.0])).at(500) == 1


def test_integral_over_uneven_samples() -> None:
    # (0 + 1)/2 x 100 + (1 + 0.5)/2 x 100
    assert RAMP.integral() == 125
    assert trapezoid(np.array([1.0, 1.0, 4.0]), np.array([0.0, 1.0, 3.0])) == 1 + 5
    with pytest.raises(SpectrumError, match="no finite integral"):
        Spectrum.constant(1.0).integral()


def test_scaling() -> None:
    assert RAMP.scaled(2).values.tolist() == [0, 2, 1]


class TestAsSpectrum:
    @pytest.mark.parametrize(
        "given", [0.25, "0.25", np.float32(0.25), ([400, 700], [0.25, 0.25]), Spectrum.constant(0.25)]
    )
    def test_kinds(self, given: object) -> None:
        assert as_spectrum(given, "S").at(550) == 0.25
        assert as_spectrum(given, "S").name == "S"

    def test_file(self, tmp_path) -> None:
        file = tmp_path / "lamp.spd"
        file.write_text("# assumed: nothing\n400 1\n500 3\n")
        assert as_spectrum(file).at(450) == as_spectrum(str(file)).at(450) == 2
        assert (as_spectrum(file).name, as_spectrum(file).assumed) == ("lamp.spd", "nothing")

    @pytest.mark.parametrize("given", [None, [1, 2, 3], float("nan"), "nowhere.spd"])
    def test_what_is_none(self, given: object) -> None:
        with pytest.raises(SpectrumError):
            as_spectrum(given)


def test_a_file_with_three_columns_is_no_spectrum(tmp_path) -> None:
    (tmp_path / "xyz.csv").write_text("400,1,2\n500,1,2")
    with pytest.raises(SpectrumError, match="3 columns"):
        read_spectrum(tmp_path / "xyz.csv")


@given(st.lists(st.floats(0, 1), min_size=3, max_size=3), st.floats(0, 1), st.floats(420, 580))
def test_a_weighted_sum_is_the_sum_at_every_wavelength(values: list[float], weight: float, at: float) -> None:
    other = Spectrum([380, 455, 590], values)
    mixed = weighted_sum([RAMP, other], [weight, 1 - weight])
    assert mixed.support == (400, 590)  # as far as both have data
    assert mixed.at(at) == pytest.approx(weight * RAMP.at(at) + (1 - weight) * other.at(at), abs=1e-12)


def test_spectra_without_a_common_range_cannot_be_added() -> None:
    with pytest.raises(SpectrumError, match="no range in common"):
        weighted_sum([RAMP, Spectrum([700, 800], [1, 1])], [0.5, 0.5])


def test_percent_and_micrometres_are_called_so() -> None:
    with pytest.raises(SpectrumError, match="not percent: divide by 100"):
        check_reflectance(Spectrum([400, 500], [40, 50]))
    with pytest.raises(SpectrumError, match="look like micrometres"):
        Spectrum([0.4, 0.7], [1, 1]).on(Wavelengths(400, 700, 100))
