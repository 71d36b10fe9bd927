"""Denoise a spectral image: clean pictures of few samples, with an error that is estimated for them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.denoising.errors import relative_error
from fluorspar.denoising.finishing import finish
from fluorspar.denoising.oidn import denoise_channels, holds_light
from fluorspar.denoising.pictures import Picture, channels_of_errors, pictures_of, strips
from fluorspar.denoising.windows import mean_around, noise_around, noisy_share
from fluorspar.errors import FluorsparWarning, ImageError, message
from fluorspar.extras import check_extra
from fluorspar.image.computed import computed
from fluorspar.image.dataset import names_of, values_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import METHODS
from fluorspar.job import RenderJob
from fluorspar.measuring.image_scene import scene_of
from fluorspar.paths.seen_first import seen_first
from fluorspar.scene.scene import Scene
from fluorspar.scene.settings import MOST_SAMPLES
from fluorspar.scene.variants import usable_cores
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Surfaces", "denoise", "surfaces_of"]

Array = NDArray[np.float32]
Surfaces = tuple[Array, Array]
# Fills in rows of an image: an array of some rows and all behind them, the row that it begins with, and the rows.
Fill = Callable[[Array, int, slice], None]

_CHANNELS = 2, 6  # of a component, and of the total
_QUALITIES = "High", "Balanced"  # of the total: two networks err in ways of their own, which add up to less
_WINDOW = 7  # pixels, for the blend with the noisy image
_LEFT = 0.25  # of the noise, in a denoised component
_KNOWN, _UNKNOWN = 1e-3, 1.0  # errors of components, relative to their level: least and most
_LEVEL = 1e-3  # of its error, at least: that of a darker pixel is no share of its light
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
    if surfaces is None:
        known = scene_of(image.attrs, scene)
        if known is not None:
            _check_scene(known, image)
        surfaces = None if known is None else surfaces_of(known, image)
    names = [name for name in image.components if name != _SOURCE]
    with ThreadPoolExecutor(threads or usable_cores()) as pool:
        *parts, whole = pictures_of(dataset, names, _CHANNELS, pool)
        if len(names) > 1 and (noise := _noise_in(parts, names)):
            names = [name for name in names if name not in noise]
            *parts, whole = pictures_of(dataset, names, _CHANNELS, pool)
        _check_light(whole, image.wavelengths.values)
        lit = {name: part for name, part in zip(names, parts, strict=True) if part.channels.any()}
        error = _denoise_total(whole, dataset, surfaces, pool)
        if len(lit) > 1:  # one alone is the total
            _denoise_components(list(lit.values()), surfaces, pool)
    fills = {"radiance": _radiance(dataset, lit, whole), "denoised_error": error}
    if "standard_error" in dataset:
        fills["noisy_standard_error"] = _copy_of(dataset)
    components, last = len(image.components), (image.size[0], len(image.wavelengths))
    variables = {
        name: _by_strips(fill, (components, *last) if name == "radiance" else last, threads or usable_cores())
        for name, fill in fills.items()
    }
    guided = "without the scene" if surfaces is None else "guided by colours and normals of surfaces"
    attrs = {**dataset.attrs, "denoised": f"Open Image Denoise, {guided}"}
    for name in ("fingerprint", "study_row"):  # it is no longer what was rendered
        attrs.pop(name, None)
    return SpectralImage(computed(variables, image.size, image.wavelengths, attrs, image.components))


def _by_strips(fill: Fill, shape: tuple[int, ...], threads: int) -> Callable[[slice], Array]:
    """A function of rows that fills them in strips, in several threads; the shape is that of a row."""

    def of(rows: slice) -> Array:
        whole = np.empty((*shape[:-2], rows.stop - rows.start, *shape[-2:]), np.float32)
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(partial(fill, whole, rows.start), strips(rows.start, rows.stop)))
        return whole

    return of


def _copy_of(dataset: xr.Dataset) -> Fill:
    def fill(out: Array, first: int, rows: slice) -> None:
        out[rows.start - first : rows.stop - first] = values_of(dataset, "standard_error", rows)

    return fill


def surfaces_of(scene: Scene, image: SpectralImage) -> Surfaces:
    """Colours and normals of the surfaces that an image of a scene shows from its camera, see `seen_first`."""
    (width, height), spp = image.size, image.attrs.get("spp")
    if isinstance(spp, int) and image.attrs.get("method") in METHODS:
        scene = scene.with_settings(spp=min(spp, MOST_SAMPLES))
    grid = image.wavelengths.values
    held = image.wavelengths if type(image.wavelengths) is Wavelengths else Wavelengths()
    if held is not image.wavelengths and not (grid[0] < held.stop and grid[-1] > held.start):
        return seen_first(scene.with_settings(width=width, height=height), held, held)
    job = RenderJob.of(scene, size=(width, height), wavelengths=held)
    return seen_first(job.scene, job.grid, job.computed_grid)


def _denoise_total(picture: Picture, dataset: xr.Dataset, surfaces: Surfaces | None, pool: Executor) -> Fill:
    """Denoise the total, in place; return what fills in its estimated error."""
    noisy, lamps = picture.channels, _lamps(dataset)
    clean = denoise_channels(noisy, surfaces, qualities=_QUALITIES, own_means=True)
    removed = noisy - clean
    holds = holds_light(noisy)
    lit = np.flatnonzero(holds)
    errors = np.full_like(noisy, np.nan)
    if "standard_error" in dataset:
        errors = channels_of_errors(dataset, "standard_error", _CHANNELS[1], pool)
        errors[lamps] = np.abs(removed[lamps])  # theirs are those of the lamp
    if not np.isfinite(errors).all():  # as of one sample per pixel
        left_out = np.where(holds, removed, noisy)  # what was removed, or is noise and stays
        squares = np.stack([mean_around(x**2, _WINDOW) for x in np.moveaxis(left_out, 2, 0)], axis=2)
        errors = np.where(np.isfinite(errors), errors, np.sqrt(np.maximum(squares, 0)))
    level_of = clean[..., lit].mean(axis=(0, 1))
    scale = np.divide(1, level_of, out=np.zeros_like(level_of), where=level_of > np.finfo(np.float32).tiny)
    variance = (errors[..., lit] * scale).mean(axis=2) ** 2
    own = noisy_share((removed[..., lit] * scale).mean(axis=2), mean_around(variance, _WINDOW), _WINDOW)
    three = lit[:: -(-len(lit) // 3)]
    share = relative_error(clean[..., three], errors[..., three], surfaces)
    of_clean = np.stack([share * mean_around(x, _WINDOW) for x in np.moveaxis(clean, 2, 0)], axis=2)
    own = own[..., np.newaxis]
    left = errors.copy()
    left[..., lit] = np.hypot((1 - own) * of_clean, own * errors)[..., lit]
    picture.channels = clean + own * removed
    of_noise = np.where(holds, 0, picture.ranges > 0).T.astype(
        np.float32
    )  # which no channel of light predicts

    def error(out: Array, first: int, rows: slice) -> None:
        by_channels = np.sqrt(np.square(left[rows]) @ np.square(picture.spectra))
        # Between channels errors are shared, and not smaller than on average.
        mean = left[rows].mean(axis=2, keepdims=True)
        level = np.maximum(picture.channels[rows].mean(axis=2, keepdims=True), _LEVEL * mean)
        on_average = np.divide(mean, level, out=np.zeros_like(mean), where=level > 0)
        values = np.maximum(by_channels, on_average * np.abs(picture.channels[rows] @ picture.spectra))
        if not holds.all():
            values = np.maximum(values, left[rows] @ of_noise)
        if lamps[rows].any() and "standard_error" in dataset:
            of_lamps = values_of(dataset, "standard_error", rows)
            values[lamps[rows]] = np.hypot(values, of_lamps)[lamps[rows]]
        for name in dataset["component"].values if picture.has_gaps else ():
            values = np.where(
                np.isnan(values_of(dataset, "radiance", rows, name)), np.float32(np.nan), values
            )
        out[rows.start - first : rows.stop - first] = values

    return error


def _check_scene(scene: Scene, image: SpectralImage) -> None:
    """Say that the guides show other surfaces than the image."""
    shown, materials = image.attrs.get("scene"), image.attrs.get("materials")
    other = ""
    if shown and shown != scene.name:
        other = f"of scene {scene.name!r}, and the image says that it shows {shown!r}"
    elif isinstance(materials, dict) and (missing := materials.keys() - scene.used.keys()):
        other = f"of the scene's own materials, and the image shows others: {', '.join(sorted(missing))}"
    if other:
        warnings.warn(
            f"the colours that guide the denoiser are those {other}; use --denoise of 'render' or 'relight', or in "
            "Python image.denoised(scene=load_scene(..., materials=...))",
            FluorsparWarning,
            stacklevel=5,
        )


def _noise_in(pictures: list[Picture], names: list[str]) -> list[str]:
    """Components of noise around zero, which stay as they are; a warning names them."""
    found = [
        name for name, picture in zip(names, pictures, strict=True) if not holds_light(picture.channels).any()
    ]
    if found:
        text = f"noise around zero instead of light: component {', '.join(found)}, which is not denoised"
        warnings.warn(text, FluorsparWarning, stacklevel=5)
    return found


def _check_light(picture: Picture, wavelengths: NDArray[np.float64]) -> None:
    """Say which wavelengths hold noise around zero instead of light."""
    dark = ~holds_light(picture.channels)
    if dark.all():
        raise ImageError(
            message(
                "there is no light to denoise",
                got="radiances about zero or negative, on average over the image",
                fix="denoise images of light, and take their difference afterwards",
            )
        )
    if dark.any():
        ends = (wavelengths[np.flatnonzero(picture.ranges[:, n])[[0, -1]]] for n in np.flatnonzero(dark))
        where = ", ".join(f"{first:g}-{last:g}" for first, last in ends)
        warnings.warn(
            f"noise around zero instead of light: {where} nm, which are not denoised",
            FluorsparWarning,
            stacklevel=5,
        )


def _denoise_components(pictures: list[Picture], surfaces: Surfaces | None, pool: Executor) -> None:
    """Denoise components, in place, and estimate their errors: the surer a component, the less the total changes it."""
    noisy = np.concatenate([picture.channels for picture in pictures], axis=2)
    clean = denoise_channels(noisy, surfaces, own_means=True)
    count = len(pictures)
    before, after = (np.split(channels, count, axis=2) for channels in (noisy, clean))
    list(pool.map(_blend, pictures, before, after))


def _blend(picture: Picture, noisy: Array, clean: Array) -> None:
    """Take the denoised channels of a component, and the noisy ones where these are better."""
    means = noisy.mean(axis=2), clean.mean(axis=2)
    variance = noise_around(*means, _WINDOW)
    own = noisy_share(means[0] - means[1], variance, _WINDOW)
    picture.channels = clean + own[..., np.newaxis] * (noisy - clean)
    level = mean_around(picture.channels.mean(axis=2), _WINDOW)
    error = np.sqrt(np.maximum(own, _LEFT**2) * variance)
    relative = np.divide(error, level, out=np.full_like(error, _UNKNOWN), where=level > error)
    picture.uncertainty = np.square(np.maximum(relative, _KNOWN))


def _lamps(dataset: xr.Dataset) -> NDArray[np.bool_]:
    """The pixels in which a lamp is seen."""
    height, width = dataset.sizes["y"], dataset.sizes["x"]
    if _SOURCE not in dataset["component"].values:
        return np.zeros((height, width), bool)
    blocks = [values_of(dataset, "radiance", rows, _SOURCE).max(axis=2) > 0 for rows in strips(0, height)]
    return np.concatenate(blocks)


def _radiance(dataset: xr.Dataset, lit: dict[str, Picture], whole: Picture) -> Fill:
    """What fills in all components: the denoised ones add up to the denoised total, the rest stays as it is."""
    names = names_of(dataset)
    places = [names.index(name) for name in lit]

    def fill(out: Array, first: int, rows: slice) -> None:
        for values, name in zip(out, names, strict=True):
            values[rows.start - first : rows.stop - first] = values_of(dataset, "radiance", rows, name)
        if lit:
            finish(out, places, list(lit.values()), whole, first, rows)

    return fill
