"""The mean spectrum of some pixels, with its standard error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.image.components import select
from fluorspar.image.dataset import add_up
from fluorspar.image.known_error import known_error
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import is_denoised
from fluorspar.measuring.error_freedom import combined_freedom, error_freedom

__all__ = ["mean_spectrum"]

Array = NDArray[np.float64]


def mean_spectrum(
    image: SpectralImage, weights: Array, component: str | None, where: str
) -> tuple[Array, Array | None, float]:
    """Return the mean of an image, which is a part of another one.

    Parameters
    ----------
    image : SpectralImage
        Y x X pixels.
    weights : ndarray of shape (Y, X)
        Of its pixels; they sum to 1.
    component : str, optional
        As in `measure`.
    where : str
        What to call the part in a message.

    Returns
    -------
    radiance : ndarray of shape (N,)
        In the unit of the image.
    error : ndarray of shape (N,) or None
        Its standard error, if the image has those of what is measured: pixels are independent. Or its estimated
        error, of a denoised image, whose pixels share theirs.
    freedom : float
        Degrees of freedom of the error; infinite without one.

    Raises
    ------
    ImageError
        If a pixel was not rendered.

    Examples
    --------
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 2, 2, 69)), Wavelengths(), 0.2 * np.ones((2, 2, 69)))
    >>> radiance, error, _ = mean_spectrum(image, np.full((2, 2), 0.25), None, "here")
    >>> float(radiance[0]), round(float(error[0]), 6)
    (7.0, 0.1)
    """
    light = add_up(image.dataset, select(component, image.components))
    radiance = np.einsum("yx,yxn->n", weights, light, dtype=np.float64)
    if not np.isfinite(radiance).all():
        raise ImageError(message("a pixel that is to be measured was not rendered", where=where))
    known = known_error(image, component)
    if not known:
        return radiance, None, np.inf
    errors = known.rows().astype(np.float64)
    if is_denoised(image):
        return radiance, np.einsum("yx,yxn->n", weights, errors), np.inf
    error = np.sqrt(np.einsum("yx,yxn->n", weights**2, errors**2))
    variances = np.square(weights * errors.mean(axis=-1))
    freedom = combined_freedom(variances.sum(), np.sum(variances**2) / error_freedom(image))
    return radiance, error, float(freedom)
