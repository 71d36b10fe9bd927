"""What Blender is told of a scene: meshes with the rows of their materials, lights and camera, in plain numbers."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.blender.process import BlenderProcess
from fluorspar.errors import SceneError, SceneNotice, message
from fluorspar.scene.camera import camera_of
from fluorspar.scene.light_places import LightPlace, light_places
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import sensor_node
from fluorspar.scene.surfaces import ABSORBS, NO_LIGHT
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.emitters.patches import EmitterArray

__all__ = ["Frame", "camera_plan", "light_plans", "mesh_plans", "notice_of_shapes"]

Array = NDArray[np.float64]
_MESHES = ("obj", "ply", "serialized", "mesh", "rectangle", "cube")  # without loss


def notice_of_shapes(scene: Scene) -> None:
    """Say which shapes become meshes.

    Warns
    -----
    SceneNotice
    """
    nodes = scene.nodes.nodes
    plugins = {surface.name: nodes[surface.node].props.plugin_name() for surface in scene.surfaces}
    curved = [f"'{name}' ({plugin})" for name, plugin in plugins.items() if plugin not in _MESHES]
    if curved:
        text = f"Cycles renders triangles: {', '.join(curved)} become meshes"
        warnings.warn(text, SceneNotice, stacklevel=3)


@dataclass(frozen=True, eq=False)
class Frame:
    """The place and size at which Blender gets a scene: around the origin, and between 1/2 and 1 in extent.

    Single precision is best there; and before 4.0, Cycles chooses how to sample a triangle that emits by comparing a
    length with an area, and loses light at large triangles (in mm, 3 % beside the lamp of the Cornell box).
    """

    centre: Array
    unit: float

    @classmethod
    def of(cls, meshes: Sequence[TriangleMesh]) -> Frame:
        """Frame of all these meshes; its unit is a power of two, which rounds nothing."""
        corners = np.concatenate([mesh.vertices for mesh in meshes])
        low, high = corners.min(axis=0), corners.max(axis=0)
        return cls((low + high) / 2, 2.0 ** np.ceil(np.log2(max(float((high - low).max()), 1e-30))))

    def __call__(self, points: Array) -> Array:
        """Points of the scene as Blender gets them."""
        return np.asarray((points - self.centre) / self.unit)


def camera_plan(scene: Scene, frame: Frame) -> dict[str, Any]:
    """The camera, which in Blender looks along its -z with y up.

    Raises
    ------
    SceneError
        If it is not a plain perspective camera.
    """
    plugin = scene.nodes.nodes[sensor_node(scene.nodes)].props.plugin_name()
    if plugin != "perspective":
        raise SceneError(
            message("the Cycles renderer has no such camera", got=f"'{plugin}'", expected="perspective")
        )
    camera = camera_of(scene)
    left, down, forward = camera.matrix[:, :3]
    centre_x, centre_y = left @ forward, down @ forward
    right, up = left - centre_x * forward, centre_y * forward - down
    focal = float(np.linalg.norm(right))
    if np.linalg.det(np.stack([right, up, -forward])) < 0:
        raise SceneError(
            message("the camera is mirrored", expected="a to_world without reflection", where="sensor")
        )
    place = np.eye(4)
    place[:3, :3] = np.stack([right / focal, up / np.linalg.norm(up), -forward], axis=1)
    place[:3, 3] = frame(
        np.asarray(np.linalg.solve(camera.matrix[:, :3], -camera.matrix[:, 3]), dtype=np.float64)
    )
    shift = [0.5 - centre_x / camera.width, (centre_y - camera.height / 2) / camera.width]
    return {"place": place.tolist(), "focal": focal / camera.width, "shift": shift}


def light_plans(scene: Scene, frame: Frame) -> list[dict[str, Any]]:
    """The lights that are on no surface, with the rows of the table of lights they are."""
    return [{"number": row, **_light(place, frame)} for row, place in light_places(scene).items()]


def _light(light: LightPlace, frame: Frame) -> dict[str, Any]:
    place = np.eye(4)
    place[:3, 3] = frame(light.position)
    z = -light.direction
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    place[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    # the irradiance of an intensity falls with the square of the distance, which is in units of the frame
    scale = frame.unit**-2 if light.plugin in ("point", "spot") else 1.0
    angles = {"cutoff": light.cutoff, "beam": light.beam}
    return {"plugin": light.plugin, "place": place.tolist(), "scale": scale, **angles}


def mesh_plans(
    blender: BlenderProcess,
    scene: Scene,
    frame: Frame,
    meshes: Sequence[TriangleMesh],
    array: EmitterArray | None,
    keep_object: bool,
) -> list[dict[str, Any]]:
    """The surfaces of a scene; with an array, which each face of its mesh emits for, without their own light."""
    plans = []
    replaced = array is not None and (array.copy is None or not keep_object)
    for number, (surface, mesh) in enumerate(zip(scene.surfaces, meshes, strict=True)):
        if array is not None and replaced and number == array.surface:
            continue
        light = surface.light if array is None else NO_LIGHT
        rows, sides = (surface.front, surface.back), (2 * number, 2 * number + 1)
        plans.append(_mesh(blender, frame, mesh, rows, sides, light=light))
    if array is not None:
        surface = scene.surfaces[array.surface]
        # emitters that are not the surface itself, or stand for one that is left out, reflect nothing
        rows, sides = (ABSORBS, ABSORBS), (-1, -1)
        if array.copy is None and keep_object:
            rows, sides = (surface.front, surface.back), (2 * array.surface, 2 * array.surface + 1)
        if array.back:
            rows, sides = rows[::-1], sides[::-1]
        plans.append(_mesh(blender, frame, array.emitting, rows, sides, per_face=True))
    return plans


def _mesh(
    blender: BlenderProcess,
    frame: Frame,
    mesh: TriangleMesh,
    rows: tuple[int, int],
    sides: tuple[int, int],
    *,
    light: int = NO_LIGHT,
    per_face: bool = False,
) -> dict[str, Any]:
    return {
        "vertices": blender.put(frame(mesh.vertices), "f4"),
        "faces": blender.put(mesh.faces, "i4"),
        "normals": None if mesh.normals is None else blender.put(mesh.normals, "f4"),
        "rows": rows,
        "sides": sides,
        "light": light,
        "per_face": per_face,
    }
