"""The triangles of a surface of a Mitsuba scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message
from fluorspar.scene.nodes import build, resolving
from fluorspar.scene.scene import Scene
from fluorspar.scene.surfaces import Surface
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.renderers.mitsuba.scene_nodes import with_materials

__all__ = ["surface_mesh"]

Array = NDArray[np.float64]
_TESSELLATION = 256  # of spheres, disks and other shapes that are not meshes, along each side


def surface_mesh(scene: Scene, surface: int) -> TriangleMesh:
    """Triangles of a surface in world coordinates; an rgb variant must be set.

    Shapes that are not meshes are tessellated, flat ones without loss.

    Raises
    ------
    SceneError
        If the surface cannot be cut into patches.
    """
    import mitsuba as mi

    state, _ = with_materials(scene)
    with resolving(*scene.folders):
        shape = build(state, scene.surfaces[surface].node)
    parameters = mi.traverse(shape)
    if "vertex_positions" not in parameters:
        return _tessellated(shape, scene.surfaces[surface])
    vertices = np.array(parameters["vertex_positions"], dtype=np.float64).reshape(-1, 3)
    faces = np.array(parameters["faces"], dtype=np.int64).reshape(-1, 3)
    normals = None
    if shape.has_vertex_normals():
        normals = np.array(parameters["vertex_normals"], dtype=np.float64).reshape(-1, 3)
    return _facing(TriangleMesh(vertices, faces, normals), shape)


def _facing(mesh: TriangleMesh, shape: Any) -> TriangleMesh:
    """Turn a mesh so that its front is what Mitsuba takes for it: `flip_normals` leaves the corners in their
    order."""
    import mitsuba as mi

    largest = int(np.argmax(mesh.areas))
    centre, normal = mesh.centroids[largest], mesh.face_normals[largest]
    start = centre + 1e-3 * np.sqrt(mesh.areas[largest]) * normal
    ray = mi.Ray3f(mi.Point3f(*start.tolist()), mi.Vector3f(*(-normal).tolist()))
    hit = mi.load_dict({"type": "scene", "shape": shape}).ray_intersect(ray)
    front = np.array(hit.n, dtype=np.float64).ravel()
    if front @ normal < 0:
        mesh = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1], mesh.normals)
    if mesh.normals is not None:
        shading = mesh.normals[mesh.faces].sum(axis=1)
        if (mesh.areas * (shading * mesh.face_normals).sum(axis=1)).sum() < 0:
            mesh = TriangleMesh(mesh.vertices, mesh.faces, -mesh.normals)
    return mesh


def _tessellated(shape: Any, surface: Surface) -> TriangleMesh:
    """Cut a shape that is not a mesh into triangles, between points that divide its area evenly."""
    import mitsuba as mi

    flat = type(shape).__name__ in ("Rectangle",) or "Rectangle" in str(shape)
    n = 1 if flat else _TESSELLATION
    u, v = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    try:
        sample = shape.sample_position(
            0.0, mi.Point2f(u.ravel().astype(np.float32), v.ravel().astype(np.float32))
        )
    except Exception as err:  # shapes without an area to sample raise bare RuntimeError
        raise SceneError(
            message(
                "this shape cannot be cut into emitters",
                where=f"shape '{surface.name}'",
                expected="a mesh, rectangle, disk, sphere or cylinder",
                fix="write it as a mesh",
            )
        ) from err
    vertices = np.array(sample.p, dtype=np.float64).T
    # one normal for all where the shape is flat
    normals = np.broadcast_to(np.array(sample.n, dtype=np.float64).T, vertices.shape)
    corner = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + n + 1, corner + n + 2], axis=1),
            np.stack([corner, corner + n + 2, corner + 1], axis=1),
        ]
    )
    mesh = TriangleMesh(vertices, faces)
    inward = (mesh.face_normals * normals[faces].mean(axis=1)).sum(axis=1) < 0
    faces[inward] = faces[inward, ::-1]
    mesh = TriangleMesh(vertices, faces, None if flat else normals, _deviation(vertices, normals, faces))
    return mesh.submesh(mesh.areas > 1e-9 * mesh.areas.sum())


def _deviation(vertices: Array, normals: Array, faces: NDArray[np.int64]) -> float:
    """How far a surface bulges out of triangles, at most, from the normals at the ends of their edges.

    An arc of radius R over a chord of 2 R sin(a) rises by R (1 - cos(a)), an eighth of the chord times the
    difference of the normals along it; the middle of a triangle rises by a third more than its edges do.
    """
    start, end = faces.ravel(), np.roll(faces, 1, axis=1).ravel()
    rise = ((vertices[end] - vertices[start]) * (normals[end] - normals[start])).sum(axis=1) / 8
    return float(np.abs(rise).max() * 4 / 3)
