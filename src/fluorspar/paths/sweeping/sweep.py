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

from collections.abc import Sequence
from concurrent.futures import Executor
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.light_paths import SLOTS, TILE, LightPaths, Segment
from fluorspar.paths.sweeping.kernel import COMPONENT_COUNT, Records, compiled
from fluorspar.paths.sweeping.spectral_tables import SpectralTables

__all__ = ["Swept", "batch_count", "room", "sweep"]

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
    paths: LightPaths,
    tables: SpectralTables,
    bands: int,
    pool: Executor,
    *,
    component_errors: bool = False,
    out: Swept | None = None,
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
    out
        Result of `room` for as many pixels or more, to be filled and returned; its old content is lost.

    Returns
    -------
    Swept
    """
    first, *later = paths.segments
    swept = Swept(*(values[: paths.pixels] for values in out or room(paths.pixels, bands, component_errors)))
    one_light = first.direct_light.size <= 1
    kernel = compiled(tables.reflectance.shape[1], one_light, component_errors)
    records = Records(
        **{name: getattr(first, name).ravel() for name in _RECORDS}, length=first.length, child=first.child
    )
    tail = (
        _joined(later)
        if later
        else Records(**{name: values[:0] for name, values in records._asdict().items()})
    )
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


def room(pixels: int, bands: int, component_errors: bool) -> Swept:
    """Allocate the result for so many pixels; using it again and again saves touching fresh memory each time."""
    return Swept(
        np.empty((pixels, COMPONENT_COUNT, bands), dtype=np.float32),
        np.empty((pixels, bands), dtype=np.float32),
        np.empty((pixels if component_errors else 0, COMPONENT_COUNT, bands), dtype=np.float32),
    )


_RECORDS = ("row", "direct", "direct_light", "sampled", "sampled_light", "survival")


def _joined(segments: Sequence[Segment]) -> Records:
    """Join segments behind one another; `child` then counts on from the first path of the first of them."""
    lengths, children, end = [], [], 0
    for segment in segments:
        # Each segment fills whole tiles, so that the tiles of all of them follow one another.
        missing = TILE * len(segment.row) - len(segment.length)
        end += TILE * len(segment.row)
        lengths.append(np.pad(segment.length, (0, missing)))
        children.append(np.pad(np.where(segment.child >= 0, segment.child + end, -1), (0, missing)))
    joined = {
        name: np.concatenate([getattr(segment, name).ravel() for segment in segments]) for name in _RECORDS
    }
    return Records(**joined, length=np.concatenate(lengths), child=np.concatenate(children).astype(np.int32))
