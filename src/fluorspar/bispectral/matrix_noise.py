"""The noise of a measured Donaldson matrix, estimated from its cells above the diagonal.

Light is never shifted to shorter wavelengths, so whatever stands above the diagonal is measurement error.
In bispectral instruments it has three parts, which matter differently to a fit:

* white noise of every cell;
* a baseline of every column - each excitation wavelength is measured by itself, with an offset and a slow drift of its
  own - which is the same above and below the diagonal and would otherwise pass for weak luminescence. An offset that
  all cells share is a zero error of the instrument;
* the finite bandpass, which spreads reflected light over the cells next to the diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["MatrixNoise", "estimate_noise", "stokes_shift"]

Array = NDArray[np.float64]

_FEWEST = 16  # cells of a column from which an offset and a tilt are worth estimating
_SMALLEST = 1e-5  # no instrument is better
_FALSE_ZERO = 0.003  # rate of zero errors that are chance
_DARK = 0.25  # of the rows below the diagonal: no dye emits in so many


@dataclass(frozen=True)
class MatrixNoise:
    """Standard deviations of band-weighted cells.

    Attributes
    ----------
    white : float
        Of a single cell, its column's baseline taken out.
    near : float
        Of a cell next to the diagonal, where the bandpass of the instrument spills reflected light.
    offset, tilt : float
        Of the baseline of a column about the common one: its mean, and its change from the middle to the end of the
        emission range.
    resolution : float
        Cells are whole multiples of this (0 if they are not rounded); its rounding error is part of `white`.
    common : float
        Offset that all cells have in common, a zero error of the instrument; 0 unless it is significant above the
        diagonal and the dark cells below have it too.
    """

    white: float
    near: float
    offset: float
    tilt: float
    resolution: float
    common: float = 0.0


def stokes_shift(emission: Array, excitation: Array, step: float) -> Array:
    """Return emission minus excitation wavelength in steps, ndarray of shape (M, P): > 0 below the diagonal.

    Examples
    --------
    >>> stokes_shift(np.array([400.0, 410.0]), np.array([390.0, 400.0]), 10.0)
    array([[1., 0.],
           [2., 1.]])
    """
    return np.asarray((emission[:, None] - excitation[None, :]) / step)


def estimate_noise(cells: Array, shift: Array) -> MatrixNoise:
    """Estimate the noise of a measured matrix from the cells above its diagonal.

    If all of them are 0, which no instrument gives, white noise is estimated from the roughness of the cells below.

    Parameters
    ----------
    cells : ndarray of shape (M, P)
        Band-weighted cells; those on and below the diagonal are only looked at for rounding.
    shift : ndarray of shape (M, P)
        See `stokes_shift`.

    Returns
    -------
    MatrixNoise

    Examples
    --------
    >>> w = np.arange(380.0, 781.0, 10.0)
    >>> rng = np.random.default_rng(1)
    >>> noise = estimate_noise(rng.normal(0, 0.003, (41, 41)), stokes_shift(w, w, 10.0))
    >>> round(noise.white, 3), noise.resolution
    (0.003, 0.0)
    """
    far, next_to = shift < -1.5, (shift < -0.5) & (shift >= -1.5)
    shapes = baseline_shapes(len(cells))
    coefficients, levels, left, freedom = [], [], 0.0, 0
    for column in range(cells.shape[1]):
        rows = far[:, column]
        if rows.sum() < _FEWEST:
            continue
        fitted = np.linalg.lstsq(shapes[:, rows].T, cells[rows, column], rcond=None)[0]
        coefficients.append(fitted)
        levels.append(float(np.mean(cells[rows, column])))
        left += float(np.sum((cells[rows, column] - fitted @ shapes[:, rows]) ** 2))
        freedom += int(rows.sum()) - len(shapes)
    resolution = _resolution(cells)
    rounding = resolution / np.sqrt(12)
    if freedom:
        white = np.hypot(np.sqrt(left / freedom), rounding)
        common = _common_offset(np.array(levels), cells, shift)
        offset, tilt = np.std(coefficients, axis=0)
    else:  # a small matrix: no column is long enough, so all is called white
        values = cells[far | next_to]
        white = np.hypot(np.sqrt(np.mean(values**2)) if values.size else 0.0, rounding)
        common = 0.0
        offset = tilt = _SMALLEST
    above = cells[shift < -0.5]
    if above.size and not above.any():  # somebody has taken away what would show the noise
        white = max(float(white), _roughness(np.where(shift > 0.5, cells, np.nan)))
    white = max(float(white), _SMALLEST)
    near = float(np.sqrt(np.mean(cells[next_to] ** 2))) if next_to.any() else white
    return MatrixNoise(
        white,
        max(near, white),
        max(float(offset), _SMALLEST),
        max(float(tilt), _SMALLEST),
        resolution,
        common,
    )


def baseline_shapes(rows: int) -> Array:
    """Return the shapes a column's baseline may have over emission, ndarray of shape (2, rows): offset and tilt."""
    return np.stack([np.ones(rows), np.linspace(-1, 1, rows)])


def _common_offset(levels: Array, cells: Array, shift: Array) -> float:
    """Return the offset that the columns above the diagonal share with the dark cells below, 0 if there is none.

    `levels` are the means of the columns above the diagonal. Columns are measured one after another and drift, so
    neighbours that are alike count as fewer than they are (Student's t).
    """
    from scipy.stats import t

    mean, off = float(np.mean(levels)), levels - np.mean(levels)
    alike = float(np.clip(off[1:] @ off[:-1] / max(off @ off, _SMALLEST**2), 0.0, 0.9))
    fewer = (1 - alike) / (1 + alike)
    count = fewer * len(levels)
    below = shift > 1.5
    columns = below.sum(axis=1)
    rows = columns >= _FEWEST
    if count < 2 or not rows.any():
        return 0.0
    error = float(np.std(levels, ddof=1)) * float(t.ppf(1 - _FALSE_ZERO / 2, count - 1))
    dark = float(np.quantile(np.where(below, cells, 0.0).sum(axis=1)[rows] / columns[rows], _DARK))
    uncertain = error * np.sqrt(1 / count + 1 / (fewer * float(np.mean(columns[rows]))))
    significant = abs(mean) > error / np.sqrt(count)
    return mean if significant and np.sign(mean) * (mean - dark) < uncertain else 0.0


def _roughness(cells: Array) -> float:
    """Noise of cells of shape (M, P), NaN where they do not count, from second differences along emission.

    The median, so that the luminescence of a dye, in some of the cells, does not count.
    """
    second = np.abs(np.diff(cells, 2, axis=0)) / np.sqrt(6)
    known = second[np.isfinite(second)]
    return float(np.median(known) / 0.6745) if known.size else 0.0


def _resolution(cells: Array) -> float:
    """Return the step to which all cells were rounded, 0 if there is none."""
    for digits in range(1, 4):
        if np.allclose(cells, np.round(cells, digits), rtol=0, atol=1e-9):
            return float(10.0**-digits)
    return 0.0
