"""Bring a measured matrix with steps of its own for emission and excitation to a common, even step."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, MaterialError, message
from fluorspar.spectral.even import even_grid

__all__ = ["on_common_step"]

Array = NDArray[np.float64]

_FINEST = 5.0  # nm: a finer matrix is slow to fit and to render, and no dye has details so small
_SAME = 1e-4  # nm


def on_common_step(
    emission: Array, excitation: Array, matrix: Array, where: object
) -> tuple[Array, Array, Array]:
    """Interpolate a matrix to one step for both wavelengths, unchanged if it has one.

    The step is the smallest there is, in whole nm, and 5 nm or more. D_L is interpolated linearly, on
    either side of the diagonal by itself: up to the diagonal it continues straight on. S is interpolated by itself.

    Parameters
    ----------
    emission : ndarray of shape (M,)
    excitation : ndarray of shape (P,)
        Ascending, in nm.
    matrix : ndarray of shape (M, P)
        S where emission and excitation are the same, D_L elsewhere, 1/nm.
    where : object
        The file, for messages.

    Returns
    -------
    emission : ndarray of shape (Q,)
    excitation : ndarray of shape (R,)
    matrix : ndarray of shape (Q, R)

    Raises
    ------
    MaterialError
        If fewer than two wavelengths are both emission and excitation: then there is no S.

    Warns
    -----
    ApproximationWarning
        If it is interpolated.

    Examples
    --------
    >>> w = np.array([400.0, 410.0, 430.0])
    >>> with warnings.catch_warnings(action="ignore"):
    ...     on_common_step(w, w, np.diag([0.5, 0.5, 0.7]), "sheet.csv")[2].diagonal()
    array([0.5, 0.5, 0.6, 0.7])
    """
    i, j = np.nonzero(np.abs(emission[:, None] - excitation) < _SAME)
    if len(i) < 2:
        fault = "a Donaldson matrix has fewer than two cells of equal emission and excitation wavelength"
        fix = (
            "they hold its reflectance: give rows and columns the same wavelengths where they overlap; "
            "of luminescence alone `fluorspar materials from-eem` makes a material"
        )
        raise MaterialError(message(fault, where=where, fix=fix))
    steps = [float(np.diff(axis).min()) for axis in (emission, excitation)]
    even = all(even_grid(axis) is not None for axis in (emission, excitation))
    if even and abs(steps[0] - steps[1]) < _SAME:
        return emission, excitation, matrix
    step = max(_FINEST, round(min(steps)))
    em, ex = (_multiples(axis, step, float(emission[i[0]])) for axis in (emission, excitation))
    density = np.zeros((len(em), len(ex)))
    for side in (1, -1):
        lit = side * (em[:, None] - ex) > _SAME
        density[lit] = _one_side(emission, excitation, matrix, em, ex, side)[lit]
    own = np.abs(em[:, None] - ex) < _SAME
    density[own] = np.interp(em[own.any(axis=1)], emission[i], matrix[i, j])
    axes = " and ".join(
        f"{what} ({_steps(axis)})" for what, axis in (("emission", emission), ("excitation", excitation))
    )
    text = (
        f"{where}: {axes} are interpolated linearly to steps of {step:g} nm, emission {em[0]:g}-{em[-1]:g} nm, "
        f"excitation {ex[0]:g}-{ex[-1]:g} nm"
    )
    warnings.warn(text, ApproximationWarning, stacklevel=3)
    return em, ex, density


def _multiples(axis: Array, step: float, anchor: float) -> Array:
    """Wavelengths within an axis, whole steps from an anchor."""
    first, last = np.ceil((axis[0] - anchor) / step - 1e-9), np.floor((axis[-1] - anchor) / step + 1e-9)
    return np.asarray(anchor + step * np.arange(first, last + 1))


def _steps(axis: Array) -> str:
    steps = np.diff(axis)
    return f"by {steps[0]:g} nm" if np.ptp(steps) < _SAME else f"by {steps.min():g} to {steps.max():g} nm"


def _one_side(emission: Array, excitation: Array, density: Array, em: Array, ex: Array, side: int) -> Array:
    """Interpolate D_L from the cells on one side of the diagonal: `side` 1 below, -1 above."""
    columns = np.zeros((len(em), len(excitation)))
    for k, excited in enumerate(excitation):
        lit = side * (emission - excited) > _SAME
        columns[:, k] = _continued(em, emission[lit], density[lit, k])
    rows = np.zeros((len(em), len(ex)))
    for k, emitted in enumerate(em):
        lit = side * (emitted - excitation) > _SAME
        rows[k] = _continued(ex, excitation[lit], columns[k, lit])
    return rows


def _continued(at: Array, x: Array, y: Array) -> Array:
    """Interpolate linearly, straight on beyond the ends; 0 where there is nothing to start from."""
    if len(x) < 2:
        return np.full(len(at), y[0] if len(y) else 0.0)
    left = np.clip(np.searchsorted(x, at) - 1, 0, len(x) - 2)
    return np.asarray(y[left] + (at - x[left]) * (np.diff(y) / np.diff(x))[left])
