"""Fill an image with what the workers of a Dask client render, or have them trace light paths to be kept."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from typing import TYPE_CHECKING

from fluorspar.cluster.dispatch import rendered_runs, traced_runs
from fluorspar.image.pixels import Target, put
from fluorspar.image.relative_error import RelativeErrors
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import Run
from fluorspar.paths.packed import PackedChunk
from fluorspar.paths.render import Fill
from fluorspar.paths.trace import TracePacked
from fluorspar.progress import Progress

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["fill_on", "trace_on"]


def fill_on(client: Client) -> Fill:
    """Make a function that puts runs of pixels of a job into a target, rendered by the workers of a client.

    The pixels are the same bit for bit as those that are rendered here. The function raises

    ClusterError
        If the scheduler is lost, a worker does not fit, or runs of pixels have failed again and again; the others are
        kept then.
    Exception
        What workers raise, if nothing succeeds.
    """

    def fill(
        target: Target,
        job: RenderJob,
        runs: list[Run],
        *,
        errors: RelativeErrors | None = None,
        progress: Progress | None = None,
    ) -> None:
        pixels = job.scene.settings.width * job.scene.settings.height
        if not runs:
            return
        with closing(rendered_runs(client, job, runs)) as results:
            for first, came in results:
                own = put(target, first, came)
                del came
                if errors is not None:
                    errors.add(first, own)
                if progress:
                    progress(target.kept, pixels)

    return fill


def trace_on(client: Client) -> TracePacked:
    """Make a function that has runs of pixels of a job traced by the workers of a client; raises as that of `fill_on`.

    The light paths are the same bit for bit as those that are traced here.
    """

    def trace(job: RenderJob, runs: list[Run]) -> Generator[PackedChunk]:
        return traced_runs(client, job, runs)

    return trace
