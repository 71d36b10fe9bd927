"""The pictures that are denoised: channels of the components of an image, and of all their light together."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.denoising.channels import channel_ranges, channel_spectra, second_moment
from fluorspar.errors import ImageError, message
from fluorspar.image.dataset import values_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Picture", "channels_of_errors", "pictures_of", "strips"]

Array = NDArray[np.float32]

_LOOKED_AT = 16  # strips, and more: these tell the spectra of the image
_LARGEST, _INFINITE = 1e18, 1e38
_ROWS = 16  # at a time: what stays in the caches


@dataclass
class Picture:
    """Channels of an image.

    Attributes
    ----------
    channels : ndarray of shape (Y, X, n)
        Noisy at first; then those of the denoised image take their place. Where nothing was rendered, those of the
        nearest pixel.
    ranges : ndarray of shape (N, n)
        What they are of spectra, see `channel_ranges`.
    spectra : ndarray of shape (n, N)
        What goes with them, see `channel_spectra`.
    has_gaps : bool
        Whether some values of the image are NaN; of the total only.
    uncertainty : ndarray of shape (Y, X)
        Variance of the denoised channels, over the square of their level; of components only.
    """

    channels: Array
    ranges: Array
    spectra: Array
    has_gaps: bool = False
    uncertainty: Array = field(init=False)


def strips(start: int, stop: int) -> list[slice]:
    """Cut rows of an image into strips."""
    return [slice(first, min(first + _ROWS, stop)) for first in range(start, stop, _ROWS)]


def pictures_of(
    dataset: xr.Dataset, names: list[str], counts: tuple[int, int], pool: Executor
) -> list[Picture]:
    """Read an image and make pictures of components, and last of their sum.

    Parameters
    ----------
    dataset : Dataset
    names : list of str
        The components.
    counts : (int, int)
        Channels of a component, and of the sum.
    pool : Executor

    Raises
    ------
    ImageError
        If a value is infinite, or too large to be squared.
    """
    height, width, bands = (dataset.sizes[dim] for dim in ("y", "x", "wavelength"))
    ranges = [channel_ranges(bands, counts[0])] * len(names) + [channel_ranges(bands, counts[1])]
    noisy = [np.empty((height, width, each.shape[1]), np.float32) for each in ranges]

    every = max(1, len(strips(0, height)) // _LOOKED_AT)

    gaps: list[slice] = []

    def read(rows: slice) -> list[NDArray[np.float64]]:
        light = np.zeros((rows.stop - rows.start, width, bands), np.float32)
        moments = []
        for number in range(len(ranges)):
            values = light
            if number < len(names):
                values = values_of(dataset, "radiance", rows, names[number])
                light += values
            noisy[number][rows], has_gaps = _means(values, ranges[number])
            if has_gaps:
                gaps.append(rows)
            if rows.start // _ROWS % every == 0:
                moments.append(second_moment(values))
        return moments

    looked_at = [of_strip for of_strip in pool.map(read, strips(0, height)) if of_strip]
    if gaps:
        _fill_missing(noisy)
    for channels, name in zip(noisy, [*names, "total"], strict=True):
        _check_size(channels, name)
    moments = [np.sum(parts, axis=0) for parts in zip(*looked_at, strict=True)]
    pictures = [
        Picture(channels, of, channel_spectra(of, moment))
        for channels, of, moment in zip(noisy, ranges, moments, strict=True)
    ]
    pictures[-1].has_gaps = bool(gaps)
    return pictures


def _means(values: Array, ranges: Array) -> tuple[Array, bool]:
    """Channels of spectra, without the bands that are NaN, NaN where all are; and whether any is."""
    with np.errstate(invalid="ignore"):  # of infinite values, which are refused later
        channels = values @ ranges
        has_gaps = bool(np.isnan(channels).any())
        if has_gaps:
            known = ~np.isnan(values)
            channels = (np.where(known, values, 0) @ ranges) / (known @ ranges)
    return np.asarray(channels, np.float32), has_gaps


def _fill_missing(pictures: list[Array]) -> None:
    """Give pixels that were not rendered the channels of the nearest one: a denoiser takes the dark for a picture."""
    from scipy.ndimage import distance_transform_edt

    missing = np.isnan(pictures[-1]).all(axis=2)
    nearest = None
    if missing.any() and not missing.all():
        nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)[:, missing]
    for channels in pictures:
        if nearest is not None:
            channels[missing] = channels[tuple(nearest)]
        np.nan_to_num(channels, copy=False, posinf=np.inf, neginf=-np.inf)


def _check_size(channels: Array, component: str) -> None:
    if max(channels.max(), -channels.min()) > _LARGEST:
        sizes = np.abs(channels).max(axis=2)
        y, x = np.unravel_index(np.argmax(sizes), sizes.shape)
        raise ImageError(
            message(
                "a radiance is too large to denoise",
                where=f"pixel ({x}, {y}), component {component}",
                got="infinite" if sizes[y, x] > _INFINITE else f"{sizes[y, x]:g}",
                expected=f"no more than {_LARGEST:g}",
                fix="see whether the file is damaged, or divide the image by a number",
            )
        )


def channels_of_errors(dataset: xr.Dataset, variable: str, count: int, pool: Executor) -> Array:
    """Channels of standard errors, NaN where not known; the bands of a pixel are fully correlated."""
    height, width, bands = (dataset.sizes[dim] for dim in ("y", "x", "wavelength"))
    ranges, channels = channel_ranges(bands, count), np.empty((height, width, count), np.float32)

    def read(rows: slice) -> None:
        channels[rows], _ = _means(values_of(dataset, variable, rows), ranges)

    list(pool.map(read, strips(0, height)))
    return channels
