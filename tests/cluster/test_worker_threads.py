"""Workers of several threads, and of different numbers of them: one task at a time in each, and the same image."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from distributed import Client

import fluorspar
from cluster.conftest import another_worker, workers
from cluster.test_same_image import assert_same
from fluorspar.cluster.connect import connected

OPTIONS: dict[str, Any] = {"size": (48, 32), "spp": 16, "seed": 5, "variant": "llvm"}

# Counts how many tasks are being done in a worker, and notes with how many threads. Dask may load it more than once.
COUNTING = """
import threading
import fluorspar.cluster.task as module
lock, now, most, threads = threading.Lock(), 0, 0, set()
def count(job, runs, kept, address, number, do=module._do_runs):
    global now, most
    with lock:
        now += 1
        most = max(most, now)
        threads.add(number)
    try:
        return do(job, runs, kept, address, number)
    finally:
        with lock:
            now -= 1
if module._do_runs.__name__ != "count":
    module._do_runs = count
"""


def counted(client: Client) -> dict[int, int]:
    """How many tasks were done at once, at the most, by the workers of each number of threads."""

    def most() -> tuple[set[int], int]:
        import counting

        return counting.threads, counting.most

    return {number: most for threads, most in client.run(most).values() for number in threads}


@pytest.mark.usefixtures("small_runs")
def test_of_different_numbers_of_threads(tmp_path: Path) -> None:
    """Expected: both do some of the work, each with all its threads, one task after another."""
    (tmp_path / "counting.py").write_text(COUNTING)
    preload = str(tmp_path / "counting.py")
    with (
        workers(1, tmp_path, threads_per_worker=4, preload=preload) as client,
        another_worker(client, tmp_path, "--nthreads", "2", "--preload", preload),
    ):
        assert sorted(client.nthreads().values()) == [2, 4]
        image = fluorspar.render("cornell-box", **OPTIONS, client=client)
        paths = fluorspar.trace("cornell-box", **OPTIONS, client=client)
        assert counted(client) == {4: 1, 2: 1}
    assert_same(image, fluorspar.render("cornell-box", **OPTIONS))
    assert_same(paths.image(), fluorspar.trace("cornell-box", **OPTIONS).image())


@pytest.mark.usefixtures("small_runs")
def test_of_this_machine() -> None:
    """Expected: with `threads`, as of `--workers 2 --threads 2`, each worker has so many."""
    with connected(workers=2, threads=2) as client:
        assert client is not None
        assert list(client.nthreads().values()) == [2, 2]
        image = fluorspar.render("cornell-box", **OPTIONS, threads=2, client=client)
    assert_same(image, fluorspar.render("cornell-box", **OPTIONS))
