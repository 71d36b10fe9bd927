"""Combining independent renders, against the same by hand in double precision."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar import SpectralImage, Wavelengths
from fluorspar.image.combining import AddedPixels, combine, pixels_of
from fluorspar.image.pixels import Pixels, PixelsInFile, PixelsInMemory, Target

GRID = Wavelengths(400, 600, 50)
ROUNDING = 4 * np.finfo(np.float32).eps


def random_pixels(seed: int, count: int = 12, component_errors: bool = True) -> Pixels:
    rng = np.random.default_rng(seed)
    made = Pixels.empty(count, len(GRID), component_errors)
    made.radiance[...] = rng.lognormal(0, 4, made.radiance.shape)
    made.standard_error[...] = rng.lognormal(0, 4, made.standard_error.shape)
    if made.component_standard_error is not None:
        made.component_standard_error[...] = rng.lognormal(0, 4, made.radiance.shape)
    return made


def arrays_of(pixels: Pixels) -> list[np.ndarray]:
    arrays = [pixels.radiance, pixels.standard_error, pixels.component_standard_error]
    return [array.copy() for array in arrays if array is not None]


@pytest.mark.parametrize("component_errors", [True, False])
@pytest.mark.parametrize(("n", "m"), [(64, 64), (1, 65535), (48, 16)])
def test_against_double_precision(n: int, m: int, component_errors: bool) -> None:
    new, old = (random_pixels(seed, component_errors=component_errors) for seed in (1, 2))
    (a, *s), (b, *t) = ([array.astype(float) for array in arrays_of(pixels)] for pixels in (new, old))
    combine(new, n, old, m)
    mean, *errors = arrays_of(new)
    np.testing.assert_allclose(mean, (n * a + m * b) / (n + m), rtol=ROUNDING)
    assert len(errors) == 1 + component_errors
    for error, of_new, of_old in zip(errors, s, t, strict=True):
        by_hand = np.sqrt(n**2 * of_new**2 + m**2 * of_old**2) / (n + m)
        np.testing.assert_allclose(error, by_hand, rtol=ROUNDING)


def test_the_earlier_pixels_are_not_changed() -> None:
    new, old = random_pixels(1), random_pixels(2)
    before = arrays_of(old)
    combine(new, 3, old, 4)
    for array, was in zip(arrays_of(old), before, strict=True):
        np.testing.assert_array_equal(array, was)


def test_order_does_not_matter() -> None:
    """Three passes in two orders, within rounding."""
    results = []
    for order in ([1, 2, 3], [3, 1, 2]):
        done, samples = random_pixels(order[0]), 16 * order[0]
        for number in order[1:]:
            more = random_pixels(number)
            combine(more, 16 * number, done, samples)
            done, samples = more, samples + 16 * number
        results.append(arrays_of(done))
    for first, second in zip(*results, strict=True):
        np.testing.assert_allclose(first, second, rtol=2 * ROUNDING)


@pytest.mark.parametrize("missing", ["new", "old", "both"])
def test_pixels_that_were_not_rendered(missing: str) -> None:
    new, old = random_pixels(1), random_pixels(2)
    holes = {"new": [new], "old": [old], "both": [new, old]}[missing]
    for pixels in holes:
        part = pixels[5:9]
        part.radiance[...], part.standard_error[...] = np.nan, np.nan
        assert part.component_standard_error is not None
        part.component_standard_error[...] = np.nan
    expected = arrays_of({"new": old, "old": new, "both": new}[missing][5:9])
    whole = random_pixels(1)
    combine(whole, 16, random_pixels(2), 16)
    combine(new, 16, old, 16)
    for array, was in zip(arrays_of(new[5:9]), expected, strict=True):
        np.testing.assert_array_equal(array, was)
    for array, was in zip(arrays_of(new[:5]), arrays_of(whole[:5]), strict=True):
        np.testing.assert_array_equal(array, was)


def test_an_unknown_error_is_that_of_the_other_samples() -> None:
    """One sample and n: the variance of a sample is n s^2, so that of the mean is n s^2 / (n + 1)."""
    n = 4
    for unknown in ("new", "old"):
        new, old = random_pixels(1), random_pixels(2)
        hole, known = (new, old) if unknown == "new" else (old, new)
        s = known.standard_error.astype(float)
        hole.standard_error[...] = np.nan
        combine(new, *((1, old, n) if unknown == "new" else (n, old, 1)))
        np.testing.assert_allclose(new.standard_error, s * np.sqrt(n / (n + 1)), rtol=ROUNDING)
    new, old = random_pixels(1), random_pixels(2)
    new.standard_error[...], old.standard_error[...] = np.nan, np.nan
    combine(new, 1, old, 1)
    assert np.isnan(new.standard_error).all()


@pytest.mark.parametrize("streamed", [True, False])
@pytest.mark.parametrize("run", [1, 5, 12])
def test_adding_to_an_image(streamed: bool, run: int, tmp_path: Path) -> None:
    """Chunk by chunk, of an image of 3 x 4 pixels, and to a file of the same name."""
    path = tmp_path / "a.nc"

    def target() -> Target:
        return PixelsInFile(path, GRID, 3, 4, True) if streamed else PixelsInMemory(GRID, 3, 4, True)

    def filled(into: Target, pixels: Pixels) -> SpectralImage:
        with into:
            for first in range(0, 12, run):
                count = min(run, 12 - first)
                room, at = into.room(first, count)
                for array, source in zip(arrays_in(room), arrays_in(pixels), strict=True):
                    array[..., at : at + count, :] = source[..., first : first + count, :]
                into.keep(first, count)
            return into.image({}, partial=False)

    def arrays_in(pixels: Pixels) -> list[np.ndarray]:
        assert pixels.component_standard_error is not None
        return [pixels.radiance, pixels.standard_error, pixels.component_standard_error]

    once = filled(target(), random_pixels(1))
    image = filled(AddedPixels(target(), 32, once, 64), random_pixels(2))
    expected = random_pixels(2)
    combine(expected, 32, random_pixels(1), 64)
    for array, wanted in zip(arrays_of(pixels_of(image, 0, 12)), arrays_of(expected), strict=True):
        np.testing.assert_array_equal(array, wanted)
    image.close()
    assert sorted(tmp_path.iterdir()) == [path] * streamed
