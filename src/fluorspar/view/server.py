"""The server in a thread of its own: listening, its address, and its end."""

from __future__ import annotations

import socket
import threading
import time

import uvicorn

from fluorspar.errors import OptionError, message
from fluorspar.view.app import make_app
from fluorspar.view.security import Guard, new_token
from fluorspar.view.workspace import Workspace

__all__ = ["Server"]

_SEEN_HERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # what browsers call them
_PATIENCE = 3  # seconds that answers under way may take at the end


class Server:
    """Serves a workspace until it is closed.

    Parameters
    ----------
    workspace : Workspace
    host : str
        Address to listen at; loopback unless somebody wants otherwise.
    port : int
        0: any that is free.
    framed : bool
        Whether pages of other origins may show the window in a frame.

    Raises
    ------
    OptionError
        If it cannot listen there.

    Examples
    --------
    >>> with Server(Workspace([])) as server:
    ...     server.address.startswith("http://127.0.0.1:")
    True
    """

    def __init__(
        self, workspace: Workspace, *, host: str = "127.0.0.1", port: int = 0, framed: bool = False
    ) -> None:
        self.workspace = workspace
        self._socket = _listening(host, port)
        port = int(self._socket.getsockname()[1])
        guard = Guard(new_token(), host, port, framed)
        shown = _SEEN_HERE.get(host, host)
        shown = f"[{shown}]" if ":" in shown else shown
        self.address = f"http://{shown}:{port}/{guard.token}/"
        config = uvicorn.Config(
            make_app(workspace, guard),
            lifespan="off",
            log_config=None,
            log_level="critical",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=_PATIENCE,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._serve, name="fluorspar view", daemon=True)
        workspace.start()
        self._thread.start()
        while not self._server.started and self._thread.is_alive():
            time.sleep(0.005)

    def _serve(self) -> None:
        self._server.run(sockets=[self._socket])

    def wait(self) -> None:
        """Wait until it ends, or Ctrl-C."""
        while self._thread.is_alive():
            self._thread.join(0.2)

    def close(self) -> None:
        """Stop, and free the port."""
        self._server.should_exit = True
        self.workspace.close()
        self._thread.join()
        self._socket.close()

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _listening(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)  # asyncio: no delay of TCP only
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen()  # from now on nobody else can have the port
    except (OSError, OverflowError, TypeError) as err:
        listening.close()
        fix = "choose another --port (0: any that is free), or an address of this computer (--host)"
        raise OptionError(message("cannot listen there", where=f"{host}:{port}", got=err, fix=fix)) from err
    return listening
