"""NetCDF images that another program wrote: other names and dimensions, packed numbers, other units."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fluorspar.errors import ApproximationWarning, ImageError, message
from fluorspar.image.components import TOTAL
from fluorspar.image.dataset import DIMS, VARIABLES, WAVELENGTH_ATTRS, load
from fluorspar.image.units import NOT_STATED, stated, wavelengths_in_nm
from fluorspar.spectral.even import even_grid

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["normalised"]

_WAVELENGTHS = ("wavelength", "wavelengths", "wl", "lambda", "wave", "bands", "band")
_ROWS = ("y", "row", "rows", "line", "lines", "height", "lat", "latitude", "northing")
_COLUMNS = (
    "x",
    "column",
    "columns",
    "col",
    "cols",
    "sample",
    "samples",
    "width",
    "lon",
    "longitude",
    "easting",
)
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

    if "radiance" not in dataset or dataset["radiance"].dims != DIMS:
        dataset = _relabelled(dataset, path)
    left_out = [str(name) for name in dataset.data_vars if name not in VARIABLES]
    if left_out and "radiance" in dataset:
        text = f"{path}: not read: {', '.join(left_out)}"
        warnings.warn(text, ApproximationWarning, stacklevel=4)
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
        if len(values) > 1 and np.all(np.diff(values) < 0):
            dataset, values = dataset.isel(wavelength=slice(None, None, -1)), values[::-1]
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


def _relabelled(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Give an image the names and the order of dimensions it has here; what is none stays as it is."""
    name = _image_in(dataset)
    at = next((known for known in _WAVELENGTHS if known in dataset and dataset[known].ndim == 1), None)
    if name is None or at is None or dataset[at].dims[0] not in dataset[name].dims:
        return dataset
    if name != "radiance":
        dataset = dataset.rename({name: "radiance"})
        quantity = "reflectance" if "reflect" in name.lower() else "radiance"
        dataset = dataset.assign_attrs({"quantity": quantity} | dataset.attrs)
        if quantity == "reflectance" and "units" not in dataset["radiance"].attrs:
            dataset["radiance"].attrs["units"] = "1"
    bands = dataset[at].dims[0]
    pixels = [dim for dim in dataset["radiance"].dims if dim not in (bands, "component")]
    rows, columns = _rows_and_columns([str(dim) for dim in pixels], path)
    values = dataset[at].variable
    dataset = dataset.drop_vars(
        [each for each in dataset.coords if each != "component"] + [at], errors="ignore"
    )
    names = {rows: "y", columns: "x", bands: "wavelength"}
    dataset = dataset.rename_dims({old: new for old, new in names.items() if old != new})
    dataset = dataset.assign_coords(wavelength=("wavelength", values.values, values.attrs))
    if "component" not in dataset["radiance"].dims:
        dataset = dataset.drop_vars("component", errors="ignore")
        dataset["radiance"] = dataset["radiance"].expand_dims(component=[TOTAL])
    for variable, (_, dims) in VARIABLES.items():
        if variable in dataset and set(dataset[variable].dims) == set(dims):
            dataset[variable] = dataset[variable].transpose(*dims)
    return load(dataset)


def _image_in(dataset: xr.Dataset) -> str | None:
    """The variable that is the image: radiance, or else the only one of three dimensions."""
    if "radiance" in dataset:
        return (
            "radiance" if dataset["radiance"].ndim == 3 + ("component" in dataset["radiance"].dims) else None
        )
    cubes = [str(name) for name, values in dataset.data_vars.items() if values.ndim == 3]
    return cubes[0] if len(cubes) == 1 and dataset[cubes[0]].dtype.kind in "fiu" else None


def _rows_and_columns(dims: list[str], path: Path) -> tuple[str, str]:
    """Which of two dimensions are the rows and the columns; if their names do not say it, rows come first."""
    first, second = (dim.lower() for dim in dims)
    if (first in _COLUMNS and second not in _COLUMNS) or (second in _ROWS and first not in _ROWS):
        return dims[1], dims[0]
    if first not in _ROWS and second not in _COLUMNS:
        text = f"{path}: {dims[0]} is taken for the rows and {dims[1]} for the columns of the image"
        warnings.warn(text, ApproximationWarning, stacklevel=6)
    return dims[0], dims[1]


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
