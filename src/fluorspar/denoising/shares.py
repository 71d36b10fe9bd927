"""Components that add up to a total."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["shared_out", "sum_of"]

Array = NDArray[np.float32]


def shared_out(total: Array, parts: list[Array], uncertainties: list[Array]) -> None:
    """Change parts, in place, so that they add up to a total: the less certain one is, the more it changes.

    Parameters
    ----------
    total : ndarray of shape (Y, X, N)
    parts : list of ndarray of shape (Y, X, N)
        None becomes negative.
    uncertainties : list of ndarray of shape (Y, X, 1)
        Variances of the parts, each over the square of its level.

    Notes
    -----
    These are the least changes for the errors stated, the sum being known: each part takes of the difference what its
    variance is of all variances.

    Examples
    --------
    >>> parts = [np.full((1, 1, 1), value, np.float32) for value in (1, 3)]
    >>> errors = [np.full((1, 1, 1), 0.1**2), np.full((1, 1, 1), 0.2**2)]
    >>> shared_out(np.full((1, 1, 1), 3, np.float32), parts, errors)
    >>> [round(float(part[0, 0, 0]), 3) for part in parts]
    [0.973, 2.027]
    """
    whole = sum_of([np.maximum(part, 0, out=part) for part in parts])
    level = np.maximum(whole, np.finfo(np.float32).tiny)
    variances = [
        np.asarray(part / level * uncertain, np.float32)
        for part, uncertain in zip(parts, uncertainties, strict=True)
    ]
    of_all = sum_of([variance * part for variance, part in zip(variances, parts, strict=True)])
    change = np.divide(total - whole, of_all, out=np.zeros_like(whole), where=of_all > 0)
    for part, variance in zip(parts, variances, strict=True):
        part *= np.maximum(1 + variance * change, 0)
    whole = sum_of(parts)
    none = whole <= 0
    parts[0][none] = whole[none] = 1
    factor = total / whole
    for part in parts:
        part *= factor


def sum_of(parts: list[Array]) -> Array:
    """Sum of a few large arrays, without a copy of all."""
    whole = parts[0].copy()
    for part in parts[1:]:
        whole += part
    return whole
