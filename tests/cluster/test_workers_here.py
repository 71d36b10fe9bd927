"""`--workers`: processes on this machine, which leave its processors to the rendering."""

from __future__ import annotations

import logging
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import dask
import numpy as np
import psutil
import pytest

import fluorspar
from cluster.test_same_image import content_of
from fluorspar.cluster import connect
from fluorspar.cluster.connect import connected
from fluorspar.errors import ClusterError

TRACE = [
    sys.executable,
    "-m",
    "fluorspar",
    "trace",
    "furnace",
    "--size",
    "16x8",
    "--spp",
    "4",
    "--variant",
    "llvm",
]


def test_nobody_looks_around_all_the_time() -> None:
    """Expected: nothing is done more than four times a second by scheduler, watchers (nannies) or workers.

    Dask's own setting is 50 to 100 times, a twentieth of a processor while two workers render.
    """

    def of_worker(dask_worker: Any) -> dict[str, float]:
        return {name: each.callback_time for name, each in dask_worker.periodic_callbacks.items()}

    with connected(workers=1) as client:
        assert client is not None
        servers = [client.cluster.scheduler, *client.cluster.workers.values()]
        here = [
            {name: each.callback_time for name, each in server.periodic_callbacks.items()}
            for server in servers
        ]
        every = [
            (name, time) for found in [*here, *client.run(of_worker).values()] for name, time in found.items()
        ]
    assert len(every) > 8
    assert [(name, time) for name, time in every if time < 250] == []


def test_trace_from_the_command_line(tmp_path: Path) -> None:
    """Expected: the file that one process writes."""
    for options in (["-o", "here.paths"], ["--workers", "2", "-o", "there.paths"]):
        done = subprocess.run([*TRACE, *options], cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, f"wrote {options[-1]}" in done.stdout) == (0, True), done.stderr
    assert content_of(tmp_path / "there.paths") == content_of(tmp_path / "here.paths")
    assert {path.name for path in tmp_path.iterdir()} == {"here.paths", "there.paths"}


def workers_of(number: int = 0, but: frozenset[int] = frozenset()) -> list[int]:
    """Processes of workers that another process, or this one, has started."""
    found = []
    for each in psutil.Process(number or None).children():
        try:
            if each.pid not in but and "spawn_main" in " ".join(each.cmdline()):
                found.append(each.pid)
        except psutil.Error:  # gone meanwhile
            continue
    return found


def until(condition: Callable[[], Any]) -> Any:
    """Wait until something is there."""
    end = time.monotonic() + 60
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.01)
    return found


@contextmanager
def killing(moments: list[float], but: frozenset[int]) -> Iterator[None]:
    """Kill a worker so many seconds after the first one was born, again and again."""

    def kill() -> None:
        until(lambda: workers_of(but=but))
        born = time.monotonic()
        for moment in moments:
            time.sleep(max(0.0, born + moment - time.monotonic()))
            for victim in workers_of(but=but)[-1:]:
                os.kill(victim, signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()
    yield
    thread.join()


@pytest.mark.usefixtures("small_runs")
def test_a_worker_may_be_killed_at_any_moment() -> None:
    """Expected: the image is the same; each time one is killed while they start, and two while they render."""
    options: dict[str, Any] = {"size": (48, 32), "spp": 16, "seed": 5, "variant": "llvm"}
    expected = fluorspar.render("cornell-box", **options).dataset
    others = frozenset(workers_of())
    for _ in range(2):
        moments = [random.uniform(0, 2.5), *sorted(random.uniform(0, 4) for _ in range(2))]
        with ExitStack() as stack:
            with killing(moments[:1], others):
                client = stack.enter_context(connected(workers=2))
            with killing(moments[1:], others):
                image = fluorspar.render("cornell-box", **options, client=client).dataset
        for name in ("radiance", "standard_error"):
            np.testing.assert_array_equal(image[name], expected[name], err_msg=f"killed after {moments} s")


def test_a_worker_that_is_killed_while_it_starts_again_is_replaced() -> None:
    """Expected: by one that Ctrl-C does not reach, as the first one."""

    def blocked() -> bool:
        return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])

    others = frozenset(workers_of())
    with connected(workers=1) as client:
        assert client is not None
        assert list(client.run(blocked).values()) == [True]
        (first,) = workers_of(but=others)
        os.kill(first, signal.SIGKILL)
        (second,) = until(lambda: workers_of(but=others | {first}))
        os.kill(second, signal.SIGKILL)
        until(lambda: workers_of(but=others | {first, second}))
        until(client.nthreads)
        assert client.submit(blocked).result(timeout=60)


def test_workers_that_never_start(tmp_path: Path) -> None:
    (tmp_path / "ends.py").write_text("import os\nos._exit(1)\n")
    with (
        dask.config.set({"distributed.worker.preload": [str(tmp_path / "ends.py")]}),
        pytest.raises(ClusterError, match=r"(?s)the workers do not start.*--workers 1.*got:.*fix:"),
        connected(workers=1),
    ):
        pass


@pytest.mark.parametrize("after", [0.0, 0.5])
def test_ctrl_c_while_workers_start(tmp_path: Path, after: float) -> None:
    """Expected: one line, though a terminal sends the signal to the workers too."""
    command = [*TRACE[:4], "furnace", "--variant", "llvm", "--workers", "2", "-o", "a.paths"]
    process = subprocess.Popen(
        command,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    until(lambda: workers_of(process.pid))
    time.sleep(after)
    os.killpg(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert (process.returncode, said) == (130, "error: interrupted\n")
    assert not list(tmp_path.iterdir())


def test_a_scheduler_that_is_silent_is_named(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Expected: it is said what is waited for, before it is an error."""
    monkeypatch.setattr(connect, "_SILENT", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as silent, caplog.at_level(logging.WARNING):
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with (
            dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
            pytest.raises(ClusterError, match=r"(?s)the scheduler does not answer.*" + address),
            connected(address),
        ):
            pass
    assert f"connecting to {address}" in caplog.messages


def test_something_else_than_a_scheduler() -> None:
    def answer() -> None:
        with server.accept()[0] as caller:
            caller.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
            caller.recv(1 << 16)

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=answer)
        thread.start()
        with (
            pytest.raises(ClusterError, match=r"(?s)does not answer.*none of a scheduler of Dask"),
            connected(f"tcp://127.0.0.1:{server.getsockname()[1]}"),
        ):
            pass
        thread.join()
