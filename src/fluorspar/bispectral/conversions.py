"""Donaldson matrices converted: density and band-weighted cells, two norms of beta, the Stokes limit.

"The paper" is cited in `fluorspar.bispectral.donaldson`.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import MaterialError, message

__all__ = [
    "Stokes",
    "density_from_band",
    "stokes_weights",
    "to_unit_norm",
]

Array = NDArray[np.float64]
Stokes = Literal["half", "strict"]


def stokes_weights(count: int, stokes: Stokes) -> Array:
    """Return the weight of each cell of alpha beta^T: 1 below the diagonal, 0 above, 1/2 or 0 on it.

    Parameters
    ----------
    count : int
        Number N of wavelengths.
    stokes : {"half", "strict"}
        "half" is the trapezoid rule for the integral up to the emission wavelength, "strict" Eq. 1 of the
        paper.

    Returns
    -------
    ndarray of shape (N, N)

    Examples
    --------
    >>> stokes_weights(2, "half")
    array([[0.5, 0. ],
           [1. , 0.5]])
    """
    return np.tri(count, k=-1) + (0.5 * np.eye(count) if stokes == "half" else 0.0)


def to_unit_norm(emission: ArrayLike, excitation: ArrayLike, step: float) -> tuple[Array, Array]:
    """Convert factors to Eq. 2 of the paper: the samples of beta have unit Euclidean norm.

    The band-weighted outer product stays what it is: alpha' beta'^T = h alpha beta^T, so alpha' depends on
    the grid.

    Parameters
    ----------
    emission, excitation : array_like of shape (..., N)
        alpha, dimensionless, and beta, 1/nm.
    step : float
        h of the grid in nm.

    Returns
    -------
    emission, excitation : ndarray of shape (..., N)

    Raises
    ------
    MaterialError
        If a beta is 0 everywhere.

    Examples
    --------
    >>> alpha, beta = to_unit_norm([0.0, 0.5], [0.1, 0.0], step=10)
    >>> alpha, beta
    (array([0. , 0.5]), array([1., 0.]))
    """
    beta = np.asarray(excitation, dtype=np.float64)
    norm = np.sqrt(np.sum(beta**2, axis=-1, keepdims=True))
    if np.any(norm == 0):
        raise MaterialError(message("an excitation spectrum that is 0 everywhere cannot be normalised"))
    return np.asarray(emission, dtype=np.float64) * (norm * step), beta / norm


def density_from_band(matrix: Array, step: float) -> tuple[Array, Array]:
    """Split a band-weighted matrix of shape (N, N) into S, shape (N,), and D_L, shape (N, N), 1/nm.

    The diagonal is S and is never scaled; the rest is D_L h.

    Examples
    --------
    >>> density_from_band(np.array([[0.5, 0], [0.2, 0.4]]), step=10)[1]
    array([[0.  , 0.  ],
           [0.02, 0.  ]])
    """
    density = np.asarray(matrix, dtype=np.float64) / step
    reflectance = np.diagonal(matrix).copy()
    np.fill_diagonal(density, 0.0)
    return reflectance, density
