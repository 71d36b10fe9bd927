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

__all__ = ["bandwidth", "check_number", "good_bands", "header_of", "stated_by", "wavelengths"]

_FIX = "add 'wavelength = { ... }' and 'wavelength units = Nanometers' to the header"


def header_of(attrs: dict[str, Any], grid: Wavelengths) -> dict[str, Any]:
    """The header of an image that is to be written.

    Parameters
    ----------
    attrs : dict
        Attributes of the image; `unit`, `quantity`, `components` and `bandwidth_nm` (as `fwhm`) come back on reading.
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
    if components := attrs.get("components"):
        header["components"] = str(components)
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


def bandwidth(header: dict[str, Any], count: int, path: Path) -> dict[str, float]:
    """The attribute `bandwidth_nm`, from `fwhm`; none if the header has none.

    Warns
    -----
    ApproximationWarning
        If the bands differ in width by more than 2 %: their mean is taken.
    """
    if "fwhm" not in header:
        return {}
    try:
        values = _numbers(header, "fwhm", count, path)
    except (ValueError, TypeError) as err:
        raise ImageError(message("the band widths (fwhm) are not readable", where=path, got=err)) from err
    at = _numbers(header, "wavelength", count, path)
    # the unit of widths is that of the wavelengths, which may have to be guessed from those
    scale = wavelengths(header, count, path)[0] / at[0]
    widths = values * scale
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


def check_number(header: dict[str, Any], name: str, path: Path) -> None:
    """Find out whether a field, if it is there, is a number that can be used.

    Raises
    ------
    ImageError
        If it is not a number, or a scale factor that is not above 0.

    Examples
    --------
    >>> check_number({"data ignore value": "-999"}, "data ignore value", Path("a.hdr"))
    """
    if name not in header:
        return
    scale = "scale" in name
    try:
        number = float(header[name])
        usable = 0 < number < np.inf if scale else True
    except (TypeError, ValueError):
        usable = False
    if not usable:
        raise ImageError(
            message(
                f"the '{name}' of the ENVI header is not usable",
                where=path,
                got=repr(header[name]),
                expected="a number above 0" if scale else "a number",
                fix="mend the line, or delete it",
            )
        )


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
