"""What a worker does: trace some runs of pixels of a job, and sweep or pack them."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import lru_cache
from types import TracebackType
from typing import Any, TypeVar

from fluorspar.cluster.fit_workers import Unfit
from fluorspar.cluster.versions import check_versions, versions_here
from fluorspar.errors import ClusterError, FluorsparError, FluorsparWarning, RendererError
from fluorspar.image.pixels import Pixels
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import Run, trace_chunks, tracer_of, variant_of
from fluorspar.paths.packed import PackedChunk
from fluorspar.paths.render import fill, tables_of
from fluorspar.paths.trace import trace_packed
from fluorspar.scene.variants import use_variant

__all__ = ["Done", "do_runs", "in_turn", "pack", "part_of", "without_results"]

# Dr.Jit and Mitsuba have one state in a process, so all tasks of a worker are done in one thread, one after another.
_Answer = TypeVar("_Answer")
_THREAD = ThreadPoolExecutor(1, "fluorspar")


def in_turn(do: Callable[..., _Answer], *given: Any) -> _Answer:
    """Call a function in the one thread of this worker in which Mitsuba is used."""
    return _THREAD.submit(do, *given).result()


def pack(job: RenderJob) -> bytes:
    """Pack a job, with the contents of the scene's files, as plain bytes: any worker can hold it and pass it on.

    Raises
    ------
    SceneError
        If a mesh or picture of the scene has changed, or is gone.
    """
    return pickle.dumps(replace(job, scene=job.scene.carried()))


@dataclass(frozen=True)
class Done:
    """What comes back of each run: `Pixels`, or a `PackedChunk` of its light paths; and what was warned of."""

    results: list[Any]
    warned: list[tuple[type[FluorsparWarning], str]]


def without_results(answer: Done | Unfit) -> Done | Unfit:
    """What a task answers, but for what is large."""
    return replace(answer, results=[]) if isinstance(answer, Done) else answer


def part_of(answer: Done, start: int, stop: int) -> Pixels:
    """Some of the pixels of the one run of a task."""
    pixels: Pixels = answer.results[0]
    return pixels[start:stop]


def do_runs(packed: bytes, runs: list[Run], *, versions: dict[str, str], kept: bool) -> Done | Unfit:
    """Do some of the runs of pixels of a job, with the threads of this worker; a task of Dask.

    Parameters
    ----------
    packed : bytes
        The job, see `pack`.
    runs : list of (int, int)
    versions : dict of str to str
        Of the client, see `versions_here`.
    kept : bool
        Return light paths, to be kept; else they are swept to pixels.
    """
    from distributed import get_worker

    worker = get_worker()
    try:
        check_versions(versions, versions_here(), worker.address)
    except ClusterError as err:
        return Unfit(worker.address, str(err))
    try:
        return in_turn(_do_runs, packed, runs, kept, worker.address, worker.state.nthreads)
    except (
        Exception
    ) as err:  # Dask loses an error whose traceback is very long, and the client would wait for it
        raise err.with_traceback(None) from None


def _do_runs(packed: bytes, runs: list[Run], kept: bool, address: str, threads: int) -> Done | Unfit:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FluorsparWarning)
        try:
            opened = _open(packed, threads, kept)
            results = _traced(opened, runs) if kept else _rendered(opened, runs)
        except RendererError as err:
            return Unfit(address, f"{err}\n  in:       worker {address}")
        except FluorsparError as err:
            raise type(err)(f"{err}\n  in:       worker {address}") from err
    told = [
        (each.category, str(each.message)) for each in caught if issubclass(each.category, FluorsparWarning)
    ]
    return Done(results, told)


def _traced(opened: _Opened, runs: list[Run]) -> list[PackedChunk]:
    return list(trace_packed(opened.job, runs, tracer=opened.tracer))


def _rendered(opened: _Opened, runs: list[Run]) -> list[Pixels]:
    target = _Kept(opened.job)
    with closing(trace_chunks(opened.job, runs, tracer=opened.tracer)) as chunks:
        fill(target, chunks, opened.job, tables=opened.tables)
    return [target.pixels[run] for run in runs]


@dataclass(frozen=True)
class _Opened:
    job: RenderJob
    tables: Any
    tracer: Any


@lru_cache(maxsize=2)
def _open(packed: bytes, threads: int, kept: bool) -> _Opened:
    """Unpack a job, once, and build its scene."""
    job: RenderJob = pickle.loads(packed)
    job = replace(job, threads=job.threads or threads)
    with use_variant(variant_of(job)):
        return _Opened(job, None if kept else tables_of(job), tracer_of(job, kept))


class _Kept:
    """A `Target` that keeps runs of pixels apart."""

    def __init__(self, job: RenderJob) -> None:
        self._bands, self._component_errors = len(job.grid), job.component_errors
        self._begun: Pixels
        self.pixels: dict[Run, Pixels] = {}

    def __enter__(self) -> _Kept:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    @property
    def kept(self) -> int:
        return sum(count for _, count in self.pixels)

    def has(self, first: int, count: int) -> bool:
        return (first, count) in self.pixels

    def stored(self, first: int, count: int) -> Pixels:
        return self.pixels[first, count]

    def room(self, first: int, count: int) -> tuple[Pixels, int]:
        self._begun = Pixels.empty(count, self._bands, self._component_errors)
        return self._begun, 0

    def keep(self, first: int, count: int) -> None:
        self.pixels[first, count] = self._begun

    def image(self, attrs: Any, *, partial: bool) -> Any:
        raise NotImplementedError
