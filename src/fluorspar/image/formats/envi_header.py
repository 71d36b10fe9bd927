"""What an ENVI header says of the bands and the numbers of an image."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, ImageError, message
from fluorspar.image.dataset import decoded_attrs
from fluorspar.image.units import NOT_STATED, quantity_of, stated, unit_of, wavelengths_in_nm
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = [
    "KEPT",
    "bandwidth",
    "good_bands",
    "header_of",
    "laid_out_as",
    "layout_of",
    "read_header",
    "stated_by",
    "wavelengths",
]

KEPT = "components", "denoised"
"""Attributes that are fields of the header."""

_ORDERS = {"bip": (0, 1, 2), "bil": (0, 2, 1), "bsq": (2, 0, 1)}
"""Which of rows, columns and bands runs slowest, and which next."""

_FIX = "add 'wavelength = { ... }' and 'wavelength units = Nanometers' to the header"


def header_of(attrs: dict[str, Any], grid: Wavelengths) -> dict[str, Any]:
    """The header of an image that is to be written.

    Parameters
    ----------
    attrs : dict
        Attributes of the image; `unit`, `quantity`, `components`, `denoised` and `bandwidth_nm` (as `fwhm`) come back
        on reading.
    grid : Wavelengths

    Examples
    --------
    >>> header_of({"bandwidth_nm": 10.0}, Wavelengths(400, 410, 10))["fwhm"]
    ['10', '10']
    """
    unit, quantity = unit_of(attrs), quantity_of(attrs)
    said = [
        f"{name}: {value}" for name, value in decoded_attrs(attrs).items() if isinstance(value, str | int)
    ]
    header: dict[str, Any] = {
        # braces end an ENVI value
        "description": "; ".join([f"spectral {quantity}, {unit}", *said]).translate(
            {123: 40, 125: 41, 10: 32}
        ),
        "quantity": quantity,
        "data units": unit,
        "wavelength": [f"{wavelength:.10g}" for wavelength in grid.values],
        "wavelength units": "Nanometers",
        "band names": [f"{wavelength:g} nm" for wavelength in grid.values],
    }
    for name in KEPT:
        if said_of := attrs.get(name):
            header[name] = str(said_of)
    if width := attrs.get("bandwidth_nm"):
        header["fwhm"] = [f"{float(width):.10g}"] * len(grid)
    return header


def wavelengths(header: dict[str, Any], count: int, path: Path) -> NDArray[np.float64]:
    """Wavelengths of the bands in nm, ndarray of shape (count,), in the order of the file.

    Raises
    ------
    ImageError
        If there are none, their number is not `count`, or their unit is not known.
    """
    try:
        at = _numbers(header, "wavelength", count, path)
    except (KeyError, ValueError, TypeError) as err:
        raise ImageError(message("the ENVI header holds no wavelengths", where=path, fix=_FIX)) from err
    return wavelengths_in_nm(at, str(header.get("wavelength units", "")), path, _FIX)


def good_bands(header: dict[str, Any], count: int, path: Path) -> NDArray[np.bool_]:
    """Bands that the bad bands list `bbl` does not exclude, ndarray of shape (count,).

    Raises
    ------
    ImageError
        If the list is not readable or has another length, or fewer than two bands are left.
    """
    if "bbl" not in header:
        return np.ones(count, bool)
    try:
        good = np.asarray(_numbers(header, "bbl", count, path) != 0)
    except (ValueError, TypeError) as err:
        raise ImageError(message("the bad bands list (bbl) is not readable", where=path, got=err)) from err
    if good.sum() < 2:
        fault = "the bad bands list (bbl) leaves fewer than two bands"
        raise ImageError(message(fault, where=path, got=int(good.sum()), expected="at least two"))
    return good


def bandwidth(header: dict[str, Any], at: NDArray[np.float64], path: Path) -> dict[str, float]:
    """The attribute `bandwidth_nm`, from `fwhm`; none if the header has none. `at` are the wavelengths in nm.

    Warns
    -----
    ApproximationWarning
        If the bands differ in width by more than 2 %: their mean is taken.
    """
    if "fwhm" not in header:
        return {}
    try:
        values = _numbers(header, "fwhm", len(at), path)
    except (ValueError, TypeError) as err:
        raise ImageError(message("the band widths (fwhm) are not readable", where=path, got=err)) from err
    # the unit of widths is that of the wavelengths, which may have to be guessed from those
    widths = values * at[0] / _numbers(header, "wavelength", len(at), path)[0]
    mean = float(widths.mean())
    if not (np.isfinite(mean) and widths.min() > 0):
        return {}
    if np.ptp(widths) > 0.02 * mean:
        text = (
            f"{path}: the bands are {widths.min():g} to {widths.max():g} nm wide; "
            f"their mean, {mean:.4g} nm, is taken for all"
        )
        warnings.warn(text, ApproximationWarning, stacklevel=4)
    return {"bandwidth_nm": float(f"{mean:.10g}")}


def laid_out_as(shape: tuple[int, ...]) -> dict[str, Any]:
    """The part of the header that says how the data lie: float32, little-endian, band interleaved by pixel.

    Examples
    --------
    >>> laid_out_as((4, 3, 69))["interleave"]
    'bip'
    """
    sizes = dict(zip(("lines", "samples", "bands"), shape, strict=True))
    return sizes | {"header offset": 0, "data type": 4, "interleave": "bip", "byte order": 0}


def read_header(path: Path) -> dict[str, Any]:
    """The fields of a header by their names.

    Raises
    ------
    ImageError
        If it is no ENVI header.
    """
    from spectral.io import envi

    try:
        with warnings.catch_warnings(action="ignore", category=UserWarning):  # that capitals are made small
            return dict(envi.read_envi_header(str(path)))
    except (envi.EnviException, OSError, ValueError) as err:
        raise ImageError(
            message(
                "the ENVI header is not readable",
                where=path,
                got=str(err).strip().splitlines()[0] if str(err).strip() else type(err).__name__,
                expected="lines such as 'samples = 640' after a first line 'ENVI'",
            )
        ) from err


def layout_of(
    header: dict[str, Any], path: Path
) -> tuple[np.dtype[Any], int, tuple[int, int, int], tuple[int, ...]]:
    """How the data lie in their file.

    Returns
    -------
    dtype : dtype
    offset : int
        Bytes before the first number.
    sizes : tuple of int
        Numbers of rows, columns and bands.
    order : tuple of int
        Which of these runs slowest, and so on.

    Raises
    ------
    ImageError
        If a field is missing or has a value that is not known, or the file is not a plain image of real numbers.

    Warns
    -----
    ApproximationWarning
        If there is no byte order: little-endian is assumed.
    """
    from spectral.io import envi

    if "library" in str(header.get("file type", "")).lower():
        fault, got = "the ENVI file is a spectral library, not an image", f"{header.get('lines')} spectra"
        raise ImageError(message(fault, where=path, got=got, fix="give an image"))
    if str(header.get("file compression", "0")) != "0":
        raise _unusable("file compression", header, path, "0: uncompressed data")
    interleave = str(header.get("interleave", "")).lower()
    if interleave not in _ORDERS:
        raise _unusable("interleave", header, path, ", ".join(_ORDERS))
    order = str(header.get("byte order", "")).strip()
    if not order:
        text = f"{path}: the header states no byte order: little-endian (byte order = 0) is assumed"
        warnings.warn(text, ApproximationWarning, stacklevel=5)
    elif order not in ("0", "1"):
        raise _unusable("byte order", header, path, "0 or 1")
    for name in ("reflectance scale factor", "data ignore value"):
        _check_number(header, name, path)
    numbers = {}
    for name in ("lines", "samples", "bands", "header offset"):
        try:
            numbers[name] = int(header.get(name, "0" if name == "header offset" else ""))
        except (TypeError, ValueError):
            numbers[name] = -1
        if numbers[name] < (name != "header offset"):
            raise _unusable(name, header, path, "a whole number")
    offset = numbers.pop("header offset")
    kind = str(header.get("data type"))
    if kind not in envi.envi_to_dtype:
        raise _unusable("data type", header, path, ", ".join(envi.envi_to_dtype))
    dtype = np.dtype(envi.envi_to_dtype[kind]).newbyteorder(">" if order == "1" else "<")
    if dtype.kind == "c":
        raise ImageError(message("the ENVI file holds complex numbers", where=path, expected="real ones"))
    for name in ("major frame offsets", "minor frame offsets"):
        if any(str(skipped) != "0" for skipped in np.atleast_1d(header.get(name, "0"))):
            raise _unusable(name, header, path, "0")
    sizes = (numbers["lines"], numbers["samples"], numbers["bands"])
    return dtype, offset, sizes, _ORDERS[interleave]


def _unusable(name: str, header: dict[str, Any], path: Path, expected: str) -> ImageError:
    got = repr(header[name]) if name in header else "no such line"
    fix = "mend the header"
    return ImageError(
        message(
            f"the '{name}' of the ENVI header is not usable", where=path, got=got, expected=expected, fix=fix
        )
    )


def _check_number(header: dict[str, Any], name: str, path: Path) -> None:
    """Find out whether a field, if it is there, is a number that can be used."""
    if name not in header:
        return
    scale = "scale" in name
    try:
        number = float(header[name])
        usable = 0 < number < np.inf if scale else True
    except (TypeError, ValueError):
        usable = False
    if not usable:
        raise _unusable(name, header, path, "a number above 0" if scale else "a number")


def stated_by(header: dict[str, Any]) -> dict[str, str]:
    """The attributes `unit` and `quantity` of an image.

    Examples
    --------
    >>> stated_by({"reflectance scale factor": "10000"})
    {'unit': '1', 'quantity': 'reflectance'}
    """
    reflectance = "reflectance scale factor" in header
    quantity = str(header.get("quantity", "reflectance" if reflectance else "radiance"))
    return stated(str(header.get("data units", "1" if reflectance else NOT_STATED)), quantity)


def _numbers(header: dict[str, Any], name: str, count: int, path: Path) -> NDArray[np.float64]:
    numbers = np.array([float(text) for text in header[name]])
    if len(numbers) != count:
        raise ImageError(
            message(
                "the ENVI header does not fit its data",
                where=path,
                got=f"{len(numbers)} numbers in '{name}'",
                expected=count,
            )
        )
    return numbers
