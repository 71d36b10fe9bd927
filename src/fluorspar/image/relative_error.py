"""How uncertain the luminance of an image is, pixel by pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.xyz import observer_weights
from fluorspar.image.pixels import Pixels
from fluorspar.spectral.bands import error_of_sum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["RelativeErrors"]


class RelativeErrors:
    """Collects the relative standard error of the luminance of each pixel: that of Y over Y, of the total.

    One path serves all bands, so the errors of the bands of a pixel are nearly fully correlated and add up. Pixels
    that show no light do not count.

    Parameters
    ----------
    grid : Wavelengths
        If no band is visible, the sum of the bands takes the place of luminance.
    pixels : int
        Of the image.

    Attributes
    ----------
    of : str
        `"luminance"` or `"sum of the bands"`.

    Examples
    --------
    >>> pixels = Pixels.empty(4, 69, component_errors=False)
    >>> pixels.radiance[...], pixels.standard_error[...] = 1.0, 0.7
    >>> errors = RelativeErrors(Wavelengths(), 4)
    >>> errors.add(0, pixels)
    >>> round(errors.mean, 4)
    0.1
    """

    def __init__(self, grid: Wavelengths, pixels: int) -> None:
        visible = observer_weights(grid)[:, 1]
        self.of = "luminance" if visible.any() else "sum of the bands"
        self._weights = visible if visible.any() else np.ones_like(visible)
        self._errors = np.full(pixels, np.nan, np.float32)  # NaN: no light, or not rendered

    def add(self, first: int, pixels: Pixels) -> None:
        """Look at the pixels from number `first` on; those of a single sample count as infinitely uncertain."""
        weights = self._weights.astype(np.float32)  # spares copies in double precision
        light = sum(layer @ weights for layer in pixels.radiance)
        error = error_of_sum(pixels.standard_error.astype(np.float64), self._weights, correlated=True)
        error[np.isnan(error)] = np.inf
        ratio = np.divide(error, light, out=np.full_like(error, np.nan), where=light > 0)
        self._errors[first : first + len(ratio)] = ratio

    @property
    def lit(self) -> NDArray[np.float32]:
        """The errors of the pixels that show light, ndarray of shape (L,)."""
        return self._errors[~np.isnan(self._errors)]

    @property
    def mean(self) -> float:
        """Of the pixels that show light; infinite if not known, 0 if there are none."""
        return float(self.lit.mean(dtype=np.float64)) if self.lit.size else 0.0

    @property
    def p95(self) -> float:
        """95th percentile of the pixels that show light; infinite if not known, 0 if there are none."""
        lit = self.lit
        return float(np.percentile(lit, 95, method="lower")) if lit.size else 0.0
