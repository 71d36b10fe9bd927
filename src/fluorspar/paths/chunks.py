"""Trace the light paths of a job, chunk after chunk of pixels."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable
from contextlib import nullcontext
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.files.run_journal import Run
from fluorspar.job import RenderJob
from fluorspar.paths.log import Chunk
from fluorspar.paths.numbering import numbered, rows_shown
from fluorspar.paths.sweeping.gpu import gpu_memory, sweeps_on_gpu
from fluorspar.scene.lobes.textures import sigmoid
from fluorspar.scene.variants import LOBE_VARIANTS, TRACE_VARIANTS, usable_cores, use_variant
from fluorspar.spectral.light import means_over_bands

__all__ = ["CHUNK", "Run", "runs_of", "trace_chunks", "tracer_of", "variant_of"]


# Paths traced at a time. The paths of a pixel are the same whatever this is, but standard errors are pooled within a
# chunk, so it is constant. A small chunk stays in a processor's caches, a large one keeps a GPU busy: 2^21 instead of
# 2^19 halves the time of tracing on an H200. A path has room for 10 to 16 entries of 16 bytes, 24 with several lights,
# and 12 more for each further term of a vertex. Dr.Jit rounds each array up to a power of two, and two chunks are in
# memory, one of them twice while lanes that went on are put behind the others: at 2^21 up to 1.5 GiB, 2.3 with several
# lights and 3.4 with two terms. With more terms a chunk on a GPU is smaller instead, so that 8 GiB suffice.
CHUNK = {"llvm": 1 << 19, "cuda": 1 << 21}
_TEXELS = 1000  # of a picture that is a light, to find its mean


def runs_of(job: RenderJob) -> list[Run]:
    """The runs of pixels that are traced together, row by row from the top left: always the same for a job.

    They have nearly equal lengths, because standard errors are pooled within each.

    Examples
    --------
    >>> runs_of(RenderJob.of("cornell-box", size=(1000, 10), spp=64, variant="llvm"))
    [(0, 5000), (5000, 5000)]
    """
    settings = job.scene.settings
    pixels = settings.width * settings.height
    paths = CHUNK[job.variant]
    if job.variant == "cuda" and job.scene.lobes is not None:
        paths >>= max(0, (job.scene.lobes.terms - 1).bit_length() - 1)
    per_chunk = max(1, paths // settings.spp)
    edges = np.linspace(0, pixels, -(-pixels // per_chunk) + 1).astype(int).tolist()
    return [(first, stop - first) for first, stop in pairwise(edges)]


def trace_chunks(
    job: RenderJob, runs: Iterable[Run] | None = None, *, kept: bool = False, tracer: Any = None
) -> Generator[Chunk]:
    """Trace the light paths of one run of pixels after another.

    Parameters
    ----------
    job : RenderJob
        Same seed, same paths, bit for bit, whatever the number of threads.
    runs : iterable of (int, int), optional
        Some of `runs_of(job)`; default: all. The next one is asked for while the one before is traced.
    kept : bool
        With rows of `numbered`, so that materials may be changed afterwards.
    tracer : Tracer, optional
        That of `tracer_of`, where it is used again.

    Yields
    ------
    Chunk
        Of each run. While the caller works on it, the next one is being traced; two are in memory if the caller keeps
        none.
    """
    import drjit as dr

    with use_variant(variant_of(job)), gpu_memory() if job.variant == "cuda" else nullcontext():
        threads_before = dr.thread_count()
        dr.set_thread_count(job.threads or usable_cores())
        try:
            tracer = tracer or tracer_of(job, kept)
            tracer.on_gpu = not kept and sweeps_on_gpu(job.variant)
            begun: deque[Any] = deque()
            for run in runs_of(job) if runs is None else runs:
                begun.append(tracer.start(*run))
                # One is waiting, so that no core does while the last paths of another are traced.
                if len(begun) > 1:
                    yield tracer.finish(begun.popleft())
            while begun:
                yield tracer.finish(begun.popleft())
        except RuntimeError as err:
            if isinstance(err.__cause__, KeyboardInterrupt):  # Dr.Jit wraps what happens in its loops
                raise KeyboardInterrupt from err
            raise
        finally:
            dr.set_thread_count(threads_before)


def variant_of(job: RenderJob) -> str:
    """The variant of Mitsuba that traces a job."""
    return (TRACE_VARIANTS if job.scene.lobes is None else LOBE_VARIANTS)[job.variant]


def tracer_of(job: RenderJob, kept: bool = False) -> Any:
    """The tracer for the kind of the scene; the variant must be set."""
    scene, survival = job.scene, _survival(job)
    if kept:
        row_of, _ = rows_shown(scene, scene)
        texels = survival[len(scene.materials if scene.lobes is None else scene.lobes.rows) :]
        of_rows = np.append(survival, 0)[np.minimum(row_of, len(survival))]
        survival = np.concatenate([of_rows, texels])
        scene = numbered(scene)
    if scene.lobes is None:
        from fluorspar.paths.tracing.trace_scene import build_trace_scene
        from fluorspar.paths.tracing.tracer import Tracer

        return Tracer(build_trace_scene(scene), scene.settings, survival, job.seed_of_stream, _power(job))
    from fluorspar.paths.tracing.lobe_scene import build_lobe_scene
    from fluorspar.paths.tracing.lobe_tracer import LobeTracer

    return LobeTracer(build_lobe_scene(scene), scene.settings, survival, job.seed_of_stream, _power(job))


def _survival(job: RenderJob) -> NDArray[np.floating]:
    """Largest share of light of any band that leaves each material again, luminescence included, for roulette.

    Whatever the job's Stokes rule, so that paths serve both.

    Returns
    -------
    ndarray of shape (rows,)
    """
    matrices = job.scene.matrices(job.computed_grid)
    of_rows = np.array([min(1.0, matrix.energy_yield().max()) for matrix in matrices])
    lobes = job.scene.lobes
    if lobes is None or not len(lobes.colours):
        return of_rows
    return np.concatenate([of_rows, lobes.brightest], dtype=np.float32)


def _power(job: RenderJob) -> NDArray[np.floating]:
    """Mean of the spectrum of each light over the bands, and over the picture of one that varies.

    Returns
    -------
    ndarray of shape (lights,)
    """
    grid, lights, lobes = job.computed_grid, job.scene.lights, job.scene.lobes
    power = np.array([means_over_bands(light.spectrum, grid).mean() for light in lights])
    if lobes is None:
        return power
    for row, (texture, first) in lobes.light_textures.items():
        texels = lobes.textures[texture].width * lobes.textures[texture].height
        colours = lobes.light_colours[first : first + texels : 1 + texels // _TEXELS, :3]
        power[row] *= sigmoid(colours, grid.values).mean()
    return power
