"""What all steps of a staged render share: spectra, samples, band groups, clock and progress."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneNotice
from fluorspar.job import RenderJob
from fluorspar.progress import Progress
from fluorspar.scene.settings import UNLIMITED
from fluorspar.staged.equations import luminescence
from fluorspar.staged.imaging import Layers, Sampling, Timing, Views, band_groups, plan_samples, render_bands
from fluorspar.staged.intermediate import Intermediate
from fluorspar.staged.options import ALBEDO_FLOOR, StagedOptions
from fluorspar.staged.renderers.protocol import LoadedScene, Renderer
from fluorspar.staged.timings import Stopwatch

__all__ = ["Passes"]

Array = NDArray[np.float64]
Groups = Sequence[NDArray[np.int64]]
_COMPILE_FROM = 16  # renders of a pass, from which one more does not matter


@dataclass
class Passes:
    """The renders of one scene, and what they need."""

    job: RenderJob
    renderer: Renderer
    progress: Progress | None
    watch: Stopwatch = field(default_factory=Stopwatch)
    done: int = 0
    expected: int = 0
    compiled: set[tuple[int, int]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.scene, self.grid, self.seed = self.job.scene, self.job.computed_grid, self.job.seed
        self.options: StagedOptions = self.job.options or StagedOptions()
        self.matrices = self.job.matrices()
        settings, bands = self.scene.settings, len(self.grid)
        self.depth = settings.max_depth
        self.bounces = self.options.bounces if self.depth == UNLIMITED or self.depth > 2 else 0
        self.repeats = min(self.options.repeats, settings.spp)
        if self.repeats < self.options.repeats:
            text = f"{self.repeats} instead of {self.options.repeats} repeats: no more than samples per pixel"
            warnings.warn(text, SceneNotice, stacklevel=4)
        per_repeat = math.ceil(settings.spp / self.repeats)
        self.sampling: Sampling = plan_samples(per_repeat, settings.width, settings.height)
        self.reflectance = np.clip([matrix.reflectance for matrix in self.matrices], 0.0, 1.0)
        glowing = np.array([matrix.is_fluorescent for matrix in self.matrices])
        self.fluorescent = np.flatnonzero(glowing).tolist()
        self.albedo = np.where(
            glowing[:, np.newaxis], np.maximum(self.reflectance, ALBEDO_FLOOR), self.reflectance
        )
        self.lights = np.array(self.job.lights())
        self.every = band_groups(range(bands), self.renderer.max_bands)
        self.emitted, self.exciting = (
            band_groups(np.flatnonzero(np.any(bands, axis=0)), self.renderer.max_bands)
            for bands in zip(*(matrix.luminescent_bands for matrix in self.matrices), strict=True)
        )
        self.kept = Intermediate(self.options.keep_intermediate, self.job.grid, self.grid)

    @cached_property
    def base(self) -> LoadedScene:
        """The scene with its own lights."""
        return self.renderer.load(self.scene)

    def pictures(
        self,
        scene: LoadedScene,
        albedo: Array,
        emission: Array,
        views: Views,
        groups: Groups,
        depths: Mapping[str, int],
        timing: Timing = lambda name: nullcontext(),
    ) -> list[Layers]:
        """Render groups of bands, of all samples of a repeat, at some depths."""
        return render_bands(
            scene,
            albedo,
            self.reflectance,
            emission,
            views,
            groups,
            depths=depths,
            timing=timing,
            tick=self.tick,
        )

    def compile(self, scene: LoadedScene, emission: Array, depths: Mapping[str, int]) -> None:
        """Render once before the clock runs, where that is a small part of the work: renderers compile."""
        if len(self.every) * self.sampling.passes * self.repeats < _COMPILE_FROM:
            return
        group, scale = self.every[0], self.sampling.scale
        for depth in depths.values():
            if (id(scene), depth) not in self.compiled:
                self.compiled.add((id(scene), depth))
                scene.render(self.albedo[:, group], emission[:, group], max_depth=depth, seed=0, scale=scale)

    def luminesced(self, light: Mapping[int, NDArray[np.floating]], views: Views) -> Array:
        """What the materials the camera sees make of the light that falls on them (Eqs. 7 and 9)."""
        y = np.zeros((*views.edge.shape, len(self.grid)))
        for row, illumination in light.items():
            y += luminescence(self.matrices[row], illumination)
        return _filtered(y, views.edge) if self.options.filter_edges else y

    def expect(self, renders: int) -> None:
        """Announce work: renders of a group of bands, or light paths of a group from points."""
        self.expected += renders

    def tick(self) -> None:
        """Count one of them as done."""
        self.done += 1
        if self.progress:
            self.progress(self.done, max(self.done, self.expected))


def _filtered(image: Array, edge: NDArray[np.bool_]) -> Array:
    """Median over 3 x 3 pixels where a pixel shows two surfaces (section VIII-A of the paper)."""
    from scipy.ndimage import median_filter

    return np.where(edge[..., np.newaxis], median_filter(image, size=(3, 3, 1), mode="nearest"), image)
