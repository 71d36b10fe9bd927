"""A headless Chromium that tests drive by its DevTools protocol, over a pipe: no port, no further dependency."""

from __future__ import annotations

import base64
import contextlib
import io
import itertools
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

__all__ = ["Page", "chromium", "opened_page"]

_SECONDS = 60.0
_KEYS = {
    "Enter": 13,
    "Escape": 27,
    "ArrowLeft": 37,
    "ArrowUp": 38,
    "ArrowRight": 39,
    "ArrowDown": 40,
    "Tab": 9,
}
_CTRL = 2


def chromium() -> str:
    """The browser: that of the environment variable CHROMIUM, else the first of the usual names."""
    names = ("chromium", "chromium-browser", "google-chrome")
    found = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
    assert found, "no Chromium: 'make test-browser' installs it, as root on Debian; or set CHROMIUM"
    return found


class Page:
    """One tab of the browser.

    Attributes
    ----------
    troubles : list of str
        What went wrong in the page by itself: errors of its scripts, what its content security policy refused.
    """

    def __init__(self, to_browser: int, from_browser: int) -> None:
        self._to, self._from = to_browser, from_browser
        self._numbers = itertools.count(1)
        self._received = b""
        self._session: str | None = None
        self._chooser: int | None = None  # the input whose dialog is open
        self.troubles: list[str] = []
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")

    def _next(self, until: float) -> dict[str, Any]:
        while b"\0" not in self._received:
            ready, _, _ = select.select([self._from], [], [], max(0.0, until - time.monotonic()))
            assert ready, "the browser does not answer"
            received = os.read(self._from, 1 << 20)
            assert received, "the browser has ended"
            self._received += received
        text, _, self._received = self._received.partition(b"\0")
        return dict(json.loads(text))

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command of the protocol and wait for its answer."""
        number = next(self._numbers)
        command = {"id": number, "method": method, "params": parameters}
        if self._session:
            command["sessionId"] = self._session
        data = json.dumps(command).encode() + b"\0"
        while data:
            data = data[os.write(self._to, data) :]
        until = time.monotonic() + _SECONDS
        while (received := self._next(until)).get("id") != number:
            self._note(received)
        assert "error" not in received, f"{method}: {received['error']}"
        return dict(received["result"])

    def _note(self, event: dict[str, Any]) -> None:
        parameters = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.troubles.append(details.get("exception", {}).get("description", details["text"]))
        elif event.get("method") == "Page.fileChooserOpened":
            self._chooser = parameters["backendNodeId"]
        elif event.get("method") == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.troubles.append(parameters["entry"]["text"])

    def size(self, width: int, height: int) -> None:
        """Set the size of the window in pixels."""
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def prefer(self, scheme: str) -> None:
        """Let the system prefer a "dark" or a "light" page."""
        feature = {"name": "prefers-color-scheme", "value": scheme}
        self.send("Emulation.setEmulatedMedia", features=[feature])

    def open(self, address: str) -> None:
        """Open an address; from another page if need be, so that it is always loaded."""
        self.send("Page.navigate", url="about:blank")
        self.wait("location.href === 'about:blank'")
        self.send("Page.navigate", url=address)
        self.wait(
            f"document.readyState === 'complete' && location.href.startsWith({json.dumps(address[:20])})"
        )

    def value(self, expression: str) -> Any:
        """The value of an expression of JavaScript; of a promise, what it gives."""
        answer = self.send(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True, userGesture=True
        )
        assert "exceptionDetails" not in answer, f"{expression}\n{answer['exceptionDetails']}"
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = _SECONDS) -> Any:
        """Wait until an expression is true; gives its value."""
        until = time.monotonic() + seconds
        while not (value := self.value(expression)):
            assert time.monotonic() < until, f"never true: {expression}\n{self.troubles}"
            time.sleep(0.03)
        return value

    def place(self, selector: str) -> tuple[float, float]:
        """The middle of the first such element that is visible, scrolled to if need be."""
        node = (
            f"[...document.querySelectorAll({json.dumps(selector)})].find((node) => node.checkVisibility())"
        )
        self.wait(f"{node} !== undefined")
        self.value(f"{node}.scrollIntoView({{block: 'nearest'}})")
        box = f"{node}.getBoundingClientRect()"
        x, y = self.value(f"[{box}.left + {box}.width / 2, {box}.top + {box}.height / 2]")
        return float(x), float(y)

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """One event of the mouse: "mouseMoved", "mousePressed", "mouseReleased" or "mouseWheel"."""
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, where: str | tuple[float, float], *, ctrl: bool = False) -> None:
        """Click an element, or a point of the screen."""
        x, y = self.place(where) if isinstance(where, str) else where
        modifiers = _CTRL if ctrl else 0
        self.mouse("mouseMoved", x, y)
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", clickCount=1, modifiers=modifiers)

    def drag(self, *points: tuple[float, float], release: bool = True) -> None:
        """Press at the first point, move along the others, and release."""
        self.mouse("mouseMoved", *points[0])
        self.mouse("mousePressed", *points[0], button="left", clickCount=1)
        for point in points[1:]:
            self.mouse("mouseMoved", *point, button="left", buttons=1)
        if release:
            self.mouse("mouseReleased", *points[-1], button="left", clickCount=1)

    def key(self, key: str, *, ctrl: bool = False, shift: bool = False) -> None:
        """Press a key, such as "Enter", "ArrowDown" or "e"."""
        modifiers = (_CTRL if ctrl else 0) | (8 if shift else 0)
        code = _KEYS.get(key, ord(key.upper()[0]))
        text = {"text": key} if len(key) == 1 and not ctrl else {}
        if key == "Enter":
            text = {"text": "\r"}
        pressed = {"key": key, "windowsVirtualKeyCode": code, "modifiers": modifiers}
        self.send("Input.dispatchKeyEvent", type="keyDown", **pressed, **text)
        self.send("Input.dispatchKeyEvent", type="keyUp", **pressed)

    def choose(self, selector: str, value: Any) -> None:
        """Choose an option of a menu by its value, written as JSON."""
        node = f"document.querySelector({json.dumps(selector)})"
        text = json.dumps(json.dumps(value, separators=(",", ":"), ensure_ascii=False))
        assert self.value(f"({node}.value = {text}, {node}.selectedIndex >= 0)"), f"{selector} has no {value}"
        self.value(f"{node}.dispatchEvent(new Event('change', {{bubbles: true}}))")

    def upload(self, press: Callable[[], object], path: Path) -> None:
        """Choose a file in the dialog that opens when something is pressed."""
        self.send("Page.setInterceptFileChooserDialog", enabled=True)
        press()
        until = time.monotonic() + _SECONDS
        while self._chooser is None:
            self._note(self._next(until))
        node, self._chooser = self._chooser, None
        self.send("DOM.setFileInputFiles", files=[str(path)], backendNodeId=node)

    def shot(self, path: Path | None = None) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """What the window shows, uint8 of shape (height, width, 3); also into a file."""
        data = base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])
        if path:
            path.write_bytes(data)
        with Image.open(io.BytesIO(data)) as image:
            return np.asarray(image.convert("RGB"))


@contextlib.contextmanager
def opened_page(profile: Path) -> Iterator[Page]:
    """A browser with one empty page. `profile` is a folder that it may fill."""
    (read_by_browser, to_browser), (from_browser, written_by_browser) = os.pipe(), os.pipe()
    options = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-background-networking",
        "--hide-scrollbars",
    ]
    options += ["--remote-debugging-pipe", f"--user-data-dir={profile}", "--no-first-run"]
    # the browser reads its commands from descriptor 3 and answers on 4
    script = f'exec "$@" 3<&{read_by_browser} 4>&{written_by_browser}'
    process = subprocess.Popen(
        ["bash", "-c", script, "bash", chromium(), *options],
        pass_fds=(read_by_browser, written_by_browser),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(read_by_browser)
    os.close(written_by_browser)
    try:
        page = Page(to_browser, from_browser)
        yield page
        page.send("Browser.close")
    finally:
        os.close(to_browser)
        os.close(from_browser)
        process.terminate()
        process.wait(30)
