"""How far off a denoised picture is, as its differences from the noisy one tell, window by window.

The square of a difference is expected to be the variance of the noise plus the square of what the denoiser is off, so
with the noise known the rest is an error of the denoiser. And where it has moved the mean of a whole block by more
than noise can, the block is given its own mean again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["bias_squares", "block_factors", "mean_around"]

Array = NDArray[np.float32]

BLOCK = 32
_MOST = 2.0  # factor on a block, and its inverse


def mean_around(values: Array, size: int) -> Array:
    """Mean over the square of `size` pixels around each pixel, ndarray of shape (Y, X)."""
    from scipy.ndimage import uniform_filter

    return np.asarray(uniform_filter(values, size, mode="reflect"))


def bias_squares(squares: Array, variances: Array, size: int) -> Array:
    """Squares of what is off: the mean over windows of squared differences, beyond what noise gives.

    Parameters
    ----------
    squares : ndarray of shape (Y, X)
        Squared differences of the denoised and the noisy picture.
    variances : ndarray of shape (Y, X)
        Of the noise.
    size : int
        Of the windows, in pixels.

    Examples
    --------
    >>> float(bias_squares(np.full((64, 64), 5, np.float32), np.ones((64, 64), np.float32), 32).max()) > 3
    True
    """
    chance = 1 + 3 / size  # twice the standard error of a mean of squares, 2 sqrt(2) / size
    return np.maximum(mean_around(squares, size) - chance * mean_around(variances, size), 0)


def block_factors(noisy: Array, denoised: Array) -> Array:
    """Factors that give blocks of 32 x 32 pixels their own means again, as far as these are known.

    Parameters
    ----------
    noisy, denoised : ndarray of shape (Y, X)
        One channel, without NaN.

    Returns
    -------
    ndarray of shape (Y, X)
        Interpolated between the middles of blocks, so that none has an edge.

    Notes
    -----
    With a difference b of the means that has the standard error s, the share max(0, 1 - s^2/b^2) of it is corrected
    (James, Stein). s follows from the differences of the pixels, which are hardly anything but noise.

    Examples
    --------
    >>> bright = np.ones((64, 96), np.float32)
    >>> round(float(block_factors(1.25 * bright, bright).max()), 2)
    1.25
    """
    height, width = noisy.shape
    rows, columns = (np.arange(0, length, BLOCK) for length in (height, width))

    def sums(values: Array) -> NDArray[np.float64]:
        partly = np.add.reduceat(values, rows, axis=0, dtype=np.float64)
        return np.asarray(np.add.reduceat(partly, columns, axis=1))

    removed = noisy - denoised
    difference, of_denoised, variance = sums(removed), sums(denoised), sums(removed**2)
    shrunk = difference * np.maximum(1 - variance / np.maximum(difference**2, 1e-300), 0)
    factors = 1 + np.divide(shrunk, of_denoised, out=np.zeros_like(shrunk), where=of_denoised > 0)
    factors = np.clip(factors, 1 / _MOST, _MOST).astype(np.float32)
    down, across = (_between(length) for length in (height, width))
    # Row by row: products of larger matrices start threads of BLAS, which take the time of ours.
    return np.asarray((down[:, np.newaxis] @ (factors @ across.T))[:, 0])


def _between(length: int) -> Array:
    """Weights that interpolate from the middles of blocks to pixels, ndarray of shape (pixels, blocks)."""
    count = -(-length // BLOCK)
    middles = BLOCK * (np.arange(count) + 0.5)
    pixels = np.arange(length) + 0.5
    return np.stack([np.interp(pixels, middles, one) for one in np.eye(count)], axis=1).astype(np.float32)
