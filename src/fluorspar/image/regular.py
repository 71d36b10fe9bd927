"""Wavelengths of other programs on an even grid."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import ApproximationWarning, ImageError, message
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["regular_spectra"]

_ROUNDING = 2e-3  # of a step: names and headers often have three digits after the point


def regular_spectra(
    values: NDArray[np.float32], wavelengths: ArrayLike, where: object
) -> tuple[NDArray[np.float32], Wavelengths]:
    """Bring spectra to an evenly spaced grid, unchanged if their own is one but for rounding.

    Parameters
    ----------
    values : ndarray of shape (Y, X, N)
    wavelengths : array_like of shape (N,)
        In nm, ascending, N >= 2.
    where : object
        The file, for messages.

    Returns
    -------
    values : ndarray of shape (Y, X, M)
    grid : Wavelengths
        From the first to the last wavelength. If they are not evenly spaced, the step is the mean one and the
        spectra are interpolated linearly.

    Raises
    ------
    ImageError
        If the wavelengths do not ascend.

    Warns
    -----
    ApproximationWarning
        If the spectra are interpolated.

    Examples
    --------
    >>> _, grid = regular_spectra(np.ones((1, 1, 3), np.float32), [400.0, 433.333, 466.667], "a.exr")
    >>> len(grid), round(grid.step, 4)
    (3, 33.3335)
    """
    at = np.asarray(wavelengths, dtype=np.float64)
    steps = np.diff(at)
    if len(at) < 2 or not np.isfinite(at).all() or at[0] <= 0 or steps.min() <= 0:
        got = ", ".join(f"{wavelength:g}" for wavelength in at[:6])
        raise ImageError(
            message("the wavelengths do not ascend", where=where, got=got, expected="nm, each once")
        )
    even = np.linspace(at[0], at[-1], len(at))
    grid = Wavelengths(float(at[0]), float(at[-1]), float((at[-1] - at[0]) / (len(at) - 1)))
    if np.abs(even - at).max() <= _ROUNDING * grid.step:
        return values, grid
    text = (
        f"{where}: the wavelengths are not evenly spaced (steps of {steps.min():g} to {steps.max():g} nm); "
        f"spectra are interpolated linearly to {grid.start:g}-{grid.stop:g} nm by {grid.step:.6g}"
    )
    warnings.warn(text, ApproximationWarning, stacklevel=4)
    left = np.clip(np.searchsorted(at, grid.values, side="right") - 1, 0, len(at) - 2)
    share = ((grid.values - at[left]) / steps[left]).astype(np.float32)
    resampled = np.empty_like(values)
    for row, spectra in enumerate(values):
        resampled[row] = (1 - share) * spectra[:, left] + share * spectra[:, left + 1]
    return resampled, grid
