"""Packages that only some purposes need, which `pip install "fluorspar[...]"` brings."""

from __future__ import annotations

from importlib.util import find_spec

from fluorspar.errors import FluorsparError, message

__all__ = ["check_extra"]

_NEEDED = {
    "view": ("the window needs", {"fastapi": "fastapi", "uvicorn": "uvicorn"}),
    "denoise": ("denoising needs", {"mitsuba_oidn": "mitsuba-oidn"}),
    "cluster": ("workers and Zarr stores need", {"distributed": "dask[distributed]", "zarr": "zarr"}),
}


def check_extra(extra: str) -> None:
    """Find out whether the packages of an extra are installed.

    Parameters
    ----------
    extra : str
        `"view"`, `"denoise"` or `"cluster"`.

    Raises
    ------
    FluorsparError
        If one is missing; the message says how to install them.

    Examples
    --------
    >>> check_extra("view")
    """
    purpose, modules = _NEEDED[extra]
    missing = [package for module, package in modules.items() if find_spec(module) is None]
    if missing:
        raise FluorsparError(
            message(
                f"{purpose} packages that are not installed",
                got=f"no {', '.join(missing)}",
                fix=f'pip install "fluorspar[{extra}]"',
            )
        )
