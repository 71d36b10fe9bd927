"""Dask's TLS, configured as docs/cluster.md says it, between real processes."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import dask
import pytest
import yaml

import fluorspar
from cluster.conftest import scheduler_and_worker
from cluster.test_same_image import assert_same
from fluorspar.cluster.connect import connected
from fluorspar.errors import ClusterError

PAGE = (Path(__file__).parents[2] / "docs" / "cluster.md").read_text("utf-8")
OPTIONS: dict[str, Any] = {"size": (16, 8), "spp": 4, "variant": "llvm"}


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a certificate, made as the page says, and with the configuration that names it."""
    folder = tmp_path_factory.mktemp("etc")
    (command,) = re.findall(r"^    (openssl .*)$", PAGE, re.MULTILINE)
    (text,) = re.findall(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    subprocess.run(command.split(), cwd=folder, check=True, capture_output=True)
    (folder / "fluorspar.yaml").write_text(text.replace("/etc/dask", str(folder)))
    return folder


@pytest.fixture(scope="module")
def encrypted(certificates: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a scheduler that has a worker."""
    folder = tmp_path_factory.mktemp("dask")
    with (
        configured(certificates),
        scheduler_and_worker(folder, DASK_CONFIG=str(certificates)) as (client, _),
    ):
        client.wait_for_workers(1, timeout=60)
        yield client.scheduler.address


@contextmanager
def configured(folder: Path, **changes: Any) -> Iterator[None]:
    """The configuration of a folder, in this process, with some changes below `distributed.comm.tls`."""
    config = yaml.safe_load((folder / "fluorspar.yaml").read_text())
    config["distributed"]["comm"]["tls"] |= changes
    with dask.config.set(dask.config.merge(dask.config.config, config)):
        yield


def test_the_same_image(encrypted: str, certificates: Path) -> None:
    """Expected: scheduler and worker listen on nothing else, and the image is that of one process."""
    assert encrypted.startswith("tls://")
    with configured(certificates), connected(scheduler=encrypted) as client:
        assert client is not None
        assert [address[:6] for address in client.nthreads()] == ["tls://"]
        there = fluorspar.render("furnace", **OPTIONS, client=client)
    assert_same(fluorspar.render("furnace", **OPTIONS), there)


def test_workers_of_this_machine_are_encrypted_too(certificates: Path) -> None:
    with configured(certificates), connected(workers=1) as client:
        assert client is not None
        assert {address[:16] for address in client.nthreads()} == {"tls://127.0.0.1:"}
        there = fluorspar.render("furnace", **OPTIONS, client=client)
    assert_same(fluorspar.render("furnace", **OPTIONS), there)


def test_a_client_without_certificates_is_told_what_to_name(encrypted: str, certificates: Path) -> None:
    with (
        configured(certificates, client={"cert": None, "key": None}),
        pytest.raises(
            ClusterError, match=r"(?s)names no certificates.*tls, client.*cert missing.*'Security'"
        ),
        connected(scheduler=encrypted),
    ):
        pass


def test_certificates_that_are_not_there_are_named(certificates: Path) -> None:
    with (
        configured(certificates, worker={"cert": "/nowhere/cert.pem"}),
        pytest.raises(ClusterError, match=r"(?s)cannot be read: No such file.*tls, worker.*/nowhere/cert"),
        connected(workers=1),
    ):
        pass


def test_a_client_that_must_encrypt_asks_for_an_address_that_does(encrypted: str, certificates: Path) -> None:
    with (
        configured(certificates),
        pytest.raises(ClusterError, match=r"(?s)encryption required.*tls:// if encrypted"),
        connected(scheduler=encrypted.replace("tls", "tcp")),
    ):
        pass


def test_a_client_of_another_authority_is_refused(encrypted: str, certificates: Path, tmp_path: Path) -> None:
    command = "openssl req -x509 -newkey rsa:2048 -nodes -subj /CN=other -keyout key.pem -out cert.pem"
    subprocess.run(command.split(), cwd=tmp_path, check=True, capture_output=True)
    cert, key = str(tmp_path / "cert.pem"), str(tmp_path / "key.pem")
    with (
        configured(certificates, **{"ca-file": cert, "client": {"cert": cert, "key": key}}),
        dask.config.set({"distributed.comm.timeouts.connect": "5s"}),
        pytest.raises(ClusterError, match="TLS certificate does not match"),
        connected(scheduler=encrypted),
    ):
        pass
