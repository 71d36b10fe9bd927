"""The files of the page: those of the package, and no others."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from fastapi import Response
from starlette.exceptions import HTTPException

__all__ = ["page_file"]

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
}


def page_file(name: str) -> Response:
    """Answer with a file of the page.

    Raises
    ------
    HTTPException
        404 if it is none of them: names are looked up in a list, not on the disk.
    """
    if name not in _names():
        raise HTTPException(404, "no such file of the page")
    kind = _KINDS[f".{name.rpartition('.')[2]}"]
    return Response(_folder().joinpath(name).read_bytes(), media_type=kind)


def _folder():  # type: ignore[no-untyped-def]
    return files("fluorspar.view") / "static"


@cache
def _names() -> frozenset[str]:
    return frozenset(
        file.name for file in _folder().iterdir() if f".{file.name.rpartition('.')[2]}" in _KINDS
    )
