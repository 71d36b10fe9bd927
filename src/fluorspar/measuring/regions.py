"""The mean spectra of rectangles of pixels."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fluorspar.errors import OptionError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of, unit_of_image
from fluorspar.image.weighting import weighted
from fluorspar.measuring.mean_spectrum import mean_spectrum
from fluorspar.measuring.point_spectra import PointSpectra

__all__ = ["measure_regions"]


def measure_regions(
    image: SpectralImage,
    regions: Mapping[str, tuple[int, int, int, int]],
    *,
    component: str | None = None,
    weights: Mapping[str, float] | None = None,
    title: str = "",
) -> PointSpectra:
    """Measure the mean spectra of rectangles; that of one pixel is what `measure` gives with an aperture of 1px.

    Parameters
    ----------
    image : SpectralImage
    regions : mapping of str to (int, int, int, int)
        By name, columns and rows x0, y0, x1, y1, inclusive, from 0.
    component : str, optional
        As in `measure`.
    weights : mapping of str to float, optional
        What components are multiplied with; 1 where there is none. See `fluorspar.image.weighting.error_of` for the
        standard error.
    title : str
        What to call the image.

    Returns
    -------
    PointSpectra
        As of `measure`.

    Raises
    ------
    OptionError
        If a region is empty or reaches beyond the image, or there is no such component.
    ImageError
        If a pixel was not rendered, or cannot be read.

    Examples
    --------
    >>> from fluorspar import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> float(measure_regions(image, {"wall": (0, 0, 3, 3)}).at("wall")[0])
    7.0
    """
    width, height = image.size
    means = []
    for name, (x0, y0, x1, y1) in regions.items():
        if not (0 <= x0 <= x1 < width and 0 <= y0 <= y1 < height):
            raise OptionError(
                message(
                    "a region is not in the image",
                    where=f"region {name}",
                    got=f"columns {x0} to {x1}, rows {y0} to {y1}",
                    expected=f"columns from 0 to {width - 1}, rows from 0 to {height - 1}, the first one first",
                )
            )
        part = SpectralImage(image.dataset.isel(y=slice(y0, y1 + 1), x=slice(x0, x1 + 1)))
        pixels = np.ones(part.shape[1:3])
        means.append(
            mean_spectrum(weighted(part, weights or {}), pixels / pixels.size, component, f"region {name}")
        )
    radiance, errors, freedom = zip(*means, strict=True)
    known = [error for error in errors if error is not None]
    places = (f"{name}: columns {r[0]}-{r[2]}, rows {r[1]}-{r[3]}" for name, r in regions.items())
    return PointSpectra(
        tuple(regions),
        bands_of(image),
        np.stack(radiance),
        np.stack(known) if known else None,
        unit_of_image(image),
        title=title or str(image.attrs.get("scene", "an image")),
        notes=(f"means over pixels: {'; '.join(places)}",),
        correlated=True,
        freedom=np.array(freedom) if known else None,
        denoised=str(image.attrs.get("denoised", "")),
    )
