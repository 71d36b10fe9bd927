"""A batch on workers of Dask: processes of this machine."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import xarray as xr

from cluster.conftest import scheduler_and_worker
from fluorspar import SpectralImage, batch
from fluorspar.cluster.versions import versions_here
from fluorspar.errors import ClusterError
from fluorspar.studies.batch import _task
from fluorspar.studies.do_group import Result
from fluorspar.studies.groups import groups_of
from fluorspar.studies.index import index_of, write_index
from fluorspar.studies.study import read_study

STUDY: dict[str, Any] = {
    "render": {
        "scene": "cornell-box",
        "size": "8x8",
        "spp": 4,
        "wavelengths": "400:700:20",
        "variant": "llvm",
    },
    "product": {"light.light": ["A", "D65"], "seed": [1, 2]},
    "output": "{light}-{seed}.nc",
}


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    dask = pytest.importorskip("dask")
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_the_same_images(client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    monkeypatch.chdir(tmp_path / "here")
    batch(STUDY)
    monkeypatch.chdir(tmp_path / "there")
    seen: list[int] = []
    index = batch(STUDY, client=client, progress=lambda done, whole: seen.append(done))
    assert index["status"].values.tolist() == ["done"] * 4, index["fault"].values
    assert seen[-1] == 4000
    for name in ("A-1.nc", "D65-2.nc"):
        with SpectralImage.open(name) as there, SpectralImage.open(tmp_path / "here" / name) as here:
            np.testing.assert_array_equal(there.dataset["radiance"].values, here.dataset["radiance"].values)


def test_a_fault_on_a_worker_is_told(client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    index = batch({"render": {"scene": "nothing.xml"}, "output": "a.nc"}, client=client)
    assert index["status"].values.tolist() == ["failed"]
    assert "nothing.xml" in index["fault"].values[0]


def test_a_worker_that_dies_fails_its_rows(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the other rows are done."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fluorspar.studies.batch._task", _deadly)
    index = batch(STUDY, client=client)
    assert index["status"].values.tolist() == ["done", "failed", "done", "failed"]
    assert "KilledWorker" in index["fault"].values[1]


def _deadly(group: Any, *_: Any) -> Any:
    if group.rows[0].settings["seed"] == 2:
        os._exit(9)
    from fluorspar.studies.do_group import do_group

    return do_group(group, 1)


@pytest.mark.filterwarnings("ignore:a worker gets no work")
def test_a_worker_of_another_version_does_nothing(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if nobody has looked at it before it was given work."""
    monkeypatch.chdir(tmp_path)
    versions = {**versions_here(), "fluorspar": "99"}
    monkeypatch.setattr("fluorspar.cluster.versions.versions_here", lambda: versions)
    with pytest.raises(ClusterError, match=r"(?s)another version of fluorspar.*expected: fluorspar 99"):
        batch(STUDY, client=client)
    assert not list(tmp_path.iterdir())


def test_a_group_that_nobody_waits_for_stops(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: after Ctrl-C a worker ends the image it is at, not the other 299 of its group."""
    monkeypatch.chdir(tmp_path)
    study = read_study(
        {
            **STUDY,
            "product": {"light.light": [1 + 0.001 * i for i in range(300)]},
            "output": f"{tmp_path}/{{number}}.nc",
        }
    )
    (group,) = groups_of(study.rows, study.rows)
    future = client.submit(_task, group, 1, versions_here(), pure=False)
    until = time.monotonic() + 60
    while not list(tmp_path.glob("*.nc")):
        assert time.monotonic() < until
        time.sleep(0.02)
    client.cancel([future])
    while any(client.run(lambda dask_worker: len(dask_worker.state.executing)).values()):
        assert time.monotonic() < until
        time.sleep(0.05)
    assert 0 < len(list(tmp_path.glob("*.nc"))) < 300
    assert not list(tmp_path.glob(".*"))


def test_a_scheduler_that_is_lost_ends_the_batch(tmp_path: Path) -> None:
    """Expected: an error; the index says what is done, and without the scheduler the same call goes on."""
    (tmp_path / "study.toml").write_text(
        """output = "{seed}.nc"
        [render]
        scene = "cornell-box"
        size = "8x8"
        spp = 4
        variant = "llvm"
        [product]
        seed = [1, 2, 3, 4, 5, 6, 7, 8]"""
    )
    with scheduler_and_worker(tmp_path) as (client, scheduler):

        def kill(done: int, whole: int) -> None:
            if 0 < done < whole and psutil.pid_exists(scheduler):
                os.kill(scheduler, signal.SIGKILL)

        with pytest.raises(ClusterError, match="the connection to the scheduler is lost"):
            batch(tmp_path / "study.toml", client=client, progress=kill)
    with xr.open_dataset(tmp_path / "study-index.nc") as index:
        status = index["status"].values.tolist()
    assert status[0] == "done"
    assert status.count("open") == 8 - status.count("done") > 0
    assert batch(tmp_path / "study.toml")["status"].values.tolist() == ["done"] * 8


def test_an_index_is_written_though_the_scheduler_is_lost(tmp_path: Path) -> None:
    """While the client still is the default one, from which a writer of NetCDF would ask a lock."""
    (tmp_path / "study.toml").write_text('output = "{seed}.nc"\n[render]\nscene = "furnace"\nseed = 1')
    study = read_study(tmp_path / "study.toml")
    with scheduler_and_worker(tmp_path) as (_, scheduler):
        os.kill(scheduler, signal.SIGKILL)
        write_index(study, index_of(study, [Result(1, "done")]))
    with xr.open_dataset(tmp_path / "study-index.nc") as index:
        assert index["status"].values.tolist() == ["done"]
