"""An image with fewer components, other wavelengths or wider bands."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.image.components import TOTAL, select, sum_of
from fluorspar.image.computed import computed
from fluorspar.image.dataset import add_up, values_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of
from fluorspar.spectral.bands import Bands, band_weights, conversion
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["ASSUMED", "converted"]

ASSUMED = "the band shape of the image is not known: samples are assumed"
"""Said in the attribute `converted` where it matters."""

Values = NDArray[np.float32]


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
        Its attribute `bandwidth_nm` says how wide its bands are; without it they are taken for samples.
    component : str, optional
        Keep only this component; or only a sum of some, "total", "single_bounce", "reflected", "luminescent" or several
        joined by "+", which is then no longer split. Default: keep all.
    wavelengths : Wavelengths, optional
        Other wavelengths, within those of the image.
    bandwidth : float
        FWHM in nm of triangular bands around the wavelengths, at least that of the image; it becomes the
        attribute `bandwidth_nm`. 0: bands as they are, interpolated linearly to other wavelengths.

    Returns
    -------
    SpectralImage
        In memory if it has at most 1 GiB; a larger one reads `image` whenever it is used. The attribute `converted`
        says what was done, `components` what a sum was made of. Standard errors are kept where they are still right:
        those of components that are kept, one of which becomes the total if it is all that is left, and those of the
        total with all components. Bands count as fully correlated.

    Raises
    ------
    OptionError
        If there is no such component, or the bandwidth is negative or less than that of the image.
    SpectrumError
        If the wavelengths lie outside those of the image.

    Examples
    --------
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> converted(image, "luminescent", Wavelengths(400, 700, 10)).shape
    (1, 4, 6, 31)
    >>> converted(image, bandwidth=10.0).attrs["bandwidth_nm"]
    10.0
    """
    target = _bands(image, wavelengths, bandwidth)
    if component is None and wavelengths is None and not bandwidth:
        return image
    on_grid, steps = _conversion(image, target)
    kept = select(component, image.components)
    if component is None:
        names = kept
    else:
        names = kept if len(kept) == 1 and component == kept[0] else (TOTAL,)
        steps.append(f"{component} only")

    def radiance(rows: slice) -> Values:
        if component is not None:
            return on_grid(add_up(image.dataset, kept, rows), False)[np.newaxis]
        return np.stack([on_grid(values_of(image.dataset, "radiance", rows, name), False) for name in kept])

    attrs = image.attrs | (sum_of(kept) if names == (TOTAL,) else {})
    if steps:
        attrs["converted"] = "; ".join([attrs["converted"], *steps] if "converted" in attrs else steps)
    for name in ("fingerprint", "study_row"):  # it is no longer what was rendered
        attrs.pop(name, None)
    if bandwidth:
        attrs["bandwidth_nm"] = float(bandwidth)
    variables = {"radiance": radiance} | _errors(image, component, kept, on_grid)
    return SpectralImage(computed(variables, image.size, target.grid, attrs, names))


def _bands(image: SpectralImage, wavelengths: Wavelengths | None, bandwidth: float) -> Bands:
    """The bands that are wanted."""
    own = float(image.attrs.get("bandwidth_nm", 0.0))
    target = Bands(wavelengths or image.wavelengths, bandwidth or own)
    if bandwidth and bandwidth < own * (1 - 1e-6):
        raise OptionError(
            message(
                "bands cannot be made narrower",
                got=f"{bandwidth:g} nm FWHM",
                expected=f"at least the {own:g} nm of the image",
            )
        )
    return target


def _conversion(image: SpectralImage, target: Bands) -> tuple[Callable[[Values, bool], Values], list[str]]:
    """A function that brings spectra, or standard errors (True), to other bands; and what it does, in words."""
    own = Bands(image.wavelengths, float(image.attrs.get("bandwidth_nm", 0.0)))
    grid = target.grid
    if own == target:
        return lambda values, absolute: values, []
    if grid.start < own.grid.start - 1e-6 or grid.stop > own.grid.stop + 1e-6:
        band_weights(own.grid.values, grid.values)  # raises, with both ranges
    weights, sentence = conversion(own, target, "wavelengths")
    assumed = [ASSUMED] if bands_of(image).fwhm is None and target.fwhm else []
    if weights is None:
        return lambda values, absolute: values, []
    plain, positive = weights.T.astype(np.float32), np.abs(weights).T.astype(np.float32)
    return lambda values, absolute: np.asarray(values @ (positive if absolute else plain)), [
        sentence,
        *assumed,
    ]


def _errors(
    image: SpectralImage,
    component: str | None,
    kept: tuple[str, ...],
    on_grid: Callable[[Values, bool], Values],
) -> dict[str, Callable[[slice], Values]]:
    """Errors, rows of them, of the total and of the components that are left, as far as they are known."""
    held = image.dataset

    def of(variable: str, name: str | None = None) -> Callable[[slice], Values]:
        return lambda rows: on_grid(values_of(held, variable, rows, name), True)

    known = {}
    if kept == select(None, image.components):
        for variable in "standard_error", "denoised_error", "noisy_standard_error":
            if variable in held:
                known[variable] = of(variable)
    if not known and len(kept) == 1 and "component_standard_error" in held:
        known["standard_error"] = of("component_standard_error", kept[0])
    if component is None and "component_standard_error" in held:
        each = [of("component_standard_error", name) for name in kept]
        known["component_standard_error"] = lambda rows: np.stack([one(rows) for one in each])
    return known
