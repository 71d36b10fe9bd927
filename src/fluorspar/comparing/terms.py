"""The terms on which two sides are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Scale", "Terms"]


@dataclass(frozen=True)
class Scale:
    """How the scale of B is matched to that of A.

    Parameters
    ----------
    factor : float
        What B is multiplied with.
    mean_a, mean_b : float
        What each side is divided by for RMSE, each in its own scale.
    error : float
        Relative standard error of the factor.
    """

    factor: float
    mean_a: float
    mean_b: float
    error: float = 0.0


@dataclass(frozen=True, eq=False)
class Terms:
    """What holds for both sides of a comparison.

    Parameters
    ----------
    grid : Wavelengths
        The T common bands.
    in_range : ndarray of shape (T,)
        Which of them RMSE is taken over.
    scale : Scale
    white : ndarray of shape (3,)
        XYZ of the white of CIELAB, in the scale of A.
    observer : str
        Of CIELAB.
    same_seed : int or None
        The seed of two renders, if it is the same.
    """

    grid: Wavelengths
    in_range: NDArray[np.bool_]
    scale: Scale
    white: NDArray[np.float64]
    observer: str
    same_seed: int | None = None
