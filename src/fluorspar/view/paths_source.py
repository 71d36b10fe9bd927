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
    """Light paths of a scene, perhaps of several numbers of samples, the last of which has the most.

    Parameters
    ----------
    name : str
    job : RenderJob
        What is traced.
    supplies : Supplies
    levels : tuple of LightPaths
        What was traced of it.
    """

    kind = "paths"

    def __init__(
        self, name: str, job: RenderJob, supplies: Supplies, levels: tuple[LightPaths, ...] = ()
    ) -> None:
        self.name, self.supplies, self.levels = name, supplies, levels
        self._job = job

    @property
    def job(self) -> RenderJob:
        """What is traced."""
        return self._job

    @property
    def generation(self) -> int:
        """The number of levels."""
        return len(self.levels)

    @property
    def samples(self) -> int:
        """Samples per pixel of the last level."""
        return self.levels[-1].job.scene.settings.spp if self.levels else 0

    def image(self, relight: Relight, coarse: bool, progress: Progress | None = None) -> KeptImage:
        """Sweep the paths.

        Raises
        ------
        NotTraced
            If there are none yet.
        FluorsparError
            If a light or material cannot be what it is to be, see `LightPaths.image`.
        """
        levels = self.levels
        if not levels:
            self.explain_nothing()
        changes: dict[str, Any] = {}
        if not relight.is_nothing:
            changes = changes_of(self.job.scene, relight, self.supplies)
        if not coarse:
            return KeptImage(levels[-1].image(**changes, progress=progress), len(levels))
        few = next((paths for paths in reversed(levels) if _samples(paths) <= _COARSE_SAMPLES), levels[0])
        image = few.image(**changes, wavelengths=coarse_grid(self.job.grid), progress=progress)
        return KeptImage(image, len(levels))

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


def _samples(paths: LightPaths) -> int:
    settings = paths.job.scene.settings
    return settings.width * settings.height * settings.spp


def coarse_grid(grid: Wavelengths) -> Wavelengths:
    """A grid from the same first wavelength, in steps of about 20 nm.

    Examples
    --------
    >>> coarse_grid(Wavelengths(360, 700, 5))
    Wavelengths(start=360.0, stop=700.0, step=20.0)
    """
    step = grid.step * max(1, round(_COARSE_STEP / grid.step))
    return Wavelengths(grid.start, grid.start + step * int((grid.stop - grid.start + 1e-6) // step), step)
