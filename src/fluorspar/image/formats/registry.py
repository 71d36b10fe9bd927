"""Which suffix is which format of images, and who reads and writes it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, cast

from fluorspar.errors import ImageError, OptionError, message
from fluorspar.files.formats import Format, suffixes_read, suffixes_written

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FORMATS", "SUFFIXES", "SUFFIXES_WRITTEN", "read_image", "suffix_among", "write_image"]

_HERE = "fluorspar.image.formats"

FORMATS = {
    ".nc": Format("NetCDF", f"{_HERE}.netcdf:read_netcdf", f"{_HERE}.netcdf:write_netcdf"),
    ".exr": Format("spectral EXR", f"{_HERE}.exr:read_exr", f"{_HERE}.exr:write_exr"),
    ".hdr": Format("ENVI", f"{_HERE}.envi:read_envi", f"{_HERE}.envi:write_envi"),
    ".zarr": Format("Zarr", f"{_HERE}.zarr:read_zarr", f"{_HERE}.zarr:write_zarr"),
    ".png": Format("PNG picture", writer="fluorspar.image.display.picture:write_png"),
}
"""The formats by suffix; a reader takes a path, a writer a data set and a path."""

SUFFIXES = suffixes_read(FORMATS)
"""Of files that hold a spectral image."""

SUFFIXES_WRITTEN = suffixes_written(FORMATS)
"""Of files that an image is written to: those, and pictures."""


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


def read_image(
    path: str | os.PathLike[str], channel_wavelengths: Sequence[float] | None = None
) -> xr.Dataset:
    """Read an image file in the format that its suffix says, as `SpectralImage.open` does.

    Raises
    ------
    ImageError
        If the suffix is none of `SUFFIXES`, or the file cannot be read.
    OptionError
        If wavelengths of channels are given for a file that states its own.
    """
    suffix = suffix_among(path, SUFFIXES, "read from")
    if channel_wavelengths is None:
        return cast("xr.Dataset", FORMATS[suffix].read(path))
    if suffix != ".exr":
        fault = "only the channels of an EXR file can be given wavelengths"
        raise OptionError(message(fault, got=path, fix="state them in the file"))
    return cast("xr.Dataset", FORMATS[suffix].read(path, channel_wavelengths))


def write_image(dataset: xr.Dataset, path: str | os.PathLike[str], compress: bool = False) -> None:
    """Write an image file in the format that its suffix says, as `SpectralImage.save` does.

    Raises
    ------
    ImageError
        If the suffix is none of `SUFFIXES_WRITTEN`, or the file cannot be written.
    OptionError
        If a format is to be compressed that is not.
    """
    suffix = suffix_among(path, SUFFIXES_WRITTEN, "written to")
    if not compress:
        FORMATS[suffix].write(dataset, path)
    elif suffix == ".nc":
        FORMATS[suffix].write(dataset, path, compress)
    else:
        fault = "only a NetCDF file can be written with compress"
        raise OptionError(message(fault, got=path, expected="a name that ends in .nc"))
