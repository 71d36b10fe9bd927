"""Opening an image file."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from fluorspar.files.writing import replacing
from fluorspar.image.formats.netcdf_layout import write_attrs
from fluorspar.image.formats.zarr_layout import describe
from fluorspar.image.spectral_image import SpectralImage

__all__ = ["attrs_in", "open", "replace_attrs"]


def open(path: str | os.PathLike[str]) -> SpectralImage:
    """Open an image file, as `SpectralImage.open` does: NetCDF, Zarr, spectral EXR or ENVI.

    Parameters
    ----------
    path : str or path-like

    Raises
    ------
    ImageError
        If the file is missing, truncated, of another kind, or not a spectral image.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> path = os.path.join(tempfile.mkdtemp(), "room.nc")
    >>> SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths()).save(path)
    >>> open(path).size
    (6, 4)
    """
    return SpectralImage.open(path)


def attrs_in(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    """Read the attributes of a `.nc` file or `.zarr` store as they are written, at once; none if it is damaged.

    Examples
    --------
    >>> attrs_in("no-such-file.nc")
    {}
    """
    with suppress(OSError, ValueError, KeyError):
        if Path(path).suffix.lower() == ".zarr":
            attrs: Mapping[str, Any] = json.loads(Path(path, "zarr.json").read_text())["attributes"]
            return attrs
        import h5py

        with h5py.File(path, "r") as file:
            return dict(file.attrs)
    return {}


def replace_attrs(path: str | os.PathLike[str], attrs: Mapping[str, Any]) -> None:
    """Give the image in a `.nc` file or `.zarr` store other attributes.

    Raises
    ------
    ImageError
        If it cannot be written; it is then as it was.
    """
    if Path(path).suffix.lower() == ".zarr":
        import zarr

        describe(zarr.open_group(path, mode="r+"), attrs)
        return
    with replacing(path) as temporary:
        shutil.copyfile(path, temporary)
        write_attrs(temporary, attrs)
