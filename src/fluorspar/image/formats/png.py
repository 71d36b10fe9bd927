"""Spectral images as PNG files: a picture of the total, which is not read back."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from fluorspar.files.writing import replacing
from fluorspar.image.dataset import names_of
from fluorspar.image.display.appearance import appearance
from fluorspar.image.display.picture import png_bytes

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["write_picture"]


def write_picture(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a picture of the total.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from fluorspar.image.dataset import make_dataset
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> path = Path(tempfile.mkdtemp()) / "room.png"
    >>> write_picture(make_dataset(np.ones((7, 4, 3, 69)), Wavelengths()), path)
    >>> path.read_bytes()[1:4]
    b'PNG'
    """
    shown = appearance(dataset, names_of(dataset))
    with replacing(path) as temporary:
        temporary.write_bytes(png_bytes(shown.bytes))
