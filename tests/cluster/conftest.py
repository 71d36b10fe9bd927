"""Workers that the tests of this folder share: two processes of one thread each."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

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
        LocalCluster(n_workers=number, local_directory=str(folder), **SETTINGS, **settings) as cluster,
        Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="session")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with workers(2, tmp_path_factory.mktemp("dask")) as connected:
        yield connected


@pytest.fixture
def small_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many runs of few pixels, so that there is something to share."""
    monkeypatch.setitem(chunks.CHUNK, "llvm", 1 << 12)
