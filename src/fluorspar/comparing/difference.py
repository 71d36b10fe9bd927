"""Differences of spectra and colours, as small functions on arrays.

Eq. 14 is that of Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, message

__all__ = ["band_bias", "band_error", "expected_rmse", "ratio", "rmse"]

Array = NDArray[np.float64]


def rmse(a: ArrayLike, b: ArrayLike, mean_a: float, mean_b: float) -> Array:
    """Return the root mean square difference of normalised spectra, for each point.

    RMSE = sqrt(mean over wavelengths of (a / mean_a - b / mean_b)^2)

    Parameters
    ----------
    a, b : array_like of shape (..., N)
        Spectra of the same points on the N bands of 400-700 nm.
    mean_a, mean_b : float
        Mean over those bands at the normalising point, each of its own side.

    Returns
    -------
    ndarray of shape (...,)
        1: relative to the mean of the normalising point.

    Raises
    ------
    OptionError
        If a mean is not positive.

    Examples
    --------
    >>> rmse([[1.0, 3.0]], [[2.0, 2.0]], mean_a=2.0, mean_b=2.0)  # (0.5, 1.5) - (1, 1)
    array([0.5])
    """
    if not (mean_a > 0 and mean_b > 0):
        raise OptionError(
            message(
                "spectra cannot be normalised",
                got=f"means {mean_a:g} and {mean_b:g}",
                expected="positive numbers",
            )
        )
    return _rms(np.asarray(a) / mean_a - np.asarray(b) / mean_b)


def _rms(difference: NDArray[np.floating]) -> Array:
    return np.asarray(np.sqrt(np.mean(np.square(difference), axis=-1)), dtype=np.float64)


def expected_rmse(a: ArrayLike, b: ArrayLike, mean_a: float, mean_b: float) -> float:
    """Return E{RMSE} of Eq. 14: the mean over points of `rmse`.

    Parameters
    ----------
    a, b : array_like of shape (P, N)
        Spectra of the same points on the N bands of 400-700 nm.
    mean_a, mean_b : float
        Mean over those bands at the normalising point, each of its own side.

    Raises
    ------
    OptionError
        If a mean is not positive.

    Examples
    --------
    >>> expected_rmse([[1.0, 3.0], [2.0, 2.0]], [[2.0, 2.0], [2.0, 2.0]], mean_a=2.0, mean_b=2.0)
    0.25
    """
    return float(np.mean(rmse(a, b, mean_a, mean_b)))


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
