"""Names of files that are read, as text, and with the column of a table that is meant."""

from __future__ import annotations

import os
from pathlib import Path

from fluorspar.errors import ImageError, message

__all__ = ["check_source", "file_and_column", "text_of"]


def file_and_column(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """Split `lamp.csv:second` into the file and the name of a column in it.

    A file that exists by the whole name is that file.

    Examples
    --------
    >>> file_and_column("lamp.csv")[1]
    ''
    >>> file_and_column(f"{__file__}:second")[1]
    'second'
    """
    text = os.fspath(path)
    if not os.path.isfile(text):
        for at in (place for place, letter in enumerate(text) if letter == ":"):
            if os.path.isfile(text[:at]):
                return Path(text[:at]), text[at + 1 :].strip()
    return Path(path), ""


def text_of(path: str | os.PathLike[str]) -> str:
    """The name of a file as text that every file and terminal can hold.

    Parameters
    ----------
    path : str or path-like
        Names may be any bytes; those that are no UTF-8 become the replacement character.

    Examples
    --------
    >>> text_of(os.fsdecode(b"caf\\xe9.nc"))
    'caf�.nc'
    """
    return os.fsencode(path).decode("utf-8", errors="replace")


def check_source(path: str | os.PathLike[str]) -> Path:
    """Check that an image file is there.

    Raises
    ------
    ImageError
        If it does not exist or is a directory.

    Examples
    --------
    >>> check_source("no-such-file.nc")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: the image file does not exist
      where:    no-such-file.nc
    """
    path = Path(path)
    if path.is_dir():
        raise ImageError(message("the image file is a directory", where=path, fix="name a file in it"))
    if not path.is_file():
        raise ImageError(message("the image file does not exist", where=path))
    return path
