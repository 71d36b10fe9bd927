"""Combine independent renders of one image: their mean, weighted by samples, and its standard error."""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.dataset import VARIABLES, readable
from fluorspar.image.pixels import Pixels, Target
from fluorspar.image.spectral_image import SpectralImage

__all__ = ["AddedPixels", "combine", "pixels_of"]

Array = NDArray[np.float32]

_RUN = 8192  # pixels read at a time


def combine(pixels: Pixels, samples: int, earlier: Pixels, earlier_samples: int) -> None:
    """Turn pixels into the mean of themselves and of those of an earlier, independent render, in place.

    With n and m samples the mean is (n a + m b) / (n + m), its squared standard error (n^2 s^2 + m^2 t^2) / (n + m)^2.

    Parameters
    ----------
    pixels, earlier : Pixels
        Of the same pixels; where one is NaN, it was not rendered, and the other one is the result.
    samples, earlier_samples : int
        Samples per pixel of each. If an error is NaN, as that of a single sample, a sample is taken to be as
        uncertain as one of the other render.

    Examples
    --------
    >>> once, again = (Pixels.empty(1, 3, component_errors=False) for _ in range(2))
    >>> once.radiance[...], once.standard_error[...] = 1.0, 0.3
    >>> again.radiance[...], again.standard_error[...] = 3.0, 0.4
    >>> combine(again, 64, once, 64)
    >>> float(again.radiance[0, 0, 0]), round(float(again.standard_error[0, 0]), 6)
    (2.0, 0.25)
    """
    share = samples / (samples + earlier_samples)
    new, old = (np.isnan(each.radiance[0, :, 0]) for each in (pixels, earlier))
    both = ~(new | old)
    pairs = [(pixels.standard_error, earlier.standard_error)]
    if pixels.component_standard_error is not None and earlier.component_standard_error is not None:
        pairs += zip(pixels.component_standard_error, earlier.component_standard_error, strict=True)
    whole = bool(both.all())
    for error, before in pairs:
        combined = _combined_error(error, before, share)
        error[...] = (
            combined if whole else np.select([both[:, None], new[:, None]], [combined, before], error)
        )
    for layer, before in zip(pixels.radiance, earlier.radiance, strict=True):
        mean = np.float32(share) * layer + np.float32(1 - share) * before
        layer[...] = mean if whole else np.select([both[:, None], new[:, None]], [mean, before], layer)


def _combined_error(error: Array, before: Array, share: float) -> Array:
    """Standard error of the mean of two renders, the first with a `share` of all samples."""
    ratio = np.float32(np.sqrt(share / (1 - share)))
    first = np.where(np.isnan(error), before / ratio, error)
    second = np.where(np.isnan(before), error * ratio, before)
    return np.asarray(np.hypot(np.float32(share) * first, np.float32(1 - share) * second))


def pixels_of(image: SpectralImage, first: int, count: int) -> Pixels:
    """Read a run of pixels of an image with all components, row by row from the top left.

    Returns
    -------
    Pixels
        Views if the image is in memory: not to be written to.

    Raises
    ------
    ImageError
        If the file of the image is damaged.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> pixels_of(SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths()), 5, 9).radiance.shape
    (7, 9, 69)
    """
    dataset, width = image.dataset, image.size[0]
    top = first // width
    rows = dataset.isel(y=slice(top, -(-(first + count) // width)))
    start = first - top * width
    read: dict[str, Array] = {}
    with readable(dataset.encoding.get("source")):
        for name in VARIABLES:
            if name in rows:
                values = rows[name].values
                flat = values.reshape(*values.shape[:-3], -1, values.shape[-1])
                read[name] = flat[..., start : start + count, :]
    missing = np.full(read["radiance"].shape[1:], np.nan, np.float32)
    return Pixels(read["radiance"], read.get("standard_error", missing), read.get("component_standard_error"))


class AddedPixels:
    """A target whose pixels are combined with those of a finished image on their way, chunk by chunk.

    The image itself is not changed, so that it is still there if the render does not come to its end.

    Parameters
    ----------
    target : Target
    samples : int
        Samples per pixel of what comes.
    image : SpectralImage
        The finished image; it is closed before the target is, which may be a file of the same name.
    image_samples : int
    """

    def __init__(self, target: Target, samples: int, image: SpectralImage, image_samples: int) -> None:
        self._target, self._samples = target, samples
        self._image, self._image_samples = image, image_samples

    def __enter__(self) -> AddedPixels:
        self._target.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._target.__exit__(kind, error, trace)

    @property
    def kept(self) -> int:
        return self._target.kept

    def has(self, first: int, count: int) -> bool:
        return self._target.has(first, count)

    def stored(self, first: int, count: int) -> Pixels:
        return self._target.stored(first, count)

    def room(self, first: int, count: int) -> tuple[Pixels, int]:
        return self._target.room(first, count)

    def keep(self, first: int, count: int) -> None:
        room, at = self._target.room(first, count)
        for start in range(0, count, _RUN):
            run = min(_RUN, count - start)
            earlier = pixels_of(self._image, first + start, run)
            pixels = room[at + start : at + start + run]
            combine(pixels, self._samples, earlier, self._image_samples)
        self._target.keep(first, count)

    def image(self, attrs: Mapping[str, Any], *, partial: bool) -> SpectralImage:
        self._image.close()
        return self._target.image(attrs, partial=partial)
