"""The random numbers of light paths: how evenly they are spread, and what is independent."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from fluorspar.paths.tracing.sobol import MOST_DIMENSIONS, sobol_points
from fluorspar.scene.settings import Settings
from fluorspar.scene.variants import TRACE_VARIANTS, use_variant

Array = NDArray[np.float64]


@pytest.fixture(autouse=True)
def variant() -> Iterator[None]:
    with use_variant(TRACE_VARIANTS["llvm"]):
        yield


def pairs(spp: int, first: int, uses: int, *, pixels: int = 25, seed: int = 0) -> Array:
    """Pairs of numbers, (pixels, uses, spp, 2)."""
    import drjit as dr
    import mitsuba as mi

    from fluorspar.paths.tracing.numbers import PathNumbers

    lane = dr.arange(mi.UInt32, pixels * spp)
    numbers = PathNumbers(Settings(pixels, 1, spp), seed).at(lane // spp, lane % spp, mi.UInt32(first))
    points = [np.array(numbers.two(use)).T.reshape(pixels, spp, 2) for use in range(uses)]
    return np.stack(points, axis=1).astype(np.float64)


@pytest.mark.parametrize(("spp", "first"), [(16, 0), (64, 1), (64, 7), (64, 8), (256, 200)])
def test_each_set_fills_all_boxes_of_a_pair_evenly(spp: int, first: int) -> None:
    """Each elementary interval of the first and best pairs holds one point; of the others each line does."""
    half = spp // 2
    bits = half.bit_length() - 1
    for points in pairs(spp, first, 8).reshape(-1, half, 2):
        for axis in range(2):
            assert (np.sort((points[:, axis] * half).astype(int)) == np.arange(half)).all()
    best = pairs(spp, 2, 1).reshape(-1, half, 2)  # the direction at the first vertex
    for across in range(bits + 1):
        box = (best * [1 << across, 1 << bits - across]).astype(int)
        assert (np.sort(box[..., 0] * (1 << bits - across) + box[..., 1]) == np.arange(half)).all()


def test_a_direction_and_the_light_it_leads_to_are_spread_together() -> None:
    """Of four numbers into halves, 32 points put two into each of 16 boxes; independent ones scatter by 1.4."""
    points = np.concatenate([pairs(64, 2, 1), pairs(64, 3, 1)], axis=-1).reshape(-1, 32, 4)
    boxes = (points * 2).astype(int) @ [1, 2, 4, 8]
    counts = np.array([np.bincount(each, minlength=16) for each in boxes])
    assert counts.std() < 0.8


@pytest.mark.parametrize("spp", [1, 2, 10, 64])
def test_numbers_are_uniform(spp: int) -> None:
    """Also where the samples are no power of two; by chi squared of 16 x 16 boxes, for all pixels together."""
    points = pairs(spp, 0, 20, pixels=3000, seed=3)
    for use in (0, 1, 2, 3, 11, 19):
        boxes = (points[:, use].reshape(-1, 2) * 16).astype(int) @ [1, 16]
        expected = len(boxes) / 256
        chi2 = np.sum((np.bincount(boxes, minlength=256) - expected) ** 2) / expected
        assert chi2 < 255 + 5 * np.sqrt(2 * 255)


def test_uses_sets_pixels_and_seeds_are_independent() -> None:
    """No correlation between numbers of different uses, of the two sets, of neighbours and of two seeds."""
    points = pairs(64, 0, 24, pixels=400)
    centred = points - 0.5

    def correlation(a: Array, b: Array) -> float:
        return float((a * b).mean() * 12 * np.sqrt(a.size))

    others = pairs(64, 0, 24, pixels=400, seed=1) - 0.5
    found = [correlation(centred[:, 0], centred[:, use]) for use in range(1, 24)]
    found += [correlation(centred[:-1, use], centred[1:, use]) for use in range(24)]
    found += [correlation(centred[:, use, :32], centred[:, use, 32:]) for use in range(24)]
    found += [correlation(centred[:, use], others[:, use]) for use in range(24)]
    found += [correlation(centred[:, use, :, 0], centred[:, use, :, 1]) for use in range(24)]
    assert np.abs(found).max() < 4.5


def test_single_numbers_are_uniform_and_independent() -> None:
    import drjit as dr
    import mitsuba as mi

    from fluorspar.paths.tracing.numbers import PathNumbers

    lane = dr.arange(mi.UInt32, 64 * 4000)
    numbers = PathNumbers(Settings(4000, 1, 64), 5).at(lane // 64, lane % 64, mi.UInt32(3))
    values = np.array([numbers.one(use) for use in range(8)]).reshape(8, 4000, 64)
    counts = np.array([np.histogram(each, 64, (0, 1))[0] for each in values])
    chi2 = np.sum((counts - 4000) ** 2, axis=1) / 4000
    assert (chi2 < 63 + 5 * np.sqrt(2 * 63)).all()
    means = values.mean(axis=-1)  # of independent numbers, unlike those that are spread
    assert means.std() == pytest.approx(1 / np.sqrt(12 * 64), rel=0.02)
    assert np.abs(np.corrcoef(values.reshape(8, -1)) - np.eye(8)).max() < 4.5 / np.sqrt(values[0].size)


@pytest.mark.parametrize("bits", [1, 5, 12])
def test_sobols_sequence_is_that_of_scipy(bits: int) -> None:
    from scipy.stats import qmc

    expected = qmc.Sobol(MOST_DIMENSIONS, scramble=False, bits=32).random(1 << bits)
    np.testing.assert_array_equal(sobol_points(MOST_DIMENSIONS, bits).T / 2.0**bits, expected)
