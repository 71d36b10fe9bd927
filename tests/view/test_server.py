"""The server itself: its port, its end, its frame in a notebook, and the command that starts it."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from typer.testing import CliRunner

import fluorspar
from fluorspar import LightPaths, SpectralImage
from fluorspar.cli.main import app
from fluorspar.errors import FluorsparError, OptionError
from fluorspar.extras import check_extra
from fluorspar.fingerprint import fingerprint
from fluorspar.job import RenderJob
from fluorspar.scene.settings_text import light_of
from fluorspar.view.server import Server
from fluorspar.view.workspace import Workspace


def port_of(address: str) -> int:
    return int(address.rpartition(":")[2].split("/")[0])


def is_free(port: int) -> bool:
    with socket.socket() as trial:
        return trial.connect_ex(("127.0.0.1", port)) != 0


def test_a_port_is_freed() -> None:
    with Server(Workspace([])) as server:
        assert urlopen(server.address).status == 200
        port = port_of(server.address)
    assert is_free(port)
    with Server(Workspace([]), port=port) as again:
        assert port_of(again.address) == port
        assert again.address != server.address  # another token


def test_a_port_that_is_taken() -> None:
    with Server(Workspace([])) as server, pytest.raises(OptionError, match="cannot listen there"):
        Server(Workspace([]), port=port_of(server.address))


@pytest.mark.parametrize(("host", "port"), [("192.0.2.1", 0), ("127.0.0.1", 70000), ("no such host", 0)])
def test_where_nobody_can_listen(host: str, port: int) -> None:
    with pytest.raises(OptionError, match="cannot listen there"):
        Server(Workspace([]), host=host, port=port)


def test_ctrl_c_ends_it(image: SpectralImage, tmp_path: Path) -> None:
    """While a scene is being traced, too; without a traceback, and nothing is left behind."""
    image.save(tmp_path / "box.nc")
    words = [str(tmp_path / "box.nc"), "cornell-box", "--size", "16x16", "--spp", "65536", "--no-browser"]
    started = subprocess.Popen(
        [sys.executable, "-m", "fluorspar", "view", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert started.stdout is not None
        address = started.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", address)
        assert urlopen(f"{address}api/progress").status == 200
        started.send_signal(signal.SIGINT)
        _, said = started.communicate(timeout=60)
    finally:
        started.kill()
    assert started.returncode == 0
    assert "Traceback" not in said
    assert "closed" in said
    assert is_free(port_of(address))


def test_without_its_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says how to get them."""
    monkeypatch.setattr("fluorspar.extras.find_spec", lambda name: name != "uvicorn" or None)
    with pytest.raises(FluorsparError, match=r'pip install "fluorspar\[view\]"'):
        check_extra("view")
    result = CliRunner().invoke(app, ["view", "cornell-box"])
    assert "no uvicorn" in str(result.exception)


@pytest.mark.parametrize("name", ["nothing.nc", "nothing.paths", "nothing.xml", "nothing"])
def test_what_is_not_there(name: str) -> None:
    result = CliRunner().invoke(app, ["view", name, "--no-browser"])
    assert isinstance(result.exception, FluorsparError)


def test_a_notebook_shows_a_frame(image: SpectralImage, paths: LightPaths) -> None:
    for shown in (image, paths):
        window = shown.explore(height=500)
        assert f"src='{window.address}'" in window._repr_html_()
        answer = urlopen(window.address)
        assert "frame-ancestors *" in answer.headers["Content-Security-Policy"]
        window.close()
        assert is_free(port_of(window.address))


def test_paths_of_a_file(paths: LightPaths, tmp_path: Path) -> None:
    from fluorspar.view.opening import opened
    from fluorspar.view.supplies import Supplies

    paths.save(tmp_path / "box.paths")
    (source,) = opened([str(tmp_path / "box.paths")], Supplies())
    assert source.kind == "paths"
    assert source.job.scene.name == fluorspar.load_scene("cornell-box").name


def test_a_scene_is_opened_as_render_makes_it() -> None:
    """Rationale: a scene in the window has the camera and the lights that are asked for. Expected: the job is that of
    `render`, and the command line of the view renders the same."""
    from fluorspar.view.command_line import command_of
    from fluorspar.view.opening import opened
    from fluorspar.view.questions import View
    from fluorspar.view.supplies import Supplies

    changed: dict[str, Any] = {"camera": "fov=20", "lights": {"light": ("A", 0.5)}}
    (source,) = opened(["cornell-box"], Supplies(), {"resolution": "16"}, spp=4, **changed)
    scene = fluorspar.load_scene("cornell-box", parameters={"resolution": "16"})
    job = RenderJob.of(scene, spp=4, **changed)
    assert fingerprint(source.job) == fingerprint(job)
    line = command_of(source, View(source="0"), Supplies()).lines[0]
    assert "--camera fov=20 --light light=Ax0.5" in line
    assert light_of("Ax0.5") == ("A", 0.5)


def test_options_of_scenes_need_one(image: SpectralImage, tmp_path: Path) -> None:
    image.save(tmp_path / "box.nc")
    words = ["view", str(tmp_path / "box.nc"), "--camera", "fov=20", "--no-browser"]
    result = CliRunner().invoke(app, words)
    assert isinstance(result.exception, OptionError)
    assert "where:    --camera" in str(result.exception)


def test_an_address_that_is_none() -> None:
    with pytest.raises(OptionError, match="cannot listen there"):
        Server(Workspace([]), host=f"{'a' * 100}.\u00e9")
