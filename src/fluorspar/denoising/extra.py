"""What denoising needs beside Fluorspar itself."""

from __future__ import annotations

from fluorspar.extras import check_installed

__all__ = ["check_extra"]


def check_extra() -> None:
    """Find out whether Open Image Denoise is installed.

    Raises
    ------
    FluorsparError
        If it is not; the message says how to install it.
    """
    check_installed("denoising", "denoise", "mitsuba_oidn")
