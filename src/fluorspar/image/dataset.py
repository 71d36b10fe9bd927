"""The layout of a spectral image as an xarray Dataset, and sums over its components.

======================== ============================== ======================================================
variable                 dims                           meaning
======================== ============================== ======================================================
radiance                 component, y, x, wavelength    float32, W m-2 sr-1 nm-1; y = 0 is the top row
standard_error           y, x, wavelength               of the total, float32, same unit; may be missing
component_standard_error component, y, x, wavelength    of each component, float32, same unit; often missing
denoised_error           y, x, wavelength               estimated error of the total of a denoised image
noisy_standard_error     y, x, wavelength               of that total before it was denoised
======================== ============================== ======================================================

A denoised image says in `denoised` how, and has the last two in place of standard errors: neighbouring pixels share
its errors.

Pixels that were not rendered are NaN and the attribute `partial` is 1. Attributes that images of other programs
may have: `unit` and `quantity`, if it is not radiance in W m-2 sr-1 nm-1, and `bandwidth_nm`, the full width at
half maximum of triangular bands (not there: samples). An image that is not split may say in `components` what it is
the sum of.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import ImageError, SpectrumError, message
from fluorspar.files.memory import check_memory
from fluorspar.image.components import COMPONENTS, TOTAL
from fluorspar.image.units import NOT_STATED, UNITS, quantity_of, unit_of
from fluorspar.spectral.uneven import grid_through
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "DIMS",
    "UNITS",
    "VARIABLES",
    "WAVELENGTH_ATTRS",
    "add_up",
    "check_dataset",
    "decoded_attrs",
    "grid_of",
    "load",
    "make_dataset",
    "names_of",
    "plain_attrs",
    "readable",
    "row_blocks",
    "values_of",
    "variable_attrs",
]

DIMS = ("component", "y", "x", "wavelength")
VARIABLES: dict[str, tuple[str, tuple[str, ...]]] = {
    "radiance": ("spectral radiance", DIMS),
    "standard_error": ("standard error of the total spectral radiance", DIMS[1:]),
    "component_standard_error": ("standard error of the spectral radiance of each component", DIMS),
    "denoised_error": ("estimated error of the denoised total spectral radiance", DIMS[1:]),
    "noisy_standard_error": ("standard error of the total spectral radiance before denoising", DIMS[1:]),
}
"""Long name and dims of every variable of a spectral image."""
WAVELENGTH_ATTRS = {"units": "nm", "standard_name": "radiation_wavelength"}

_BLOCK_BYTES = 32 * 2**20
_BLOCK_ROWS = 16
_EXPECTED = (
    "radiance(component, y, x, wavelength) and, optionally, standard_error(y, x, wavelength); or an image of three "
    "dimensions and 'wavelength' along one of them"
)


def make_dataset(
    radiance: ArrayLike,
    wavelengths: Wavelengths,
    standard_error: ArrayLike | None = None,
    attrs: Mapping[str, Any] | None = None,
    *,
    component_standard_error: ArrayLike | None = None,
    denoised_error: ArrayLike | None = None,
    noisy_standard_error: ArrayLike | None = None,
    components: Sequence[str] = COMPONENTS,
) -> xr.Dataset:
    """Label the arrays of a spectral image; float32 arrays are not copied.

    Parameters
    ----------
    radiance : array_like of shape (C, Y, X, N)
        W m-2 sr-1 nm-1.
    wavelengths : Wavelengths
        The N wavelengths.
    standard_error : array_like of shape (Y, X, N), optional
        Of the total.
    attrs : mapping, optional
        Numbers and strings are kept; anything else is kept as JSON.
    component_standard_error : array_like of shape (C, Y, X, N), optional
        Of each component.
    denoised_error, noisy_standard_error : array_like of shape (Y, X, N), optional
        Of a denoised image.
    components : sequence of str
        The C names, those of `COMPONENTS` unless one is missing; or `TOTAL` alone, for an image not split.

    Returns
    -------
    Dataset
        As laid out at the top of this module.

    Raises
    ------
    ImageError
        If the shapes do not match.

    Examples
    --------
    >>> import numpy as np
    >>> dataset = make_dataset(np.ones((7, 2, 3, 69)), Wavelengths(), attrs={"spp": 16})
    >>> dict(dataset.sizes)
    {'component': 7, 'y': 2, 'x': 3, 'wavelength': 69}
    """
    import xarray as xr

    given = {
        "radiance": radiance,
        "standard_error": standard_error,
        "component_standard_error": component_standard_error,
        "denoised_error": denoised_error,
        "noisy_standard_error": noisy_standard_error,
    }
    arrays = {name: np.asarray(array, np.float32) for name, array in given.items() if array is not None}
    shape = arrays["radiance"].shape
    expected = {"component": len(components), "wavelength": len(wavelengths)}
    if len(shape) == 4:
        expected.update(y=shape[1], x=shape[2])
    for name, array in arrays.items():
        wanted = tuple(expected.get(dim, f"any number of {dim}") for dim in VARIABLES[name][1])
        if array.shape != wanted:
            raise ImageError(
                message(
                    "an array of a spectral image has the wrong shape",
                    where=name,
                    got=array.shape,
                    expected=wanted,
                )
            )
    attrs = plain_attrs(attrs or {})
    variables = {
        name: (VARIABLES[name][1], array, variable_attrs(name, attrs)) for name, array in arrays.items()
    }
    coords = {
        "component": list(components),
        "wavelength": ("wavelength", wavelengths.values, WAVELENGTH_ATTRS),
    }
    return check_dataset(xr.Dataset(variables, coords, attrs))


def variable_attrs(name: str, attrs: Mapping[str, Any]) -> dict[str, str]:
    """The attributes of a variable, by those of the image.

    Examples
    --------
    >>> variable_attrs("radiance", {})
    {'units': 'W m-2 sr-1 nm-1', 'long_name': 'spectral radiance'}
    >>> variable_attrs("radiance", {"unit": "1", "quantity": "reflectance"})
    {'units': '1', 'long_name': 'spectral reflectance'}
    """
    units = {} if unit_of(attrs) == NOT_STATED else {"units": unit_of(attrs)}
    return units | {"long_name": VARIABLES[name][0].replace("radiance", quantity_of(attrs))}


def check_dataset(dataset: xr.Dataset, where: object = None) -> xr.Dataset:
    """Return `dataset` if it is a spectral image, else say what is amiss.

    Parameters
    ----------
    dataset : Dataset
        As laid out at the top of this module.
    where : object, optional
        The file it came from, for the message.

    Raises
    ------
    ImageError
        If a variable, a dimension or a component name is not as it must be.

    Examples
    --------
    >>> import xarray as xr
    >>> check_dataset(xr.Dataset(), where="empty.nc")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: this is not a spectral image of Fluorspar: it has no variable 'radiance'
      where:    empty.nc
      expected: radiance(component, y, x, wavelength) and, optionally, standard_error(y, x, wavelength); or ...
    """
    problem = ""
    if "radiance" not in dataset:
        problem = "it has no variable 'radiance'"
    for name, (_, dims) in VARIABLES.items():
        if not problem and name in dataset and dataset[name].dims != dims:
            problem = f"{name} has the dims {dataset[name].dims}"
        if not problem and name in dataset and dataset[name].dtype.kind not in "fiu":
            problem = f"{name} holds no real numbers"
    if not problem:
        missing = [name for name in ("component", "wavelength") if name not in dataset.coords]
        names = [] if missing else [str(name) for name in dataset["component"].values]
        if missing:
            problem = f"it has no coordinate {missing[0]!r}"
        elif names != [name for name in COMPONENTS if name in names] and names != [TOTAL]:
            problem = (
                f"its components are {', '.join(names)}, not some of {', '.join(COMPONENTS)} in this order"
            )
        else:
            try:
                grid_of(dataset)
            except SpectrumError as err:
                problem = str(err).splitlines()[0]
    if problem:
        raise ImageError(
            message(
                f"this is not a spectral image of Fluorspar: {problem}",
                where=where,
                expected=_EXPECTED,
            )
        )
    return dataset


def grid_of(dataset: xr.Dataset) -> Wavelengths:
    """The wavelengths of a spectral image, which may be uneven."""
    return grid_through(dataset["wavelength"].values, dataset.encoding.get("source"), SpectrumError)


def names_of(dataset: xr.Dataset) -> tuple[str, ...]:
    """The names of the components a spectral image holds, in their order."""
    return tuple(str(name) for name in dataset["component"].values)


@contextmanager
def readable(where: object) -> Iterator[None]:
    """Turn what HDF5 raises while it reads damaged pixels into an error that names the file."""
    try:
        yield
    except (OSError, RuntimeError, KeyError) as err:
        raise ImageError(
            message(
                "pixels of the image cannot be read",
                where=where,
                got=str(err).splitlines()[0] if str(err) else type(err).__name__,
                fix="the file is damaged: write or copy it again",
            )
        ) from err


def load(dataset: xr.Dataset) -> xr.Dataset:
    """Load all of an image into memory; return it.

    Raises
    ------
    ImageError
        If it does not fit, or the file is damaged.
    """
    _check_size(dataset, sum(4 * dataset[name].size for name in VARIABLES if name in dataset))
    with readable(dataset.encoding.get("source")):
        return dataset.load()


def _check_size(dataset: xr.Dataset, needed: int, what: str = "spectra") -> None:
    size = f"{dataset.sizes['x']} x {dataset.sizes['y']} pixels"
    check_memory(needed, dataset.encoding.get("source"), f"{what} of {size}")


def values_of(
    dataset: xr.Dataset, variable: str, rows: slice = slice(None), component: str | None = None
) -> NDArray[np.float32]:
    """Load some rows of a variable, of one component if it has several.

    Parameters
    ----------
    dataset : Dataset
        A spectral image, in memory or in a file.
    variable : str
        `radiance`, `standard_error` or `component_standard_error`.
    rows : slice
        The rows y.
    component : str, optional
        Which component.

    Returns
    -------
    ndarray of shape (rows, X, N)
        A view if the data set is in memory: not to be written to.

    Examples
    --------
    >>> dataset = make_dataset(np.ones((7, 4, 3, 69)), Wavelengths())
    >>> values_of(dataset, "radiance", slice(0, 2), "source").shape
    (2, 3, 69)
    """
    index: dict[str, Any] = {"y": rows}
    if component is not None:
        index["component"] = names_of(dataset).index(component)
    chosen = dataset[variable].isel(index)
    _check_size(dataset, 4 * chosen.size)
    with readable(dataset.encoding.get("source")):
        return np.asarray(chosen.values, np.float32)


def add_up(dataset: xr.Dataset, components: Sequence[str], rows: slice = slice(None)) -> NDArray[np.float32]:
    """Add components, one at a time, so that never more than two of them are in memory.

    Parameters
    ----------
    dataset : Dataset
        A spectral image, in memory or in a file.
    components : sequence of str
        The components to be added, at least one.
    rows : slice
        The rows y.

    Returns
    -------
    ndarray of shape (rows, X, N)
        A new array, added up in float32 in the order given.

    Examples
    --------
    >>> dataset = make_dataset(np.ones((7, 4, 3, 69)), Wavelengths())
    >>> float(add_up(dataset, COMPONENTS).max())
    7.0
    """
    total = np.array(values_of(dataset, "radiance", rows, components[0]), np.float32, order="C")
    for name in components[1:]:
        total += values_of(dataset, "radiance", rows, name)
    return total


def row_blocks(dataset: xr.Dataset) -> Iterator[slice]:
    """Cut an image into blocks of rows of about 32 MB a component, whole chunks of the file if possible.

    Raises
    ------
    ImageError
        If not even three numbers a pixel would fit into memory: no image is that large, its file is damaged.
    """
    pixels = dataset.sizes["y"] * dataset.sizes["x"]
    _check_size(dataset, 3 * 8 * pixels, "three numbers a pixel")
    return _row_blocks(dataset)


def _row_blocks(dataset: xr.Dataset) -> Iterator[slice]:
    height, width, bands = (dataset.sizes[dim] for dim in ("y", "x", "wavelength"))
    rows = _BLOCK_BYTES // max(4 * width * bands, 1)
    rows = max(rows // _BLOCK_ROWS * _BLOCK_ROWS, min(rows, _BLOCK_ROWS), 1)
    for first in range(0, height, rows):
        yield slice(first, min(first + rows, height))


def plain_attrs(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Make attributes of numbers and strings only, as every file format can hold them.

    Parameters
    ----------
    attrs : mapping
        Booleans become 0 or 1, paths strings, dicts and lists JSON; None is left out.

    Returns
    -------
    dict

    Raises
    ------
    ImageError
        If a value cannot be written as JSON.

    Examples
    --------
    >>> plain_attrs({"spp": 64, "partial": True, "timings": {"trace": 1.5}})
    {'spp': 64, 'partial': 1, 'timings': '{"trace": 1.5}'}
    """
    return {name: _plain(name, value) for name, value in attrs.items() if value is not None}


def _plain(name: str, value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str | int | float):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    try:
        return json.dumps(value, ensure_ascii=False, default=_jsonable)
    except (TypeError, ValueError) as err:
        raise ImageError(
            message(
                "an attribute cannot be stored",
                where=name,
                got=type(value).__name__,
                expected="a number, a string, or a dict or list of them",
            )
        ) from err


def _jsonable(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(type(value).__name__)


def decoded_attrs(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Undo `plain_attrs`: JSON objects and lists become dicts and lists again.

    Examples
    --------
    >>> decoded_attrs({"spp": 64, "timings": '{"trace": 1.5}'})
    {'spp': 64, 'timings': {'trace': 1.5}}
    """
    decoded = {}
    for name, value in attrs.items():
        decoded[name] = value
        if isinstance(value, str) and value[:1] in ("{", "["):
            try:
                decoded[name] = json.loads(value)
            except ValueError:
                continue
    return decoded
