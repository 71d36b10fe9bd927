"""From light paths to an image: chunk after chunk is swept into memory or into a file."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from typing import TYPE_CHECKING, Protocol

from fluorspar.errors import ClusterError, FluorsparWarning
from fluorspar.fingerprint import fingerprint
from fluorspar.image.pixels import PixelsInFile, PixelsInMemory, Target
from fluorspar.image.relative_error import RelativeErrors
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import Run, runs_of, trace_chunks
from fluorspar.paths.log import Chunk
from fluorspar.paths.resuming import (
    check_passes,
    earlier_image,
    earlier_left,
    say_unfinished,
    take_over,
    unfinished_image,
)
from fluorspar.paths.sweeping.gpu import sweeps_on_gpu, why_not_on_gpu
from fluorspar.paths.sweeping.lobe_kernel import LobeTables, lobe_tables
from fluorspar.paths.sweeping.spectral_tables import SpectralTables, spectral_tables
from fluorspar.paths.sweeping.sweep import sweep
from fluorspar.progress import Progress
from fluorspar.scene.sample_sets import sample_sets
from fluorspar.scene.variants import usable_cores

if TYPE_CHECKING:
    from fluorspar.paths.sweeping.cuda_sweep import SweepOnGpu

__all__ = [
    "Fill",
    "fill",
    "fill_here",
    "keep_finished",
    "new_target",
    "render_chunks",
    "render_paths",
    "tables_of",
]


class Fill(Protocol):
    """Puts runs of pixels of a job into a target: traced and swept here, or on workers."""

    def __call__(
        self,
        target: Target,
        job: RenderJob,
        runs: list[Run],
        *,
        errors: RelativeErrors | None = None,
        progress: Progress | None = None,
    ) -> None: ...


def fill_here(
    target: Target,
    job: RenderJob,
    runs: list[Run],
    *,
    errors: RelativeErrors | None = None,
    progress: Progress | None = None,
) -> None:
    """Trace and sweep runs of pixels of a job into a target, and collect the relative errors of what is kept there."""
    with closing(trace_chunks(job, runs)) as chunks:
        fill(target, chunks if runs else (), job, errors=errors, progress=progress)


def render_paths(
    job: RenderJob,
    *,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    fill: Fill = fill_here,
) -> SpectralImage:
    """Trace and sweep a job into an image of all components.

    Parameters
    ----------
    job : RenderJob
    output : path-like, optional
        A `.nc` file or `.zarr` store to stream the image to.
    resume : bool
        Go on with what is there of it, if anything is.
    progress : callable, optional
        Called with the pixels done and the pixels in all, after each chunk.
    fill : callable
        Where it is done.

    Returns
    -------
    SpectralImage
        Partial, with the rest NaN, if the user interrupted; or if workers have failed, which attribute `fault` says.
    """
    label = fingerprint(job)
    earlier = None
    if resume and output is not None and label is not None:
        earlier = earlier_image(job, label, output)
        if earlier is not None and not earlier.attrs.get("partial"):
            check_passes(earlier, job, output)
            return earlier
    elif output is not None and label is not None:
        say_unfinished(unfinished_image(job, label, output), output)
    with new_target(job, output, label, resume=resume) as target:
        if earlier is not None:
            take_over(target, earlier, runs_of(job))
            earlier.close()
        left = [run for run in runs_of(job) if not target.has(*run)]
        return _image(target, job, label, lambda: fill(target, job, left, progress=progress))


def render_chunks(
    chunks: Iterable[Chunk],
    job: RenderJob,
    *,
    output: str | os.PathLike[str] | None = None,
    label: Mapping[str, str] | None = None,
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
    label : mapping, optional
        Fingerprint of the job, for the attributes.
    progress : callable, optional
        Called with the pixels done and the pixels in all, after each chunk.

    Returns
    -------
    SpectralImage
        Partial, with the rest NaN, if the user interrupted.
    """
    with new_target(job, output) as target:
        return _image(target, job, label, lambda: fill(target, chunks, job, progress=progress))


def _image(
    target: Target, job: RenderJob, label: Mapping[str, str] | None, work: Callable[[], None]
) -> SpectralImage:
    """Do the work that fills a target, and finish it; what is finished is kept if the work is not."""
    began = time.perf_counter()
    pixels = job.scene.settings.width * job.scene.settings.height
    fault = None
    try:
        work()
    except KeyboardInterrupt:
        keep_finished(target, pixels)
    except ClusterError as err:
        if target.kept == 0:
            raise
        fault = str(err)
        text = f"{target.kept} of {pixels} pixels are finished, the others are NaN: {fault}"
        warnings.warn(text, FluorsparWarning, stacklevel=5)
    timings = {"render": round(time.perf_counter() - began, 3)}
    attrs = {**job.attrs, "fingerprint": label, "timings": timings, "fault": fault}
    return target.image(attrs, partial=target.kept < pixels)


def new_target(
    job: RenderJob,
    output: str | os.PathLike[str] | None,
    label: Mapping[str, str] | None = None,
    *,
    resume: bool = False,
) -> Target:
    """Where the pixels of a job go: into memory, or into a `.nc` file.

    Parameters
    ----------
    job : RenderJob
    output : path-like, optional
        The file.
    label : mapping, optional
        Fingerprint of the job: a writer that is killed then leaves what is finished.
    resume : bool
        Go on with that.
    """
    settings = job.scene.settings
    shape = (job.grid, settings.height, settings.width, job.component_errors)
    if output is None:
        return PixelsInMemory(*shape)
    left = None
    if resume and label is not None:
        left = earlier_left(label, output)
    return PixelsInFile(output, *shape, label, left, resume)


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
                text = f"light paths are traced on the GPU, but spectra are computed on the CPU: {why_not_on_gpu()}"
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
