"""Standard errors of evenly spread samples, pooled over neighbouring pixels.

The samples of a pixel are two sets whose random numbers are independent. With v, the squared standard error by the
scatter of these two, which is unbiased but has one degree of freedom, and s, that by the scatter of many batches,
which is known well but does not see how evenly they are spread and is too large, the squared standard error of a pixel
is

    mean(v) (0.7 + 0.3 s / mean(s)),

with means over a window of 25 pixels around it: the neighbours tell how large the noise is, and s how it differs from
pixel to pixel. Pixels at the rim of a lamp, which only some samples show, are left out, and their error is that of
batches. Against converged images the deviations in these standard errors have a standard deviation of 0.92 to 1.04
(Cornell box, still life, open scenes, a bright room; 16 and 64 samples), and their tails are those of a Student's t of
25.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.sweeping.kept_code import FAST, keep_code

__all__ = ["pool_errors"]

_WINDOW = 25
_SIDE = 5
_OWN = 0.3
_TASKS = 8


def pool_errors(
    errors: NDArray[np.float32],
    halves: NDArray[np.float32],
    first_pixel: int,
    row_length: int,
) -> list[Callable[[], None]]:
    """Pool the standard errors of a run of pixels.

    Parameters
    ----------
    errors : ndarray of shape (P, N)
        By the scatter of batches; replaced.
    halves : ndarray of shape (P, N)
        By the scatter of the two halves; NaN for pixels that are left out.
    first_pixel, row_length : int
        Place of the run in the image, and pixels of a row.

    Returns
    -------
    list of callable
        What is to be done, in any order or at once.
    """
    rows = max(1, min(_SIDE, len(errors) // row_length))
    reach = _WINDOW // rows // 2, rows // 2
    squares = np.square(errors)
    last = (first_pixel + len(errors) - 1) // row_length + 1
    edges = np.linspace(first_pixel // row_length, last, _TASKS + 1).astype(int).tolist()

    def work(begin: int, end: int) -> Callable[[], None]:
        return lambda: _pool(errors, squares, halves, first_pixel, row_length, *reach, begin, end)

    return [work(*edge) for edge in pairwise(edges) if edge[0] < edge[1]]


@numba.njit(nogil=True, fastmath=FAST)
def _pool(
    errors: Any,
    squares: Any,
    halves: Any,
    first: int,
    width: int,
    across: int,
    down: int,
    begin: int,
    end: int,
) -> None:
    """Pool the pixels of rows `begin` to `end` of the image; the window is 2 across + 1 wide, 2 down + 1 high."""
    pixels, bands = errors.shape
    scatter = np.empty((width, bands), np.float32)
    apart = np.empty((width, bands), np.float32)
    counts = np.empty(width, np.int64)
    s, v = np.empty(bands, np.float32), np.empty(bands, np.float32)
    one, own = np.float32(1 - _OWN), np.float32(_OWN)
    for y in range(begin, end):
        for x in range(width):
            counts[x] = 0
            scatter[x] = 0
            apart[x] = 0
            for row in range(y - down, y + down + 1):
                p = row * width + x - first
                if 0 <= p < pixels and not np.isnan(halves[p, 0]):
                    counts[x] += 1
                    for j in range(bands):
                        scatter[x, j] += squares[p, j]
                    for j in range(bands):
                        apart[x, j] += halves[p, j] * halves[p, j]
        for x in range(width):
            p = y * width + x - first
            if p < 0 or p >= pixels or np.isnan(halves[p, 0]):
                continue
            s[:] = 0
            v[:] = 0
            n = 0
            for column in range(max(0, x - across), min(width, x + across + 1)):
                n += counts[column]
                for j in range(bands):
                    s[j] += scatter[column, j]
                for j in range(bands):
                    v[j] += apart[column, j]
            per_pixel = np.float32(1) / np.float32(n)
            for j in range(bands):
                if s[j] > 0:
                    share = squares[p, j] / (per_pixel * s[j])
                    errors[p, j] = np.sqrt(per_pixel * v[j] * (one + own * share))


keep_code(_pool, "the pooling of standard errors")
