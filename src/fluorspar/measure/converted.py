"""An image with fewer components or other wavelengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.components import TOTAL, select
from fluorspar.image.dataset import add_up, values_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measure.bands import Bands, band_weights, conversion
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["converted"]


def converted(
    image: SpectralImage,
    component: str | None = None,
    wavelengths: Wavelengths | None = None,
    bandwidth: float = 0.0,
) -> SpectralImage:
    """Convert an image.

    Parameters
    ----------
    image : SpectralImage
    component : str, optional
        Keep only this component; or only a sum of some, "total", "single_bounce", "reflected" or
        "luminescent", which is then no longer split. Default: keep all.
    wavelengths : Wavelengths, optional
        Other wavelengths, within those of the image.
    bandwidth : float
        FWHM in nm of triangular bands around them; 0: linear interpolation.

    Returns
    -------
    SpectralImage
        In memory, unless nothing is to be done. The attribute `converted` says what was done. Standard errors
        are kept where they are still right: those of the total with all components; bands count as fully
        correlated.

    Raises
    ------
    OptionError
        If there is no such component.
    SpectrumError
        If the wavelengths lie outside those of the image.

    Examples
    --------
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> converted(image, "luminescent", Wavelengths(400, 700, 10)).shape
    (1, 4, 6, 31)
    """
    if component is None and wavelengths is None:
        return image
    grid = wavelengths or image.wavelengths
    own, target = Bands(image.wavelengths), Bands(grid, bandwidth if wavelengths else 0.0)
    weights = None
    said = []
    if own != target:
        if grid.start < own.grid.start - 1e-6 or grid.stop > own.grid.stop + 1e-6:
            band_weights(own.grid.values, grid.values)  # raises, with both ranges
        weights, sentence = conversion(own, target, "wavelengths")
        said.append(sentence)
    chosen = select(component, image.components)
    all_of_it = chosen == select(None, image.components)

    def on_grid(values: NDArray[np.float32], absolute: bool = False) -> NDArray[np.float32]:
        if weights is None:
            return values
        return np.asarray(values @ (np.abs(weights) if absolute else weights).T.astype(np.float32))

    if component is None:
        names = chosen
        layers = [on_grid(values_of(image.dataset, "radiance", component=name)) for name in chosen]
    else:
        names = chosen if len(chosen) == 1 and component == chosen[0] else (TOTAL,)
        layers = [on_grid(add_up(image.dataset, chosen))]
        said.append(f"{component} only")
    error = None
    if all_of_it and "standard_error" in image.dataset:
        error = on_grid(values_of(image.dataset, "standard_error"), absolute=True)
    attrs = image.attrs | {
        "converted": "; ".join(filter(None, [str(image.attrs.get("converted", "")), *said]))
    }
    return SpectralImage.from_arrays(np.stack(layers), grid, error, attrs, components=names)
