"""What goes wrong on a cluster, done to real processes on this machine."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import trimesh
from distributed import Client

import fluorspar
from cluster.conftest import another_worker, scheduler_and_worker, workers
from fluorspar.cluster import dispatch
from fluorspar.errors import ClusterError, FluorsparWarning, SceneError

OPTIONS: dict[str, Any] = {"size": (48, 32), "spp": 16, "seed": 5, "variant": "llvm"}
COMMAND = [sys.executable, "-m", "fluorspar", "render", "cornell-box", "--variant", "llvm"]


@pytest.fixture(scope="module")
def expected() -> fluorspar.SpectralImage:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(fluorspar.paths.chunks.CHUNK, "llvm", 1 << 12)
        return fluorspar.render("cornell-box", **OPTIONS)


def assert_same_where_finished(image: fluorspar.SpectralImage, expected: fluorspar.SpectralImage) -> float:
    """The finished share of the image."""
    radiance, whole = image.dataset["radiance"].values, expected.dataset["radiance"].values
    finished = ~np.isnan(radiance).any(axis=(0, -1))
    np.testing.assert_array_equal(radiance[:, finished], whole[:, finished])
    assert np.isnan(radiance[:, ~finished]).all()
    return float(finished.mean())


@pytest.mark.usefixtures("small_runs")
def test_a_worker_that_is_killed_in_the_middle_of_a_chunk_costs_time_only(
    client: Client, expected: fluorspar.SpectralImage, tmp_path: Path
) -> None:
    """Expected: both workers are killed, one after the other, and start again; the image is the same."""
    before = client.run(os.getpid)
    victims = list(before.values())

    def kill(done: int, whole: int) -> None:
        if victims:
            os.kill(victims.pop(), signal.SIGKILL)

    image = fluorspar.render("cornell-box", **OPTIONS, client=client, output=tmp_path / "a.nc", progress=kill)
    assert not victims
    assert assert_same_where_finished(image, expected) == 1
    client.wait_for_workers(2)
    assert not set(client.run(os.getpid).values()) & set(before.values())


@pytest.mark.usefixtures("small_runs")
def test_what_is_finished_is_kept_if_the_scheduler_is_killed(
    expected: fluorspar.SpectralImage, tmp_path: Path
) -> None:
    """Expected: a partial image that says why; after that nothing can be rendered, which is an error."""
    file = tmp_path / "a.nc"
    with scheduler_and_worker(tmp_path) as (client, scheduler):

        def kill(done: int, whole: int) -> None:
            if done < whole and psutil.pid_exists(scheduler):
                os.kill(scheduler, signal.SIGKILL)

        with pytest.warns(
            FluorsparWarning, match=r"(?s)others are NaN: the connection to the scheduler is lost"
        ):
            image = fluorspar.render("cornell-box", **OPTIONS, client=client, output=file, progress=kill)
        assert image.attrs["partial"] == 1
        assert "the connection to the scheduler is lost" in image.attrs["fault"]
        assert 0 < assert_same_where_finished(image, expected) < 1
        with pytest.raises(ClusterError, match="the connection to the scheduler is lost"):
            fluorspar.render("cornell-box", **OPTIONS, client=client)
        with pytest.raises(ClusterError, match="the connection to the scheduler is lost"):
            fluorspar.trace("cornell-box", **OPTIONS, client=client)
    assert not [path for path in tmp_path.iterdir() if path.suffix == ".tmp"]


FAULTY = """
import fluorspar.paths.render as module
def fail(chunk, *arguments, sweep=module.sweep, **options):
    if chunk.first_pixel in {faulty}:
        raise MemoryError("no more")
    return sweep(chunk, *arguments, **options)
module.sweep = fail
"""


@pytest.mark.usefixtures("small_runs")
def test_chunks_that_always_fail(expected: fluorspar.SpectralImage, tmp_path: Path) -> None:
    """Expected: of some, the others are kept, and one warning; of all, the error itself, and an older file stays."""
    (tmp_path / "faulty.py").write_text(FAULTY.format(faulty="(256, 1024)"))
    with (
        workers(1, tmp_path, preload=str(tmp_path / "faulty.py")) as client,
        pytest.warns(FluorsparWarning) as warned,
    ):
        image = fluorspar.render("cornell-box", **OPTIONS, client=client)
    assert len(warned) == 1
    assert "512 pixels could not be rendered" in str(warned[0].message)
    assert "MemoryError: no more" in image.attrs["fault"]
    assert assert_same_where_finished(image, expected) == 2 / 3

    (tmp_path / "faulty.py").write_text(FAULTY.format(faulty="range(10000)"))
    older = tmp_path / "a.nc"
    older.write_text("older")
    with (
        workers(1, tmp_path, preload=str(tmp_path / "faulty.py")) as client,
        pytest.raises(MemoryError, match="no more"),
    ):
        fluorspar.render("cornell-box", **OPTIONS, client=client, output=older)
    assert older.read_text() == "older"
    assert not list(tmp_path.glob(".a.nc*"))


OLDER = """
from importlib import metadata
def older(name, version=metadata.version):
    return '0.0.9' if name == 'fluorspar' else version(name)
metadata.version = older
"""


def test_a_worker_of_another_version_is_refused(tmp_path: Path) -> None:
    (tmp_path / "older.py").write_text(OLDER)
    expected = rf"(?s)another version of fluorspar.*worker tcp.*fluorspar 0\.0\.9.*{fluorspar.__version__}"
    with (
        workers(1, tmp_path, preload=str(tmp_path / "older.py")) as client,
        pytest.raises(ClusterError, match=expected),
    ):
        fluorspar.render("cornell-box", **OPTIONS, client=client)


@pytest.mark.usefixtures("small_runs")
def test_a_worker_of_another_version_that_joins_late_gets_no_work(
    expected: fluorspar.SpectralImage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: it is told of once; the others make the image."""
    monkeypatch.setattr(dispatch, "_LOOK", 0.0)
    (tmp_path / "older.py").write_text(OLDER)
    with workers(1, tmp_path) as client, ExitStack() as stack:

        def join(done: int, whole: int) -> None:
            if done == 256:
                stack.enter_context(another_worker(client, tmp_path, "--preload", str(tmp_path / "older.py")))

        with pytest.warns(FluorsparWarning, match=r"(?s)gets no work.*fluorspar 0\.0\.9") as warned:
            image = fluorspar.render("cornell-box", **OPTIONS, client=client, progress=join)
    assert len(warned) == 1
    assert assert_same_where_finished(image, expected) == 1


@pytest.mark.usefixtures("small_runs")
def test_the_only_worker_that_fits_may_be_killed(
    expected: fluorspar.SpectralImage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: what no other one could do is done by the one that comes in its stead."""
    monkeypatch.setattr(dispatch, "_LOOK", 0.5)
    (tmp_path / "older.py").write_text(OLDER)
    with (
        workers(1, tmp_path) as client,
        another_worker(client, tmp_path, "--preload", str(tmp_path / "older.py")),
    ):
        victims = [each.pid for each in client.cluster.workers.values()]

        def kill(done: int, whole: int) -> None:
            if victims:
                os.kill(victims.pop(), signal.SIGKILL)

        with pytest.warns(FluorsparWarning, match=r"(?s)gets no work.*fluorspar 0\.0\.9"):
            image = fluorspar.render("cornell-box", **OPTIONS, client=client, progress=kill)
    assert not victims
    assert assert_same_where_finished(image, expected) == 1


@pytest.mark.usefixtures("small_runs")
def test_a_worker_without_llvm_among_others_gets_no_work(
    expected: fluorspar.SpectralImage, tmp_path: Path
) -> None:
    """Expected: it is found out when it is given some; the others make the image."""
    nowhere = {"DRJIT_LIBLLVM_PATH": str(tmp_path / "libLLVM.so")}
    with (
        workers(1, tmp_path) as client,
        another_worker(client, tmp_path, **nowhere),
        pytest.warns(FluorsparWarning, match=r"(?s)gets no work.*does not start.*worker tcp") as warned,
    ):
        image = fluorspar.render("cornell-box", **OPTIONS, client=client)
    assert len(warned) == 1
    assert assert_same_where_finished(image, expected) == 1


def test_a_worker_without_llvm_is_named(tmp_path: Path) -> None:
    nowhere = {"DRJIT_LIBLLVM_PATH": str(tmp_path / "libLLVM.so")}
    with (
        workers(1, tmp_path, env=nowhere) as client,
        pytest.raises(ClusterError, match=r"(?s)'llvm_ad_mono' does not start.*LLVM.*worker tcp://127"),
    ):
        fluorspar.render("cornell-box", **OPTIONS, client=client)


def test_a_mesh_that_is_missing_is_said_before_anything_is_sent(client: Client, tmp_path: Path) -> None:
    trimesh.creation.icosphere(1).export(tmp_path / "ball.ply")
    (tmp_path / "room.xml").write_text(
        '<scene version="3.0.0"> <sensor type="perspective"> <film type="hdrfilm"> <rfilter type="box"/> </film> '
        '</sensor> <emitter type="constant"/> <shape type="ply"> <string name="filename" value="ball.ply"/> </shape> '
        "</scene>"
    )
    scene = fluorspar.load_scene(tmp_path / "room.xml")
    (tmp_path / "ball.ply").unlink()
    with pytest.raises(SceneError, match=r"ball\.ply is gone"):
        fluorspar.render(scene, **OPTIONS, client=client)


def test_a_full_disk_is_said_and_an_older_file_stays(tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_text("older")
    command = f"ulimit -f 200; exec {' '.join(COMMAND)} --size 64x64 --spp 4 --workers 1 -o a.nc"
    done = subprocess.run(["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, (tmp_path / "a.nc").read_text()) == (2, "older")
    assert "the disk is full" in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]


def test_workers_end_with_a_client_that_is_killed_and_listen_on_loopback_only(tmp_path: Path) -> None:
    """Expected: an older file stays, and the next one who writes it leaves nothing beside it."""
    (tmp_path / "temporary").mkdir()
    (tmp_path / "a.nc").write_text("older")
    command = [*COMMAND, "--size", "512x512", "--spp", "1024", "--workers", "2", "-o", "a.nc"]
    process = psutil.Popen(
        command,
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(tmp_path / "temporary")},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    until = time.monotonic() + 60
    while not list(tmp_path.glob(".a.nc*")) or len(process.children()) < 3:  # with the tracker of resources
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)
    family = [process, *process.children(recursive=True)]
    listening = [
        each.laddr.ip for one in family for each in one.net_connections() if each.status == psutil.CONN_LISTEN
    ]
    assert len(listening) > 3
    assert set(listening) == {"127.0.0.1"}
    process.kill()
    process.wait(10)
    assert not psutil.wait_procs(family, timeout=30)[1]
    assert (tmp_path / "a.nc").read_text() == "older"
    fluorspar.render("furnace", size=(4, 4), spp=1, output=tmp_path / "a.nc")
    assert {path.name for path in tmp_path.iterdir()} == {"a.nc", "temporary"}
