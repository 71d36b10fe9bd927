"""NetCDF images that another program wrote: packed numbers, other units, rounded wavelengths."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fluorspar.errors import ImageError, message
from fluorspar.image.dataset import VARIABLES, WAVELENGTH_ATTRS
from fluorspar.image.units import NOT_STATED, stated, wavelengths_in_nm
from fluorspar.spectral.even import even_grid

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["normalised"]

_PACKED = ("scale_factor", "add_offset", "missing_value", "_Unsigned")


def normalised(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Bring a data set to the conventions of Fluorspar; one of Fluorspar's own stays as it is.

    Parameters
    ----------
    dataset : Dataset
        As it was opened, nothing decoded.
    path : Path
        For messages.

    Returns
    -------
    Dataset
        Packed numbers are decoded when they are used, fill values are NaN, the names of components are text,
        wavelengths are in nm. The attributes `unit` and `quantity` say what `radiance` is, if that is not
        radiance in W m-2 sr-1 nm-1.

    Raises
    ------
    ImageError
        If the unit of the wavelengths is not known, or the attribute `bandwidth_nm` is not a number.
    """
    import xarray as xr

    if any(_is_packed(dataset[name]) for name in VARIABLES if name in dataset):
        dataset = xr.decode_cf(dataset, decode_times=False, decode_coords=False)
    if "component" in dataset.coords:
        names = [
            name.decode() if isinstance(name, bytes) else str(name) for name in dataset["component"].values
        ]
        dataset = dataset.assign_coords(component=names)
    if "wavelength" in dataset.coords and dataset["wavelength"].ndim == 1:
        unit = str(dataset["wavelength"].attrs.get("units", ""))
        fix = "set the attribute 'units' of the variable 'wavelength' to 'nm'"
        values = wavelengths_in_nm(dataset["wavelength"].values, unit, path, fix)
        grid = even_grid(values)
        at = values if grid is None else grid.values
        dataset = dataset.assign_coords(wavelength=("wavelength", at, WAVELENGTH_ATTRS))
    if "radiance" in dataset:
        said = dataset["radiance"].attrs.get("units") or dataset.attrs.get("unit") or NOT_STATED
        quantity = str(dataset.attrs.get("quantity", "radiance"))
        dataset = dataset.assign_attrs(stated(str(said), quantity))
    if "bandwidth_nm" in dataset.attrs:
        dataset = dataset.assign_attrs(bandwidth_nm=_width(dataset.attrs["bandwidth_nm"], path))
    return dataset


def _width(value: object, path: Path) -> float:
    """A bandwidth, of which other programs may make text or an array of one number."""
    try:
        width = float(np.asarray(value).reshape(()))
    except (TypeError, ValueError):
        width = np.nan
    if not (np.isfinite(width) and width >= 0):
        raise ImageError(
            message(
                "the bandwidth of the image is not readable",
                where=f"{path}, attribute bandwidth_nm",
                got=repr(value),
                expected="the FWHM in nm as a number, 0 for samples",
                fix="mend the attribute, or remove it if it is not known",
            )
        )
    return width


def _is_packed(variable: xr.DataArray) -> bool:
    fill = variable.attrs.get("_FillValue", np.nan)
    return any(name in variable.attrs for name in _PACKED) or not np.isnan(fill)
