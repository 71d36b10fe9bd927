"""Give the runs of pixels of a job to workers, and take what they send back, in any order."""

from __future__ import annotations

import logging
import time
import uuid
import warnings
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from fluorspar.cluster.task import Done, SentJob, render_runs
from fluorspar.cluster.versions import check_workers
from fluorspar.errors import ClusterError, message
from fluorspar.image.components import COMPONENTS
from fluorspar.image.pixels import Pixels
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import Run

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["rendered_runs"]

_LOG = logging.getLogger(__name__)

# A task is more than one run where there are many: the scheduler has less to do.
_RUNS = 8
_TASK = 64 * 2**20  # bytes that come back at once
_SHARES = 16  # tasks of each worker at least, so that none waits long for the last
_BEGUN = 3  # tasks of each worker, of which one is being done: the others are there when it is
_LOOK = 5.0  # seconds after which new workers are looked for
_TRIES = 2


def rendered_runs(client: Client, job: RenderJob, runs: Sequence[Run]) -> Generator[tuple[Run, Pixels]]:
    """Render runs of pixels on the workers of a client; there is no run in memory here but the one that is yielded.

    Parameters
    ----------
    client : distributed.Client
    job : RenderJob
        Of method `"paths"`, without passes.
    runs : sequence of (int, int)
        Some of `runs_of(job)`.

    Yields
    ------
    (run, Pixels)
        In the order in which they are finished.

    Raises
    ------
    SceneError
        If a mesh or picture of the scene has changed, or is gone.
    ClusterError
        If the scheduler is lost, or a worker does not fit; or after all others have been yielded, if runs have failed
        again and again.
    Exception
        What a worker has raised, if nothing succeeds.
    """
    work = _Work(client, SentJob.of(job), _bytes_of_pixel(job), runs)
    try:
        while work.begin():
            future, tried = work.next()
            try:
                done: Done = future.result()
            except Exception as err:
                work.failed(tried, err)
                continue
            finally:
                del future  # the workers forget the result
            for kind, text in done.warned:
                work.warn(kind, text)
            work.succeeded = True
            yield from zip(tried, done.pixels, strict=True)
            del done
    finally:
        work.cancel()
    work.check()


def _bytes_of_pixel(job: RenderJob) -> int:
    spectra = len(COMPONENTS) * (2 if job.component_errors else 1) + 1
    return 4 * len(job.grid) * spectra


class _Work:
    """The tasks of a job: those that wait, those that workers have, and what has failed."""

    def __init__(self, client: Client, sent: SentJob, bytes_of_pixel: int, runs: Sequence[Run]) -> None:
        self.client = client
        self.succeeded = False
        self._name = f"fluorspar-{uuid.uuid4().hex[:8]}"
        self._begun: dict[str, tuple[Future, list[Run]]] = {}
        self._finished: SimpleQueue[Future] = SimpleQueue()
        self._failures: dict[Run, list[Exception]] = {}
        self._told: set[tuple[type[Warning], str]] = set()
        self._number = 0
        with self._connected(), warnings.catch_warnings():
            self._wait_for_workers()
            check_workers(client)
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            # A task, not data that are scattered: where the workers that hold it are lost, it is done again.
            self._job = client.submit(_itself, sent, key=f"{self._name}-job")
        self._workers: frozenset[str] = frozenset()
        self._look()
        size = max((count for _, count in runs), default=1) * bytes_of_pixel
        shares = _SHARES * max(1, len(self._workers))
        per_task = max(1, min(_RUNS, _TASK // size, len(runs) // shares))
        self._waiting = deque([*runs[i : i + per_task]] for i in range(0, len(runs), per_task))

    def begin(self) -> bool:
        """Give the workers as much as they should have; return whether there is anything that they have."""
        if time.monotonic() - self._looked > _LOOK:
            self._look()
        with self._connected():
            while self._waiting and len(self._begun) < _BEGUN * max(1, len(self._workers)):
                runs = self._waiting.popleft()
                self._number += 1
                future = self.client.submit(
                    render_runs, self._job, runs, key=f"{self._name}-{self._number:06d}", pure=False
                )
                self._begun[future.key] = future, runs
                future.add_done_callback(self._finished.put)
        return bool(self._begun)

    def next(self) -> tuple[Future, list[Run]]:
        """Wait for a task that is finished, or has failed."""
        while True:
            with suppress(Empty):
                future = self._finished.get(timeout=1.0)
                self._check_connection()
                return self._begun.pop(future.key)
            self._check_connection()

    def failed(self, runs: list[Run], err: Exception) -> None:
        """Note that a task has failed, and do each of its runs once more, by itself."""
        self._check_connection()
        if isinstance(err, ClusterError):
            raise err
        for run in runs:
            failures = self._failures.setdefault(run, [])
            failures.append(err)
            if len(failures) < _TRIES:
                self._waiting.appendleft([run])
        hopeless = sum(len(failures) == _TRIES for failures in self._failures.values())
        if not self.succeeded and hopeless > _BEGUN * len(self._workers):
            self.check()

    def check(self) -> None:
        """Say what has failed again and again."""
        failures = {run: errors for run, errors in self._failures.items() if len(errors) == _TRIES}
        if failures:
            first = next(iter(failures.values()))[-1]
            if not self.succeeded:
                raise first
            raise ClusterError(
                message(
                    f"{sum(count for _, count in failures)} pixels could not be rendered",
                    where=f"{len(failures)} runs of pixels, the first from pixel {min(failures)[0]} on, "
                    f"{_TRIES} times each",
                    got=f"{type(first).__name__}: {first}",
                )
            ) from first

    def warn(self, kind: type[Warning], text: str) -> None:
        """Pass on what a worker warns of, once."""
        if (kind, text) not in self._told:
            self._told.add((kind, text))
            warnings.warn(text, kind, stacklevel=6)

    def cancel(self) -> None:
        """Let the workers stop after what they are doing."""
        futures = [*(future for future, _ in self._begun.values()), self._job]
        self._begun.clear()
        if self.client.status == "running":
            with suppress(Exception):
                self.client.cancel(futures)

    def _look(self) -> None:
        """Find out which workers there are, and let new ones have the job beforehand."""
        with self._connected():
            workers = frozenset(self.client.nthreads())
            if workers - self._workers:
                if err := self._job.exception():  # waits until it has reached a worker
                    raise ClusterError(
                        message(
                            "the job does not reach the workers",
                            got=f"{type(err).__name__}: {err}".partition("\n")[0],
                            fix="install the same version of Fluorspar where the scheduler and the workers run",
                        )
                    ) from err
                self.client.replicate(self._job)
        self._workers, self._looked = workers, time.monotonic()

    def _wait_for_workers(self) -> None:
        """Wait for the first worker, which on a machine with a queue may take hours."""
        self._check_connection()
        if not self.client.nthreads():
            _LOG.warning("waiting for workers")
        while not self.client.nthreads():
            time.sleep(0.5)

    @contextmanager
    def _connected(self) -> Iterator[None]:
        try:
            yield
        except (OSError, TimeoutError) as err:
            raise _lost(self.client) from err

    def _check_connection(self) -> None:
        if self.client.status != "running":
            raise _lost(self.client)


def _lost(client: Client) -> ClusterError:
    address = client.scheduler.address if client.scheduler else ""
    fix = "see whether it still runs, and what it has logged"
    return ClusterError(
        message("the connection to the scheduler is lost", where=f"scheduler {address}", fix=fix)
    )


def _itself(job: SentJob) -> SentJob:
    return job
