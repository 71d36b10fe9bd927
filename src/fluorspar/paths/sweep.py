"""The sweep: from recorded light paths to the spectra of all components.

For each path, from its last vertex to its first, three spectra are carried: R, F and G, the light arriving at
the vertex that has luminesced never, once, and more often (Phi E is the integral of D_L E):

    R_k = E_D(x_k) + f_k  S_{k+1} R_{k+1}
    F_k =            f_k (S_{k+1} F_{k+1} + Phi_{k+1} R_{k+1})
    G_k =            f_k (S_{k+1} G_{k+1} + Phi_{k+1} (F_{k+1} + G_{k+1}))

At the camera vertex the sums over the samples are turned into the components, once for each pixel and material:

    y_1 = S E_D            y_3 = S (R_1 - E_D)      y_5 = S F_1
    y_2 = Phi E_D          y_4 = Phi (R_1 - E_D)    y_6 = S G_1 + Phi (F_1 + G_1)

The loops are in `kernel.py`, Phi in `luminesce.py`.
"""

from __future__ import annotations

from concurrent.futures import Executor
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.kernel import COMPONENT_COUNT, Records, compiled
from fluorspar.paths.light_paths import SLOTS, TILE, LightPaths
from fluorspar.paths.tables import SpectralTables

__all__ = ["Swept", "batch_count", "sweep"]

_MOST_BATCHES = 32
_TASKS = 16  # pixel ranges a chunk is divided into; more than cores, so that none waits long


class Swept(NamedTuple):
    """Spectra of a run of pixels, float32, W m-2 sr-1 nm-1.

    Attributes
    ----------
    radiance
        (pixels, 7, N): the components.
    standard_error
        (pixels, N): of the total; NaN for a single sample.
    component_standard_error
        (pixels, 7, N), or (0, 7, N) if not asked for.
    """

    radiance: NDArray[np.float32]
    standard_error: NDArray[np.float32]
    component_standard_error: NDArray[np.float32]


def batch_count(spp: int) -> int:
    """Number of batches of samples from which standard errors are estimated.

    Examples
    --------
    >>> batch_count(1024), batch_count(20), batch_count(4)
    (32, 20, 4)
    """
    return min(spp, _MOST_BATCHES)


def sweep(
    paths: LightPaths, tables: SpectralTables, bands: int, pool: Executor, *, component_errors: bool = False
) -> Swept:
    """Compute the spectra of all components of the pixels of `paths`.

    Parameters
    ----------
    paths
        Recorded light paths.
    tables
        Spectra of the materials and lights whose rows the paths refer to.
    bands
        Number N of wavelengths.
    pool
        Threads to compute with; the result does not depend on their number.
    component_errors
        Estimate the standard error of each component too.

    Returns
    -------
    Swept
    """
    first, *later = paths.segments
    rest = [
        np.concatenate([getattr(segment, name) for segment in later]) if later else getattr(first, name)[:0]
        for name in _RECORDS
    ]
    # A path goes on at an index within its segment; the later segments are joined, so count on from the first of them.
    starts = np.cumsum([TILE * len(segment.row) for segment in later]).tolist()
    counts = [TILE * len(segment.row) for segment in later]
    rest_length = np.zeros(sum(counts), dtype=np.uint8)
    rest_child = np.full(sum(counts), -1, dtype=np.int64)
    for segment, end, count in zip(later, starts, counts, strict=True):
        start, n = end - count, len(segment.length)
        rest_length[start : start + n] = segment.length
        rest_child[start : start + n] = np.where(segment.child >= 0, segment.child + end, -1)

    swept = Swept(
        np.empty((paths.pixels, COMPONENT_COUNT, bands), dtype=np.float32),
        np.empty((paths.pixels, bands), dtype=np.float32),
        np.empty((paths.pixels if component_errors else 0, COMPONENT_COUNT, bands), dtype=np.float32),
    )
    one_light = first.direct_light.size <= 1
    kernel = compiled(tables.reflectance.shape[1], one_light, component_errors)
    records = Records(*(getattr(first, name).ravel() for name in _RECORDS), first.length, first.child)
    tail = Records(*(values.ravel() for values in rest), rest_length, rest_child)
    longest = SLOTS * len(paths.segments)
    edges = np.linspace(0, paths.pixels, _TASKS + 1).astype(int)
    tasks = [
        pool.submit(
            kernel,
            int(a),
            int(b),
            paths.spp,
            batch_count(paths.spp),
            paths.rr_depth,
            longest,
            records,
            tail,
            tables,
            *swept,
        )
        for a, b in pairwise(edges)
        if a < b
    ]
    for task in tasks:
        task.result()
    return swept


_RECORDS = ("row", "direct", "direct_light", "sampled", "sampled_light", "survival")
