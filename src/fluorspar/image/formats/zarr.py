"""Spectral images as Zarr stores: the data set as it is, in chunks that can be read one by one."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from fluorspar.errors import FluorsparError, ImageError, message
from fluorspar.extras import check_extra
from fluorspar.files.beside import Temporary
from fluorspar.files.writing import check_folder, undisturbed, write_error
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
from fluorspar.image.formats.zarr_layout import create, is_store, put

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["check_zarr_target", "read_zarr", "write_zarr"]


def check_zarr_target(path: str | os.PathLike[str]) -> Path:
    """Check, before any work is done, that a Zarr store can be written; return its folder.

    Raises
    ------
    FluorsparError
        If the package `zarr` is missing.
    ImageError
        If the store cannot be made there, or what is there is something else.
    """
    check_extra("cluster")
    return check_folder(path, is_store, "Zarr store of a spectral image")


def write_zarr(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a spectral image to a Zarr store, without loss.

    Parameters
    ----------
    dataset : Dataset
        A spectral image; it may be larger than memory.
    path : str or path-like
        The store to be written or replaced, a folder.

    Raises
    ------
    FluorsparError
        If the package `zarr` is missing.
    ImageError
        If the store cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from fluorspar.image.dataset import make_dataset
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> path = Path(tempfile.mkdtemp()) / "room.zarr"
    >>> write_zarr(make_dataset(np.ones((7, 4, 3, 69)), Wavelengths(), attrs={"spp": 16}), path)
    >>> read_zarr(path).attrs["spp"]
    16
    """
    target = check_zarr_target(path)
    present = [name for name in VARIABLES if name in dataset]
    names, size = names_of(dataset), (dataset.sizes["y"], dataset.sizes["x"])
    temporary = None
    try:
        temporary = Temporary(target, folder=True)
        group = create(temporary.path, grid_of(dataset), names, *size, present, plain_attrs(dataset.attrs))
        for rows in row_blocks(dataset):
            for name in present:
                layers = enumerate(names) if "component" in VARIABLES[name][1] else [(None, None)]
                for index, component in layers:
                    put(group[name], index, rows.start, values_of(dataset, name, rows, component))
        with undisturbed():
            temporary.keep()
    except (OSError, RuntimeError) as err:
        raise write_error(target, err) from err
    finally:
        if temporary is not None:
            temporary.drop()


def read_zarr(path: str | os.PathLike[str]) -> xr.Dataset:
    """Open a spectral image in a Zarr store; radiance is read from it when it is used.

    Parameters
    ----------
    path : str or path-like
        A store written by Fluorspar, perhaps still being written, or any that holds an image as `read_netcdf` takes it.

    Returns
    -------
    Dataset
        As of `read_netcdf`.

    Raises
    ------
    FluorsparError
        If the package `zarr` is missing.
    ImageError
        If the store is missing, damaged, or not a spectral image.

    Warns
    -----
    ApproximationWarning
        If something has to be assumed, or is not read.

    Examples
    --------
    >>> read_zarr("no-such-store.zarr")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: the Zarr store does not exist
      where:    no-such-store.zarr
    """
    import xarray as xr

    check_extra("cluster")
    path = Path(path)
    if not path.exists():
        raise ImageError(message("the Zarr store does not exist", where=path))
    try:
        dataset = xr.open_dataset(
            path, engine="zarr", chunks=None, mask_and_scale=False, decode_times=False, consolidated=False
        )
        read = check_dataset(normalised(dataset, path), path)
        read.attrs = plain_attrs(read.attrs)
    except Exception as err:  # of a damaged store, two libraries may raise anything
        if isinstance(err, FluorsparError | Warning):
            raise
        said = str(err).splitlines()[0] if str(err) else type(err).__name__
        raise ImageError(
            message(
                "the Zarr store is not readable",
                where=path,
                got=said,
                expected="a complete Zarr store, a folder",
                fix="write or copy it again",
            )
        ) from err
    for name in VARIABLES:
        if name in read:
            read[name].attrs.pop("_FillValue", None)
    return read
