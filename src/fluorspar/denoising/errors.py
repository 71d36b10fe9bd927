"""The estimated error of a denoised picture.

The denoised picture is taken for the truth, noise as large as that of the image is added to it, and it is denoised
again: what comes out differs from that truth as the picture itself may differ from the real one. Structure that the
denoiser has lost for good is not seen this way, so there is a share of the picture's own contrast, and of its level.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.denoising.oidn import denoise_channels
from fluorspar.denoising.windows import mean_around

__all__ = ["relative_error"]

Array = NDArray[np.float32]

# Measured against converged images of the box, an open scene and the still life, at 16 and 64 samples.
_OF_LEVEL = 0.01
_OF_CONTRAST = 0.25
_WINDOW, _NEAR, _EDGE = 15, 7, 5  # pixels
_DARKEST = 0.01  # of the mean level
_SEED = 0


def relative_error(denoised: Array, errors: Array, surfaces: tuple[Array, Array] | None) -> Array:
    """Estimate the error of a denoised picture, as a share of the level around each pixel.

    Parameters
    ----------
    denoised : ndarray of shape (Y, X, 3)
        Channels, without NaN.
    errors : ndarray of shape (Y, X, 3)
        Standard errors of the noisy ones.
    surfaces : (ndarray, ndarray), optional
        As for `denoise_channels`.

    Returns
    -------
    ndarray of shape (Y, X)
    """
    noise = np.random.default_rng(_SEED).standard_normal(denoised.shape[:2], dtype=np.float32)
    probe = np.maximum(denoised + errors * noise[..., np.newaxis], 0)
    again = denoise_channels(probe, surfaces)
    mean = denoised.mean(axis=(0, 1))
    scale = np.where(mean > 0, mean, 1)
    picture = (denoised / scale).mean(axis=2)
    level = mean_around(picture, _NEAR) + _DARKEST
    moved = ((again - denoised) / scale).mean(axis=2) / level
    shown = picture / level
    contrast = np.maximum(mean_around(shown**2, _EDGE) - mean_around(shown, _EDGE) ** 2, 0)
    variance = mean_around(moved**2, _WINDOW) + _OF_CONTRAST**2 * contrast + _OF_LEVEL**2
    return np.asarray(np.sqrt(variance), np.float32)
