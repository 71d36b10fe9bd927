"""Colours as an eye sees them that is adapted to the light, shown on a screen with D65 white."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["adapt_to_d65", "is_adaptable"]

Array = NDArray[np.float64]

# Bradford: XYZ to sharpened cone responses (Lam 1985; ICC.1:2010, annex E)
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_D65 = np.array([0.9505, 1.0, 1.089])  # the white of the sRGB matrix


def adapt_to_d65(xyz: Array, white: Array) -> Array:
    """Adapt XYZ to the D65 of sRGB (linear Bradford transform), so that `white` becomes its white.

    Parameters
    ----------
    xyz : ndarray of shape (..., 3)
    white : ndarray of shape (3,)
        XYZ of the white that the eye is adapted to, in the same unit.

    Returns
    -------
    ndarray of shape (..., 3)

    Examples
    --------
    >>> adapt_to_d65(np.array([109.85, 100.0, 35.58]), np.array([109.85, 100.0, 35.58])).round(2)
    array([ 95.05, 100.  , 108.9 ])
    """
    gains = (_BRADFORD @ _D65) / (_BRADFORD @ (white / white[1]))
    transform = np.linalg.inv(_BRADFORD) @ (gains[:, None] * _BRADFORD)
    return np.asarray(xyz @ transform.T)


def is_adaptable(white: Array) -> bool:
    """Whether every cone sees something of a white, as the transform needs: not of a light of one wavelength.

    Examples
    --------
    >>> is_adaptable(np.array([109.85, 100.0, 35.58])), is_adaptable(np.array([0.03, 1.0, 0.0]))
    (True, False)
    """
    return bool((white[1] > 0) and (_BRADFORD @ white > 0).all())
