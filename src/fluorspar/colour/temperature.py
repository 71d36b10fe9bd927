"""Correlated colour temperature, where there is one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from fluorspar.spectral.colour_science import colour_science

__all__ = ["colour_temperature"]

_FARTHEST = 0.05  # from the Planckian locus, in u, v: CIE 15 gives no temperature beyond
_RANGE = (1000.0, 25_000.0)  # K


def colour_temperature(xy: ArrayLike) -> float:
    """Return the correlated colour temperature in K; NaN where none is sensible.

    Parameters
    ----------
    xy : array_like of shape (2,)
        Chromaticity, CIE 1931.

    Returns
    -------
    float
        NaN beyond 1000-25000 K, or farther than 0.05 in (u, v) from the Planckian locus, where CIE 15 has none.

    References
    ----------
    Y. Ohno, "Practical use and calculation of CCT and Duv", LEUKOS 10(1), 2014.

    Examples
    --------
    >>> round(colour_temperature([0.44758, 0.40745]), -1), colour_temperature([0.2, 0.6])  # A, a green
    (2860.0, nan)
    """
    x, y = np.asarray(xy, np.float64)
    below = -2 * x + 12 * y + 3
    if not (math.isfinite(below) and below > 0 and y > 0):
        return math.nan
    temperature = colour_science().temperature
    kelvin, distance = temperature.uv_to_CCT_Ohno2013(np.array([4 * x, 6 * y]) / below)
    sensible = abs(distance) <= _FARTHEST and _RANGE[0] <= kelvin <= _RANGE[1]
    return float(kelvin) if sensible else math.nan
