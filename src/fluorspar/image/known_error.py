"""The standard error of a choice of components, as far as an image holds what it follows from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.components import TOTAL, select
from fluorspar.image.dataset import values_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import is_denoised

__all__ = ["OF_ALL", "KnownError", "is_all_light", "known_error"]

OF_ALL = ("standard_error", "denoised_error")
"""The variables that hold an error of the total; an image has one of them."""

_OF_ALL_LIGHT = "standard errors of single_bounce are those of the total, which are slightly larger"
_BOUND = (
    "standard errors of a sum of components are upper limits, the sums of those of its components: their noise is "
    "correlated, and how much is not known"
)
_HOW = {
    "paths": "render with errors of components (component_errors=True, --component-errors)",
    "staged": "the staged method estimates them for the total only",
}


@dataclass(frozen=True)
class KnownError:
    """The standard error of a choice of components: the sum of some variables of the image.

    Parameters
    ----------
    image : SpectralImage
    variable : str
        Of its data set; empty: no error is known.
    components : tuple of str
        Components of the variable, whose errors are added; empty if it has none.
    note : str
        What a reader has to know about it, in one sentence without a full stop; often empty.
    """

    image: SpectralImage
    variable: str = ""
    components: tuple[str, ...] = ()
    note: str = ""

    def __bool__(self) -> bool:
        return bool(self.variable)

    def rows(self, rows: slice = slice(None)) -> NDArray[np.float32]:
        """Read some rows, ndarray of shape (rows, X, N); not to be written to."""
        dataset = self.image.dataset
        if not self.components:
            return values_of(dataset, self.variable, rows)
        first, *others = (values_of(dataset, self.variable, rows, name) for name in self.components)
        return np.asarray(sum(others, start=first))


def is_all_light(image: SpectralImage, component: str | None) -> bool:
    """Whether a choice of components is all light of an image, or all that luminesced at most once.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 1, 1, 69)), Wavelengths())
    >>> is_all_light(image, None), is_all_light(image, "single_bounce"), is_all_light(image, "reflected")
    (True, True, False)
    """
    held = image.components
    chosen = select(component, held)
    return chosen == select(None, held) or (held != (TOTAL,) and chosen == select("single_bounce", held))


def known_error(image: SpectralImage, component: str | None) -> KnownError:
    """Find the standard error of a choice of components.

    The components of a pixel come from the same light paths, so their errors are correlated. The error of a sum is at
    most the sum of the errors of its terms (the triangle inequality for standard deviations).

    Parameters
    ----------
    image : SpectralImage
    component : str, optional
        As in `SpectralImage.xyz`.

    Returns
    -------
    KnownError
        False as a bool if there is none; its note then says why, and how to get one. That of all components is exact;
        that of `single_bounce` is that of the total, since the light it leaves out only adds to the noise; that of
        another sum is an upper limit.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> ones = np.ones((7, 4, 6, 69))
    >>> image = SpectralImage.from_arrays(ones, Wavelengths(), ones[0], component_standard_error=ones)
    >>> float(known_error(image, "total").rows().max()), float(known_error(image, "reflected").rows().max())
    (1.0, 2.0)
    """
    dataset, chosen = image.dataset, select(component, image.components)
    of_total = next((name for name in OF_ALL if name in dataset), "")
    all_light = is_all_light(image, component)
    if of_total and all_light:
        whole = chosen == select(None, image.components)
        return KnownError(image, of_total, note="" if whole else _OF_ALL_LIGHT)
    if "component_standard_error" in dataset:
        return KnownError(image, "component_standard_error", chosen, _BOUND if len(chosen) > 1 else "")
    if all_light:
        return KnownError(image)
    if is_denoised(image):
        how = "a denoised image has errors of the total only"
    else:
        how = _HOW.get(str(image.attrs.get("method")), "the image holds none of components")
    return KnownError(image, note=f"no standard errors of {component}: {how}")
