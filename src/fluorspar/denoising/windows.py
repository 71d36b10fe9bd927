"""How far off a denoised picture is, as its differences from the noisy one tell, window by window.

The square of a difference is expected to be the variance of the noise plus the square of what the denoiser is off, so
with the noise known the rest is an error of the denoiser. And where it has moved the mean of a whole block by more
than noise can, the block is given its own mean again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["block_factors", "mean_around", "noise_around", "noisy_share"]

Array = NDArray[np.float32]

BLOCK = 32
_MOST = 2.0  # factor on a block, and its inverse


def mean_around(values: Array, size: int) -> Array:
    """Mean over the square of `size` pixels around each pixel, ndarray of shape (Y, X)."""
    from scipy.ndimage import uniform_filter

    return np.asarray(uniform_filter(values, size, mode="reflect"))


def noise_around(noisy: Array, denoised: Array, size: int) -> Array:
    """Variance of the noise of a picture in windows.

    Parameters
    ----------
    noisy, denoised : ndarray of shape (Y, X)
    size : int
        Of the windows, in pixels.

    Returns
    -------
    ndarray of shape (Y, X)
        Infinite where the picture is one pixel.

    Notes
    -----
    Pixels beside one another have noise of their own, but may share what they show, at least along an edge; and what
    the denoiser is off as well. So of half the squared differences of neighbours, in four directions, the least are
    taken, of the noisy picture and of what was removed from it.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0, 2, (64, 64)).astype(np.float32)
    >>> edge = np.repeat([0, 100], 32).astype(np.float32)
    >>> bool(noise_around(edge + noise, np.zeros_like(noise), 7).max() < 10)
    True
    """
    height, width = noisy.shape
    least = np.full_like(noisy, np.inf)
    for picture in noisy, noisy - denoised:
        for down, across in (0, 1), (1, 0), (1, 1), (1, -1):
            left, right = max(-across, 0), max(across, 0)
            squares = picture[down:, right : width - left] - picture[: height - down, left : width - right]
            if squares.size:
                around = np.pad(mean_around(squares**2, size), ((0, down), (left, right)), mode="edge")
                np.minimum(least, around / 2, out=least)
    return np.maximum(least, 0)  # means of large and small numbers may be less, by rounding


def noisy_share(removed: Array, variance: Array, size: int) -> Array:
    """The share of the noisy picture in its best mean with the denoised one: noise against bias.

    Parameters
    ----------
    removed : ndarray of shape (Y, X)
        The noisy picture without the denoised one.
    variance : ndarray of shape (Y, X)
        Of the noise, on average over windows.
    size : int
        Of the windows, in pixels.

    Returns
    -------
    ndarray of shape (Y, X)
        0 where noise explains all that was removed.

    Examples
    --------
    >>> removed = np.full((8, 8), 3, np.float32)
    >>> round(float(noisy_share(removed, np.ones((8, 8), np.float32), 7).mean()), 2)
    0.88
    """
    variance = np.maximum(variance, 0)  # means of large and small numbers may be less, by rounding
    chance = 1 + 3 / size  # twice the standard error of a mean of squares, 2 sqrt(2) / size
    bias = np.maximum(mean_around(removed**2, size) - chance * variance, 0)
    return np.asarray(bias / np.maximum(bias + variance, np.finfo(np.float32).tiny))


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
