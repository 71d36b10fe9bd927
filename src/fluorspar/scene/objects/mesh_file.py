"""Triangles of a mesh file, with its vertex normals where it has some."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message
from fluorspar.files.formats import Format

__all__ = ["FORMATS", "Triangles", "read_triangles"]

FORMATS = {
    ".obj": Format("Wavefront OBJ", "trimesh:load"),
    ".ply": Format("PLY", "trimesh:load"),
    ".stl": Format("STL", "trimesh:load"),
    ".gltf": Format("glTF", "trimesh:load"),
    ".glb": Format("binary glTF", "trimesh:load"),
}
"""The formats of meshes by suffix."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles as a file has them, vertices merged or not.

    Attributes
    ----------
    vertices : ndarray of shape (V, 3)
    faces : ndarray of shape (F, 3)
    normals : ndarray of shape (V, 3)
        NaN where the file has none.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float64]


def read_triangles(path: Path) -> Triangles:
    """Read a mesh file, all its parts as one; vertices that no face uses are left out.

    Raises
    ------
    SceneError
        If the file is missing, unreadable, of another kind, or holds no faces or coordinates that are not finite.
    """
    import trimesh

    if not path.is_file():
        raise SceneError(message("the mesh file does not exist", where=path, fix="check the path"))
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise SceneError(
            message(
                "this kind of mesh file is not known",
                where=path,
                got=suffix or "no suffix",
                expected=", ".join(FORMATS),
            )
        )
    try:
        loaded = FORMATS[suffix].read(path, process=False)
        triangles = _joined(loaded if isinstance(loaded, trimesh.Scene) else trimesh.Scene(loaded))
    except Exception as err:  # the readers raise whatever the damage leads to
        raise SceneError(
            message("the mesh cannot be read", where=path, got=err, expected="a mesh of triangles")
        ) from err
    bad = int((~np.isfinite(triangles.vertices)).any(axis=1).sum())
    if bad:
        raise SceneError(
            message(
                "the mesh has coordinates that are not finite numbers",
                where=path,
                got=f"{bad} of {len(triangles.vertices)} vertices",
                expected="finite coordinates",
                fix="repair the mesh, or export it again",
            )
        )
    corners = triangles.vertices[triangles.faces]
    area = trimesh.triangles.area(corners).sum() if len(corners) else 0.0
    if not 0 < area < np.inf:
        raise SceneError(
            message(
                "the mesh has no faces with an area",
                where=path,
                got=f"{len(triangles.vertices)} vertices, {len(triangles.faces)} faces",
                expected="a mesh of triangles",
            )
        )
    return triangles


def _joined(scene: Any) -> Triangles:
    """All triangles of a scene in its coordinates."""
    import trimesh

    vertices, faces, normals, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], [np.zeros((0, 3))], 0
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        part = scene.geometry[name]
        if not isinstance(part, trimesh.Trimesh) or len(part.faces) == 0:
            continue
        used, corners = np.unique(part.faces, return_inverse=True)
        corners = corners.reshape(-1, 3) + count
        turn = matrix[:3, :3]
        mirrored = np.linalg.det(turn) < 0
        # a mesh just read has normals in its cache if the file has; the property would make them up
        given = (
            part.vertex_normals[used] if "vertex_normals" in part._cache else np.full((len(used), 3), np.nan)
        )
        with np.errstate(invalid="ignore"):  # infinite coordinates
            vertices.append(part.vertices[used] @ turn.T + matrix[:3, 3])
        faces.append(corners[:, ::-1] if mirrored else corners)
        normals.append(given @ np.linalg.inv(turn))
        count += len(used)
    return Triangles(np.concatenate(vertices), np.concatenate(faces), np.concatenate(normals))
