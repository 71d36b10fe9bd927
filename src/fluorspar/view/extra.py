"""What the window needs beside Fluorspar itself."""

from __future__ import annotations

from fluorspar.extras import check_installed

__all__ = ["check_extra"]


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
    check_installed("the window", "view", "fastapi", "uvicorn")
