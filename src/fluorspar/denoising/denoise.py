"""Denoise a spectral image: clean pictures of few samples, with an error that is estimated for them."""

from __future__ import annotations

from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.denoising.errors import relative_error
from fluorspar.denoising.oidn import denoise_channels
from fluorspar.denoising.pictures import Picture, channels_of_errors, pictures_of, strips
from fluorspar.denoising.shares import shared_out
from fluorspar.denoising.windows import bias_squares, block_factors, mean_around
from fluorspar.errors import ImageError, message
from fluorspar.extras import check_extra
from fluorspar.files.memory import check_memory
from fluorspar.image.dataset import make_dataset, values_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.measuring.image_scene import given_scene, scene_of
from fluorspar.paths.seen_first import seen_first
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import usable_cores
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Surfaces", "denoise", "surfaces_of"]

Array = NDArray[np.float32]
Surfaces = tuple[Array, Array]

_CHANNELS = 3, 6  # of a component, and of the total
_WINDOW = 7  # pixels, for the blend with the noisy image
_SOURCE = "source"


def denoise(
    image: SpectralImage,
    *,
    scene: Scene | str | Path | None = None,
    surfaces: Surfaces | None = None,
    threads: int | None = None,
) -> SpectralImage:
    """Denoise an image, all components and wavelengths; see `SpectralImage.denoised`.

    Parameters
    ----------
    image : SpectralImage
    scene : Scene, str or path, optional
        What it was rendered from; of a built-in scene the image knows.
    surfaces : (ndarray, ndarray), optional
        What `surfaces_of` returns, where it is at hand.
    threads : int, optional
        Default: all cores this process may use.
    """
    check_extra("denoise")
    dataset = image.dataset
    if "denoised" in dataset.attrs:
        how = dataset.attrs["denoised"]
        raise ImageError(message("the image is denoised already", got=how, fix="denoise the noisy one"))
    check_memory(4 * dataset["radiance"].size, dataset.encoding.get("source"), "the denoised image")
    if surfaces is None:
        known = given_scene(scene) or scene_of(image)
        surfaces = None if known is None else surfaces_of(known, image)
    names = [name for name in image.components if name != _SOURCE]
    with ThreadPoolExecutor(threads or usable_cores()) as pool:
        *parts, whole = pictures_of(dataset, names, _CHANNELS, pool)
        error = _denoise_total(whole, dataset, surfaces, pool)
        if len(names) == 1:
            parts = [whole]
        else:
            _denoise_components([part for part in parts if part.noisy.any()], surfaces)
        radiance = _radiance(dataset, dict(zip(names, parts, strict=True)), whole, pool)
    guided = "without the scene" if surfaces is None else "guided by colours and normals of surfaces"
    errors = {"denoised_error": error}
    if "standard_error" in dataset:
        errors["noisy_standard_error"] = values_of(dataset, "standard_error")
    attrs = {**dataset.attrs, "denoised": f"Open Image Denoise, {guided}"}
    clean_one = make_dataset(radiance, image.wavelengths, attrs=attrs, components=image.components, **errors)
    return SpectralImage(clean_one)


def surfaces_of(scene: Scene, image: SpectralImage) -> Surfaces:
    """Colours and normals of the surfaces that an image of a scene shows, see `seen_first`."""
    width, height = image.size
    grid = image.wavelengths.values
    held = image.wavelengths if type(image.wavelengths) is Wavelengths else Wavelengths()
    if held is not image.wavelengths and not (grid[0] < held.stop and grid[-1] > held.start):
        return seen_first(scene.with_settings(width=width, height=height), held, held)
    job = RenderJob.of(scene, size=(width, height), wavelengths=held)
    return seen_first(job.scene, job.grid, job.computed_grid)


def _denoise_total(picture: Picture, dataset: xr.Dataset, surfaces: Surfaces | None, pool: Executor) -> Array:
    """Denoise the total, in place; return its estimated error, ndarray of shape (Y, X, N)."""
    noisy, lamps = picture.noisy, _lamps(dataset)
    clean = _with_own_means(noisy, denoise_channels(noisy, surfaces))
    removed = noisy - clean
    if "standard_error" in dataset:
        errors = channels_of_errors(dataset, "standard_error", _CHANNELS[1], pool)
        errors[lamps] = np.abs(removed[lamps])  # theirs are those of the lamp
    else:
        errors = np.stack([np.sqrt(mean_around(x**2, _WINDOW)) for x in np.moveaxis(removed, 2, 0)], axis=2)
    scale = 1 / np.maximum(clean.mean(axis=(0, 1)), np.finfo(np.float32).tiny)
    variance = (errors * scale).mean(axis=2) ** 2
    bias = bias_squares((removed * scale).mean(axis=2) ** 2, variance, _WINDOW)
    # The best weights of two estimates, one of which has noise and the other a bias.
    own = bias / np.maximum(bias + mean_around(variance, _WINDOW), np.finfo(np.float32).tiny)
    share = relative_error(clean[..., ::2], errors[..., ::2], surfaces)
    of_clean = np.stack([share * mean_around(x, _WINDOW) for x in np.moveaxis(clean, 2, 0)], axis=2)
    own = own[..., np.newaxis]
    left = np.hypot((1 - own) * of_clean, own * errors)
    picture.clean = clean + own * removed
    error = np.empty((*noisy.shape[:2], picture.spectra.shape[1]), np.float32)

    def put(rows: slice) -> None:
        by_channels = np.sqrt(np.square(left[rows]) @ np.square(picture.spectra))
        # Between channels errors are shared, and not smaller than on average.
        on_average = left[rows].mean(axis=2, keepdims=True) / np.maximum(
            picture.clean[rows].mean(axis=2, keepdims=True), np.finfo(np.float32).tiny
        )
        error[rows] = np.maximum(by_channels, on_average * np.abs(picture.clean[rows] @ picture.spectra))
        if lamps[rows].any() and "standard_error" in dataset:
            of_lamps = values_of(dataset, "standard_error", rows)
            error[rows][lamps[rows]] = np.hypot(error[rows], of_lamps)[lamps[rows]]

    list(pool.map(put, strips(len(noisy))))
    return error


def _denoise_components(pictures: list[Picture], surfaces: Surfaces | None) -> None:
    """Denoise components, in place: only their shares of the total are used."""
    if pictures:
        noisy = np.concatenate([picture.noisy for picture in pictures], axis=2)
        clean = _with_own_means(noisy, denoise_channels(noisy, surfaces, fast=True))
        for picture, of_picture in zip(pictures, np.split(clean, len(pictures), axis=2), strict=True):
            picture.clean = of_picture


def _lamps(dataset: xr.Dataset) -> NDArray[np.bool_]:
    """The pixels in which a lamp is seen."""
    height, width = dataset.sizes["y"], dataset.sizes["x"]
    if _SOURCE not in dataset["component"].values:
        return np.zeros((height, width), bool)
    blocks = [values_of(dataset, "radiance", rows, _SOURCE).max(axis=2) > 0 for rows in strips(height)]
    return np.concatenate(blocks)


def _with_own_means(noisy: Array, clean: Array) -> Array:
    factors = [block_factors(noisy[..., n], clean[..., n]) for n in range(noisy.shape[2])]
    return clean * np.stack(factors, axis=2)


def _radiance(dataset: xr.Dataset, parts: dict[str, Picture], whole: Picture, pool: Executor) -> Array:
    """All components: what was denoised adds up to the denoised total, the rest stays as it is."""
    radiance = np.empty(dataset["radiance"].shape, np.float32)
    names = [str(name) for name in dataset["component"].values]
    lit = [name for name, part in parts.items() if part.noisy.any()]

    def finish(rows: slice) -> None:
        for number, name in enumerate(names):
            radiance[number, rows] = values_of(dataset, "radiance", rows, name)
        if lit:
            for y in range(rows.start, rows.stop):  # what stays in the caches
                finish_row(slice(y, y + 1))

    def finish_row(row: slice) -> None:
        done = [radiance[names.index(name), row] for name in lit]
        total = done[0].copy()
        for values in done[1:]:
            total += values
        for name, values in zip(lit, done, strict=True):
            values[...] = parts[name].denoised(values, row)
        shared_out(whole.denoised(total, row), done)

    list(pool.map(finish, strips(dataset.sizes["y"])))
    return radiance
