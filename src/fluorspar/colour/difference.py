"""The difference of two colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.spectral.colour_science import colour_science

__all__ = ["ciede2000"]

Array = NDArray[np.float64]


def ciede2000(lab_a: ArrayLike, lab_b: ArrayLike) -> Array:
    """Return the colour difference CIEDE2000, by colour-science.

    Parameters
    ----------
    lab_a, lab_b : array_like of shape (..., 3)
        CIELAB of both with respect to the same white.

    Returns
    -------
    ndarray of shape (...,)

    References
    ----------
    G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 color-difference formula: implementation notes,
    supplementary test data, and mathematical observations", Color Res. Appl. 30(1), 2005.

    Examples
    --------
    >>> ciede2000([[50.0, 2.6772, -79.7751]], [[50.0, 0.0, -82.7485]]).round(4)
    array([2.0425])
    """
    difference = colour_science().difference.delta_E_CIE2000
    with np.errstate(invalid="ignore"):
        return np.asarray(difference(np.asarray(lab_a, float), np.asarray(lab_b, float)), dtype=np.float64)
