"""Components with weights: an image in which one counts twice and another not at all."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from fluorspar.image.components import select
from fluorspar.image.dataset import names_of
from fluorspar.image.spectral_image import SpectralImage

__all__ = ["weighted"]


def weighted(
    image: SpectralImage, weights: Mapping[str, float], part: xr.Dataset | None = None
) -> SpectralImage:
    """Return an image, or a part of it, with its components multiplied by weights.

    Its standard error is that of the weighted total where it can be known: all weights are the same, or only one
    component is left and it has an error of its own. Otherwise it has none, since the components are correlated.

    Parameters
    ----------
    image : SpectralImage
    weights : mapping of str to float
        By component; 1 where there is none.
    part : Dataset, optional
        A part of the data set of the image.

    Raises
    ------
    OptionError
        If the image has no such component.

    Examples
    --------
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths(), np.ones((4, 6, 69)))
    >>> float(weighted(image, {"source": 0.5}).total().max())
    6.5
    >>> "standard_error" in weighted(image, {"source": 0.5}).dataset
    False
    """
    if weights:
        select(list(weights), image.components)
    dataset = image.dataset if part is None else part
    names = names_of(dataset)
    factors = np.array([weights.get(name, 1.0) for name in names], np.float32)
    if (factors == 1).all():
        return SpectralImage(dataset)
    changed = dataset.drop_vars(["standard_error", "component_standard_error"], errors="ignore")
    scale = xr.DataArray(factors, dims="component")
    changed["radiance"] = (dataset["radiance"] * scale).assign_attrs(dataset["radiance"].attrs)
    changed["radiance"] = changed["radiance"].transpose(*dataset["radiance"].dims)
    used = np.flatnonzero(factors)
    if "standard_error" in dataset and (factors == factors[0]).all():
        changed["standard_error"] = dataset["standard_error"] * factors[0]
    elif "component_standard_error" in dataset and len(used) == 1:
        own = dataset["component_standard_error"].isel(component=int(used[0]), drop=True)
        changed["standard_error"] = own * factors[used[0]]
    return SpectralImage(changed)
