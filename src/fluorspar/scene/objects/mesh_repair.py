"""Make a mesh from anywhere fit to be rendered: its crumbs, its winding, its holes, its vertex normals.

Whatever is changed or wrong is told in a `SceneNotice`.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, SceneNotice, message
from fluorspar.scene.objects.mesh_file import Triangles
from fluorspar.scene.objects.mesh_winding import turned_faces

if TYPE_CHECKING:
    import trimesh

__all__ = ["CREASE", "repaired"]

CREASE = 30.0
"""Edges of more degrees than this are sharp, where the file has no vertex normals."""

_STRAY = 0.01  # a component with less than this share of the area of the largest may not belong to the object
_CRUMBS = 0.01  # all that is dropped, at most, as a share of the area
_SAME = 6  # digits in which two equal vertices agree


def repaired(mesh: Triangles, name: str) -> trimesh.Trimesh:
    """Drop stray components, turn faces outwards, find vertex normals, say what else is wrong.

    Parameters
    ----------
    mesh : Triangles
        Of extent 1. Its vertex normals are kept. Where it has none, edges of more than 30 degrees are sharp, and all
        others are smooth.
    name : str
        Of the file, for notices.

    Returns
    -------
    trimesh.Trimesh
        With vertex normals. Vertices at sharp edges are there once for each side.

    Raises
    ------
    SceneError
        If no face has three corners at different places.

    Warns
    -----
    SceneNotice
        If stray components were dropped, faces turned, or the mesh is not watertight.
    """
    import trimesh

    skin = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    skin.merge_vertices(digits_vertex=_SAME)
    # trimesh's `nondegenerate_faces` also drops slivers, across which their neighbours hang together
    whole = (skin.faces != np.roll(skin.faces, 1, axis=1)).all(axis=1)
    if not whole.any():
        raise SceneError(
            message(
                "the mesh has no faces with an area",
                where=name,
                got=f"{len(whole)} faces, all with two corners at one place",
                expected="a mesh of triangles",
            )
        )
    skin.update_faces(whole)
    kept = ~_stray_faces(skin, name)
    skin.update_faces(kept)
    turned = turned_faces(skin, name)
    skin.faces[turned] = skin.faces[turned, ::-1]
    corners = mesh.faces[whole][kept]  # by vertices of the file, which may have several normals at one place
    corners[turned] = corners[turned, ::-1]
    _tell_holes(skin, name)
    smooth = _split_at_creases(skin)
    around = trimesh.Trimesh(mesh.vertices, corners, process=False).vertex_normals
    inwards = np.sum(mesh.normals * around, axis=1) < 0
    given = trimesh.unitize(np.where(inwards[:, np.newaxis], -mesh.normals, mesh.normals))
    known = np.isfinite(mesh.normals).all(axis=1) & (np.abs(mesh.normals).max(axis=1) > 1e-6)
    faces = np.where(known[corners], corners, smooth.faces + len(mesh.vertices))[skin.area_faces > 0]
    used, faces = np.unique(faces, return_inverse=True)
    return trimesh.Trimesh(
        np.concatenate([mesh.vertices, smooth.vertices])[used],
        faces.reshape(-1, 3),
        vertex_normals=np.concatenate([given, smooth.vertex_normals])[used],
        process=False,
    )


def _stray_faces(mesh: trimesh.Trimesh, name: str) -> NDArray[np.bool_]:
    """Which faces belong to small separate components that may be left out."""
    import trimesh

    label = trimesh.graph.connected_component_labels(mesh.edges, node_count=len(mesh.vertices))
    of_face = label[mesh.faces[:, 0]]
    areas = np.bincount(of_face, mesh.area_faces)
    small = (areas < _STRAY * areas.max()) & (np.bincount(of_face) > 0)
    stray = np.asarray(small[of_face])
    if not stray.any():
        return stray
    share = float(mesh.area_faces[stray].sum() / mesh.area)
    what = f"{int(stray.sum())} of {len(stray)} triangles and {100 * share:.2g} % of the area"
    if share > _CRUMBS:
        _tell(f"{name}: {int(small.sum())} small separate components with {what} are kept")
        return np.zeros_like(stray)
    _tell(f"{name}: {int(small.sum())} stray components with {what} are left out")
    return stray


def _tell_holes(mesh: trimesh.Trimesh, name: str) -> None:
    sides = np.bincount(mesh.edges_unique_inverse)
    if (sides == 1).any():
        _tell(
            f"{name} is not watertight: light gets in through the holes ({int((sides == 1).sum())} open edges) "
            "and is absorbed by the inner side, which is black, so the object looks darker there than a closed one"
        )
    elif (sides > 2).any():
        _tell(
            f"{name} is not watertight in the strict sense: {int((sides > 2).sum())} edges are shared by more "
            "than two triangles, as where bodies touch. It has no holes, and no light gets in"
        )


def _split_at_creases(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh with its faces in their order, and vertices at sharp edges once for each side.

    `trimesh.graph.smooth_shade` splits whole patches only: a crease that ends within one would become smooth.
    """
    import trimesh

    faces = np.asarray(mesh.faces)
    smooth = mesh.face_adjacency_angles < np.radians(CREASE)
    pairs, ends = mesh.face_adjacency[smooth], mesh.face_adjacency_edges[smooth]
    # corners of two faces at either end of the edge they share
    links = [
        np.stack([3 * face + (faces[face] == end[:, np.newaxis]).argmax(axis=1) for face in pairs.T], axis=1)
        for end in ends.T
    ]
    label = trimesh.graph.connected_component_labels(np.concatenate(links), node_count=faces.size)
    vertices = np.empty((label.max() + 1, 3))
    vertices[label] = mesh.vertices[faces.ravel()]
    return trimesh.Trimesh(vertices, label.reshape(-1, 3), process=False)


def _tell(text: str) -> None:
    warnings.warn(text, SceneNotice, stacklevel=5)
