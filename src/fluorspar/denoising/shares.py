"""Components that add up to a total."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["shared_out"]

Array = NDArray[np.float32]


def shared_out(total: Array, parts: list[Array]) -> None:
    """Change parts, in place, so that they add up to a total: each by its share of their sum, at each wavelength.

    Parameters
    ----------
    total : ndarray of shape (Y, X, N)
    parts : list of ndarray of shape (Y, X, N)

    Examples
    --------
    >>> parts = [np.full((1, 1, 1), 1, np.float32), np.full((1, 1, 1), 3, np.float32)]
    >>> shared_out(np.full((1, 1, 1), 8, np.float32), parts)
    >>> [float(part[0, 0, 0]) for part in parts]
    [2.0, 6.0]
    """
    shares = [np.maximum(part, 0, out=part) for part in parts]
    whole = shares[0].copy()
    for share in shares[1:]:
        whole += share
    none = whole <= 0
    shares[0][none] = whole[none] = 1
    factor = total / whole
    for share in shares:
        share *= factor
