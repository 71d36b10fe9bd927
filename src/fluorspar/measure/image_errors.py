"""Which standard errors an image holds for a choice of components."""

from __future__ import annotations

import math

from fluorspar.image.components import select
from fluorspar.image.spectral_image import SpectralImage

__all__ = ["OF_TOTAL", "error_freedom", "error_layer"]

OF_TOTAL = "standard errors of single_bounce are those of the total, which are slightly larger"


def error_layer(image: SpectralImage, component: str | None) -> tuple[str, str | None] | None:
    """Find the standard errors of what is chosen.

    Parameters
    ----------
    image : SpectralImage
    component : str, optional
        As in `SpectralImage.xyz`.

    Returns
    -------
    variable, component : str, str or None
        The variable of the data set, and which component of it; None as a whole if there are none. Those of
        `single_bounce` are those of the total: the light it leaves out only adds to the noise.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths(), np.ones((4, 6, 69)))
    >>> error_layer(image, "total"), error_layer(image, "source")
    (('standard_error', None), None)
    """
    chosen = select(component, image.components)
    if "standard_error" in image.dataset and chosen == select(None, image.components):
        return "standard_error", None
    if "component_standard_error" in image.dataset and len(chosen) == 1:
        return "component_standard_error", chosen[0]
    if "standard_error" in image.dataset and component == "single_bounce":
        return "standard_error", None
    return None


def error_freedom(image: SpectralImage) -> float:
    """Degrees of freedom of the standard errors of a pixel: of the batches or repeats they come from, less one.

    Parameters
    ----------
    image : SpectralImage

    Returns
    -------
    float
        Infinite, as if they were known, for an image that does not say.

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
    from fluorspar.paths.sweep import batch_count

    spp, repeats = image.attrs.get("spp"), image.attrs.get("repeats")
    if isinstance(repeats, int):
        samples = repeats
    elif image.attrs.get("method") == "paths" and isinstance(spp, int):
        samples = batch_count(spp)
    else:
        return math.inf
    return float(max(samples - 1, 1))
