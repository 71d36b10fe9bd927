"""Directions in which a probe looks, to tell whether it is inside a hollow object."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["directions"]

_COUNT = 16
_GOLDEN = np.pi * (3 - np.sqrt(5))


def directions() -> NDArray[np.float64]:
    """Unit vectors spread over the half space around z by the cosine, ndarray of shape (16, 3).

    Examples
    --------
    >>> directions().shape, bool((directions()[:, 2] > 0).all())
    ((16, 3), True)
    """
    squares = (np.arange(_COUNT) + 0.5) / _COUNT  # of the sine
    turn = _GOLDEN * np.arange(_COUNT)
    across = np.sqrt(squares)
    return np.stack([across * np.cos(turn), across * np.sin(turn), np.sqrt(1 - squares)], axis=1)
