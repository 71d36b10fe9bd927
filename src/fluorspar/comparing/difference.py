"""Differences of spectra, as small functions on arrays.

Eq. 14 is that of Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, message

__all__ = ["band_bias", "band_error", "mean_rmse", "ratio", "rmse_eq14", "rmse_of_each"]

Array = NDArray[np.float64]


def rmse_eq14(a: ArrayLike, b: ArrayLike, mean_a: float, mean_b: float) -> float:
    """Return the root mean square difference of normalised spectra, one root over all points: Eq. 14.

    RMSE = sqrt(mean over points of mean over wavelengths of (a / mean_a - b / mean_b)^2)

    Parameters
    ----------
    a, b : array_like of shape (P, N)
        Spectra of the same P points on the N bands of 400-700 nm.
    mean_a, mean_b : float
        Mean over those bands at the normalising point, each of its own side.

    Returns
    -------
    float
        1: relative to the mean of the normalising point.

    Raises
    ------
    OptionError
        If a mean is not positive.

    Examples
    --------
    >>> rmse_eq14([[1.0, 3.0], [2.0, 2.0]], [[2.0, 2.0], [2.0, 2.0]], mean_a=2.0, mean_b=2.0)  # root of 0.5 / 4
    0.3535533905932738
    """
    return float(np.sqrt(np.mean(np.square(_normalised_difference(a, b, mean_a, mean_b)))))


def rmse_of_each(a: ArrayLike, b: ArrayLike, mean_a: float, mean_b: float) -> Array:
    """Return the root mean square difference of normalised spectra, of each point.

    sqrt(mean over wavelengths of (a / mean_a - b / mean_b)^2)

    Parameters
    ----------
    a, b : array_like of shape (P, N)
        As in `rmse_eq14`.
    mean_a, mean_b : float
        As in `rmse_eq14`.

    Returns
    -------
    ndarray of shape (P,)

    Raises
    ------
    OptionError
        If a mean is not positive.

    Examples
    --------
    >>> rmse_of_each([[1.0, 3.0], [2.0, 2.0]], [[2.0, 2.0], [2.0, 2.0]], mean_a=2.0, mean_b=2.0)
    array([0.5, 0. ])
    """
    return np.asarray(np.sqrt(np.mean(np.square(_normalised_difference(a, b, mean_a, mean_b)), axis=-1)))


def mean_rmse(each: ArrayLike) -> float:
    """Return the mean of the RMSE of each point or pixel, which is at most that of Eq. 14; NaN if none is known.

    Parameters
    ----------
    each : array_like of shape (P,) or (Y, X)
        From `rmse_of_each`; NaN where it is not known.

    Examples
    --------
    >>> mean_rmse([0.5, 0.0])
    0.25
    """
    values = np.asarray(each)
    known = values[np.isfinite(values)]
    return float(np.mean(known, dtype=np.float64)) if known.size else np.nan


def _normalised_difference(a: ArrayLike, b: ArrayLike, mean_a: float, mean_b: float) -> Array:
    if not (mean_a > 0 and mean_b > 0):
        fault, got = "spectra cannot be normalised", f"means {mean_a:g} and {mean_b:g}"
        raise OptionError(message(fault, got=got, expected="positive numbers"))
    return np.asarray(a, np.float64) / mean_a - np.asarray(b, np.float64) / mean_b


def band_error(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the relative error of each band: mean over points of |b - a|, over the mean of a.

    Parameters
    ----------
    a, b : array_like of shape (P, N)

    Returns
    -------
    ndarray of shape (N,)
        NaN where the mean of a is 0 and b is not; 0 where both are.

    Examples
    --------
    >>> band_error([[1.0], [3.0]], [[2.0], [2.0]])
    array([0.5])
    """
    first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return np.asarray(ratio(np.abs(second - first).mean(axis=0), first.mean(axis=0)))


def band_bias(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the bias of each band: mean over points of b - a, over the mean of a.

    Parameters
    ----------
    a, b : array_like of shape (P, N)

    Returns
    -------
    ndarray of shape (N,)
        NaN where the mean of a is 0 and b is not; 0 where both are.

    Examples
    --------
    >>> band_bias([[1.0], [3.0]], [[2.0], [2.0]])
    array([0.])
    """
    first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return np.asarray(ratio((second - first).mean(axis=0), first.mean(axis=0)))


def ratio(numerator: ArrayLike, denominator: ArrayLike) -> Any:
    """Return how much one number is of another: NaN of 0, but 0 if both are 0, as two black sides do not differ.

    Parameters
    ----------
    numerator, denominator : array_like of the same shape

    Returns
    -------
    ndarray or float

    Examples
    --------
    >>> ratio([1.0, 1.0, 0.0], [2.0, 0.0, 0.0])
    array([0.5, nan, 0. ])
    """
    upper, lower = np.asarray(numerator, dtype=np.float64), np.asarray(denominator, dtype=np.float64)
    missing = np.where(upper == 0, 0.0, np.nan)
    return np.divide(upper, lower, out=missing, where=lower != 0)[()]
