"""One number for each pixel as a colour: bands, standard errors, differences."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.image.dataset import names_of, row_blocks, values_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import unit_of_image
from fluorspar.image.weighting import error_of, factors_of
from fluorspar.view.questions import View

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MAPS", "coloured", "layer_of", "stops"]

MAPS = {
    "band": "viridis",
    "standard_error": "magma",
    "relative_error": "magma",
    "difference": "magma",
    "matrix": "viridis",
}
"""Matplotlib's colour map of each kind of number."""

Array = NDArray[np.float64]

_TOP = 99.0  # percentile at which colours end: lamps must not take all of them
_MISSING = (51, 51, 51)
_WITHIN = 1e-6  # nm


def layer_of(image: SpectralImage, view: View) -> tuple[NDArray[np.float64], str]:
    """The numbers of a view that is not in colour.

    Parameters
    ----------
    image : SpectralImage
    view : View
        Its band, both ends included, is that of the mean; None: all wavelengths.

    Returns
    -------
    values : ndarray of shape (Y, X)
        The mean over the band of the radiance; or its standard error, the bands of a pixel being fully correlated;
        or their ratio, NaN where there is no light.
    unit : str

    Raises
    ------
    OptionError
        If no wavelength is in the band, or the standard error is not known.
    """
    factors_of(image, view.weights)  # says so if there is no such component
    at = image.wavelengths.values
    first, last = sorted(view.band) if view.band else (at[0], at[-1])
    inside = np.flatnonzero((at >= first - _WITHIN) & (at <= last + _WITHIN))
    if not inside.size:
        got, expected = f"{first:g} to {last:g} nm", f"within {image.wavelengths}"
        raise OptionError(message("no wavelength of the image is in the band", got=got, expected=expected))
    bands = image.dataset.isel(wavelength=slice(int(inside[0]), int(inside[-1]) + 1))
    unit = unit_of_image(image)
    if view.mode == "band":
        return _radiance(bands, view), unit
    layer = error_of(image, view.weights)
    if layer is None:
        held = "standard_error" in image.dataset
        fault = "the standard error of components of different weights is not known"
        fix = "give all components the same weight" if held else "render with more than one sample per pixel"
        raise OptionError(message(fault if held else "the image holds no standard error", fix=fix))
    variable, component, factor = layer
    error = _mean(bands, variable, component, factor)
    if view.mode == "standard_error":
        return error, unit
    radiance = _radiance(bands, view)
    return np.divide(error, radiance, out=np.full_like(error, np.nan), where=radiance > 0), "1"


def _radiance(bands: xr.Dataset, view: View) -> Array:
    """Mean over bands of the weighted total, ndarray of shape (Y, X)."""
    total = np.zeros((bands.sizes["y"], bands.sizes["x"]))
    for name in names_of(bands):
        if view.weight(name):
            total += _mean(bands, "radiance", name, view.weight(name))
    return total


def _mean(bands: xr.Dataset, variable: str, component: str | None, factor: float) -> Array:
    """Mean over bands times a factor, ndarray of shape (Y, X)."""
    count = bands.sizes["wavelength"]
    share = np.full(count, factor / count, np.float32)
    return np.concatenate(
        [values_of(bands, variable, rows, component) @ share for rows in row_blocks(bands)], dtype=np.float64
    )


def coloured(
    values: NDArray[np.floating], mode: str, limits: tuple[float, float] | None = None
) -> tuple[NDArray[np.uint8], tuple[float, float]]:
    """Show numbers as colours.

    Parameters
    ----------
    values : ndarray of shape (Y, X)
        Grey where they are NaN.
    mode : str
        A key of `MAPS`.
    limits : (float, float), optional
        What the ends of the colours stand for; default: 0, or what is below, and the 99th percentile.

    Returns
    -------
    rgb : ndarray of shape (Y, X, 3)
        uint8.
    limits : (float, float)

    Examples
    --------
    >>> coloured(np.array([[0.0, 1.0, np.nan]]), "band", (0.0, 1.0))[0].tolist()
    [[[68, 1, 84], [253, 231, 37], [51, 51, 51]]]
    """
    known = values[np.isfinite(values)]
    if limits is None:
        low = min(0.0, float(known.min())) if known.size else 0.0
        tops = (float(np.percentile(known, _TOP)), float(known.max())) if known.size else ()
        limits = (low, next((top for top in tops if top > low), low + 1.0))
    low, high = limits
    if not low < high:
        expected = "two numbers, the first one smaller"
        raise OptionError(message("a range of colours is impossible", got=limits, expected=expected))
    with np.errstate(invalid="ignore"):
        place = np.nan_to_num(np.clip((values - low) / (high - low), 0.0, 1.0))
    rgb = _table(MAPS[mode])[np.asarray(place * 255 + 0.5, np.uint8)]
    rgb[~np.isfinite(values)] = _MISSING
    return rgb, limits


def stops(mode: str, count: int = 17) -> list[str]:
    """Evenly spaced colours of a map, as `#rrggbb`, for a colour bar.

    Examples
    --------
    >>> stops("band", 2)
    ['#440154', '#fde725']
    """
    table = _table(MAPS[mode])[np.linspace(0, 255, count).round().astype(int)]
    return ["#" + "".join(f"{channel:02x}" for channel in colour) for colour in table]


@cache
def _table(name: str) -> NDArray[np.uint8]:
    from matplotlib import colormaps

    return np.asarray(colormaps[name](np.linspace(0, 1, 256))[:, :3] * 255 + 0.5, np.uint8)
