"""Which suffix is which format, and who reads and writes it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from fluorspar.errors import ImageError, message

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SUFFIXES", "read_image", "suffix_among", "write_image"]

SUFFIXES = (".nc", ".exr", ".hdr")
"""NetCDF, spectral EXR and ENVI."""


def suffix_among(path: str | os.PathLike[str], known: tuple[str, ...], doing: str) -> str:
    """The suffix of an image file, in lower case.

    Raises
    ------
    ImageError
        If it is none of those known; the message says what could not be done ("read from", "written to").

    Examples
    --------
    >>> suffix_among("room.NC", SUFFIXES, "read from")
    '.nc'
    """
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        raise ImageError(
            message(
                f"a spectral image cannot be {doing} this kind of file",
                where=path,
                got=suffix or "no suffix",
                expected=", ".join(known),
            )
        )
    return suffix


def read_image(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read an image file in the format that its suffix says, as `SpectralImage.open` does.

    Raises
    ------
    ImageError
        If the suffix is none of `SUFFIXES`, or the file cannot be read.
    """
    suffix = suffix_among(path, SUFFIXES, "read from")
    if suffix == ".nc":
        from fluorspar.image.formats.netcdf import read_netcdf

        return read_netcdf(path)
    if suffix == ".hdr":
        from fluorspar.image.formats.envi import read_envi

        return read_envi(path)
    from fluorspar.image.formats.exr import read_exr

    return read_exr(path)


def write_image(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write an image file in the format that its suffix says, as `SpectralImage.save` does.

    Raises
    ------
    ImageError
        If the suffix is none of `SUFFIXES`, or the file cannot be written.
    """
    suffix = suffix_among(path, SUFFIXES, "written to")
    if suffix == ".nc":
        from fluorspar.image.formats.netcdf import write_netcdf

        write_netcdf(dataset, path)
    elif suffix == ".hdr":
        from fluorspar.image.formats.envi import write_envi

        write_envi(dataset, path)
    else:
        from fluorspar.image.formats.exr import write_exr

        write_exr(dataset, path)
