"""Workers that the tests of this folder share: two processes of one thread each."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import dask
import pytest
from distributed import Client, LocalCluster

from fluorspar.paths import chunks

SETTINGS: dict[str, Any] = {
    "processes": True,
    "threads_per_worker": 1,
    "host": "127.0.0.1",
    "dashboard_address": "127.0.0.1:0",
    "silence_logs": logging.CRITICAL,
}


@contextmanager
def workers(number: int, folder: Path, **settings: Any) -> Iterator[Client]:
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # it tells of each worker that is killed
    with (
        LocalCluster(n_workers=number, local_directory=str(folder), **(SETTINGS | settings)) as cluster,
        Client(cluster) as client,
    ):
        yield client


@contextmanager
def another_worker(client: Client, folder: Path, *options: str, **env: str) -> Iterator[None]:
    """One more worker, a process without a watcher (nanny)."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", client.scheduler.address, "--no-nanny"]
    worker = subprocess.Popen(
        [*command, "--nthreads", "1", "--local-directory", str(folder), *options],
        env={**os.environ, **env},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        client.wait_for_workers(2, timeout=60)
        yield
    finally:
        worker.terminate()
        worker.wait(30)


@contextmanager
def scheduler_and_worker(folder: Path, **env: str) -> Iterator[tuple[Client, int]]:
    """A client of a scheduler in a process of its own, and the number of that process."""
    env = {**os.environ, **env}
    log = (folder / "log").open("w")
    run = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    options = ["--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0"]
    file = folder / "scheduler.json"
    scheduler = subprocess.Popen(
        [*run, *options, "--scheduler-file", str(file)], env=env, stdout=log, stderr=log
    )
    run = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file)]
    options = ["--nthreads", "1", "--host", "127.0.0.1", "--local-directory", str(folder)]
    worker = None
    try:
        until = time.monotonic() + 30
        while not file.exists():
            assert time.monotonic() < until
            time.sleep(0.05)
        worker = subprocess.Popen([*run, *options], env=env, stdout=log, stderr=log)
        # How long a client tries to find a scheduler again that is lost: by default 30 s.
        with (
            dask.config.set({"distributed.comm.timeouts.connect": "5s"}),
            Client(scheduler_file=str(file)) as client,
        ):
            yield client, scheduler.pid
    finally:
        for process in (scheduler, worker):
            if process is not None:
                process.terminate()
                process.wait(30)
        log.close()


@pytest.fixture(scope="session")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with workers(2, tmp_path_factory.mktemp("dask")) as connected:
        yield connected


@pytest.fixture
def small_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many runs of few pixels, so that there is something to share."""
    monkeypatch.setitem(chunks.CHUNK, "llvm", 1 << 12)
