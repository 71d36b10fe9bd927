"""The relative standard error of luminance, against sums by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fluorspar import Wavelengths
from fluorspar.colour.xyz import luminance
from fluorspar.image.pixels import Pixels
from fluorspar.image.relative_error import RelativeErrors

GRID = Wavelengths(400, 700, 20)


def pixels(count: int = 4, bands: int = len(GRID)) -> Pixels:
    made = Pixels.empty(count, bands, component_errors=False)
    made.radiance[...], made.standard_error[...] = 1.0, 0.0
    return made


def test_errors_of_bands_add_up() -> None:
    """In single precision, of random spectra, against the luminance of error and total."""
    made, rng = pixels(100), np.random.default_rng(0)
    made.radiance[...] = rng.uniform(size=made.radiance.shape)
    made.standard_error[...] = rng.uniform(size=made.standard_error.shape)
    errors = RelativeErrors(GRID, 100)
    errors.add(0, made)
    error, total = made.standard_error.astype(float), made.radiance.sum(axis=0, dtype=float)
    by_hand = luminance(error, GRID) / luminance(total, GRID)
    assert errors.of == "luminance"
    assert errors.mean == pytest.approx(by_hand.mean(), rel=1e-6)
    assert errors.p95 == pytest.approx(np.sort(by_hand)[94], rel=1e-6)


def test_bands_that_nobody_sees_do_not_count() -> None:
    grid = Wavelengths(340, 700, 20)
    made = pixels(4, len(grid))
    made.standard_error[:, 0] = 1e3
    errors = RelativeErrors(grid, 4)
    errors.add(0, made)
    assert errors.mean == 0


def test_an_image_that_nobody_sees() -> None:
    grid = Wavelengths(300, 340, 20)
    made = pixels(4, len(grid))
    made.standard_error[...] = [0.7, 1.4, 2.1]
    errors = RelativeErrors(grid, 4)
    errors.add(0, made)
    assert errors.of == "sum of the bands"
    assert errors.mean == pytest.approx(4.2 / 21)


def test_dark_pixels_do_not_count() -> None:
    made = pixels()
    made.radiance[:, :2] = 0
    made.standard_error[3] = 0.7
    errors = RelativeErrors(GRID, 6)
    errors.add(1, made)
    assert errors.lit.tolist() == pytest.approx([0.0, 0.1])
    assert errors.mean == pytest.approx(0.05)


def test_darkness() -> None:
    made = pixels()
    made.radiance[...] = 0
    errors = RelativeErrors(GRID, 4)
    errors.add(0, made)
    assert (errors.mean, errors.p95) == (0, 0)


def test_a_single_sample() -> None:
    made = pixels()
    made.standard_error[...] = np.nan
    errors = RelativeErrors(GRID, 4)
    errors.add(0, made)
    assert (errors.mean, errors.p95) == (math.inf, math.inf)
