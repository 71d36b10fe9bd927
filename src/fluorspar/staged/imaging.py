"""Renders in groups of bands: images of all bands, also split by the material that each sample shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fluorspar.staged.renderers.protocol import LoadedScene, OffersIrradiance

__all__ = [
    "Layers",
    "Sampling",
    "Tick",
    "Timing",
    "Views",
    "band_groups",
    "plan_samples",
    "render_bands",
    "seeds_of",
    "views_of",
]

Array = NDArray[np.float64]
Pixels = NDArray[np.float32]  # an image of many bands is large
_LARGEST_SIDE = 4096  # of a film with one sample per small pixel
Tick = Callable[[], None]
Timing = Callable[[str], AbstractContextManager[None]]
Seen = dict[int, tuple[NDArray[np.int64], NDArray[np.int64]]]
"""By material row: small pixels that show it, and the pixels they belong to."""


def band_groups(bands: Sequence[int] | NDArray[np.integer], max_bands: int) -> list[NDArray[np.int64]]:
    """Deal bands out into groups that are rendered together.

    Far bands share a group: Russian roulette then looks at the brightest part of the spectrum, so that bands
    in which a surface is dark are not noisier than others.

    Examples
    --------
    >>> [group.tolist() for group in band_groups(range(7), 3)]
    [[0, 3, 6], [1, 4], [2, 5]]
    """
    every = np.asarray(bands, dtype=np.int64)
    count = math.ceil(len(every) / max_bands)
    return [every[first::count] for first in range(count)]


@dataclass(frozen=True)
class Sampling:
    """How the samples of a pixel are spread over renders.

    `scale` x `scale` small pixels with one sample each, in `passes` renders.
    """

    scale: int
    passes: int

    @property
    def samples(self) -> int:
        """Samples per pixel."""
        return self.scale**2 * self.passes


def plan_samples(samples: int, width: int, height: int) -> Sampling:
    """Choose small pixels and renders for at least `samples` samples per pixel.

    Examples
    --------
    >>> plan_samples(64, 512, 512), plan_samples(8, 100, 100)
    (Sampling(scale=8, passes=1), Sampling(scale=2, passes=2))
    """
    scale = max(1, min(math.isqrt(samples), _LARGEST_SIDE // max(width, height)))
    return Sampling(scale, math.ceil(samples / scale**2))


def seeds_of(*key: int, count: int) -> list[int]:
    """Independent seeds for a renderer, the same for the same key."""
    return [int(seed) >> 1 for seed in np.random.SeedSequence(key).generate_state(count)]


@dataclass(frozen=True)
class Views:
    """What the samples of each pass show.

    Attributes
    ----------
    seeds : list of int
        Seed of each pass.
    seen : list of Seen
        For each pass.
    edge : ndarray of bool of shape (Y, X)
        Pixels that show more than one row.
    """

    sampling: Sampling
    seeds: list[int]
    seen: list[Seen]
    edge: NDArray[np.bool_]


def views_of(scene: LoadedScene, sampling: Sampling, seeds: list[int], rows: Sequence[int]) -> Views:
    """Find out which samples show which of the given material rows."""
    seen: list[Seen] = []
    lowest: NDArray[np.int64] | None = None
    highest: NDArray[np.int64] | None = None
    a = sampling.scale
    for seed in seeds:
        rows_seen = scene.rows_seen(seed=seed, scale=a)
        height, width = rows_seen.shape[0] // a, rows_seen.shape[1] // a
        blocks = rows_seen.reshape(height, a, width, a)
        low, high = blocks.min(axis=(1, 3)), blocks.max(axis=(1, 3))
        lowest = low if lowest is None else np.minimum(lowest, low)
        highest = high if highest is None else np.maximum(highest, high)
        here = {}
        for row in rows:
            small = np.flatnonzero(rows_seen == row)
            here[row] = (small, (small // (a * width) // a) * width + small % (a * width) // a)
        seen.append(here)
    assert lowest is not None
    assert highest is not None
    return Views(sampling, seeds, seen, lowest != highest)


@dataclass
class Layers:
    """An image, and the share of it that each fluorescent material shows.

    Attributes
    ----------
    image : ndarray of shape (Y, X, N)
        W m-2 sr-1 nm-1.
    light : dict of int to ndarray of shape (Y, X, N)
        By material row, the illumination E of that material times the share of the pixel it fills.
    surplus : ndarray of shape (Y, X, N), optional
        The share 1 - S / albedo of what is seen of materials whose S is too small to divide by, and which were
        rendered with a larger albedo; None where there are none.
    """

    image: Pixels
    light: dict[int, Pixels] = field(default_factory=dict)
    surplus: Pixels | None = None

    def without(self, source: Layers) -> Layers:
        """Take out what is seen of lamps themselves, and what a larger albedo than S has added to the rest."""
        image = self.image - source.image
        if self.surplus is not None and source.surplus is not None:
            image -= self.surplus - source.surplus
        return Layers(image, {row: e - source.light[row] for row, e in self.light.items()})

    def __sub__(self, other: Layers) -> Layers:
        return Layers(self.image - other.image, {row: e - other.light[row] for row, e in self.light.items()})


def render_bands(
    scene: LoadedScene,
    albedo: Array,
    reflectance: Array,
    emission: Array,
    views: Views,
    groups: Sequence[NDArray[np.int64]],
    *,
    depths: Mapping[str, int],
    timing: Timing,
    tick: Tick,
) -> list[Layers]:
    """Render all groups of bands, at one depth after the other before the next group.

    Parameters
    ----------
    albedo, reflectance : ndarray of shape (rows, N)
        What the renderer is given, and S: they differ where S is too small to divide by.
    emission : ndarray of shape (emitters, N)
    views : Views
        Its rows are the materials whose share of the image, as illumination, is wanted.
    depths : mapping of str to int
        Each `max_depth`, by a name for its time.
    timing : callable
        Given that name, a context manager around each render.

    Returns
    -------
    list of Layers
        One for each depth. Bands in no group are 0.
    """
    offers = scene if isinstance(scene, OffersIrradiance) else None
    if offers:
        albedo = reflectance  # nothing is divided by it
    sums = [_Sum(views, albedo, reflectance) for _ in depths]
    for seed, seen in zip(views.seeds, views.seen, strict=True):
        for group in groups:
            for into, (name, depth) in zip(sums, depths.items(), strict=True):
                with timing(name):
                    options = {"max_depth": depth, "seed": seed, "scale": views.sampling.scale}
                    small = scene.render(albedo[:, group], emission[:, group], **options)
                    into.add_image(group, small)
                    if offers is None:
                        into.add_light(group, seen, small, divided=True)
                    elif depth != 1:  # at that depth nothing is illuminated yet
                        light = offers.illumination(albedo[:, group], emission[:, group], **options)
                        into.add_light(group, seen, light, divided=False)
                tick()
    return [into.layers() for into in sums]


class _Sum:
    """What the samples of an image add up to."""

    def __init__(self, views: Views, albedo: Array, reflectance: Array) -> None:
        self.albedo, self.reflectance = albedo, reflectance
        self.scale, self.share = views.sampling.scale, 1.0 / views.sampling.samples
        self.shape = (*views.edge.shape, albedo.shape[1])
        self.image = self.zeros()
        self.light = {row: self.zeros() for row in views.seen[0]}
        self.surplus: Pixels | None = None

    def zeros(self) -> Pixels:
        return np.zeros((self.shape[0] * self.shape[1], self.shape[2]), dtype=np.float32)

    def add_image(self, group: NDArray[np.int64], small: Pixels) -> None:
        height, width, _ = self.shape
        blocks = small.reshape(height, self.scale, width, self.scale, len(group))
        summed = blocks.sum(axis=(1, 3), dtype=np.float64).reshape(-1, len(group))
        self.image[:, group] += (self.share * summed).astype(np.float32)

    def add_light(self, group: NDArray[np.int64], seen: Seen, small: Pixels, *, divided: bool) -> None:
        """Add what each material shows, `divided` by its albedo, or illumination as it is."""
        flat = small.reshape(-1, len(group))
        for row, (at, pixel) in seen.items():
            for k, band in enumerate(group):
                per_pixel = self.share * np.bincount(pixel, flat[at, k], minlength=len(self.image))
                if divided:
                    excess = 1 - self.reflectance[row, band] / self.albedo[row, band]
                    if excess > 0:
                        self.surplus = self.zeros() if self.surplus is None else self.surplus
                        self.surplus[:, band] += (excess * per_pixel).astype(np.float32)
                    per_pixel /= self.albedo[row, band]
                self.light[row][:, band] += per_pixel.astype(np.float32)

    def layers(self) -> Layers:
        light = {row: e.reshape(self.shape) for row, e in self.light.items()}
        surplus = None if self.surplus is None else self.surplus.reshape(self.shape)
        return Layers(self.image.reshape(self.shape), light, surplus)
