"""Degrees of freedom of standard errors that are estimates themselves, from few samples."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.image.spectral_image import SpectralImage
from fluorspar.scene.sample_sets import batch_count

__all__ = ["combined_freedom", "error_freedom"]

Array = NDArray[np.float64]


def error_freedom(image: SpectralImage) -> float:
    """Degrees of freedom of the standard errors of a pixel: of the batches or repeats they come from, less one.

    Parameters
    ----------
    image : SpectralImage

    Returns
    -------
    float
        Attribute `error_freedom`, or what follows from the number of samples. Infinite, as if they were known, for
        an image that says neither.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> ones = np.ones((7, 4, 6, 69))
    >>> error_freedom(SpectralImage.from_arrays(ones, Wavelengths(), attrs={"method": "paths", "spp": 64}))
    31.0
    >>> error_freedom(SpectralImage.from_arrays(ones, Wavelengths(), attrs={"repeats": 4}))
    3.0
    """
    spp, repeats, stated = (image.attrs.get(name) for name in ("spp", "repeats", "error_freedom"))
    if isinstance(stated, float) and stated > 0:
        return stated
    if isinstance(repeats, int):
        samples = repeats
    elif image.attrs.get("method") == "paths" and isinstance(spp, int):
        samples = batch_count(spp)
    else:
        return math.inf
    return float(max(samples - 1, 1))


def combined_freedom(variances: ArrayLike, squares: ArrayLike) -> Array:
    """Return the degrees of freedom of a sum of estimated variances.

    Parameters
    ----------
    variances : array_like
        The sum of variances.
    squares : array_like
        The sum of their squares, each over its own degrees of freedom.

    Returns
    -------
    ndarray
        Infinite where the variances are known.

    References
    ----------
    F. E. Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics
    Bulletin 2(6), 1946.

    Examples
    --------
    >>> combined_freedom(1.0 + 1.0, 1 / 3 + 1 / 3)
    array(6.)
    """
    above, below = np.asarray(variances, np.float64) ** 2, np.asarray(squares, np.float64)
    return np.asarray(np.divide(above, below, out=np.full(np.shape(above), np.inf), where=below > 0))
