"""Light paths that are looked at: images of any lights and materials follow from them."""

from __future__ import annotations

from typing import Any

from fluorspar.errors import FluorsparError, message
from fluorspar.image.components import COMPONENTS
from fluorspar.image.dataset import UNITS
from fluorspar.job import RenderJob
from fluorspar.paths.light_paths import LightPaths
from fluorspar.progress import Progress
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.questions import Relight
from fluorspar.view.relighting import changes_of
from fluorspar.view.scene_facts import light_facts, surface_facts
from fluorspar.view.sources import component_facts
from fluorspar.view.supplies import Supplies
from fluorspar.view.turns import Turns

__all__ = ["NotTraced", "PathsSource"]

_COARSE_SAMPLES = 2**18  # of all pixels: enough to see what a slider does


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
        if coarse:
            settings = self.job.scene.settings
            changes["samples"] = max(1, _COARSE_SAMPLES // (settings.width * settings.height))
        return KeptImage(levels[-1].image(**changes, progress=progress), len(levels))

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
