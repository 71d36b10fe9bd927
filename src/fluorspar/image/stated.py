"""What an image says of itself: its bands, its unit, and whether it is denoised."""

from __future__ import annotations

from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.units import in_our_spelling, quantity_of, unit_of
from fluorspar.spectral.bands import Bands

__all__ = ["METHODS", "bands_of", "is_denoised", "unit_of_image"]

METHODS = ("paths", "staged")
"""The attribute `method` of images that Fluorspar rendered."""


def is_denoised(image: SpectralImage) -> bool:
    """Whether an image is denoised: neighbouring pixels then share errors, which are estimates.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> is_denoised(SpectralImage.from_arrays(np.ones((7, 1, 1, 69)), Wavelengths()))
    False
    """
    return "denoised" in image.attrs


def bands_of(image: SpectralImage) -> Bands:
    """The bands of an image: those it states; samples if Fluorspar rendered it; else not known.

    Parameters
    ----------
    image : SpectralImage

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> ones, attrs = np.ones((7, 1, 1, 69)), {"method": "paths", "bandwidth_nm": 10}
    >>> print(bands_of(SpectralImage.from_arrays(ones, Wavelengths(), attrs=attrs)))
    360-700 nm by 5, triangular bands of 10 nm FWHM
    >>> print(bands_of(SpectralImage.from_arrays(ones, Wavelengths())))
    360-700 nm by 5, band shape not known
    """
    ours = image.attrs.get("method") in METHODS
    stated = image.attrs.get("bandwidth_nm", 0.0 if ours else None)
    return Bands(image.wavelengths, None if stated is None else float(stated))


def unit_of_image(image: SpectralImage) -> str:
    """The unit of an image, in the spelling of its source; radiance has that of Fluorspar.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> attrs = {"unit": "W.m^-2.sr^-1.nm^-1"}
    >>> unit_of_image(SpectralImage.from_arrays(np.ones((7, 1, 1, 69)), Wavelengths(), attrs=attrs))
    'W m-2 sr-1 nm-1'
    """
    return in_our_spelling("1" if quantity_of(image.attrs) == "reflectance" else unit_of(image.attrs))
