"""Names of files that are read, as text, and with the column of a table that is meant."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fluorspar.errors import ImageError, message

__all__ = ["check_source", "encodable", "file_and_column", "text_of"]


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
    try:
        folder, file = path.is_dir(), path.is_file()
    except OSError as err:
        raise ImageError(message("the image file cannot be read", where=path, got=err.strerror)) from err
    if folder:
        raise ImageError(message("the image file is a directory", where=path, fix="name a file in it"))
    if not file:
        raise ImageError(message("the image file does not exist", where=path))
    return path


@contextmanager
def encodable(path: Path) -> Iterator[str]:
    """Give a name of a file in UTF-8, for libraries that take no other; its folder gets another name meanwhile.

    Parameters
    ----------
    path : Path
        Names may be any bytes.

    Examples
    --------
    >>> with encodable(Path("room.exr")) as name:
    ...     print(name)
    room.exr
    """
    if text_of(path) == str(path):
        yield str(path)
        return
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / "file"
        link.symlink_to(path.absolute())
        yield str(link)
