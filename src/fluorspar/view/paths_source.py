"""Light paths that are looked at: images of any lights and materials follow from them."""

from __future__ import annotations

from functools import cached_property
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

_COARSE_SAMPLES = 2**19  # of all pixels: enough to see what a slider does


class NotTraced(FluorsparError):
    """There is no light path of a scene yet."""


class PathsSource:
    """Light paths of a scene.

    Parameters
    ----------
    name : str
    job : RenderJob
        What is traced.
    supplies : Supplies
    paths : LightPaths, optional
        What was traced of it.

    Attributes
    ----------
    generation : int
        How often there were paths, each time of more samples.
    """

    kind = "paths"

    def __init__(
        self, name: str, job: RenderJob, supplies: Supplies, paths: LightPaths | None = None
    ) -> None:
        self.name, self.supplies = name, supplies
        self.paths, self.generation = paths, int(paths is not None)
        self._job = job

    @property
    def job(self) -> RenderJob:
        """What is traced."""
        return self._job

    @property
    def samples(self) -> int:
        """Samples per pixel of the paths there are."""
        return 0 if self.paths is None else self.paths.job.scene.settings.spp

    def image(self, relight: Relight, coarse: bool, progress: Progress | None = None) -> KeptImage:
        """Sweep the paths.

        Raises
        ------
        NotTraced
            If there are none yet.
        FluorsparError
            If a light or material cannot be what it is to be, see `LightPaths.image`.
        """
        generation, paths = self.generation, self.paths
        if paths is None:
            raise self.why_nothing()
        changes: dict[str, Any] = {}
        if not relight.is_nothing:
            changes = changes_of(self.job.scene, relight, self.supplies)
        if coarse:
            settings = self.job.scene.settings
            changes["samples"] = max(1, _COARSE_SAMPLES // (settings.width * settings.height))
        return KeptImage(paths.image(**changes, progress=progress), generation)

    def why_nothing(self) -> FluorsparError:
        """Why there is no path."""
        return NotTraced(message("the scene is being traced: there is no picture yet", where=self.name))

    def about(self) -> dict[str, Any]:
        """Facts of the scene."""
        job = self.job
        width, height = job.scene.settings.width, job.scene.settings.height
        return {
            "size": (width, height),
            "wavelengths": job.grid.values,
            "unit": UNITS,
            "components": component_facts(COMPONENTS),
            "standard_error": True,
            "partial": self.paths is not None and self.paths.pixels < width * height,
            "attrs": job.attrs | {"spp": self.samples},
            **self._scene_facts,
        }

    @cached_property
    def _scene_facts(self) -> dict[str, Any]:
        scene = self.job.scene
        return {"lights": light_facts(scene), "surfaces": surface_facts(scene)}

    def progress(self) -> dict[str, Any]:
        """Nothing goes on."""
        return {"generation": self.generation, "progress": None, "error": None}

    def start(self, turns: Turns) -> None:
        """Nothing begins."""

    def stop(self) -> None:
        """Nothing ends."""
