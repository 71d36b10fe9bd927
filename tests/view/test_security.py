"""Nobody but the window itself gets an answer, and nothing but its page is read from the disk."""

from __future__ import annotations

import pytest
from fastapi.testclient import TestClient
from window_parts import HOST, TOKEN

from fluorspar.view.security import MOST_BYTES, Guard


@pytest.mark.parametrize(
    "path", ["/", "/api/about", "/wrong/", "/wrong/api/about", f"/{TOKEN}x/", f"/{TOKEN[:-1]}/"]
)
def test_without_the_token_there_is_nothing(client: TestClient, path: str) -> None:
    response = client.get(f"http://{HOST}{path}")
    assert response.status_code == 404
    assert TOKEN not in response.text


@pytest.mark.parametrize(
    "host",
    [
        "evil.example:8123",
        "127.0.0.1",
        "127.0.0.1:80",
        "127.0.0.1:8123.evil.example",
        "",
        "a@127.0.0.1:8123",
        "127.0.0.1:8123?x",
        "127.0.0.1:8123#x",
    ],
)
def test_another_name_of_the_host_is_refused(client: TestClient, host: str) -> None:
    """DNS rebinding: a foreign name that resolves to this computer."""
    assert client.get("api/about", headers={"Host": host}).status_code == 421


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:8123", "http://127.0.0.1:9"]
)
def test_a_page_of_another_origin_is_refused(client: TestClient, origin: str) -> None:
    assert client.get("api/about", headers={"Origin": origin}).status_code == 403


@pytest.mark.parametrize("host", ["127.0.0.1:8123", "localhost:8123", "[::1]:8123"])
def test_names_of_this_computer_are_let_in(client: TestClient, host: str) -> None:
    assert client.get("api/progress", headers={"Host": host, "Origin": f"http://{host}"}).status_code == 200


def test_a_server_for_others_is_asked_by_address() -> None:
    """A name could be anybody's."""
    guard = Guard(TOKEN, "0.0.0.0", 8123)
    assert guard.knows("192.168.1.7:8123")
    assert not guard.knows("evil.example:8123")
    assert not Guard(TOKEN, "127.0.0.1", 8123).knows("192.168.1.7:8123")


@pytest.mark.parametrize(
    "name",
    ["../app.py", "..%2fapp.py", "%2e%2e/app.py", "/etc/passwd", "%2fetc%2fpasswd", "static/index.html", ""],
)
def test_only_the_page_is_read_from_the_disk(client: TestClient, name: str) -> None:
    response = client.get(f"http://{HOST}/{TOKEN}/static/{name}")
    assert response.status_code == 404
    assert "def " not in response.text
    assert "root:" not in response.text


def test_the_page_and_its_headers(client: TestClient) -> None:
    response = client.get("")
    assert response.headers["content-type"].startswith("text/html")
    policy = response.headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; script-src 'self'")
    assert "unsafe" not in policy
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["referrer-policy"] == "no-referrer"
    assert "access-control-allow-origin" not in response.headers
    assert client.get("api/about").headers["cache-control"] == "no-store"


@pytest.mark.parametrize("path", ["docs", "openapi.json", "redoc", "api/nothing"])
def test_there_is_nothing_else(client: TestClient, path: str) -> None:
    assert client.get(path).status_code == 404


def test_a_huge_upload_is_refused(client: TestClient) -> None:
    """Whether its size is told before or not."""
    large = b"0" * (MOST_BYTES + 1)
    told = client.post("api/upload?name=a.csv&kind=light", content=large)
    untold = client.post(
        "api/upload?name=a.csv&kind=light", content=iter([large[:MOST_BYTES], large[MOST_BYTES:]])
    )
    for response in (told, untold):
        assert response.status_code == 413
        assert "8 MiB" in response.json()["error"]


@pytest.mark.parametrize("length", ["-1", "x", "1e9"])
def test_an_odd_length_is_refused(client: TestClient, length: str) -> None:
    assert client.post("api/picture", headers={"Content-Length": length}).status_code == 413
