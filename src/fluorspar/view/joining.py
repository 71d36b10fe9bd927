"""Images of independent passes joined into one of all their samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.spectral_image import SpectralImage

__all__ = ["joined"]


def joined(images: Sequence[SpectralImage]) -> SpectralImage:
    """Return the mean of images of different seeds, each weighted by its samples, `spp` of its attributes.

    Parameters
    ----------
    images : sequence of SpectralImage
        Of one scene, size and grid.

    Returns
    -------
    SpectralImage
        Its standard errors are those of independent images: the root of the sum of (n_k / n)^2 e_k^2.

    Examples
    --------
    >>> from fluorspar import Wavelengths
    >>> ones, error = np.ones((7, 4, 6, 69)), np.full((4, 6, 69), 0.5)
    >>> four = SpectralImage.from_arrays(ones, Wavelengths(), error, {"spp": 4, "seed": 0})
    >>> twelve = SpectralImage.from_arrays(3 * ones, Wavelengths(), error, {"spp": 12, "seed": 1})
    >>> mean = joined([four, twelve])
    >>> float(mean.component("source")[0, 0, 0]), round(float(mean.standard_error()[0, 0, 0]), 4), mean.attrs["spp"]
    (2.5, 0.3953, 16)
    """
    if len(images) == 1:
        return images[0]
    samples = np.array([image.attrs["spp"] for image in images])
    shares = (samples / samples.sum()).astype(np.float32)
    first = images[0].dataset
    variables = {"radiance": _mean([image.dataset["radiance"].values for image in images], shares)}
    for name in ("standard_error", "component_standard_error"):
        if all(name in image.dataset for image in images):
            variables[name] = _root_of_squares([image.dataset[name].values for image in images], shares)
    dataset = first.assign(
        {name: (first[name].dims, values, first[name].attrs) for name, values in variables.items()}
    )
    dataset.attrs = {**first.attrs, "spp": int(samples.sum())}
    dataset.attrs.pop("timings", None)
    return SpectralImage(dataset)


def _mean(arrays: Sequence[NDArray[np.float32]], shares: NDArray[np.float32]) -> NDArray[np.float32]:
    total = arrays[0] * shares[0]
    for part, share in zip(arrays[1:], shares[1:], strict=True):
        for into, values in zip(
            total, part, strict=True
        ):  # component by component, rather than a copy of all
            into += share * values
    return total


def _root_of_squares(
    arrays: Sequence[NDArray[np.float32]], shares: NDArray[np.float32]
) -> NDArray[np.float32]:
    total = np.square(arrays[0] * shares[0])
    for part, share in zip(arrays[1:], shares[1:], strict=True):
        for into, values in zip(total, part, strict=True):
            into += np.square(share * values)
    return np.sqrt(total, out=total)
