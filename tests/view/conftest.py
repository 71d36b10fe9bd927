"""A window on an image, on another one, and on light paths, asked without a network."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from window_parts import HOST, TOKEN, Ask, image_of

import fluorspar
from fluorspar import LightPaths, SpectralImage
from fluorspar.view.app import make_app
from fluorspar.view.paths_source import PathsSource
from fluorspar.view.security import Guard
from fluorspar.view.sources import ImageSource, Source
from fluorspar.view.supplies import Supplies
from fluorspar.view.workspace import Workspace


@pytest.fixture(scope="session")
def image() -> SpectralImage:
    return image_of(1)


@pytest.fixture(scope="session")
def other() -> SpectralImage:
    return image_of(2, component_errors=True)


@pytest.fixture(scope="session")
def paths() -> LightPaths:
    return fluorspar.trace("cornell-box", size=(16, 16), spp=8, wavelengths="400:700:20")


@pytest.fixture
def workspace(image: SpectralImage, other: SpectralImage, paths: LightPaths) -> Workspace:
    supplies = Supplies()
    sources: list[Source] = [ImageSource("box.nc", image), ImageSource("other.nc", other)]
    return Workspace([*sources, PathsSource("box.paths", paths.job, supplies, paths)], supplies)


@pytest.fixture
def client(workspace: Workspace) -> Iterator[TestClient]:
    app = make_app(workspace, Guard(TOKEN, "127.0.0.1", 8123))
    with TestClient(app, base_url=f"http://{HOST}/{TOKEN}/", raise_server_exceptions=False) as client:
        yield client


@pytest.fixture
def ask(client: TestClient) -> Ask:
    """Ask a question that has an answer; returns it as JSON, or as it is."""

    def answer(path: str, **question: Any) -> Any:
        response = client.post(f"api/{path}", json=question)
        assert response.status_code == 200, response.text
        return response.json() if response.headers["content-type"] == "application/json" else response

    return answer


@pytest.fixture
def refused(client: TestClient) -> Ask:
    """Ask a question that is refused; returns what is said, without line breaks."""

    def answer(path: str, status: int = 400, **question: Any) -> str:
        response = client.post(f"api/{path}", json=question)
        assert response.status_code == status, response.text
        return " ".join(response.json()["error"].split())

    return answer


@pytest.fixture
def lamp_file() -> bytes:
    return b"wavelength,value\n300,1\n800,2\n"
