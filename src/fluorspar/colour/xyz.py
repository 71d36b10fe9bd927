"""From radiance to XYZ, CIELAB, luminance and sRGB.

The sums are matrix products. All of them run over the part of the render grid that the observer's table covers,
360-830 nm for the CIE 1931 and 1964 observers: a grid of 360-700 nm leaves out 0.05 % of the luminous efficiency,
ultraviolet bands below 360 nm count as 0.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.colour.observers import CIE_1931, matching_functions
from fluorspar.errors import OptionError, message
from fluorspar.spectral.bands import band_weights
from fluorspar.spectral.uneven import UnevenWavelengths
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = [
    "CIE_1931",
    "K_M",
    "SRGB_FROM_XYZ",
    "lab_from_xyz",
    "luminance",
    "observer_weights",
    "outside_srgb",
    "srgb_encode",
    "srgb_from_xyz",
    "white_xyz",
    "xyz_from_radiance",
]

Array = NDArray[np.float64]

K_M = 683.0
"""Maximum luminous efficacy, lm/W."""

# IEC 61966-2-1, linear sRGB from XYZ with Y = 1 for white
SRGB_FROM_XYZ = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]], dtype=np.float64
)
_ROUNDING = 1e-4  # the matrix has four decimals: white itself leaves the cube by that much


@lru_cache(maxsize=32)
def observer_weights(grid: Wavelengths, observer: str = CIE_1931) -> Array:
    """Return the matrix that takes radiance to XYZ: K_m cmf(lambda) h.

    Parameters
    ----------
    grid : Wavelengths
        N wavelengths. The sum runs over those within the observer's table (360-830 nm for CIE 1931); the
        weight of others is 0. If they are uneven, a spectrum linear between them is integrated from the first to
        the last.
    observer : str
        As for `observer_named`; its functions are interpolated linearly, from 1 nm steps.

    Returns
    -------
    ndarray of shape (N, 3)
        In lm/W nm, read-only.

    Raises
    ------
    OptionError
        If there is no such observer.

    Examples
    --------
    >>> grid = Wavelengths(550, 560, 5)
    >>> observer_weights(grid)[1].round(1)  # 683 x 5 x (0.51205, 1, 0.00575) at 555 nm
    array([1748.7, 3415. ,   19.6])
    """
    at, cmfs = matching_functions(observer)
    if isinstance(grid, UnevenWavelengths):
        nodes = np.union1d(grid.values, at[(at > grid.start) & (at < grid.stop)])
        halves = np.diff(nodes) / 2
        widths = np.append(halves, 0.0) + np.insert(halves, 0, 0.0)  # the trapezoid rule
        on_nodes = band_weights(grid.values, nodes) * widths[:, np.newaxis]
        weights = np.asarray(K_M * on_nodes.T @ _between(at, cmfs, nodes))
    else:
        weights = K_M * grid.step * _between(at, cmfs, grid.values)
    weights.flags.writeable = False
    return weights


def _between(at: Array, functions: Array, nodes: Array) -> Array:
    """Tabulated functions at other wavelengths, 0 beyond the table, ndarray of shape (nodes, functions)."""
    return np.stack([np.interp(nodes, at, values, left=0.0, right=0.0) for values in functions.T], axis=-1)


def xyz_from_radiance(radiance: ArrayLike, grid: Wavelengths, observer: str = CIE_1931) -> Array:
    """Return XYZ, Y in cd/m2.

    Parameters
    ----------
    radiance : array_like of shape (..., N)
        W m-2 sr-1 nm-1.
    grid : Wavelengths
        Its N wavelengths; the sum runs over those within the observer's table, 360-830 nm.

    Returns
    -------
    ndarray of shape (..., 3)

    Raises
    ------
    OptionError
        If there is no such observer.

    Examples
    --------
    >>> xyz_from_radiance(np.ones(95), Wavelengths(360, 830, 5)).round(0)  # 683 x 106.857 for equal energy
    array([72989., 72983., 73008.])
    """
    return _weighted(radiance, observer_weights(grid, observer))


def _weighted(radiance: ArrayLike, weights: Array) -> Array:
    radiance = np.asarray(radiance)
    if radiance.dtype == np.float32:
        weights = weights.astype(np.float32)  # spares a copy of the image twice its size
    return np.asarray(radiance @ weights, dtype=np.float64)


def luminance(radiance: ArrayLike, grid: Wavelengths, observer: str = CIE_1931) -> Array:
    """Return luminance in cd/m2, ndarray of shape (...,), of radiance of shape (..., N); the Y of XYZ.

    Examples
    --------
    >>> round(float(luminance([0.0, 0.2, 0.0], Wavelengths(550, 560, 5))), 6)  # 1 W m-2 sr-1 at 555 nm
    683.0
    """
    return _weighted(radiance, observer_weights(grid, observer)[:, 1])[()]


def white_xyz(illuminant: ArrayLike, grid: Wavelengths, observer: str = CIE_1931) -> Array:
    """Return the XYZ of a perfect white diffuser in this light: the same sum as `xyz_from_radiance`.

    Parameters
    ----------
    illuminant : array_like of shape (N,)
        What the diffuser shows, irradiance / pi, W m-2 sr-1 nm-1; or any relative spectrum if only ratios
        matter.
    grid : Wavelengths
        Its N wavelengths.

    Returns
    -------
    ndarray of shape (3,)

    Examples
    --------
    >>> from fluorspar.spectral.illuminants import illuminant
    >>> grid = Wavelengths(360, 780, 5)
    >>> white = white_xyz(illuminant("D65").on(grid), grid)
    >>> (white / white[1]).round(4)
    array([0.9505, 1.    , 1.089 ])
    """
    return xyz_from_radiance(illuminant, grid, observer)


def lab_from_xyz(xyz: ArrayLike, white: ArrayLike) -> Array:
    """Return CIELAB 1976 (CIE 15).

    Parameters
    ----------
    xyz : array_like of shape (..., 3)
    white : array_like of shape (3,)
        XYZ of the white in the same unit.

    Returns
    -------
    ndarray of shape (..., 3)
        L*, a*, b*.

    Examples
    --------
    >>> lab_from_xyz([[95.0, 100.0, 108.0], [0.0, 0.0, 0.0]], [95.0, 100.0, 108.0]).round(6) + 0.0
    array([[100.,   0.,   0.],
           [  0.,   0.,   0.]])
    """
    t = np.asarray(xyz, dtype=np.float64) / np.asarray(white, dtype=np.float64)
    edge = 6 / 29
    f = np.where(t > edge**3, np.cbrt(t), t / (3 * edge**2) + 4 / 29)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def srgb_from_xyz(xyz: ArrayLike, exposure: float = 1.0) -> tuple[Array, float]:
    """Return sRGB for display, and how much of the image sRGB cannot show.

    A colour outside the gamut is mixed with the grey of its own luminance until it fits, so its lightness
    is right and its hue nearly so; what is brighter than white becomes white.

    Parameters
    ----------
    xyz : array_like of shape (..., 3)
    exposure : float
        What `xyz` is multiplied with, so that Y = 1 shows as white (D65; no chromatic adaptation).

    Returns
    -------
    rgb : ndarray of shape (..., 3)
        Gamma-encoded, 0 to 1.
    out_of_gamut : float
        Fraction of the colours that were changed, from 0 to 1.

    Raises
    ------
    OptionError
        If the exposure is not a positive number.

    Examples
    --------
    >>> rgb, changed = srgb_from_xyz([[0.9505, 1.0, 1.089], [0.1, 0.5, 0.1]])
    >>> rgb.round(2), changed
    (array([[1.  , 1.  , 1.  ],
           [0.  , 0.84, 0.54]]), 0.5)
    """
    if not (np.isfinite(exposure) and exposure > 0):
        raise OptionError(message("an exposure is impossible", got=exposure, expected="a positive number"))
    scaled = np.asarray(xyz, dtype=np.float64) * exposure
    linear = scaled @ SRGB_FROM_XYZ.T
    lowest, highest = (each[..., np.newaxis] for each in _extremes(linear))
    changed = _outside(linear)
    grey = np.clip(scaled[..., 1:2], 0.0, 1.0)
    # share of the colour itself that is left when mixed with its grey: both ends of the cube bound it
    keep_low = np.where(lowest < 0, grey / np.where(lowest < 0, grey - lowest, 1.0), 1.0)
    keep_high = np.where(highest > 1, (1 - grey) / np.where(highest > 1, highest - grey, 1.0), 1.0)
    keep = np.minimum(keep_low, keep_high)
    fitted = np.clip(grey + keep * (linear - grey), 0.0, 1.0)
    return srgb_encode(fitted), float(np.mean(changed)) if changed.size else 0.0


def outside_srgb(xyz: ArrayLike, exposure: float = 1.0) -> NDArray[np.bool_]:
    """Return which colours sRGB cannot show as they are, those that `srgb_from_xyz` changes.

    Parameters
    ----------
    xyz : array_like of shape (..., 3)
    exposure : float
        As in `srgb_from_xyz`.

    Returns
    -------
    ndarray of shape (...,)

    Examples
    --------
    >>> outside_srgb([[0.9505, 1.0, 1.089], [0.1, 0.5, 0.1]])
    array([False,  True])
    """
    return _outside(np.asarray(xyz, dtype=np.float64) * exposure @ SRGB_FROM_XYZ.T)


def _outside(linear: Array) -> NDArray[np.bool_]:
    lowest, highest = _extremes(linear)
    return np.asarray((lowest < -_ROUNDING) | (highest > 1 + _ROUNDING))


def _extremes(linear: Array) -> tuple[Array, Array]:
    """The least and greatest of three channels, ten times as fast as NumPy's reductions of an axis that short."""
    first, second, third = linear[..., 0], linear[..., 1], linear[..., 2]
    return (
        np.minimum(np.minimum(first, second), third),
        np.maximum(np.maximum(first, second), third),
    )


def srgb_encode(linear: ArrayLike) -> Array:
    """Return the gamma-encoded values of linear sRGB in 0 to 1, any shape (IEC 61966-2-1).

    Examples
    --------
    >>> srgb_encode([0.0, 0.2140411, 1.0]).round(4)
    array([0. , 0.5, 1. ])
    """
    linear = np.asarray(linear, dtype=np.float64)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055)
