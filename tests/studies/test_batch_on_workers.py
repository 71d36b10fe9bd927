"""A batch on workers of Dask: processes of this machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluorspar import SpectralImage, batch

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


def _deadly(group: Any, threads: int | None) -> Any:
    if group.rows[0].settings["seed"] == 2:
        os._exit(9)
    from fluorspar.studies.do_group import do_group

    return do_group(group, 1)
