"""Meshes: the arrays of Blender as PLY files, one for each material of a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Mesh", "encloses", "parts", "write_ply"]

_APART = 1e-4  # of a front and its back, in extents of the mesh

Array = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a vertex for each different corner.

    Attributes
    ----------
    points, normals : ndarray of shape (V, 3)
    uv : ndarray of shape (V, 2), or None
    faces : ndarray of shape (F, 3)
    """

    points: Array
    normals: Array
    uv: Array | None
    faces: NDArray[np.int32]

    def mirrored(self) -> Mesh:
        """Wound the other way round, for a transform that mirrors; its normals stay."""
        return replace(self, faces=self.faces[:, ::-1])

    @property
    def is_closed(self) -> bool:
        """Whether it faces outwards all around, without a border: each edge is passed both ways equally often."""
        a, b, c = np.moveaxis((self.points - self.points.mean(axis=0))[self.faces].astype(np.float64), 1, 0)
        if (a * np.cross(b, c)).sum() <= 0:
            return False
        _, same = np.unique(self.points, axis=0, return_inverse=True)
        corners = same.ravel()[self.faces].astype(np.int64)
        start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
        count = len(self.points)
        return bool(np.array_equal(np.sort(start * count + end), np.sort(end * count + start)))

    def with_back(self) -> Mesh:
        """The same surface twice, closely apart, facing either way: Mitsuba's emit to the front only."""
        gap = _APART * float(np.ptp(self.points, axis=0).max())
        behind = (self.points - gap * self.normals).astype(np.float32)
        return Mesh(
            np.concatenate([self.points, behind]),
            np.concatenate([self.normals, -self.normals]),
            None if self.uv is None else np.concatenate([self.uv, self.uv]),
            np.concatenate([self.faces, self.faces[:, ::-1] + len(self.points)]).astype(np.int32),
        )


def parts(said: dict[str, Any], folder: Path, uv_of_slot: dict[int, str]) -> Iterator[tuple[int, Mesh]]:
    """The part of a mesh that each material slot covers.

    Parameters
    ----------
    said : dict
        What the script inside Blender says of the mesh: names of files.
    folder : Path
        Where they are.
    uv_of_slot : dict
        Names of the UV maps that the materials of slots ask for; default: the one that Blender renders with.
    """
    points = np.fromfile(folder / said["points"], np.float32).reshape(-1, 3)
    vertex = np.fromfile(folder / said["corners"], np.int32)
    triangles = np.fromfile(folder / said["triangles"], np.int32).reshape(-1, 3)
    slots = np.fromfile(folder / said["slots"], np.int32)
    normals = np.fromfile(folder / said["normals"], np.float32).reshape(-1, 3)
    for slot in np.unique(slots):
        corners, faces = np.unique(triangles[slots == slot], return_inverse=True)
        columns = [points[vertex[corners]], normals[corners]]
        layer = uv_of_slot.get(int(slot), said["uv_rendered"])
        if (file := said["uv"].get(layer, said["uv"].get(said["uv_rendered"]))) is not None:
            columns.append(np.fromfile(folder / file, np.float32).reshape(-1, 2)[corners])
        table, same = np.unique(np.hstack(columns), axis=0, return_inverse=True)
        faces = same.ravel()[faces.reshape(-1, 3)]
        uv = table[:, 6:] if table.shape[1] > 6 else None
        if uv is None:  # as in Blender, where Mitsuba has coordinates of each triangle
            uv = np.zeros((len(table), 2), np.float32)
        yield int(slot), Mesh(table[:, :3], table[:, 3:6], uv, np.asarray(faces, dtype=np.int32))


def encloses(said: dict[str, Any], folder: Path, point: NDArray[np.float64]) -> bool:
    """Whether the box around a mesh holds a point."""
    points = np.fromfile(folder / said["points"], np.float32).reshape(-1, 3)
    return bool(((points.min(axis=0) < point) & (point < points.max(axis=0))).all())


def write_ply(mesh: Mesh, file: Path) -> None:
    """Write a binary PLY file as Mitsuba reads it."""
    names = ["x", "y", "z", "nx", "ny", "nz", *(["u", "v"] if mesh.uv is not None else [])]
    table = np.hstack([mesh.points, mesh.normals, *([mesh.uv] if mesh.uv is not None else [])]).astype("<f4")
    rows = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, mesh.faces
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(table)}"]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(rows)}", "property list uchar int vertex_indices", "end_header", ""]
    with open(file, "wb") as out:
        out.write("\n".join(head).encode("ascii"))
        out.write(table.tobytes())
        out.write(rows.tobytes())
