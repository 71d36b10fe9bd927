"""Who may ask: the right address, from the right page, with little to say."""

from __future__ import annotations

import ipaddress
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["LOOPBACK", "MOST_BYTES", "Gate", "Guard", "new_token"]

MOST_BYTES = 8 * 2**20
"""Of the body of a request."""

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this computer that no other one can reach."""

_TOO_LARGE = f"that is too large: at most {MOST_BYTES >> 20} MiB are taken"
_EVERYWHERE = ("0.0.0.0", "::")
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'"
)


def new_token() -> str:
    """A random word for the address: who does not know it finds nothing."""
    return secrets.token_urlsafe(16)


@dataclass(frozen=True)
class Guard:
    """What a request must have.

    Parameters
    ----------
    token : str
        First part of every path.
    host : str
        The address that is listened at.
    port : int
    framed : bool
        Whether pages of other origins may show the window in a frame, as notebooks do.

    Examples
    --------
    >>> guard = Guard("secret", "127.0.0.1", 8000)
    >>> guard.knows("localhost:8000"), guard.knows("evil.example:8000"), guard.knows("localhost:80")
    (True, False, False)
    """

    token: str
    host: str
    port: int
    framed: bool = False

    def knows(self, host: str) -> bool:
        """Whether a Host header names this server. A foreign name that resolves to it (DNS rebinding) does not."""
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return False
        if port != self.port or parts.netloc != host or parts.username is not None:
            return False
        return name in self._names() or (self.host in _EVERYWHERE and _is_address(name))

    def knows_origin(self, origin: str) -> bool:
        """Whether an Origin header is that of a page of this server."""
        scheme, separator, host = origin.partition("://")
        return scheme == "http" and bool(separator) and self.knows(host)

    def fits(self, path: str) -> bool:
        """Whether a path begins with the token."""
        word, _, _ = path.removeprefix("/").partition("/")
        return path.startswith("/") and secrets.compare_digest(word.encode(), self.token.encode())

    @property
    def policy(self) -> str:
        """The content security policy of every answer."""
        return f"{_POLICY}; frame-ancestors {'*' if self.framed else chr(39) + 'self' + chr(39)}"

    def _names(self) -> Iterable[str]:
        import socket

        own = () if self.host not in _EVERYWHERE else (socket.gethostname().lower(),)
        return (*LOOPBACK, self.host.lower(), *own)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class Gate:
    """Middleware: refuses what the guard does not let in, limits bodies, and sets the headers of every answer."""

    def __init__(self, app: ASGIApp, guard: Guard) -> None:
        self.app, self.guard = app, guard

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":
            return  # no other kind of connection is served
        guard = self.guard
        read = 0

        async def limited() -> Message:
            nonlocal read
            message = await receive()
            read += len(message.get("body", b""))
            if read > MOST_BYTES:
                raise HTTPException(413, _TOO_LARGE)  # which the application answers with
            return message

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update({**_HEADERS, "Content-Security-Policy": guard.policy})
                headers.setdefault("Cache-Control", "no-store")
            await send(message)

        refusal = self._refusal(scope)
        if refusal is None:
            await self.app({**scope, "root_path": f"/{guard.token}"}, limited, guarded)
        else:
            await refusal(scope, receive, guarded)

    def _refusal(self, scope: Scope) -> JSONResponse | None:
        headers, guard = Headers(scope=scope), self.guard
        if not guard.knows(headers.get("host", "")):
            return _error(421, "this server does not go by that name: open the address that was printed")
        origin = headers.get("origin")
        if origin is not None and not guard.knows_origin(origin):
            return _error(403, "a page of another origin asks: only the window itself may")
        if not guard.fits(scope["path"]):
            return _error(404, "there is nothing here: open the whole address that was printed")
        length = headers.get("content-length", "0")
        if not length.isdecimal() or int(length) > MOST_BYTES:
            return _error(413, _TOO_LARGE)
        return None


def _error(status: int, text: str) -> JSONResponse:
    return JSONResponse({"error": text}, status)
