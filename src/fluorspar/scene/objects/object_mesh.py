"""The curved object of the scene `cornell-mesh`: a procedural mesh, or a file of the user's fitted into the
box."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.files.temporary import temporary_folder
from fluorspar.scene.objects.mesh_file import FORMATS, read_triangles
from fluorspar.scene.objects.mesh_repair import repaired

if TYPE_CHECKING:
    import trimesh

__all__ = ["FORMATS", "object_file", "procedural_mesh", "read_mesh"]

_CENTRE = (278.0, 279.6)  # of the floor of the Cornell box: x, z, in mm
_EXTENT = 330.0  # largest side of the object's bounding box in mm, the height of the box's tall block


def object_file(path: Path | None = None) -> Path:
    """Prepare the object of `cornell-mesh` as a PLY file in the box's coordinates.

    The mesh is centred over the floor, scaled so that its largest side is 330 mm, and set on the floor. The
    file lasts as long as this process; no other file is written.

    Parameters
    ----------
    path : Path, optional
        A mesh, y up (OBJ, PLY, STL, glTF); None for the procedural one.

    Raises
    ------
    SceneError
        If the file is missing, unreadable, of another kind, or holds no faces or coordinates that are not finite.

    Warns
    -----
    SceneNotice
        If stray components were dropped, faces turned, or the mesh is not watertight.

    Examples
    --------
    >>> object_file().suffix
    '.ply'
    """
    mesh = procedural_mesh() if path is None else read_mesh(path)
    low, high = mesh.bounds
    scale = _EXTENT / float((high - low).max())
    centre = (low + high) / 2
    mesh.apply_translation([-centre[0], -low[1], -centre[2]])
    mesh.apply_scale(scale)
    mesh.apply_translation([_CENTRE[0], 0.0, _CENTRE[1]])
    data = _ply(np.asarray(mesh.vertices), np.asarray(mesh.faces), np.asarray(mesh.vertex_normals))
    target = temporary_folder() / f"object-{hashlib.sha256(data).hexdigest()[:16]}.ply"
    if not target.exists():
        target.write_bytes(data)
    return target


def procedural_mesh() -> trimesh.Trimesh:
    """Make a closed, smooth, partly concave body of 20,480 triangles by waves on a sphere.

    Examples
    --------
    >>> procedural_mesh().is_watertight
    True
    """
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=5, radius=1.0)
    x, y, z = np.asarray(ball.vertices).T
    radius = (
        1
        + 0.22 * np.sin(3 * x + 0.5) * np.cos(2.5 * y)
        + 0.16 * np.sin(4 * z + 2 * x)
        + 0.1 * np.cos(5 * y - z)
    )
    return trimesh.Trimesh(np.asarray(ball.vertices) * radius[:, np.newaxis], ball.faces, process=False)


def read_mesh(path: Path) -> trimesh.Trimesh:
    """Read a mesh file, all its parts as one, and repair it.

    Vertex normals of the file are kept; without them edges of more than 30 degrees are sharp.

    Raises
    ------
    SceneError
        If the file is missing, unreadable, of another kind, or holds no faces or coordinates that are not finite.

    Warns
    -----
    SceneNotice
        If stray components were dropped, faces turned, or the mesh is not watertight.
    """
    import trimesh

    triangles = read_triangles(path)
    # normals of triangles that are small in the unit of the file would be taken for those of none
    low, extent = triangles.vertices.min(axis=0), float(np.ptp(triangles.vertices, axis=0).max())
    mesh = repaired(replace(triangles, vertices=(triangles.vertices - low) / extent), path.name)
    return trimesh.Trimesh(
        mesh.vertices * extent + low, mesh.faces, vertex_normals=mesh.vertex_normals, process=False
    )


def _ply(vertices: NDArray[np.floating], faces: NDArray[np.integer], normals: NDArray[np.floating]) -> bytes:
    """Encode a mesh with vertex normals as binary PLY."""
    corners = np.hstack([vertices, normals]).astype("<f4")
    triangles = np.empty(len(faces), dtype=[("count", "u1"), ("corner", "<i4", 3)])
    triangles["count"], triangles["corner"] = 3, faces
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(corners)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return header.encode("ascii") + corners.tobytes() + triangles.tobytes()
