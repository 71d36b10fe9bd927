"""Give the runs of pixels of a job to workers, and take what they send back, in any order."""

from __future__ import annotations

import time
import uuid
import warnings
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from fluorspar.cluster.connect import check_connection, connection
from fluorspar.cluster.fit_workers import FitWorkers, Unfit
from fluorspar.cluster.task import Done, SentJob, do_runs, part_of, without_results
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
_LOOK = 5.0  # seconds after which new workers are looked for
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
        for future, tried in work.finished():
            with work.trying(tried):
                if len(tried) > 1 or tried[0][1] * per_pixel <= _TASK:
                    done = work.take(future.result())
                    for (first, _), pixels in zip(tried, done.results, strict=True):
                        yield first, pixels
                        del pixels
                    del done
                else:
                    ((first, count),) = tried
                    work.take(work.ask(without_results, future))
                    for start in range(0, count, _TASK // per_pixel):
                        stop = min(start + _TASK // per_pixel, count)
                        yield first + start, work.ask(part_of, future, start, stop)
            del future  # the workers forget the result


def traced_runs(client: Client, job: RenderJob, runs: Sequence[Run]) -> Generator[PackedChunk]:
    """Trace runs of pixels on the workers of a client; as `rendered_runs`.

    Yields
    ------
    PackedChunk
        Of each run, in the order in which they come.
    """
    with closing(_Work(client, job, runs, _PATH * job.scene.settings.spp, kept=True)) as work:
        for future, tried in work.finished():
            with work.trying(tried):
                done = work.take(future.result())
                yield from done.results
                del done
            del future


def _bytes_of_pixel(job: RenderJob) -> int:
    spectra = len(COMPONENTS) * (2 if job.component_errors else 1) + 1
    return 4 * len(job.grid) * spectra


class _Refused(Exception):
    """A worker does not fit."""


class _Work:
    """The tasks of a job: those that wait, those that workers have, and what has failed."""

    def __init__(
        self, client: Client, job: RenderJob, runs: Sequence[Run], bytes_of_pixel: int, *, kept: bool
    ) -> None:
        self._client, self._kept = client, kept
        self._name = f"fluorspar-{uuid.uuid4().hex[:8]}"
        self._begun: dict[str, tuple[Future, list[Run], list[str] | None]] = {}
        self._finished: SimpleQueue[Future] = SimpleQueue()
        self._failures: dict[Run, list[Exception]] = {}
        self._told: set[tuple[type[Warning], str]] = set()
        self._number = 0
        self._succeeded = False
        sent = SentJob.of(job)
        self._workers = FitWorkers(client)
        with connection(client), warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            # A task, not data that are scattered: where the workers that hold it are lost, it is done again.
            self._job = client.submit(_itself, sent, key=f"{self._name}-job", **self._where(wish=True))
        self._bring_job(self._workers.fit)
        size = max((count for _, count in runs), default=1) * bytes_of_pixel
        self._most = _BEGUN if size <= _TASK else _BEGUN_LARGE
        self._most_runs = max(1, min(_RUNS, _TASK // size))
        self._fresh = deque(runs)
        self._again: deque[list[Run]] = deque()

    def finished(self) -> Iterator[tuple[Future, list[Run]]]:
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
                future = self._finished.get(timeout=1.0)
                check_connection(self._client)
                _, runs, _ = self._begun.pop(future.key, (None, None, None))
                if runs is not None:
                    yield future, runs
                del future
            check_connection(self._client)
        self._check()

    @contextmanager
    def trying(self, runs: list[Run]) -> Iterator[None]:
        """Take what has come of some runs; if that fails, have each done once more, by itself."""
        try:
            yield
        except _Refused:
            self._again.extend([run] for run in runs)
        except Exception as err:
            self._failed(runs, err)
        else:
            self._succeeded = True

    def take(self, answer: Done | Unfit) -> Done:
        """Take an answer: pass on what the worker warns of, once; give one that does not fit no more work."""
        if isinstance(answer, Unfit):
            self._workers.refuse(answer)
            raise _Refused
        for kind, text in answer.warned:
            if (kind, text) not in self._told:
                self._told.add((kind, text))
                warnings.warn(text, kind, stacklevel=6)
        return answer

    def ask(self, function: Any, *given: Any) -> Any:
        """Call a function on the worker that has a result."""
        return self._client.submit(function, *given, pure=False, **self._where(wish=True)).result()

    def close(self) -> None:
        """Let the workers stop after what they are doing."""
        futures = [*(future for future, *_ in self._begun.values()), self._job]
        self._begun.clear()
        if self._client.status == "running":
            with suppress(Exception):
                self._client.cancel(futures)

    def _where(self, *, wish: bool) -> dict[str, Any]:
        """Options of `Client.submit`: the workers that fit, if there are others."""
        only = self._workers.only
        return {} if only is None else {"workers": only, "allow_other_workers": wish}

    def _begin(self) -> None:
        """Give the workers as much as they should have."""
        fit = self._workers.fit
        with connection(self._client):
            while fit and (self._fresh or self._again) and len(self._begun) < self._most * len(fit):
                runs = self._next()
                self._number += 1
                future = self._client.submit(
                    do_runs,
                    self._job,
                    runs,
                    kept=self._kept,
                    key=f"{self._name}-{self._number:06d}",
                    pure=False,
                    **self._where(wish=False),
                )
                self._begun[future.key] = future, runs, self._workers.only
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
        for key, (future, runs, only) in list(self._begun.items()):
            if only is not None and not self._workers.fit.intersection(only):
                del self._begun[key]
                self._client.cancel([future])
                self._again.append(runs)

    def _bring_job(self, workers: frozenset[str]) -> None:
        """Let workers have the job beforehand."""
        self._looked = time.monotonic()
        if not workers:
            return
        with connection(self._client):
            if err := self._job.exception():  # waits until it has reached a worker
                raise ClusterError(
                    message(
                        "the job does not reach the workers",
                        got=f"{type(err).__name__}: {err}".partition("\n")[0],
                        fix="install the same version of Fluorspar where the scheduler and the workers run",
                    )
                ) from err
            self._client.replicate(self._job, workers=sorted(workers))


def _itself(job: SentJob) -> SentJob:
    return job
