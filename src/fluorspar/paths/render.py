"""From light paths to an image: chunk after chunk is swept into memory or into a file."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

from fluorspar.errors import FluorsparWarning
from fluorspar.image.pixels import PixelsInFile, PixelsInMemory, Target
from fluorspar.image.relative_error import RelativeErrors
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.paths.log import Chunk
from fluorspar.paths.sweeping.gpu import sweeps_on_gpu, why_not_on_gpu
from fluorspar.paths.sweeping.lobe_kernel import LobeTables, lobe_tables
from fluorspar.paths.sweeping.spectral_tables import SpectralTables, spectral_tables
from fluorspar.paths.sweeping.sweep import sweep
from fluorspar.progress import Progress
from fluorspar.scene.sample_sets import sample_sets
from fluorspar.scene.variants import usable_cores

if TYPE_CHECKING:
    from fluorspar.paths.sweeping.cuda_sweep import SweepOnGpu

__all__ = ["fill", "keep_finished", "new_target", "render_chunks", "tables_of"]


def render_chunks(
    chunks: Iterable[Chunk],
    job: RenderJob,
    *,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> SpectralImage:
    """Sweep light paths into an image of all components.

    Parameters
    ----------
    chunks : iterable of Chunk
        Light paths of `job.scene`, pixel after pixel.
    job : RenderJob
        Grid, samples, Stokes rule, errors and attributes of the image.
    output : path-like, optional
        A `.nc` file to stream the image to.
    progress : callable, optional
        Called with the pixels done and the pixels in all, after each chunk.

    Returns
    -------
    SpectralImage
        Partial, with the rest NaN, if the user interrupted.
    """
    began = time.perf_counter()
    pixels = job.scene.settings.width * job.scene.settings.height
    with new_target(job, output) as target:
        try:
            fill(target, chunks, job, progress=progress)
        except KeyboardInterrupt:
            keep_finished(target, pixels)
        timings = {"render": round(time.perf_counter() - began, 3)}
        return target.image({**job.attrs, "timings": timings}, partial=target.kept < pixels)


def new_target(job: RenderJob, output: str | os.PathLike[str] | None) -> Target:
    """Where the pixels of a job go: into memory, or into a `.nc` file."""
    settings = job.scene.settings
    shape = (job.grid, settings.height, settings.width, job.component_errors)
    return PixelsInMemory(*shape) if output is None else PixelsInFile(output, *shape)


def fill(
    target: Target,
    chunks: Iterable[Chunk],
    job: RenderJob,
    *,
    tables: SpectralTables | LobeTables | None = None,
    errors: RelativeErrors | None = None,
    progress: Progress | None = None,
) -> None:
    """Sweep the light paths of a job into a target, and collect the relative errors of what is kept there.

    `tables` are those of `tables_of`, where they are used again.
    """
    settings = job.scene.settings
    with ThreadPoolExecutor(job.threads or usable_cores()) as pool:
        tables = tables or tables_of(job)
        gpu = _gpu(job, tables)
        untold = job.variant == "cuda" and gpu is None and job.stream == 0
        row_length = settings.width if sample_sets(settings) == 2 else None
        for chunk in chunks:
            if untold:  # only now it is certain that the GPU traces
                text = f"light paths are traced on the GPU, but swept on the CPU: {why_not_on_gpu()}"
                warnings.warn(text, FluorsparWarning, stacklevel=5)
                untold = False
            first, count = chunk.first_pixel, chunk.pixels
            room, at = target.room(first, count)
            sweep(chunk, tables, pool, room, at, settings.spp, gpu, row_length=row_length)
            del chunk  # its log goes before the next one comes
            target.keep(first, count)
            if errors is not None:
                errors.add(first, room[at : at + count])
            if progress:
                progress(target.kept, settings.width * settings.height)


def keep_finished(target: Target, pixels: int) -> None:
    """After a Ctrl-C: say what is finished of the `pixels` of an image; interrupt if that is nothing."""
    if target.kept == 0:
        raise KeyboardInterrupt  # nothing to keep, and an older file stays as it was
    if target.kept < pixels:
        text = f"interrupted: {target.kept} of {pixels} pixels are finished, the others are NaN"
        warnings.warn(text, FluorsparWarning, stacklevel=5)


def _gpu(job: RenderJob, tables: SpectralTables | LobeTables) -> SweepOnGpu | None:
    """What sweeps on a GPU, for paths that were traced on one."""
    if sweeps_on_gpu(job.variant):
        from fluorspar.paths.sweeping.cuda_sweep import SweepOnGpu

        return SweepOnGpu(tables, job.component_errors)
    return None


def tables_of(job: RenderJob) -> SpectralTables | LobeTables:
    """Spectra of the scene's materials and lights on the computed grid."""
    grid, lobes = job.computed_grid, job.scene.lobes
    matrices = job.matrices()
    if lobes is not None:
        return lobe_tables(matrices, lobes, job.lights(), lobes.more_on(grid, job.stokes))
    return spectral_tables(matrices, job.lights())
