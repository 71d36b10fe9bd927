"""Spectral images as NetCDF files: the data set as it is."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from fluorspar.errors import FluorsparError, ImageError, message
from fluorspar.files.names import check_source
from fluorspar.files.patient_file import PatientFile
from fluorspar.files.writing import replacing
from fluorspar.image.dataset import (
    VARIABLES,
    check_dataset,
    grid_of,
    names_of,
    plain_attrs,
    row_blocks,
    values_of,
)
from fluorspar.image.formats.foreign_netcdf import normalised
from fluorspar.image.formats.netcdf_layout import create
from fluorspar.image.formats.netcdf_writer import NetcdfWriter

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["NetcdfWriter", "read_netcdf", "write_netcdf"]


def write_netcdf(dataset: xr.Dataset, path: str | os.PathLike[str], compress: bool = False) -> None:
    """Write a spectral image to a NetCDF file, without loss.

    Parameters
    ----------
    dataset : Dataset
        A spectral image; it may be larger than memory.
    path : str or path-like
        The file to be written or replaced.
    compress : bool
        Pack the numbers without loss: less than half the size, but written about eight times as slowly.

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
    >>> path = Path(tempfile.mkdtemp()) / "room.nc"
    >>> write_netcdf(make_dataset(np.ones((7, 4, 3, 69)), Wavelengths(), attrs={"spp": 16}), path)
    >>> read_netcdf(path).attrs["spp"]
    16
    """
    present = [name for name in VARIABLES if name in dataset]
    shape = (dataset.sizes["y"], dataset.sizes["x"])
    attrs = plain_attrs(dataset.attrs)
    size = sum(4 * dataset[name].size for name in present)
    with replacing(path, 0 if compress else size) as temporary, PatientFile(temporary) as stream:
        with create(stream, grid_of(dataset), names_of(dataset), *shape, present, attrs, compress) as file:
            for rows in row_blocks(dataset):
                for name in present:
                    if "component" in VARIABLES[name][1]:
                        for index, component in enumerate(names_of(dataset)):
                            file[name][index, rows] = values_of(dataset, name, rows, component)
                    else:
                        file[name][rows] = values_of(dataset, name, rows)
                stream.check()
            file.attrs.update(attrs)
        stream.check()


def read_netcdf(path: str | os.PathLike[str]) -> xr.Dataset:
    """Open a spectral image in a NetCDF file; radiance is read from the file when it is used.

    Parameters
    ----------
    path : str or path-like
        A file written by Fluorspar, or any NetCDF file that holds an image with wavelengths: `radiance` or
        `reflectance` in any order of dimensions, with or without components. Numbers packed with `scale_factor` and
        `add_offset` are decoded, wavelengths in micrometres become nm.

    Returns
    -------
    Dataset
        Close it when done, or call its method `load` to have it all in memory. If the file does not say that
        it holds radiance in W m-2 sr-1 nm-1, the attributes `unit` and `quantity` keep what it says.

    Raises
    ------
    ImageError
        If the file is missing, truncated, or not a spectral image.

    Warns
    -----
    ApproximationWarning
        If something has to be assumed, or is not read.

    Examples
    --------
    >>> read_netcdf("no-such-file.nc")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: the image file does not exist
      where:    no-such-file.nc
    """
    import h5py
    import xarray as xr

    path = check_source(path)
    dataset = None
    try:
        with path.open("rb") as stream:
            classic = stream.read(3) == b"CDF"  # NetCDF 3
        if not classic:
            with h5py.File(path, "r") as file:
                file.attrs.get("_nc3_strict")  # where this fails, h5netcdf prints a traceback as it closes
        engine = "scipy" if classic else "h5netcdf"
        dataset = xr.open_dataset(path, engine=engine, mask_and_scale=False, decode_times=False)
        read = check_dataset(normalised(dataset, path), path)
        read.attrs = plain_attrs(read.attrs)
    except Exception as err:  # of a damaged file, three libraries may raise anything
        if dataset is not None:
            dataset.close()
        if isinstance(err, FluorsparError | Warning):
            raise
        said = str(err).splitlines()[0] if str(err) else type(err).__name__
        raise ImageError(
            message(
                "the image file is truncated" if "truncated" in said else "the image file is not readable",
                where=path,
                got=said,
                expected="a complete NetCDF file",
                fix="write or copy it again",
            )
        ) from err
    for name in VARIABLES:
        if name in read:
            read[name].attrs.pop("_FillValue", None)
    read.set_close(dataset.close)
    return read
