"""A scene that Blender holds: its renders, split by the way of the light, and the light at points of surfaces."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.blender.process import BlenderProcess
from fluorspar.errors import RendererError, message
from fluorspar.scene.scene import Scene
from fluorspar.scene.settings import UNLIMITED
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.emitters.patches import EmitterArray
from fluorspar.staged.options import ALBEDO_FLOOR
from fluorspar.staged.renderers.cycles.passes_file import read_passes
from fluorspar.staged.renderers.cycles.plan import Frame, camera_plan, light_plans, mesh_plans
from fluorspar.staged.renderers.looking_around import directions

__all__ = ["CyclesScene"]

_BOUNCES = 1024  # the most that Blender takes
_PROBE = 1e-3  # edge of the triangles at which light is measured, in units of the frame

Array = NDArray[np.float64]
Pixels = NDArray[np.float32]


class CyclesScene:
    """See `fluorspar.staged.renderers.protocol.LoadedScene` and `OffersIrradiance`.

    One render of Cycles holds the lamps, the direct and the indirect light: the last one is kept, and answers for
    all depths.

    Attributes
    ----------
    seconds : float
        Time of Cycles itself so far.
    """

    def __init__(
        self,
        process: BlenderProcess,
        number: int,
        scene: Scene,
        meshes: Sequence[TriangleMesh],
        array: EmitterArray | None,
        *,
        keep_object: bool,
        by_patch: bool,
        threads: int,
    ) -> None:
        self._process, self._number, self._scene = process, number, scene
        self._emitter_of_face = array.patch_of_face if array is not None and by_patch else None
        self._frame = frame = Frame.of(meshes)
        self.seconds = 0.0
        self._kept: tuple[Any, dict[str, Pixels]] = (None, {})
        self._looked: Any = None
        self._seen: NDArray[np.bool_] = np.zeros(0, dtype=np.bool_)
        settings = scene.settings
        plan = {
            "size": (settings.width, settings.height),
            "threads": threads,
            "rr_depth": settings.rr_depth,
            "camera": camera_plan(scene, frame),
            "lights": light_plans(scene, frame) if array is None else [],
            "meshes": mesh_plans(process, scene, frame, meshes, array, keep_object),
        }
        file = process.name(".json")
        with open(file, "w", encoding="utf-8") as text:
            json.dump(plan, text)
        process.ask("load", number=number, file=file)

    def render(
        self, albedo: Array, emission: Array, *, max_depth: int, seed: int, scale: int
    ) -> NDArray[np.float32]:
        """See `fluorspar.staged.renderers.protocol.LoadedScene`."""
        bands = albedo.shape[1]
        passes = self._passes(albedo, emission, max_depth, seed, scale)
        source = (passes["emitted"] + passes["background"])[..., :bands]
        if max_depth == 1:
            return source
        reflectance = np.vstack([albedo, np.zeros(bands)]).astype(np.float32)  # the last for row -1
        light = self._illumination(passes, max_depth)[..., :bands]
        return source + reflectance[_rows(passes)] * light

    def illumination(
        self, albedo: Array, emission: Array, *, max_depth: int, seed: int, scale: int
    ) -> NDArray[np.float32]:
        """See `fluorspar.staged.renderers.protocol.OffersIrradiance`."""
        passes = self._passes(albedo, emission, max_depth, seed, scale)
        return self._illumination(passes, max_depth)[..., : albedo.shape[1]]

    def rows_seen(self, *, seed: int, scale: int) -> NDArray[np.int64]:
        """See `fluorspar.staged.renderers.protocol.LoadedScene`."""
        out = self._process.name(".exr")
        self._process.ask("render", number=self._number, bounces=0, seed=seed, scale=scale, out=out)
        return _rows(_read(out))

    def probe(
        self,
        points: Array,
        normals: Array,
        albedo: Array,
        emission: Array,
        *,
        surface: int,
        back: bool,
        offset: float,
        max_depth: int,
        seed: int,
    ) -> NDArray[np.float32]:
        """See `fluorspar.staged.renderers.protocol.LoadedScene`; without what the surface itself emits."""
        self._look(points, normals, 2 * surface + back, offset)
        bands = albedo.shape[1]
        shown = np.zeros((len(points), bands), dtype=np.float32)
        if max_depth != 1:
            out = self._process.name(".bin")
            self._ask("bake", albedo, emission, max_depth, seed, out=out)
            measured = np.fromfile(out, dtype=np.float32).reshape(-1, 4)
            os.remove(out)
            if (measured[:, 3] != 1).any():
                missing = f"{(measured[:, 3] != 1).sum()} of {len(points)} without light"
                raise RendererError(
                    message(
                        "Blender has not measured the light at points",
                        got=missing,
                        expected="light at all",
                    )
                )
            light = measured[:, :bands]
            row = (self._scene.surfaces[surface].front, self._scene.surfaces[surface].back)[back]
            shown = light * albedo[row].astype(np.float32)
        shown[~self._seen] = np.nan
        return shown

    def _look(self, points: Array, normals: Array, side: int, offset: float) -> None:
        """Put probes at points, unless they are there already."""
        key = (points.tobytes(), normals.tobytes(), side, offset)
        if key == self._looked:
            return
        process, out = self._process, self._process.name(".bin")
        process.ask(
            "look",
            number=self._number,
            points=process.put(self._frame(points), "f4"),
            normals=process.put(normals, "f4"),
            side=side,
            offset=offset / self._frame.unit,
            size=_PROBE,
            directions=directions().tolist(),
            out=out,
        )
        self._looked, self._seen = key, np.fromfile(out, dtype=np.bool_)
        os.remove(out)

    def _illumination(self, passes: dict[str, Pixels], max_depth: int) -> Pixels:
        if max_depth == 1:
            return np.zeros_like(passes["direct"])
        return passes["direct"] if max_depth == 2 else passes["direct"] + passes["indirect"]

    def _passes(
        self, albedo: Array, emission: Array, max_depth: int, seed: int, scale: int
    ) -> dict[str, Pixels]:
        """The passes of one render, which answers for depths of 1, of 2 and of the scene."""
        deepest = self._scene.settings.max_depth if max_depth in (1, 2) else max_depth
        if max_depth == 2 and deepest == 1:
            deepest = 2
        key = (albedo.tobytes(), emission.tobytes(), deepest, seed, scale)
        if self._kept[0] != key:
            self._kept = key, self._rendered(albedo, emission, deepest, seed, scale)
        return self._kept[1]

    def _rendered(
        self, albedo: Array, emission: Array, max_depth: int, seed: int, scale: int
    ) -> dict[str, Pixels]:
        out = self._process.name(".exr")
        self._ask("render", albedo, emission, max_depth, seed, scale=scale, out=out)
        return _read(out)

    def _ask(self, do: str, albedo: Array, emission: Array, max_depth: int, seed: int, **more: Any) -> None:
        """Render with spectra; rows that luminesce get a colour that lets light through to the passes."""
        bands = albedo.shape[1]
        floors = [ALBEDO_FLOOR if made.fluorescent else 0.0 for made in self._scene.materials]
        colours = np.zeros((len(albedo), 3))
        colours[:, :bands] = np.maximum(albedo, np.array(floors)[:, np.newaxis])
        if self._emitter_of_face is not None:
            emission = emission[self._emitter_of_face]
        light = np.zeros((len(emission), 3))
        light[:, :bands] = emission
        bounces = _BOUNCES if max_depth == UNLIMITED else max(0, min(max_depth - 2, _BOUNCES))
        answer = self._process.ask(
            do,
            number=self._number,
            albedo=colours.tolist(),
            emission=self._process.put(light, "f4"),
            bounces=bounces,
            seed=seed,
            **more,
        )
        self.seconds += answer["seconds"]


def _read(file: str) -> dict[str, Pixels]:
    passes = read_passes(file)
    os.remove(file)
    return passes


def _rows(passes: dict[str, Pixels]) -> NDArray[np.int64]:
    return np.rint(passes["row"][..., 0]).astype(np.int64) - 1
