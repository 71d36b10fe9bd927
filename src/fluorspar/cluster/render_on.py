"""Render a job on the workers of a Dask client."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterable
from contextlib import closing
from typing import TYPE_CHECKING

from fluorspar.cluster.dispatch import rendered_runs
from fluorspar.errors import ClusterError, FluorsparWarning
from fluorspar.image.pixels import Pixels, Target
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import Run, runs_of
from fluorspar.paths.render import keep_finished, new_target
from fluorspar.progress import Progress

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["put", "render_on"]


def render_on(
    client: Client,
    job: RenderJob,
    *,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> SpectralImage:
    """Render a job on the workers of a client; see `fluorspar.render`.

    Returns
    -------
    SpectralImage
        The same bit for bit as `render_job` gives. Partial, with the rest NaN, if the user interrupted, the scheduler
        was lost or runs of pixels have failed again and again; attribute `fault` says what of the last two.

    Raises
    ------
    ClusterError
        If the scheduler is lost, or a worker does not fit, before anything is finished.
    Exception
        What workers raise, if nothing succeeds.

    Warns
    -----
    FluorsparWarning
        If the image is partial.
    """
    began = time.perf_counter()
    pixels = job.scene.settings.width * job.scene.settings.height
    fault = None
    with new_target(job, output) as target:
        try:
            with closing(rendered_runs(client, job, runs_of(job))) as results:
                put(target, results, pixels, progress)
        except KeyboardInterrupt:
            keep_finished(target, pixels)
        except ClusterError as err:
            if target.kept == 0:
                raise
            fault = str(err)
            text = f"{target.kept} of {pixels} pixels are finished, the others are NaN: {fault}"
            warnings.warn(text, FluorsparWarning, stacklevel=4)
        attrs = {**job.attrs, "timings": {"render": round(time.perf_counter() - began, 3)}}
        if fault is not None:
            attrs["fault"] = fault
        return target.image(attrs, partial=target.kept < pixels)


def put(
    target: Target, results: Iterable[tuple[Run, Pixels]], pixels: int, progress: Progress | None = None
) -> None:
    """Put what comes from workers into a target, an image of so many pixels."""
    for (first, count), came in results:
        room, at = target.room(first, count)
        own = room[at : at + count]
        own.radiance[:], own.standard_error[:] = came.radiance, came.standard_error
        if own.component_standard_error is not None:
            own.component_standard_error[:] = came.component_standard_error
        del came
        target.keep(first, count)
        if progress:
            progress(target.kept, pixels)
