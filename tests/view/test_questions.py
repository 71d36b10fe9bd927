"""Questions that cannot be understood or answered: 400 or 404, with a reason."""

from __future__ import annotations

from typing import Any

import pytest
from fastapi.testclient import TestClient
from window_parts import Ask


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b'"0"', b"\xff\xfe", b'{"source": "0", "exposure": NaN}'])
def test_malformed_json(client: TestClient, body: bytes) -> None:
    response = client.post("api/picture", content=body, headers={"Content-Type": "application/json"})
    assert response.status_code == 400
    assert "cannot be understood" in response.json()["error"]


@pytest.mark.parametrize(
    ("view", "said"),
    [
        ({"mode": "sepia"}, "mode"),
        ({"weight": {}}, "weight"),
        ({"weights": {"source": 3}}, "weights.source"),
        ({"weights": {"sauce": 1}}, "no such component"),
        ({"exposure": 0}, "exposure"),
        ({"white": "moonlight"}, "no such illuminant"),
        ({"white": "/etc/passwd"}, "no such illuminant"),
        ({"white": [0.03, 1, 1e-9]}, "too saturated to adapt to"),
        ({"white": [1, 2]}, "white"),
        ({"white": [0, 1, 1]}, "white"),
        ({"white": {"light": "sun"}}, "cannot be relit"),
        ({"mode": "band", "band": [900, 950]}, "no wavelength"),
        ({"mode": "band", "range": [1, 1]}, "range"),
        ({"mode": "standard_error", "weights": {"source": 0.5}}, "different weights"),
        ({"relight": {"lights": {"light": {"factor": 2}}}}, "cannot be relit"),
    ],
)
def test_a_view_that_cannot_be_shown(refused: Ask, view: dict[str, Any], said: str) -> None:
    assert said in refused("picture", source="0", **view)


def test_an_unknown_source(refused: Ask) -> None:
    assert "0, 1, 2" in refused("picture", 404, source="7")


@pytest.mark.parametrize("region", [[0, 0, 8, 0], [-1, 0, 0, 0], [3, 3, 2, 3], [0, 0, 0, 6]])
def test_a_region_that_is_not_in_the_image(refused: Ask, region: list[int]) -> None:
    assert "columns from 0 to 7, rows from 0 to 5" in refused("spectrum", source="0", region=region)


@pytest.mark.parametrize(
    ("relight", "said"),
    [
        ({"lights": {"sun": {"factor": 2}}}, "no light 'sun' expected: one of light"),
        ({"lights": {"light": {"factor": -1}}}, "factor"),
        ({"lights": {"light": {"spectrum": {"name": "FL99"}}}}, "no such illuminant"),
        ({"lights": {"light": {"spectrum": {"name": "/etc/passwd"}}}}, "no such illuminant"),
        ({"lights": {"light": {"spectrum": {"name": "A", "blackbody": 3000}}}}, "give one of"),
        ({"lights": {"light": {"spectrum": {}}}}, "give one of"),
        ({"lights": {"light": {"spectrum": {"blackbody": 1e9}}}}, "blackbody"),
        ({"lights": {"light": {"spectrum": {"curve": [[400, 1]]}}}}, "curve"),
        ({"lights": {"light": {"spectrum": {"curve": [[400, 1], [400, 2]]}}}}, "do not ascend"),
        ({"lights": {"light": {"spectrum": {"curve": [[400, 0], [500, 0]]}}}}, "dark"),
        ({"lights": {"light": {"spectrum": {"upload": "upload:nothing"}}}}, "no such upload"),
        ({"materials": {"roof": "poster-red"}}, "no shape or BSDF 'roof'"),
        ({"materials": {"left-wall": "poster-pink"}}, "no such material"),
        ({"materials": {"left-wall": "/etc/passwd"}}, "no such material"),
        ({"materials": {"left-wall": "poster-red:0.5,/etc/passwd:0.5"}}, "no such material"),
        ({"materials": {"left-wall": ",".join(25 * ["poster-red:0.5"])}}, "add up to 1"),
        ({"materials": {"left-wall": "upload:nothing"}}, "no such upload"),
        ({"concentration": {"left-wall": -1}}, "concentration"),
        ({"concentration": {"roof": 2}}, "no shape or BSDF 'roof'"),
    ],
)
def test_a_light_or_material_that_cannot_be(refused: Ask, relight: dict[str, Any], said: str) -> None:
    assert said in refused("picture", source="2", relight=relight)


@pytest.mark.parametrize(
    ("kind", "content", "said"),
    [
        ("light", b"", "no rows"),
        ("light", b"\x00\x01\x02", ""),
        ("light", b"wavelength,value\n400,x\n", ""),
        ("light", b"wavelength,value\n400,1\n500,-5\n", "negative"),
        ("light", b"400,1\n400,2\n", "ascend"),
        ("material", b"wavelength,reflectance\n400,1\n", ""),
        ("material", b"# fluorspar-material: 1\nwavelength,reflectance\n300,7\n780,7\n", ""),
        ("picture", b"", "light or material"),
    ],
)
def test_a_malformed_spectrum(client: TestClient, kind: str, content: bytes, said: str) -> None:
    """The message names the file as the user does, not where it was put."""
    response = client.post("api/upload", params={"name": "mine.csv", "kind": kind}, content=content)
    assert response.status_code == 400
    assert said in response.json()["error"]
    assert "/tmp" not in response.json()["error"]


def test_a_file_of_another_kind(client: TestClient) -> None:
    for name in ("../../etc/passwd", "c:\\x\\y.exe", ".", ""):
        response = client.post("api/upload", params={"name": name, "kind": "material"}, content=b"abc")
        assert response.status_code == 400
        assert "/" not in response.json()["error"].splitlines()[0]


def test_a_fault_of_ours_is_said(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """To the page, and with its traceback in the log."""

    def fails(*_: object) -> None:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr("fluorspar.view.app.picture_of", fails)
    response = client.post("api/picture", json={"source": "0"})
    assert response.status_code == 500
    assert "ZeroDivisionError('oh')" in response.json()["error"]
    assert "Traceback" in caplog.text


def test_pins_are_told_apart(refused: Ask) -> None:
    """Each is a line of the table, and none is left out."""
    pins = [{"name": "wall", "region": [x, 0, x, 0]} for x in (0, 1)]
    assert "the same name got: wall" in refused("csv", source="0", pins=pins)
    assert "name" in refused("csv", source="0", pins=[{"name": "wall\n1", "region": [0, 0, 0, 0]}])
