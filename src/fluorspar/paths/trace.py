"""Trace the light paths of a job and keep them: in memory, or in a file."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from typing import Any, Protocol

from fluorspar.errors import FluorsparError, FluorsparWarning, OptionError, message
from fluorspar.files.beside import remove_unfinished
from fluorspar.fingerprint import fingerprint
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import Run, runs_of, trace_chunks
from fluorspar.paths.light_paths import LightPaths, load_paths
from fluorspar.paths.numbering import count_rows
from fluorspar.paths.packed import PackedChunk, pack
from fluorspar.paths.paths_file import PathsWriter
from fluorspar.paths.resuming import look_for, pixels_left, say_unfinished
from fluorspar.progress import Progress
from fluorspar.scene.variants import usable_cores

__all__ = ["TracePacked", "trace_job", "trace_packed"]


class TracePacked(Protocol):
    """Traces runs of pixels of a job, here or on workers, and packs their light paths; in any order."""

    def __call__(self, job: RenderJob, runs: list[Run]) -> Generator[PackedChunk]: ...


def trace_packed(job: RenderJob, runs: Iterable[Run], *, tracer: Any = None) -> Generator[PackedChunk]:
    """Trace runs of pixels of a job one after another, and pack their light paths.

    `tracer` is that of `tracer_of` for paths that are kept, where it is used again.
    """
    rows, _ = count_rows(job.scene)
    with (
        closing(trace_chunks(job, runs, kept=True, tracer=tracer)) as chunks,
        ThreadPoolExecutor(job.threads or usable_cores()) as pool,
    ):
        for chunk in chunks:
            yield pack(chunk, rows, pool)


def trace_job(
    job: RenderJob,
    progress: Progress | None = None,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    trace: TracePacked = trace_packed,
) -> LightPaths:
    """Trace all light paths of a job and keep them, in memory or in a file.

    Returns
    -------
    LightPaths
        Of fewer pixels, if the user interrupted.

    Raises
    ------
    OptionError
        If they do not fit into memory.
    ImageError
        If the file cannot be written.
    ClusterError
        If workers do not do it. What has come from them is left beside the file, to be continued.
    """
    if output is None:
        kept: list[PackedChunk] = []
        fix = "write them to a file (output=...), or trace fewer samples or a smaller image"
        _trace(job, trace, progress, kept.append, fix, set())
        return LightPaths(job, tuple(sorted(kept, key=lambda chunk: chunk.first_pixel)))
    label, left, earlier = fingerprint(job), None, None
    settings = job.scene.settings
    pixels = settings.width * settings.height
    if resume and label is not None:
        found = look_for(label, output, lambda: load_paths(output).fingerprint)
        left, earlier = found.left, load_paths(output) if found.is_there else None
        if earlier is not None and earlier.pixels == pixels:
            if left is not None:
                remove_unfinished(left)
            return earlier
    elif label is not None and (there := max(pixels_left(label, output), _pixels_in(output, label, pixels))):
        say_unfinished(f"{there} of {pixels} pixels", output)
    with PathsWriter(output, job, label, left, journaled=True) as writer:
        for chunk in () if earlier is None else earlier.chunks:
            if chunk.first_pixel not in writer.written:
                writer.write(chunk)
        fix = "free memory: half a million paths are traced at a time"
        _trace(job, trace, progress, writer.write, fix, writer.written)
        writer.keep()
    return load_paths(output)


def _pixels_in(output: str | os.PathLike[str], label: Mapping[str, str], pixels: int) -> int:
    """How many pixels an unfinished file of light paths has; 0 if it is another one, finished or none."""
    with suppress(FluorsparError):
        there = load_paths(output)
        return there.pixels if there.fingerprint == label and there.pixels < pixels else 0
    return 0


def _trace(
    job: RenderJob,
    trace: TracePacked,
    progress: Progress | None,
    keep: Callable[[PackedChunk], object],
    fix: str,
    before: Iterable[int],
) -> None:
    """Hand over the paths of the runs that do not begin with pixels `before`; some, if the user interrupts."""
    settings = job.scene.settings
    pixels = settings.width * settings.height
    runs = [run for run in runs_of(job) if run[0] not in before]
    done = pixels - sum(count for _, count in runs)
    if not runs:
        return
    try:
        with closing(trace(job, runs)) as chunks:
            for chunk in chunks:
                keep(chunk)
                done += chunk.pixels
                del chunk  # before the next one comes
                if progress:
                    progress(done, pixels)
    except MemoryError as err:
        raise OptionError(
            message(
                "the light paths do not fit into memory",
                got=f"{settings.width} x {settings.height} pixels, {settings.spp} samples",
                fix=fix,
            )
        ) from err
    except KeyboardInterrupt:
        if not done:
            raise  # nothing to keep
        if done < pixels:
            text = f"interrupted: the paths of {done} of {pixels} pixels are kept"
            warnings.warn(text, FluorsparWarning, stacklevel=4)
