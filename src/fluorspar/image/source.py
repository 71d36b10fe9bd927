"""The file an image is read from."""

from __future__ import annotations

import os
from pathlib import Path

from fluorspar.errors import ImageError, message

__all__ = ["check_source"]


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
