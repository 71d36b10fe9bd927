"""Give the runs of pixels of a job to workers, and take what they send back, in any order."""

from __future__ import annotations

import time
import uuid
import warnings
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from fluorspar.cluster.connect import check_connection, connection
from fluorspar.cluster.fit_workers import FitWorkers, Unfit
from fluorspar.cluster.task import Done, do_runs, pack, part_of, without_results
from fluorspar.cluster.versions import versions_here
from fluorspar.errors import ClusterError, message
from fluorspar.image.components import COMPONENTS
from fluorspar.image.pixels import Pixels
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import Run
from fluorspar.paths.packed import PackedChunk

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["rendered_runs", "traced_runs"]

# A task is more than one run while many are left: the scheduler has less to do.
_RUNS = 8
_TASK = 64 * 2**20  # bytes that come back at once
_SHARES = 4  # tasks of each worker that what is left is enough for, so that none waits long for the last
_BEGUN = 3  # tasks of each worker, of which one is being done: the others are there when it is
_BEGUN_LARGE = 1  # tasks of more than `_TASK`: their results wait in the worker, which is the faster one
_LOOK = 5.0  # seconds after which workers are looked for that are new, or lost
_LONG = 600.0  # seconds in which a result has come that is there
_TRIES = 2
_PATH = 60  # bytes of packed light paths, at the most of what was seen


def rendered_runs(client: Client, job: RenderJob, runs: Sequence[Run]) -> Generator[tuple[int, Pixels]]:
    """Render runs of pixels on the workers of a client; there is little in memory here but what is yielded.

    Parameters
    ----------
    client : distributed.Client
    job : RenderJob
        Of method `"paths"`, without passes.
    runs : sequence of (int, int)
        Some of `runs_of(job)`.

    Yields
    ------
    (first_pixel, Pixels)
        A run, or a part of a large one, in the order in which they come.

    Raises
    ------
    SceneError
        If a mesh or picture of the scene has changed, or is gone.
    ClusterError
        If the scheduler is lost, or no worker fits; or after all others have been yielded, if runs have failed again
        and again.
    Exception
        What a worker has raised, if nothing succeeds.
    """
    per_pixel = _bytes_of_pixel(job)
    with closing(_Work(client, job, runs, per_pixel, kept=False)) as work:
        for task in work.finished():
            with work.trying(task):
                if len(task.runs) > 1 or task.runs[0][1] * per_pixel <= _TASK:
                    done = work.take(work.result(task))
                    for (first, _), pixels in zip(task.runs, done.results, strict=True):
                        yield first, pixels
                        del pixels
                    del done
                else:
                    ((first, count),) = task.runs
                    work.take(work.ask(task, without_results))
                    for start in range(0, count, _TASK // per_pixel):
                        stop = min(start + _TASK // per_pixel, count)
                        yield first + start, work.ask(task, part_of, start, stop)
            del task  # the workers forget the result


def traced_runs(client: Client, job: RenderJob, runs: Sequence[Run]) -> Generator[PackedChunk]:
    """Trace runs of pixels on the workers of a client; as `rendered_runs`.

    Yields
    ------
    PackedChunk
        Of each run, in the order in which they come.
    """
    with closing(_Work(client, job, runs, _PATH * job.scene.settings.spp, kept=True)) as work:
        for task in work.finished():
            with work.trying(task):
                done = work.take(work.result(task))
                yield from done.results
                del done
            del task


def _bytes_of_pixel(job: RenderJob) -> int:
    spectra = len(COMPONENTS) * (2 if job.component_errors else 1) + 1
    return 4 * len(job.grid) * spectra


class _Again(Exception):
    """What was done, or begun, is to be done again: by a worker that fits, or because all that could are lost."""


@dataclass(frozen=True)
class _Task:
    """Runs of pixels that were given to workers: to some only, if there are others that do not fit."""

    future: Future
    runs: list[Run]
    only: list[str] | None


class _Work:
    """The tasks of a job: those that wait, those that workers have, and what has failed."""

    def __init__(
        self, client: Client, job: RenderJob, runs: Sequence[Run], bytes_of_pixel: int, *, kept: bool
    ) -> None:
        self._client, self._kept = client, kept
        self._name = f"fluorspar-{uuid.uuid4().hex[:8]}"
        self._begun: dict[str, _Task] = {}
        self._finished: SimpleQueue[Future] = SimpleQueue()
        self._failures: dict[Run, list[Exception]] = {}
        self._told: set[tuple[type[Warning], str]] = set()
        self._number = 0
        self._succeeded = False
        packed, self._versions = pack(job), versions_here()
        self._workers = FitWorkers(client)
        with connection(client), warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            # A task, not data that are scattered: where the workers that hold it are lost, any other one does it again.
            self._job = client.submit(bytes, packed, key=f"{self._name}-job")
        self._bring_job(self._workers.fit)
        size = max((count for _, count in runs), default=1) * bytes_of_pixel
        self._most = _BEGUN if size <= _TASK else _BEGUN_LARGE
        self._most_runs = max(1, min(_RUNS, _TASK // size))
        self._fresh = deque(runs)
        self._again: deque[list[Run]] = deque()

    def finished(self) -> Iterator[_Task]:
        """Go through the tasks that are finished, or have failed, until there is nothing left to do.

        Raises
        ------
        ClusterError, Exception
            If runs have failed again and again.
        """
        while self._fresh or self._again or self._begun:
            if time.monotonic() - self._looked > _LOOK:
                self._look()
            self._begin()
            with suppress(Empty):
                task = self._begun.pop(self._finished.get(timeout=1.0).key, None)
                check_connection(self._client)
                if task is not None:
                    yield task
                del task
            check_connection(self._client)
        self._check()

    @contextmanager
    def trying(self, task: _Task) -> Iterator[None]:
        """Take what has come of some runs; if that fails, have each done once more, by itself."""
        try:
            yield
        except _Again:
            self._again.extend([run] for run in task.runs)
        except Exception as err:
            self._failed(task.runs, err)
        else:
            self._succeeded = True

    def take(self, answer: Done | Unfit) -> Done:
        """Take an answer: pass on what the worker warns of, once; give one that does not fit no more work."""
        if isinstance(answer, Unfit):
            self._workers.refuse(answer)
            raise _Again
        for kind, text in answer.warned:
            if (kind, text) not in self._told:
                self._told.add((kind, text))
                warnings.warn(text, kind, stacklevel=6)
        return answer

    def result(self, task: _Task) -> Any:
        """What a task answers."""
        return self._come(task.future, task)

    def ask(self, task: _Task, function: Any, *given: Any) -> Any:
        """Call a function on the worker that has the result of a task."""
        return self._come(
            self._client.submit(function, task.future, *given, pure=False, workers=task.only), task
        )

    def _come(self, future: Future, task: _Task) -> Any:
        """Wait for something, for as long as there are workers that can do it."""
        from distributed import wait

        while not future.done():
            with connection(self._client), suppress(TimeoutError):
                wait([future], timeout=_LOOK)
            self._look()
            if self._is_lost(task):
                raise _Again
        return future.result(timeout=_LONG)

    def close(self) -> None:
        """Let the workers stop after what they are doing."""
        futures = [*(task.future for task in self._begun.values()), self._job]
        self._begun.clear()
        if self._client.status == "running":
            with suppress(Exception):
                self._client.cancel(futures)

    def _begin(self) -> None:
        """Give the workers as much as they should have."""
        fit = self._workers.fit
        with connection(self._client):
            while fit and (self._fresh or self._again) and len(self._begun) < self._most * len(fit):
                runs, only = self._next(), self._workers.only
                self._number += 1
                future = self._client.submit(
                    do_runs,
                    self._job,
                    runs,
                    versions=self._versions,
                    kept=self._kept,
                    key=f"{self._name}-{self._number:06d}",
                    pure=False,
                    workers=only,
                )
                self._begun[future.key] = _Task(future, runs, only)
                future.add_done_callback(self._finished.put)

    def _next(self) -> list[Run]:
        """What the next task is: what is to be done again, or as many runs as leave enough for all workers."""
        if self._again:
            return self._again.popleft()
        share = len(self._fresh) // (_SHARES * len(self._workers.fit))
        return [self._fresh.popleft() for _ in range(max(1, min(self._most_runs, share)))]

    def _failed(self, runs: list[Run], err: Exception) -> None:
        check_connection(self._client)
        if isinstance(err, ClusterError):
            raise err
        for run in runs:
            failures = self._failures.setdefault(run, [])
            failures.append(err)
            if len(failures) < _TRIES:
                self._again.append([run])
        hopeless = sum(len(failures) == _TRIES for failures in self._failures.values())
        if not self._succeeded and hopeless > _BEGUN * len(self._workers.fit):
            self._check()

    def _check(self) -> None:
        """Say what has failed again and again."""
        failures = {run: errors for run, errors in self._failures.items() if len(errors) == _TRIES}
        if failures:
            first = next(iter(failures.values()))[-1]
            if not self._succeeded:
                raise first
            raise ClusterError(
                message(
                    f"{sum(count for _, count in failures)} pixels could not be rendered",
                    where=f"{len(failures)} runs of pixels, the first from pixel {min(failures)[0]} on, "
                    f"{_TRIES} times each",
                    got=f"{type(first).__name__}: {first}",
                )
            ) from first

    def _look(self) -> None:
        """Find out which workers there are; do again what only workers could do that are lost."""
        self._bring_job(self._workers.look(patient=self._succeeded))
        for key, task in list(self._begun.items()):
            if self._is_lost(task):
                del self._begun[key]
                self._client.cancel([task.future])
                self._again.append(task.runs)

    def _is_lost(self, task: _Task) -> bool:
        """Whether all workers are gone that could do a task: Dask would wait for them for ever."""
        return task.only is not None and not self._workers.fit.intersection(task.only)

    def _bring_job(self, workers: frozenset[str]) -> None:
        """Let workers have the job beforehand: Dask prefers those that do. One that is lost is not waited for."""
        from distributed import wait

        self._looked = time.monotonic()
        if not workers:
            return
        others = self._workers.only is None
        with connection(self._client):
            brought = [
                self._client.submit(
                    _arrived, self._job, pure=False, workers=[worker], allow_other_workers=others
                )
                for worker in sorted(workers)
            ]
            with suppress(TimeoutError, CancelledError):
                wait(brought, timeout=_LOOK)
        for each in brought:
            if each.status == "error":
                err = each.exception()
                raise ClusterError(
                    message(
                        "the job does not reach the workers",
                        got=f"{type(err).__name__}: {err}".partition("\n")[0],
                        fix="install the same version of Fluorspar where the scheduler and the workers run",
                    )
                )


def _arrived(packed: bytes) -> None:
    """Called on a worker that has the job."""
