"""What the window needs beside Fluorspar itself."""

from __future__ import annotations

from importlib.util import find_spec

from fluorspar.errors import FluorsparError, message

__all__ = ["check_extra"]

_NEEDED = ("fastapi", "uvicorn")


def check_extra() -> None:
    """Find out whether the server's packages are installed.

    Raises
    ------
    FluorsparError
        If one is missing; the message says how to install them.

    Examples
    --------
    >>> check_extra()
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        fix = 'pip install "fluorspar[view]"'
        raise FluorsparError(
            message(
                "the window needs packages that are not installed", got=f"no {', '.join(missing)}", fix=fix
            )
        )
