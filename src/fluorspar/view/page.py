"""The files of the page: those of the package, and no others."""

from __future__ import annotations

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
    kind = _KINDS.get(f".{name.rpartition('.')[2]}")
    for file in (files("fluorspar.view") / "static").iterdir():
        if file.name == name and kind is not None:
            return Response(file.read_bytes(), media_type=kind)
    raise HTTPException(404, "no such file of the page")
