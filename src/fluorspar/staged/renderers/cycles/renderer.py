"""Cycles as a renderer of three bands: Blender runs as a process of its own."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fluorspar.blender.process import PATIENCE, BlenderProcess
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import usable_cores, use_variant
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.emitters.patches import EmitterArray
from fluorspar.staged.renderers.cycles.loaded_scene import CyclesScene
from fluorspar.staged.renderers.cycles.plan import notice_of_shapes
from fluorspar.staged.renderers.mitsuba.mesh import surface_mesh
from fluorspar.staged.renderers.mitsuba.renderer import VARIANTS

__all__ = ["CyclesRenderer"]

_INSIDE = Path(__file__).with_name("inside_blender")


class CyclesRenderer:
    """Three linear bands at a time, with Cycles in a Blender that is started for each session.

    Parameters
    ----------
    blender : str or path, optional
        Blender 3.4 or newer, or a Python that has `bpy`; default: the environment variable `BLENDER`, else the
        `blender` of the search path.
    patience : float
        Seconds without any sign of life after which Blender counts as hung.

    Examples
    --------
    >>> CyclesRenderer().max_bands
    3
    """

    max_bands = 3

    def __init__(self, blender: str | os.PathLike[str] | None = None, patience: float = PATIENCE) -> None:
        self._blender, self._patience = blender, patience
        self._process: BlenderProcess | None = None
        self._meshes: dict[int, TriangleMesh] = {}
        self._scenes: list[CyclesScene] = []
        self._threads = 1

    @property
    def seconds(self) -> float:
        """Time that Cycles has rendered in this session or the last one, with its own preparations."""
        return sum(loaded.seconds for loaded in self._scenes)

    @contextmanager
    def session(self, threads: int | None = None) -> Iterator[None]:
        """Start Blender for a while.

        Raises
        ------
        RendererError
            If there is no Blender, it is too old, or it does not start.
        """
        self._threads = threads or usable_cores()
        self._meshes.clear()
        self._scenes.clear()
        with (
            BlenderProcess(_INSIDE, self._blender, self._patience) as self._process,
            use_variant(VARIANTS["llvm"]),  # it reads shapes
        ):
            try:
                yield
            finally:
                self._process = None

    def load(
        self, scene: Scene, array: EmitterArray | None = None, *, keep_object: bool = True
    ) -> CyclesScene:
        """Load the scene, see `fluorspar.staged.renderers.protocol.Renderer`.

        Warns
        -----
        SceneNotice
            If a shape is not a mesh and becomes one.
        """
        if array is None:
            notice_of_shapes(scene)
        return self._load(scene, array, keep_object, by_patch=True)

    def load_faces(self, scene: Scene, array: EmitterArray, *, keep_object: bool = True) -> CyclesScene:
        """Load the scene, see `fluorspar.staged.renderers.protocol.EmitsPerFace`."""
        return self._load(scene, array, keep_object, by_patch=False)

    def _load(
        self, scene: Scene, array: EmitterArray | None, keep_object: bool, *, by_patch: bool
    ) -> CyclesScene:
        assert self._process is not None
        meshes = [self.mesh(scene, number) for number in range(len(scene.surfaces))]
        loaded = CyclesScene(
            self._process,
            len(self._scenes),
            scene,
            meshes,
            array,
            keep_object=keep_object,
            by_patch=by_patch,
            threads=self._threads,
        )
        self._scenes.append(loaded)
        return loaded

    def mesh(self, scene: Scene, surface: int) -> TriangleMesh:
        """Triangles of a surface in world coordinates; a session is for one scene.

        Raises
        ------
        SceneError
            If the shape has no area.
        """
        if surface not in self._meshes:
            self._meshes[surface] = surface_mesh(scene, surface)
        return self._meshes[surface]
