"""Wavelengths of other programs on an even grid."""

from __future__ import annotations

import warnings
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import ApproximationWarning, FluorsparError, ImageError, message
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["check_ascending", "even_grid", "interpolated", "regular_spectra"]

F = TypeVar("F", bound=np.floating[Any])
_ROUNDING = 2e-3  # of a step: names and headers often have three digits after the point


def regular_spectra(
    values: NDArray[F],
    wavelengths: ArrayLike,
    where: object,
    error: type[FluorsparError] = ImageError,
) -> tuple[NDArray[F], Wavelengths]:
    """Bring spectra to an evenly spaced grid, unchanged if their own is one but for rounding.

    Parameters
    ----------
    values : ndarray of shape (Y, X, N)
    wavelengths : array_like of shape (N,)
        In nm, ascending, N >= 2.
    where : object
        The file, for messages.
    error : type of FluorsparError
        What to raise.

    Returns
    -------
    values : ndarray of shape (Y, X, M)
    grid : Wavelengths
        From the first to the last wavelength. If they are not evenly spaced, the step is the mean one and the
        spectra are interpolated linearly.

    Raises
    ------
    FluorsparError
        Of class `error`, if the wavelengths do not ascend or are fewer than two.

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
    check_ascending(at, where, error)
    grid = even_grid(at)
    if grid is not None:
        return values, grid
    grid = Wavelengths(float(at[0]), float(at[-1]), float((at[-1] - at[0]) / (len(at) - 1)))
    steps = np.diff(at)
    text = (
        f"{where}: the wavelengths are not evenly spaced (steps of {steps.min():g} to {steps.max():g} nm); "
        f"spectra are interpolated linearly to {grid.start:g}-{grid.stop:g} nm by {grid.step:.6g}"
    )
    warnings.warn(text, ApproximationWarning, stacklevel=4)
    return interpolated(values, at, grid.values), grid


def even_grid(at: NDArray[np.float64]) -> Wavelengths | None:
    """The grid that ascending wavelengths lie on but for rounding, None if they are not evenly spaced.

    Examples
    --------
    >>> even_grid(np.array([400.0, 403.33, 406.67, 410.0])).step.__round__(4)
    3.3333
    """
    if len(at) < 2 or not 0 < at[0] < at[-1] < np.inf:
        return None
    grid = Wavelengths(float(at[0]), float(at[-1]), float((at[-1] - at[0]) / (len(at) - 1)))
    return grid if np.abs(grid.values - at).max() <= _ROUNDING * grid.step else None


def interpolated(values: NDArray[F], at: NDArray[np.float64], to: NDArray[np.float64]) -> NDArray[F]:
    """Interpolate spectra linearly.

    Parameters
    ----------
    values : ndarray of shape (Y, X, N)
    at : ndarray of shape (N,)
        Their wavelengths, ascending, N >= 2.
    to : ndarray of shape (M,)
        Wavelengths wanted, within those.

    Returns
    -------
    ndarray of shape (Y, X, M)

    Examples
    --------
    >>> interpolated(np.array([[[1.0, 2.0]]]), np.array([400.0, 500.0]), np.array([450.0]))
    array([[[1.5]]])
    """
    left = np.clip(np.searchsorted(at, to, side="right") - 1, 0, len(at) - 2)
    share = ((to - at[left]) / np.diff(at)[left]).astype(values.dtype)
    resampled = np.empty((*values.shape[:2], len(to)), values.dtype)
    for row, spectra in enumerate(values):
        resampled[row] = (1 - share) * spectra[:, left] + share * spectra[:, left + 1]
    return resampled


def check_ascending(at: NDArray[np.float64], where: object, error: type[FluorsparError]) -> None:
    if len(at) < 2:
        fault, got = "there is only one wavelength", f"{', '.join(f'{wavelength:g}' for wavelength in at)} nm"
        raise error(message(fault, where=where, got=got, expected="at least two"))
    steps = np.diff(at)
    if np.isfinite(at).all() and at[0] > 0 and steps.min() > 0:
        return
    twice = at[1:][steps == 0]
    fault = f"{twice[0]:g} nm occurs twice" if len(twice) else "the wavelengths do not ascend"
    got = ", ".join(f"{wavelength:g}" for wavelength in at[:6]) + (", ..." if len(at) > 6 else "")
    raise error(message(fault, where=where, got=got, expected="ascending wavelengths in nm, each once"))
