"""Meshes of Blender from numbers in files."""

from __future__ import annotations

import math
import os
from array import array
from typing import Any

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["smooth", "taken", "triangle_mesh"]


def taken(file: str, kind: str) -> array[Any]:
    """Read a file of numbers and remove it."""
    values = array(kind)
    values.fromfile(open(file, "rb"), os.path.getsize(file) // values.itemsize)  # noqa: SIM115
    os.remove(file)
    return values


def triangle_mesh(corners: array[float], triangles: array[int]) -> Any:
    mesh = bpy.data.meshes.new("mesh")
    count = len(triangles) // 3
    mesh.vertices.add(len(corners) // 3)
    mesh.vertices.foreach_set("co", corners)
    mesh.loops.add(len(triangles))
    mesh.loops.foreach_set("vertex_index", triangles)
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", array("i", range(0, 3 * count, 3)))
    if bpy.app.version < (4, 0):
        mesh.polygons.foreach_set("loop_total", array("i", [3]) * count)
    mesh.polygons.foreach_set("use_smooth", array("b", [0]) * count)
    mesh.update(calc_edges=True)
    return mesh


def smooth(mesh: Any, normals: array[float]) -> None:
    """Give a mesh normals of its vertices."""
    mesh.polygons.foreach_set("use_smooth", array("b", [1]) * len(mesh.polygons))
    if bpy.app.version < (4, 1):
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi
    mesh.normals_split_custom_set_from_vertices(
        [tuple(normals[i : i + 3]) for i in range(0, len(normals), 3)]
    )
