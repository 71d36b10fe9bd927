"""The sweep: from recorded light paths to the spectra of all components.

For each path, from its last vertex to its first, three spectra are carried: R, F and G, the light arriving at
the vertex that has luminesced never, once, and more often (Phi E is the integral of D_L E):

    R_k = E_D(x_k) + f_k  S_{k+1} R_{k+1}
    F_k =            f_k (S_{k+1} F_{k+1} + Phi_{k+1} R_{k+1})
    G_k =            f_k (S_{k+1} G_{k+1} + Phi_{k+1} (F_{k+1} + G_{k+1}))

At the camera vertex the sums over the samples are turned into the components, once for each pixel and material row:

    y_1 = S E_D            y_3 = S (R_1 - E_D)      y_5 = S F_1
    y_2 = Phi E_D          y_4 = Phi (R_1 - E_D)    y_6 = S G_1 + Phi (F_1 + G_1)

The recursion is in `propagate.py`, the components in `camera_vertex.py`, Phi in `luminesce.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Executor, wait
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.pixels import Pixels
from fluorspar.paths.log import Chunk, flat, lanes_per_pixel
from fluorspar.paths.sweeping.kernel import compiled, new_scratch
from fluorspar.paths.sweeping.lobe_kernel import LobeTables, compiled_for_lobes, new_lobe_scratch
from fluorspar.paths.sweeping.pooled_errors import pool_errors
from fluorspar.paths.sweeping.spectral_tables import SpectralTables
from fluorspar.scene.sample_sets import batch_count

if TYPE_CHECKING:
    from fluorspar.paths.sweeping.cuda_sweep import SweepOnGpu

__all__ = ["sweep"]

_TASKS = 16  # pixel ranges a chunk is divided into; more than cores, so that none waits long
_ROOM = 8  # material rows of a pixel that there is room for at first


def sweep(
    chunk: Chunk,
    tables: SpectralTables | LobeTables,
    pool: Executor,
    out: Pixels,
    at: int = 0,
    samples: int | None = None,
    gpu: SweepOnGpu | None = None,
    *,
    row_length: int | None = None,
) -> None:
    """Compute the spectra of all components of the pixels of a chunk.

    Parameters
    ----------
    chunk : Chunk
        Recorded light paths.
    tables : SpectralTables or LobeTables
        Spectra of the materials and lights whose rows the paths refer to.
    pool : Executor
        Threads to compute with; the result does not depend on their number.
    out : Pixels
        Where the result goes, the last bands if it holds fewer than the tables; standard errors of the components are
        estimated if there is room for them.
    at : int
        Pixel of `out` that the first one of the chunk becomes.
    samples : int, optional
        Only so many of the samples of each pixel are swept, the first ones of each lane, at least one a lane.
    gpu : SweepOnGpu, optional
        Made of the same tables; it sweeps in place of the threads, which gives the same numbers up to rounding.
    row_length : int, optional
        Pixels of a row of the image; the samples of a pixel are then two sets, and standard errors are pooled over
        neighbours, see `pooled_errors.py`.
    """
    swept = min(samples or chunk.spp, chunk.spp)
    counts = swept, lanes_per_pixel(chunk.spp), batch_count(swept)
    bands, errors = out.radiance.shape[2], out.component_standard_error
    halves = np.empty((1 if errors is None else len(errors) + 1, chunk.pixels, bands), np.float32)
    own = out[at : at + chunk.pixels]
    if gpu is None:
        _sweep_on_cpu(chunk, counts, tables, pool, out, at, halves)
    else:
        gpu.sweep(counts, flat(chunk.log), pool, own, halves)
    if row_length is not None:
        of_components = own.component_standard_error
        estimated = [*(() if of_components is None else of_components), own.standard_error]
        for by_batches, by_halves in zip(estimated, halves, strict=True):
            _do(pool, pool_errors(by_batches, by_halves, chunk.first_pixel, row_length))


def _sweep_on_cpu(
    chunk: Chunk,
    counts: tuple[int, int, int],
    tables: SpectralTables | LobeTables,
    pool: Executor,
    out: Pixels,
    at: int,
    halves: NDArray[np.float32],
) -> None:
    """Run the kernels of the processor; `counts` are samples of a pixel, its lanes and its batches."""
    log = flat(chunk.log)
    scratch_for: Callable[[int], Any]
    if isinstance(tables, LobeTables):
        width = len(tables.wavelengths)
        terms = log.row.size // log.sampled.size
        kernel = compiled_for_lobes(width)
        scratch_for = partial(new_lobe_scratch, terms, width)
    else:
        rows, width = tables.reflectance.shape
        kernel = compiled(width, len(log.direct_light) == 0)
        scratch_for = partial(new_scratch, rows, width)
    errors = out.component_standard_error
    if errors is None:
        errors = out.radiance[:, :0]

    def run(first: int, stop: int) -> None:
        room = _ROOM
        while first < stop:
            scratch: Any = scratch_for(room)
            first = kernel(
                first,
                stop,
                *counts,
                log,
                tables,
                out.radiance,
                out.standard_error,
                errors,
                halves,
                at,
                scratch,
            )
            room *= 2  # for a pixel that sees more rows, or a path that is longer

    edges = np.linspace(0, chunk.pixels, _TASKS + 1).astype(int).tolist()
    _do(pool, [partial(run, *edge) for edge in pairwise(edges)])


def _do(pool: Executor, work: Iterable[Callable[[], None]]) -> None:
    """Do everything; after an exception nobody is at work any more."""
    tasks = [pool.submit(each) for each in work]
    try:
        for task in tasks:
            task.result()
    except BaseException:
        # The caller may do something to `out` after a Ctrl-C, so nobody must write there any more.
        for task in tasks:
            task.cancel()
        wait(tasks)
        raise
