"""What denoising needs beside Fluorspar itself."""

from __future__ import annotations

from importlib.util import find_spec

from fluorspar.errors import FluorsparError, message

__all__ = ["check_extra"]


def check_extra() -> None:
    """Find out whether Open Image Denoise is installed.

    Raises
    ------
    FluorsparError
        If it is not; the message says how to install it.
    """
    if find_spec("mitsuba_oidn") is None:
        raise FluorsparError(
            message(
                "denoising needs a package that is not installed",
                got="no mitsuba-oidn",
                fix='pip install "fluorspar[denoise]"',
            )
        )
