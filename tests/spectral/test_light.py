"""The light of a lamp on a grid: energy is kept, wherever its lines are."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from fluorspar.errors import ApproximationWarning, ExtrapolationWarning
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.light import light_on, means_over_bands
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(360, 700, 5)


def laser(at: float) -> Spectrum:
    """1 W in a triangle of 1 nm."""
    return Spectrum([at - 0.5, at, at + 0.5], [0.0, 2.0, 0.0], "a laser")


@pytest.mark.parametrize("at", [485.0, 485.3, 486.0, 487.5, 488.0, 489.9, 490.0])
def test_a_laser_gives_its_power_wherever_its_line_is(at: float) -> None:
    with pytest.warns(ApproximationWarning, match=r"used every 5 nm: \d+ % .* averaged .* 360:700:1 "):
        light = light_on(laser(at), GRID)
    assert GRID.step * light.sum() == pytest.approx(1.0, rel=1e-12)
    assert light @ GRID.values / light.sum() == pytest.approx(at, abs=1e-9)  # its place is kept, too
    if 485.5 <= at <= 489.5:  # no part of it beyond its two bands, which share it linearly
        np.testing.assert_allclose(5 * light[[25, 26]], [(490 - at) / 5, (at - 485) / 5], rtol=1e-12)


def test_lines_above_a_continuum_keep_their_energy() -> None:
    w = np.arange(300.0, 801.0)
    rng = np.random.default_rng(3)
    lines = Spectrum(w, 1 + 50 * (rng.random(len(w)) < 0.03), "a tube")
    with pytest.warns(ApproximationWarning, match="a tube"):
        light = light_on(lines, GRID)
    # under triangles that add up to 1 within the grid and fall to 0 outside
    shares = np.clip(1 - np.maximum(360 - w, w - 700) / 5, 0, 1)
    fine = np.arange(300, 800.0001, 0.01)
    exact = np.trapezoid(
        np.interp(fine, w, lines.values) * np.clip(1 - np.maximum(360 - fine, fine - 700) / 5, 0, 1), fine
    )
    assert shares.any()
    assert GRID.step * light.sum() == pytest.approx(exact, rel=1e-6)


def test_linear_pieces_have_their_mean_in_the_middle() -> None:
    sloped = Spectrum([300, 431, 800], [0.2, 3.0, 1.0])
    means = means_over_bands(sloped, GRID)
    away = np.abs(GRID.values - 431) > 5
    np.testing.assert_allclose(means[away], sloped.on(GRID)[away], rtol=1e-12)
    assert (means[~away] < sloped.on(GRID)[~away]).all()


@pytest.mark.parametrize("name", ["D65", "D50", "A", "FL2", "FL11", "LED-B1"])
def test_a_table_on_the_wavelengths_of_the_grid_is_sampled(name: str) -> None:
    lamp, grid = illuminant(name), Wavelengths(380, 780, 5)
    assert np.array_equal(light_on(lamp, grid), lamp.on(grid))
    if name in ("D65", "D50"):  # which are linear within 10 nm
        assert np.array_equal(light_on(lamp, Wavelengths(380, 780, 10)), lamp.on(Wavelengths(380, 780, 10)))


def test_no_light_outside_the_data_and_full_light_up_to_them() -> None:
    """A jump at the end of a table is no line."""
    box = Spectrum([400, 700], [1.0, 1.0], "a box")
    with pytest.warns(ExtrapolationWarning, match="a box: data for 400-700 nm, used on 360-760 nm.*no light"):
        light = light_on(box, Wavelengths(360, 760, 5))
    assert np.array_equal(light, (np.arange(360, 761, 5) >= 400) & (np.arange(360, 761, 5) <= 700))
    with pytest.warns(ExtrapolationWarning):
        off = light_on(Spectrum([402, 702], [1.0, 1.0], "a box"), Wavelengths(360, 760, 5))
    assert 5 * off.sum() == pytest.approx(300, rel=1e-12)


def test_what_is_cut_away_gives_no_light_to_a_neighbouring_band() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert not light_on(laser(399.0), GRID, above=400).any()
        assert 5 * light_on(laser(401.0), GRID, above=400).sum() == pytest.approx(1)


def test_a_weak_line_counts_where_there_is_little_other_light() -> None:
    """A lamp of which 0.0004 is a line in the ultraviolet, which may be all that excites."""
    w = np.arange(300.0, 801.0)
    visible = np.where(w > 400, np.sin((w - 400) / 400 * np.pi) * 100, 0.0)
    weak = Spectrum(w, visible + np.where(w == 363, 12.0, 0.0), "a lamp")
    light = light_on(weak, GRID)
    assert 5 * light[GRID.values < 380].sum() == pytest.approx(12, rel=1e-9)
    smooth = Spectrum(w, 1 + 0.5 * np.sin(w / 60))
    assert np.array_equal(light_on(smooth, Wavelengths(400, 700, 20)), smooth.on(Wavelengths(400, 700, 20)))
