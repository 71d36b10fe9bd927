"""Meshes as files of numbers, as `array` writes them."""

from __future__ import annotations

from array import array
from pathlib import Path
from typing import Any

from .values import Said

__all__ = ["Meshes"]


class Meshes:
    """Meshes as files of numbers, each once for all objects that share it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.table: list[Said] = []
        self.numbers: dict[Any, int | None] = {}

    def number(self, thing: Any) -> int | None:
        """Number of the mesh of an object; None if it has no faces."""
        key = (thing.data.as_pointer(), thing.type) if thing.type == "MESH" else thing.name_full
        if key not in self.numbers:
            mesh = thing.to_mesh()
            mesh.calc_loop_triangles()
            self.numbers[key] = None
            if len(mesh.loop_triangles):
                self.numbers[key] = len(self.table)
                self.table.append(self.written(mesh, len(self.table)))
            thing.to_mesh_clear()
        return self.numbers[key]

    def written(self, mesh: Any, number: int) -> Said:
        corners, triangles = len(mesh.loops), len(mesh.loop_triangles)
        files = {
            "points": self.put(number, mesh.vertices, "co", "f", 3 * len(mesh.vertices)),
            "corners": self.put(number, mesh.loops, "vertex_index", "i", corners),
            "triangles": self.put(number, mesh.loop_triangles, "loops", "i", 3 * triangles),
            "slots": self.put(number, mesh.loop_triangles, "material_index", "i", triangles),
        }
        if hasattr(mesh, "corner_normals"):
            files["normals"] = self.put(number, mesh.corner_normals, "vector", "f", 3 * corners)
        else:
            mesh.calc_normals_split()
            files["normals"] = self.put(number, mesh.loops, "normal", "f", 3 * corners)
        layers = {
            layer.name: self.put(number, layer.data, "uv", "f", 2 * corners, f"-{at}")
            for at, layer in enumerate(mesh.uv_layers)
            if len(layer.data) == corners
        }
        rendered = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
        return {**files, "uv": layers, "uv_rendered": rendered}

    def put(self, number: int, things: Any, name: str, kind: str, length: int, more: str = "") -> str:
        values = array(kind, bytes(4 * length))
        things.foreach_get(name, values)
        file = self.folder / f"mesh-{number}-{name}{more}"
        with open(file, "wb") as out:
            values.tofile(out)
        return file.name
