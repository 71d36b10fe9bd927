"""The noise of a measured Donaldson matrix, estimated from its cells above the diagonal.

Light is never shifted to shorter wavelengths, so whatever stands above the diagonal is measurement error.
In bispectral instruments it has three parts, which matter differently to a fit:

* white noise of every cell;
* a baseline of every column - each excitation wavelength is measured by itself, with an offset and a slow drift of its
  own - which is the same above and below the diagonal and would otherwise pass for weak luminescence. What all columns
  have in common of it is a zero error of the instrument;
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
_SIGNIFICANT = 3.0  # standard errors


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
    common : tuple of float
        Offset and tilt of the baseline that all columns have in common; 0 where it is less than three times its
        standard error.
    """

    white: float
    near: float
    offset: float
    tilt: float
    resolution: float
    common: tuple[float, float] = (0.0, 0.0)

    def common_baseline(self, rows: int) -> Array:
        """Return the baseline of all columns over `rows` emission wavelengths, ndarray of shape (rows,).

        Examples
        --------
        >>> MatrixNoise(0.001, 0.001, 0.0, 0.0, 0.0, (0.002, 0.001)).common_baseline(3)
        array([0.001, 0.002, 0.003])
        """
        return np.asarray(np.array(self.common) @ baseline_shapes(rows))


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
    coefficients, left, freedom = [], 0.0, 0
    for column in range(cells.shape[1]):
        rows = far[:, column]
        if rows.sum() < _FEWEST:
            continue
        fitted = np.linalg.lstsq(shapes[:, rows].T, cells[rows, column], rcond=None)[0]
        coefficients.append(fitted)
        left += float(np.sum((cells[rows, column] - fitted @ shapes[:, rows]) ** 2))
        freedom += int(rows.sum()) - len(shapes)
    resolution = _resolution(cells)
    rounding = resolution / np.sqrt(12)
    if freedom:
        white = np.hypot(np.sqrt(left / freedom), rounding)
        common, spread = np.mean(coefficients, axis=0), np.std(coefficients, axis=0)
        common[np.abs(common) < _SIGNIFICANT * spread / np.sqrt(len(coefficients))] = 0.0
        offset, tilt = spread
    else:  # a small matrix: no column is long enough, so all is called white
        values = cells[far | next_to]
        white = np.hypot(np.sqrt(np.mean(values**2)) if values.size else 0.0, rounding)
        common = np.zeros(2)
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
        (float(common[0]), float(common[1])),
    )


def baseline_shapes(rows: int) -> Array:
    """Return the shapes a column's baseline may have over emission, ndarray of shape (2, rows): offset and tilt."""
    return np.stack([np.ones(rows), np.linspace(-1, 1, rows)])


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
