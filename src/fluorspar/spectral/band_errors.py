"""Standard errors of sums over bands: fully correlated in a render, independent in a table of measurements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["error_of_sum", "errors_on_bands"]

Array = NDArray[np.float64]


def error_of_sum(errors: Array, shares: Array, correlated: bool) -> Array:
    """Return the standard error of weighted sums over bands.

    Parameters
    ----------
    errors : ndarray of shape (P, N)
    shares : ndarray of shape (N,)
        Weights of the bands.
    correlated : bool
        Whether the errors of the bands are fully correlated; else they are independent.

    Returns
    -------
    ndarray of shape (P,)

    Examples
    --------
    >>> errors, mean = np.ones((1, 4)), np.full(4, 0.25)
    >>> error_of_sum(errors, mean, correlated=True), error_of_sum(errors, mean, correlated=False)
    (array([1.]), array([0.5]))
    """
    if correlated:
        return np.asarray(errors @ np.abs(shares))
    return np.asarray(np.sqrt(errors**2 @ shares**2))


def errors_on_bands(errors: Array | None, weights: Array | None, correlated: bool) -> Array | None:
    """Bring standard errors to other bands.

    Parameters
    ----------
    errors : ndarray of shape (P, N) or None
    weights : ndarray of shape (T, N) or None
        As from `conversion`; None: nothing is to be done.
    correlated : bool
        As in `error_of_sum`.

    Returns
    -------
    ndarray of shape (P, T) or None

    Examples
    --------
    >>> errors_on_bands(np.ones((1, 2)), np.array([[0.5, 0.5]]), correlated=True)
    array([[1.]])
    """
    if errors is None or weights is None:
        return errors
    return np.stack([error_of_sum(errors, row, correlated) for row in weights], axis=-1)
