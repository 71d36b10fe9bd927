"""Light paths that are looked at: images of any lights and materials follow from them."""

from __future__ import annotations

from typing import Any

from fluorspar.errors import FluorsparError, message
from fluorspar.image.components import COMPONENTS
from fluorspar.image.dataset import UNITS
from fluorspar.job import RenderJob
from fluorspar.paths.light_paths import LightPaths
from fluorspar.progress import Progress
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.view.joining import joined
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.questions import Relight
from fluorspar.view.relighting import changes_of
from fluorspar.view.scene_facts import light_facts, surface_facts
from fluorspar.view.sources import component_facts
from fluorspar.view.supplies import Supplies
from fluorspar.view.turns import Turns

__all__ = ["NotTraced", "PathsSource", "coarse_grid"]

_COARSE_STEP = 20.0  # nm
_COARSE_SAMPLES = 2**20  # of all pixels: enough to see what a slider does


class NotTraced(FluorsparError):
    """There is no light path of a scene yet."""


class PathsSource:
    """Light paths of a scene, in one or several passes of different seeds.

    Parameters
    ----------
    name : str
    job : RenderJob
        What is traced.
    supplies : Supplies
    passes : tuple of LightPaths
        What was traced of it.
    """

    kind = "paths"

    def __init__(
        self, name: str, job: RenderJob, supplies: Supplies, passes: tuple[LightPaths, ...] = ()
    ) -> None:
        self.name, self.supplies, self.passes = name, supplies, passes
        self._job = job

    @property
    def job(self) -> RenderJob:
        """What is traced."""
        return self._job

    @property
    def generation(self) -> int:
        """The number of passes."""
        return len(self.passes)

    @property
    def samples(self) -> int:
        """Samples per pixel of all passes."""
        return sum(paths.job.scene.settings.spp for paths in self.passes)

    def image(
        self, relight: Relight, coarse: bool, before: KeptImage | None, progress: Progress | None = None
    ) -> KeptImage:
        """Sweep the paths; to the image before only what passes add to it.

        Raises
        ------
        NotTraced
            If there are none yet.
        FluorsparError
            If a light or material cannot be what it is to be, see `LightPaths.image`.
        """
        passes = self.passes
        if not passes:
            self.explain_nothing()
        changes: dict[str, Any] = {}
        if not relight.is_nothing:
            changes = changes_of(self.job.scene, relight, self.supplies)
        if coarse:
            few, changes = self._first_of(passes), changes | {"wavelengths": coarse_grid(self.job.grid)}
            images = [paths.image(**changes, progress=progress) for paths in few]
        else:
            begun = 0 if before is None else before.generation
            known = [] if before is None else [before.image]
            images = [*known, *(paths.image(**changes, progress=progress) for paths in passes[begun:])]
        return KeptImage(joined(images), len(passes))

    def explain_nothing(self) -> None:
        """Say why there is no path."""
        raise NotTraced(message("the scene is being traced: there is no picture yet", where=self.name))

    def about(self) -> dict[str, Any]:
        """Facts of the scene."""
        job = self.job
        settings = job.scene.settings
        return {
            "size": (settings.width, settings.height),
            "wavelengths": job.grid.values,
            "unit": UNITS,
            "components": component_facts(COMPONENTS),
            "standard_error": True,
            "partial": False,
            "attrs": job.attrs | {"spp": self.samples},
            "lights": light_facts(job.scene),
            "surfaces": surface_facts(job.scene),
        }

    def progress(self) -> dict[str, Any]:
        """Nothing goes on."""
        return {"generation": self.generation, "progress": None, "error": None}

    def start(self, turns: Turns) -> None:
        """Nothing begins."""

    def stop(self) -> None:
        """Nothing ends."""

    def _first_of(self, passes: tuple[LightPaths, ...]) -> tuple[LightPaths, ...]:
        """As many passes as a coarse picture needs, at least one."""
        settings, samples = self.job.scene.settings, 0
        for number, paths in enumerate(passes):
            samples += settings.width * settings.height * paths.job.scene.settings.spp
            if samples >= _COARSE_SAMPLES:
                return passes[: number + 1]
        return passes


def coarse_grid(grid: Wavelengths) -> Wavelengths:
    """A grid from the same first wavelength, in steps of about 20 nm.

    Examples
    --------
    >>> coarse_grid(Wavelengths(360, 700, 5))
    Wavelengths(start=360.0, stop=700.0, step=20.0)
    """
    step = grid.step * max(1, round(_COARSE_STEP / grid.step))
    return Wavelengths(grid.start, grid.start + step * int((grid.stop - grid.start + 1e-6) // step), step)
