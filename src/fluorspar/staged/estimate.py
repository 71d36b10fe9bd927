"""Render with the staged method: the steps of the paper, on a renderer that is a black box."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fluorspar
from fluorspar.errors import ApproximationWarning, FluorsparWarning
from fluorspar.image.components import COMPONENTS, SINGLE_BOUNCE
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.progress import Progress
from fluorspar.scene.scene import UNLIMITED, Scene
from fluorspar.scene.surfaces import NO_LIGHT
from fluorspar.spectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.emission import emitter_arrays, patch_illumination, refine
from fluorspar.staged.equations import (
    indirect_reflection,
    luminescence,
    luminescent_reflection,
    total,
)
from fluorspar.staged.imaging import (
    Layers,
    Sampling,
    Views,
    band_groups,
    plan_samples,
    render_bands,
    seeds_of,
    views_of,
)
from fluorspar.staged.intermediate import Intermediate
from fluorspar.staged.mitsuba_renderer import MitsubaRenderer
from fluorspar.staged.options import ALBEDO_FLOOR, StagedOptions
from fluorspar.staged.patches import EmitterArray
from fluorspar.staged.protocol import LoadedScene, Renderer
from fluorspar.staged.timings import FIRST, Stopwatch

__all__ = ["render_staged"]

Array = NDArray[np.float64]
_COMPILE_FROM = 16  # renders of a pass, from which one more does not matter
_ADAPTIVE_STREAM = 1 << 16  # seeds of the adaptive subdivision, away from those of the repeats


def render_staged(
    scene: Scene,
    grid: Wavelengths,
    *,
    seed: int = 0,
    options: StagedOptions | None = None,
    stokes: Stokes = "half",
    threads: int | None = None,
    progress: Progress | None = None,
    renderer: Renderer | None = None,
) -> SpectralImage:
    """Render components 0 to 5 (and 6 with `bounces` of 2 or more) by the paper's procedure.

    Parameters
    ----------
    scene
        What to render; size, samples and depths are those of `scene.settings`. Samples are rounded up to what
        the repeats and square small pixels need; the attribute `spp` says how many were taken.
    grid
        Wavelengths.
    seed
        Same seed, same image.
    options
        See `StagedOptions`.
    stokes
        Weight of excitation at the emission wavelength itself, see `DonaldsonMatrix`.
    threads
        Default: all cores this process may use.
    progress
        Called with the renders done and the renders in all.
    renderer
        Default: Mitsuba in its variant llvm.

    Returns
    -------
    SpectralImage
        `standard_error` is that of the mean of the repeats and missing for a single one; it does not hold the
        error that a finite number of emitters makes. Attributes `single_bounce` (1, or 0 with component 6),
        `timings` (each pass relative to component 1), `emitters` (by object, their number).

    Raises
    ------
    OptionError, MaterialError, SceneError
        If an option is out of range, or a material or a fluorescent surface cannot be used.

    Warns
    -----
    ApproximationWarning
        If the depth is limited to something between 3 and infinity: component 5 then holds longer paths too,
        because depth counts anew from the emitters.

    Notes
    -----
    Components 1 and 3: `max_depth` 2, unlimited depth with the same seed, and their difference, each without
    the directly seen lamp. E = y / S (Eq. 11) per material and sample, so pixels that show several materials
    need no care. Components 2 and 4: Eqs. 7 and 9. Component 5: each fluorescent surface becomes an array of
    area lights (Eq. 10). The sum is Eq. 13.

    Examples
    --------
    >>> from fluorspar.scene.scene import load_scene
    >>> scene = load_scene("cornell-box").with_settings(width=8, height=8, spp=4)
    >>> options = StagedOptions(emitters=2, patch_samples=64, repeats=1)
    >>> image = render_staged(scene, Wavelengths(400, 700, 50), options=options)
    >>> image.components[-1], image.attrs["emitters"]
    ('luminescent_reflection', {'right-wall': 4, 'left-wall': 4})
    """
    options = options or StagedOptions()
    renderer = renderer or MitsubaRenderer()
    matrices = [made.on(grid, stokes=stokes) for made in scene.materials]
    depth = scene.settings.max_depth
    if depth > 2:
        warnings.warn(
            f"max_depth {depth}: the staged method counts depth anew from each emitter of component 5, "
            "which therefore holds longer paths too",
            ApproximationWarning,
            stacklevel=2,
        )
    with renderer.session(threads):
        return _Staged(scene, grid, matrices, renderer, options, seed, progress).render()


@dataclass
class _Object:
    """A fluorescent surface as emitters, and the scene in which they are the only lights."""

    name: str
    array: EmitterArray
    scene: LoadedScene
    glows: bool


@dataclass
class _Staged:
    """The procedure for one scene; each method is one step."""

    scene: Scene
    grid: Wavelengths
    matrices: list[DonaldsonMatrix]
    renderer: Renderer
    options: StagedOptions
    seed: int
    progress: Progress | None
    watch: Stopwatch = field(default_factory=Stopwatch)
    done: int = 0
    compiled: set[tuple[int, int]] = field(default_factory=set)

    def __post_init__(self) -> None:
        settings, bands = self.scene.settings, len(self.grid)
        self.depth = settings.max_depth
        self.bounces = self.options.bounces if self.depth == UNLIMITED or self.depth > 2 else 0
        per_repeat = math.ceil(settings.spp / self.options.repeats)
        self.sampling: Sampling = plan_samples(per_repeat, settings.width, settings.height)
        self.reflectance = np.clip([matrix.reflectance for matrix in self.matrices], 0.0, 1.0)
        glowing = np.array([matrix.is_fluorescent for matrix in self.matrices])
        self.fluorescent = np.flatnonzero(glowing).tolist()
        self.albedo = np.where(
            glowing[:, np.newaxis], np.maximum(self.reflectance, ALBEDO_FLOOR), self.reflectance
        )
        self.lights = np.array([light.spectrum.on(self.grid) for light in self.scene.lights])
        self.every = band_groups(range(bands), self.renderer.max_bands)
        density = np.array([matrix.density() != 0 for matrix in self.matrices])
        self.exciting = band_groups(np.flatnonzero(density.any(axis=(0, 1))), self.renderer.max_bands)
        self.emitted = band_groups(np.flatnonzero(density.any(axis=(0, 2))), self.renderer.max_bands)
        self.kept = Intermediate(self.options.keep_intermediate, self.grid)

    @cached_property
    def base(self) -> LoadedScene:
        return self.renderer.load(self.scene)

    def render(self) -> SpectralImage:
        objects = self.objects() if self.bounces else []
        names = COMPONENTS if self.bounces > 1 else SINGLE_BOUNCE
        repeats = self.options.repeats
        mean = np.zeros(0, dtype=np.float32)
        totals: list[NDArray[np.float32]] = []
        for repeat in range(repeats):
            try:
                components = self.repeat(repeat, objects)[: len(names)]
            except KeyboardInterrupt:
                if not totals:
                    raise
                warnings.warn(
                    f"interrupted: {len(totals)} of {repeats} repeats are finished",
                    FluorsparWarning,
                    stacklevel=3,
                )
                break
            mean = mean + components if totals else components
            totals.append(total(list(components)).astype(np.float32))
        done = len(totals)
        mean /= done
        error = np.std(totals, axis=0, ddof=1) / math.sqrt(done) if done > 1 else None
        attrs: dict[str, Any] = {
            "version": fluorspar.__version__,
            "method": "staged",
            "spp": self.sampling.samples * done,
            "seed": self.seed,
            "max_depth": self.depth,
            "rr_depth": self.scene.settings.rr_depth,
            "repeats": done,
            "stokes": self.matrices[0].stokes,
            "single_bounce": int(len(names) == len(SINGLE_BOUNCE)),
            "scene": self.scene.name,
            "materials": {made.name: made.credit for made in self.scene.materials},
            "emitters": {item.name: len(item.array) for item in objects},
            "timings": self.watch.relative(),
        }
        return SpectralImage.from_arrays(mean, self.grid, error, attrs, components=names)

    def objects(self) -> list[_Object]:
        """Cut fluorescent surfaces into emitters, and load a scene for each."""
        arrays = emitter_arrays(self.renderer, self.scene, self.matrices, self.options)
        found = []
        for number, array in enumerate(arrays):
            surface = self.scene.surfaces[array.surface]
            glows = surface.light != NO_LIGHT
            if self.options.tolerance is not None and array.copy is None:
                with self.watch.timing("subdivision"):
                    array = self.subdivided(array, number, glows)
            loaded = self.renderer.load(
                self.scene, array, keep_object=not self.options.exclude_emitter_geometry
            )
            name = surface.name + (" (back)" if array.back else "")
            found.append(_Object(name, array, loaded, glows))
        return found

    def subdivided(self, array: EmitterArray, number: int, glows: bool) -> EmitterArray:
        def probe(cut: EmitterArray, samples: int, stream: int) -> Array:
            return patch_illumination(
                self.base,
                cut,
                self.albedo,
                self.lights,
                self.exciting,
                samples=samples,
                max_depth=self.depth,
                seed=seeds_of(self.seed, _ADAPTIVE_STREAM + number, stream, count=1)[0],
                glows=glows,
            )

        tolerance = self.options.tolerance
        assert tolerance is not None
        samples = max(1, self.options.patch_samples // 16)
        cut, error = refine(array, self.matrices[array.row], probe, tolerance=tolerance, samples=samples)
        if error > tolerance:
            name = self.scene.surfaces[array.surface].name
            warnings.warn(
                f"'{name}': with {len(cut)} emitters, the most there may be, the "
                f"estimated error is {error:.3g}, above the tolerance of {tolerance:g}",
                ApproximationWarning,
                stacklevel=2,
            )
        return cut

    def repeat(self, repeat: int, objects: Sequence[_Object]) -> NDArray[np.float32]:
        """Components 0 to 6 from one set of seeds, ndarray of shape (7, Y, X, N)."""
        seeds = seeds_of(self.seed, repeat, count=self.sampling.passes)
        views = views_of(self.base, self.sampling, seeds, self.fluorescent)
        # the extra seed is for the emitters: their light must not be estimated with the camera's paths
        spare = seeds_of(self.seed, repeat, 1, count=2)
        names = ("source", FIRST, "components 1 and 3")
        depths = (1, 2, self.depth)
        images: list[Layers] = []
        for name, depth in zip(names, depths, strict=True):
            if depth != UNLIMITED and self.depth != UNLIMITED and depth > self.depth:
                depth = self.depth
            self.compile(self.base, self.lights, depth)
            with self.watch.timing(name):
                images.append(self.picture(self.base, self.albedo, self.lights, views, self.every, depth))
        source, direct, everything = images[0], images[1] - images[0], images[2] - images[0]

        with self.watch.timing("components 2 and 4"):
            light_i = {
                row: indirect_reflection(everything.light[row], direct.light[row]) for row in self.fluorescent
            }
            y2 = self.luminesced(direct.light, views)
            y4 = self.luminesced(light_i, views)
        if repeat == 0:
            for row in self.fluorescent:
                name = self.scene.materials[row].name
                self.kept.image(f"E_D {name}", direct.light[row])
                self.kept.image(f"E_I {name}", light_i[row])
        y5, y6 = self.mutual(repeat, objects, views, spare)
        y3 = indirect_reflection(everything.image, direct.image)
        return np.stack(
            [source.image, direct.image, y2, y3, y4, y5, y6], dtype=np.float32, casting="same_kind"
        )

    def picture(
        self,
        scene: LoadedScene,
        albedo: Array,
        emission: Array,
        views: Views,
        groups: Sequence[NDArray[np.int64]],
        depth: int,
    ) -> Layers:
        return render_bands(
            scene, albedo, self.reflectance, emission, views, groups, max_depth=depth, tick=self.tick
        )

    def compile(self, scene: LoadedScene, emission: Array, depth: int) -> None:
        """Render once before the clock runs, where that is a small part of the work: renderers compile."""
        key = (id(scene), depth)
        if (
            key in self.compiled
            or len(self.every) * self.sampling.passes * self.options.repeats < _COMPILE_FROM
        ):
            return
        self.compiled.add(key)
        group, scale = self.every[0], self.sampling.scale
        scene.render(self.albedo[:, group], emission[:, group], max_depth=depth, seed=0, scale=scale)

    def luminesced(self, light: Mapping[int, NDArray[np.floating]], views: Views) -> Array:
        """What the materials the camera sees make of the light that falls on them (Eqs. 7 and 9)."""
        y = np.zeros((*views.edge.shape, len(self.grid)))
        for row, illumination in light.items():
            y += luminescence(self.matrices[row], illumination)
        return _filtered(y, views.edge) if self.options.filter_edges else y

    def mutual(
        self, repeat: int, objects: Sequence[_Object], views: Views, spare: Sequence[int]
    ) -> tuple[Array, Array]:
        """Components 5 and 6: light that luminesced on other surfaces first (Eq. 10, and VIII-A)."""
        y5 = np.zeros((*views.edge.shape, len(self.grid)))
        y6 = np.zeros_like(y5)
        samples = max(1, self.options.patch_samples // self.options.repeats)
        emission: list[Array] = []
        for number, item in enumerate(objects):
            with self.watch.timing("light on emitters"):
                light = self.on_patches(self.base, item, self.lights, samples, spare[0] + number)
                emission.append(luminescence(self.matrices[item.array.row], light))
            if repeat == 0:
                self.kept.patches(f"L_F {item.name}", item.array, light, emission[-1])
        for bounce in range(1, self.bounces + 1):
            last = bounce == self.bounces
            renders, light_f = [], dict.fromkeys(self.fluorescent, np.zeros(()))
            for item, emitted in zip(objects, emission, strict=True):
                shown = self.emitter_render(item, emitted, views, bounce, layers=not last)
                renders.append(shown.image)
                if repeat == 0:
                    order = "" if bounce == 1 else f" {bounce}"
                    self.kept.image(f"emitters{order} {item.name}", shown.image)
                if not last:
                    light_f = {row: e + shown.light[row] for row, e in light_f.items()}
            reflected = luminescent_reflection(renders) if renders else np.zeros_like(y5)
            if bounce == 1:
                y5 = reflected
            else:
                y6 += reflected
            if not last and objects:
                y6 += self.luminesced(light_f, views)
                with self.watch.timing("light on emitters"):
                    emission = self.next_emission(objects, emission, samples, spare[1] + bounce)
        return y5, y6

    def on_patches(
        self, scene: LoadedScene, item: _Object, emission: Array, samples: int, seed: int
    ) -> Array:
        """E on the patches of an object, (K, N)."""
        return patch_illumination(
            scene,
            item.array,
            self.albedo,
            emission,
            self.exciting,
            samples=samples,
            max_depth=self.depth,
            seed=seed,
            glows=item.glows or scene is not self.base,
        )

    def emitter_render(
        self, item: _Object, emitted: Array, views: Views, bounce: int, *, layers: bool
    ) -> Layers:
        """What the emitters of one object show in the scene, without being seen themselves."""
        radiance = np.maximum(emitted, 0.0) * item.array.gain[:, np.newaxis]
        for depth in (self.depth, 1):
            self.compile(item.scene, radiance, depth)
        rows = self.fluorescent if layers else []
        with self.watch.timing(f"component {5 if bounce == 1 else 6}: {item.name}"):
            seen = Views(views.sampling, views.seeds, [{}] * len(views.seeds), views.edge)
            if layers:
                seen = views_of(item.scene, views.sampling, views.seeds, rows)
            albedo = self.albedo if layers else self.reflectance
            everything, itself = (
                self.picture(item.scene, albedo, radiance, seen, self.emitted, depth)
                for depth in (self.depth, 1)
            )
            return everything - itself

    def next_emission(
        self, objects: Sequence[_Object], emission: Sequence[Array], samples: int, seed: int
    ) -> list[Array]:
        """What each object emits in the light of all objects' emitters."""
        new = []
        for item in objects:
            light = np.zeros((len(item.array), len(self.grid)))
            for other, emitted in zip(objects, emission, strict=True):
                radiance = np.maximum(emitted, 0.0) * other.array.gain[:, np.newaxis]
                light += self.on_patches(other.scene, item, radiance, samples, seed)
            new.append(luminescence(self.matrices[item.array.row], light))
        return new

    def tick(self) -> None:
        self.done += 1
        if self.progress:
            objects = sum(row in (s.front, s.back) for s in self.scene.surfaces for row in self.fluorescent)
            passes = 3 * len(self.every) + 2 * self.bounces * objects * len(self.emitted)
            every = passes * self.sampling.passes * self.options.repeats
            self.progress(min(self.done, every), every)


def _filtered(image: Array, edge: NDArray[np.bool_]) -> Array:
    """Median over 3 x 3 pixels where a pixel shows two surfaces (section VIII-A of the paper)."""
    from scipy.ndimage import median_filter

    return np.where(edge[..., np.newaxis], median_filter(image, size=(3, 3, 1), mode="nearest"), image)
