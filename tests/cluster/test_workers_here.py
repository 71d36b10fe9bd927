"""`--workers`: processes on this machine, which leave its processors to the rendering."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from cluster.test_same_image import content_of
from fluorspar.cluster.connect import connected

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
