"""From spectra to a few channels and back: what a denoiser of pictures sees of a spectral image.

A channel is the mean over a range of wavelengths, so it is positive where spectra are, and three of them look like a
colour picture. What they change by is put back as the spectra that best predict the image from its channels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["channel_ranges", "channel_spectra", "second_moment"]

Array = NDArray[np.float32]

_BLOCK = 4  # pixels: the mean of a block has less noise, and the same spectra
_AT_ONCE = 16  # blocks: products of larger matrices start threads of BLAS, which take the time of ours
_DARKEST = 1e-3  # of the mean: darker spectra count as if they were as bright
_LEAST = 1e-5  # of the variance of all channels together


def channel_ranges(bands: int, count: int) -> Array:
    """Ranges of wavelengths: spectra times these are channels.

    Parameters
    ----------
    bands : int
        N wavelengths.
    count : int
        n channels.

    Returns
    -------
    ndarray of shape (N, n)

    Examples
    --------
    >>> channel_ranges(4, 3).T
    array([[1. , 0. , 0. , 0. ],
           [0. , 1. , 0. , 0. ],
           [0. , 0. , 0.5, 0.5]], dtype=float32)
    """
    ranges = np.zeros((bands, count), np.float32)
    for n in range(count):
        first = n * bands // count
        last = max((n + 1) * bands // count, first + 1)
        ranges[first:last, n] = 1 / (last - first)
    return ranges


def second_moment(radiance: Array) -> NDArray[np.float64]:
    """Sum over small blocks of pixels of the products of their mean spectra, by their level: dark ones count too.

    Parameters
    ----------
    radiance : ndarray of shape (Y, X, N)

    Returns
    -------
    ndarray of shape (N, N)
    """
    height, width, bands = radiance.shape
    down, across = min(_BLOCK, height), min(_BLOCK, width)
    cut = radiance[: height // down * down, : width // across * across]
    sums = cut.reshape(height // down, down, -1, across, bands).sum(axis=1).sum(axis=2)
    spectra = sums.reshape(-1, bands).astype(np.float64) / (down * across)
    spectra = spectra[np.isfinite(spectra).all(axis=1)]
    if not spectra.any():
        return np.zeros((bands, bands))
    level = spectra.mean(axis=1)
    weighted = spectra / np.maximum(level, _DARKEST * level.mean())[:, np.newaxis]
    parts = np.array_split(np.arange(len(spectra)), -(-len(spectra) // _AT_ONCE))
    moments: NDArray[np.float64] = np.sum([weighted[part].T @ spectra[part] for part in parts], axis=0)
    return moments


def channel_spectra(ranges: Array, moment: NDArray[np.float64]) -> Array:
    """Spectra that go with channels: channels times these predict an image as well as so few numbers can.

    Parameters
    ----------
    ranges : ndarray of shape (N, n)
    moment : ndarray of shape (N, N)
        Of `second_moment`.

    Returns
    -------
    ndarray of shape (n, N)

    Examples
    --------
    >>> ramps = (np.outer([1.0, 2.0], np.arange(6.0)) + [[1.0], [0.0]]).reshape(1, 2, 6)
    >>> ranges = channel_ranges(6, 3)
    >>> spectra = channel_spectra(ranges, ramps[0].T @ ramps[0])
    >>> bool(np.allclose(ramps @ ranges @ spectra, ramps, rtol=0.01, atol=0.01))
    True
    """
    of_channels = ranges.T @ moment @ ranges
    of_channels += _LEAST * np.trace(of_channels) * np.eye(len(of_channels))
    return (np.linalg.pinv(of_channels) @ (ranges.T @ moment)).astype(np.float32)
