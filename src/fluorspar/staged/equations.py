"""The equations of the paper that the staged method goes through, as functions of arrays.

"The paper" is Tominaga, Guarnera, Ohtera, "Spectral Image Rendering of Fluorescent Objects Using a
Conventional Renderer", IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980. Symbols: y radiance towards the camera,
S reflected and D_L luminescent radiance factor, E illumination (irradiance / pi), indices D direct, I
indirect, F luminescent.

Where each equation is
----------------------
Eq. 1
    The Donaldson matrix: `DonaldsonMatrix.band`, with `stokes="strict"` to the letter.
Eq. 2
    Its factors: `DonaldsonMatrix.emission` and `excitation`; in the paper's normalisation: `to_unit_norm`.
Eq. 3, Eq. 4, Eq. 5, Eq. 6, Eq. 8
    With the others up to Eq. 13, how radiance falls into components: the light E = f L on a surface, f its
    shading, by the way it came (E_D, E_I, E_F); of each the reflection S E and the luminescence, the integral of
    D_L E over excitation, which Eq. 4 takes up to the emission wavelength and including it (here it counts
    half there, see `DonaldsonMatrix`). y1 = S E_D and y3 = S E_I come from the renderer, which multiplies
    f, L and S in one; `indirect_reflection` tells them apart. All of them at once: the one-pass method.
Eq. 7, Eq. 9
    `luminescence`: y2 of E_D, y4 of E_I.
Eq. 10
    `luminescent_reflection`: y5 = S E_F, and before it `average_illumination`.
Eq. 11
    `illumination`: E_D of y1, E_I of y3.
Eq. 12, Eq. 13
    `total`.
Eq. 14
    The comparison of measured and rendered spectra: `compare`.
Eq. 15, Eq. 16
    Where points appear: `fluorspar.scene.camera.Camera`, `fluorspar.scene.photograph.estimate_projection`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.bispectral.donaldson import DonaldsonMatrix

__all__ = [
    "average_illumination",
    "illumination",
    "indirect_reflection",
    "luminescence",
    "luminescent_reflection",
    "total",
]

Array = NDArray[np.float64]


def indirect_reflection(all_bounces: ArrayLike, direct: ArrayLike) -> Array:
    """Return y3 = S E_I, what a render of unlimited depth shows beyond one of max_depth 2, which is y1 = S E_D.

    Eq. 3 to Eq. 6 and Eq. 8 of the paper; see the head of this file.

    Parameters
    ----------
    all_bounces : array_like of shape (..., N)
        y1 + y3, W m-2 sr-1 nm-1.
    direct : array_like of shape (..., N)
        y1, rendered with the same seed: the difference is then exact, path by path.

    Returns
    -------
    ndarray of shape (..., N)

    Examples
    --------
    >>> indirect_reflection([0.5, 0.7], [0.25, 0.5])
    array([0.25, 0.2 ])
    """
    return np.asarray(np.asarray(all_bounces, dtype=np.float64) - np.asarray(direct, dtype=np.float64))


def illumination(reflected: ArrayLike, albedo: ArrayLike) -> Array:
    """Return E = y / S (Eq. 11), for y1 or for y3.

    Parameters
    ----------
    reflected : array_like of shape (..., N)
        Light that one surface reflects towards the camera, W m-2 sr-1 nm-1.
    albedo : array_like of shape (N,)
        The reflectance the surface was rendered with, greater than 0: S, or `ALBEDO_FLOOR` where S is
        smaller.

    Returns
    -------
    ndarray of shape (..., N)
        W m-2 sr-1 nm-1.

    Raises
    ------
    ZeroDivisionError
        If an albedo is 0: E leaves no trace in the image there.

    Examples
    --------
    >>> illumination([0.1, 0.3], [0.5, 0.6])
    array([0.2, 0.5])
    """
    albedo = np.asarray(albedo, dtype=np.float64)
    if not np.all(albedo > 0):
        raise ZeroDivisionError("E = y / S needs an albedo greater than 0")
    return np.asarray(np.asarray(reflected, dtype=np.float64) / albedo)


def luminescence(matrix: DonaldsonMatrix, light: ArrayLike) -> Array:
    """Return the integral of D_L E over excitation: y2 of E_D (Eq. 7), y4 of E_I (Eq. 9).

    Parameters
    ----------
    matrix : DonaldsonMatrix
        The surface.
    light : array_like of shape (..., N)
        E, W m-2 sr-1 nm-1.

    Returns
    -------
    ndarray of shape (..., N)
        W m-2 sr-1 nm-1.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> D = DonaldsonMatrix.from_band([[0.5, 0], [0.25, 0.4]], Wavelengths(400, 410, 10))
    >>> luminescence(D, [2.0, 1.0])
    array([0. , 0.5])
    """
    return matrix.apply_luminescent(light)


def average_illumination(samples: ArrayLike, patch: ArrayLike, count: int) -> Array:
    """Average the illumination of points spread evenly over each patch of a surface (before Eq. 10).

    Parameters
    ----------
    samples : array_like of shape (n, N)
        E at the points.
    patch : array_like of shape (n,)
        The patch each point lies on.
    count : int
        Number of patches K; one without points is dark.

    Returns
    -------
    ndarray of shape (K, N)

    Examples
    --------
    >>> average_illumination([[1.0], [3.0], [5.0]], [0, 0, 1], 2)
    array([[2.],
           [5.]])
    """
    values, of = np.asarray(samples, dtype=np.float64), np.asarray(patch)
    points = np.maximum(np.bincount(of, minlength=count), 1)
    sums = np.stack([np.bincount(of, band, minlength=count) for band in values.T], axis=1)
    return np.asarray(sums / points[:, np.newaxis])


def luminescent_reflection(renders: Sequence[ArrayLike]) -> Array:
    """Return y5 = S E_F, the sum over objects of what each one's emitters show in the scene (Eq. 10).

    Parameters
    ----------
    renders : sequence of array_like of shape (..., N)
        W m-2 sr-1 nm-1.

    Returns
    -------
    ndarray of shape (..., N)

    Examples
    --------
    >>> luminescent_reflection([[0.25, 0.0], [0.5, 0.25]])
    array([0.75, 0.25])
    """
    return np.asarray(np.sum([np.asarray(render, dtype=np.float64) for render in renders], axis=0))


def total(components: Sequence[ArrayLike]) -> Array:
    """Return the sum of components (Eq. 13; Eq. 12 where D_L = 0, because y2 and y4 are 0 there).

    Parameters
    ----------
    components : sequence of array_like of shape (..., N)
        y1 to y5, and y0, a light source seen directly, if it is to be counted.

    Returns
    -------
    ndarray of shape (..., N)

    Examples
    --------
    >>> total([[0.25], [0.5], [0.125], [0.0], [0.0]])
    array([0.875])
    """
    return np.asarray(np.sum([np.asarray(part, dtype=np.float64) for part in components], axis=0))
