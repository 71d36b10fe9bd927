"""Marks: which row of a study made an image, as the image itself says in any format."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from fluorspar.image.opening import attrs_in
from fluorspar.studies.files import mark_of
from fluorspar.studies.study import Row

__all__ = ["MARK", "made_by"]

MARK = "study_row"
"""Attribute of an image: the mark of its row, see `mark_of`."""

# Bytes at the beginning of a file that hold the attributes: as JSON in EXR files, as text in ENVI headers.
_HEAD = 2**18
_NOTED = re.compile(rf'\b({MARK}|version|partial)"?: "?([\w.]+)')


def made_by(row: Row) -> tuple[str, set[str]] | None:
    """The mark of a row and the versions of Fluorspar that made its files, if all are there, whole and of this row.

    Examples
    --------
    >>> made_by(Row(1, {"scene": "furnace"}, (Path("nothing.nc"),), Path())) is None
    True
    """
    marks, versions = zip(*map(_mark_in, row.outputs), strict=True)
    if not all(marks) or set(marks) != {mark_of(row)}:
        return None
    return marks[0], set(versions)


def _mark_in(path: Path) -> tuple[str, str]:
    """The mark of the row that a file was made by, "" if it is a part of an image, or another's; and the version."""
    suffix = path.suffix.lower()
    attrs: Mapping[str, Any] = {}
    with suppress(OSError, ValueError, KeyError):  # damaged
        if suffix in (".nc", ".zarr"):
            attrs = attrs_in(path)
        elif suffix == ".png":
            from PIL import Image

            with Image.open(path) as picture:
                attrs = picture.info
        elif suffix != ".hdr" or path.with_suffix(".img").exists():
            with path.open("rb") as stream:
                attrs = dict(_NOTED.findall(stream.read(_HEAD).decode(errors="replace")))
    return "" if "partial" in attrs else str(attrs.get(MARK, "")), str(attrs.get("version", ""))
