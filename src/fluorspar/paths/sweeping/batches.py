"""Standard errors from batches: the samples of a pixel are divided into batches, whose means scatter.

With n samples in batches of n_b samples and means m_b, the squared standard error of the mean m is

    (sum n_b m_b^2 - n m^2) / (n (batches - 1))
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np

from fluorspar.image.components import COMPONENTS

__all__ = ["COMPONENT_COUNT", "TOTAL", "Tally", "count", "new_tally", "store"]

COMPONENT_COUNT = len(COMPONENTS)
TOTAL = COMPONENT_COUNT  # index behind the components, for the tally of the total


class Tally(NamedTuple):
    """Batch means of the components and, last, of the total: weighted sums and squares of their distance to `pivot`.

    Counted from the mean of the first batch, because in single precision the difference of two large sums would be
    noise. `half` is `sums` of the first half of the batches. All of shape (8, B).
    """

    pivot: Any
    sums: Any
    squares: Any
    half: Any


def new_tally(width: int) -> Any:
    return Tally(*np.zeros((4, COMPONENT_COUNT + 1, width), dtype=np.float32))


@numba.njit(inline="always")
def count(tally: Any, at: int, total: Any, size: int, b: int, batches: int, width: int) -> None:
    """Count in the sum `total` over the `size` samples of batch `b` of `batches`; batch 0 begins anew."""
    n = np.float32(size)
    per_sample = np.float32(1) / n
    if b == 0:
        for j in range(width):
            tally.pivot[at, j] = per_sample * total[j]
            tally.sums[at, j] = 0
            tally.squares[at, j] = 0
    else:
        for j in range(width):
            difference = per_sample * total[j] - tally.pivot[at, j]
            tally.sums[at, j] += n * difference
            tally.squares[at, j] += n * difference * difference
    if b + 1 == batches // 2:
        for j in range(width):
            tally.half[at, j] = tally.sums[at, j]


@numba.njit(inline="always")
def store(
    p: int,
    y: Any,
    tally: Any,
    spp: int,
    batches: int,
    computed: int,
    component_errors: bool,
    radiance: Any,
    error: Any,
    errors: Any,
    halves: Any,
    at: int,
    lamps: int,
) -> None:
    """Write the means and standard errors of pixel `p`, of the last of the `computed` bands that it has room for.

    And the standard errors by the scatter of the two halves of its samples to pixel `at` of `halves`, of shape
    (components + 1, P, N), or (1, P, N) for the total alone, which comes last. They are NaN where only some of the
    samples, `lamps` of them, show a lamp: the error of such a pixel is unlike that of its neighbours.
    """
    bands = radiance.shape[2]
    skip = computed - bands
    scale = np.float32(1) / np.float32(spp)
    freedom = np.float32(spp) * np.float32(batches - 1)
    for c in range(COMPONENT_COUNT):
        for j in range(bands):
            radiance[c, p, j] = scale * y[c, skip + j]
    first = np.float32(batches // 2 * spp // batches)
    if 0 < lamps < spp:
        first = np.float32(0)
    rest = np.float32(spp) - first
    for j in range(bands):
        halves[-1, at, j] = _of_halves(tally.sums[TOTAL, skip + j], tally.half[TOTAL, skip + j], first, rest)
    for j in range(bands):
        error[p, j] = _error(tally.sums[TOTAL, skip + j], tally.squares[TOTAL, skip + j], scale, freedom)
    if component_errors:
        for c in range(COMPONENT_COUNT):
            for j in range(bands):
                errors[c, p, j] = _error(tally.sums[c, skip + j], tally.squares[c, skip + j], scale, freedom)
            for j in range(bands):
                halves[c, at, j] = _of_halves(tally.sums[c, skip + j], tally.half[c, skip + j], first, rest)


@numba.njit(inline="always")
def _error(total: Any, squares: Any, scale: Any, freedom: Any) -> Any:
    """Standard error of a mean from its batches; NaN of a single one."""
    if freedom <= 0:
        return np.float32(np.nan)
    return math.sqrt(max(squares - scale * total * total, np.float32(0)) / freedom)


@numba.njit(inline="always")
def _of_halves(total: Any, half: Any, first: Any, rest: Any) -> Any:
    """Standard error of a mean from its two halves, of `first` and `rest` samples, by the formula above."""
    if first == 0:
        return np.float32(np.nan)
    apart = half / first - (total - half) / rest
    return abs(apart) * math.sqrt(first * rest) / (first + rest)
