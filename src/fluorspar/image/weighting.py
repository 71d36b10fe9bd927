"""Components with weights: an image in which one counts twice and another not at all."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from fluorspar.image.components import select
from fluorspar.image.dataset import VARIABLES
from fluorspar.image.known_error import OF_ALL
from fluorspar.image.spectral_image import SpectralImage

__all__ = ["error_of", "factors_of", "weighted"]


def factors_of(image: SpectralImage, weights: Mapping[str, float]) -> dict[str, float]:
    """The weight of every component of an image, 1 where none is given.

    Raises
    ------
    OptionError
        If there is a weight for a component that it has not.
    """
    if weights:
        select(list(weights), image.components)
    return {name: float(weights.get(name, 1.0)) for name in image.components}


def error_of(image: SpectralImage, weights: Mapping[str, float]) -> tuple[str, str | None, float] | None:
    """Find the standard error of a weighted total.

    Components are correlated, so it is known only if all weights are the same, or if one component is left that has
    an error of its own.

    Returns
    -------
    variable, component, factor : str, str or None, float
        The variable of the data set, the component of it, and what it is to be multiplied with; None as a whole if the
        error is not known.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths(), np.ones((4, 6, 69)))
    >>> error_of(image, {}), error_of(image, {"source": 0.5})
    (('standard_error', None, 1.0), None)
    """
    factors = factors_of(image, weights)
    used = [name for name, factor in factors.items() if factor]
    for variable in OF_ALL:
        if variable in image.dataset and len(set(factors.values())) == 1:
            return variable, None, next(iter(factors.values()))
    if "component_standard_error" in image.dataset and len(used) == 1:
        return "component_standard_error", used[0], factors[used[0]]
    return None


def weighted(image: SpectralImage, weights: Mapping[str, float]) -> SpectralImage:
    """Return an image with its components multiplied by weights; its standard error is that of `error_of`.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths(), np.ones((4, 6, 69)))
    >>> float(weighted(image, {"source": 0.5}).total().max())
    6.5
    """
    factors = factors_of(image, weights)
    if set(factors.values()) == {1.0}:
        return image
    dataset, error = image.dataset, error_of(image, weights)
    changed = dataset.drop_vars([name for name in VARIABLES if name != "radiance"], errors="ignore")
    scale = xr.DataArray(list(factors.values()), dims="component").astype("float32")
    radiance = (dataset["radiance"] * scale).transpose(*dataset["radiance"].dims)
    changed["radiance"] = radiance.assign_attrs(dataset["radiance"].attrs)
    if error is not None:
        variable, component, factor = error
        own = (
            dataset[variable] if component is None else dataset[variable].sel(component=component, drop=True)
        )
        changed[variable if component is None else "standard_error"] = own * factor
    return SpectralImage(changed)
