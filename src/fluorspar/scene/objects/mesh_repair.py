"""Make a mesh from anywhere fit to be rendered: its crumbs, its winding, its holes, its vertex normals.

Whatever is changed or wrong is told in a `SceneNotice`.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, SceneNotice, message
from fluorspar.scene.objects.mesh_file import Triangles

if TYPE_CHECKING:
    import trimesh

__all__ = ["CREASE", "repaired", "smooth_corners", "turned_faces", "welded_faces"]

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Chosen = NDArray[np.bool_]

CREASE = 30.0
"""Edges of more degrees than this are sharp, where the file has no vertex normals."""

_STRAY = 0.01  # a component with less than this share of the area of the largest may not belong to the object
_CRUMBS = 0.01  # all that is dropped, at most, as a share of the area
_SAME = 6  # digits, relative to the extent, in which two equal vertices agree
_FLAT = 0.01  # volume over area^1.5 of an open part (0.09 for a ball) below which it has no outer side


def repaired(mesh: Triangles, name: str) -> trimesh.Trimesh:
    """Drop stray components, turn faces outwards, find vertex normals, say what else is wrong.

    Parameters
    ----------
    mesh
        Its vertex normals are kept. Where it has none, edges of more than 30 degrees are sharp, and all others
        are smooth.
    name
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

    places, faces = welded_faces(mesh.vertices, mesh.faces)
    corners = mesh.faces
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    if not whole.any():
        raise SceneError(
            message(
                "the mesh has no faces with an area",
                where=name,
                got=f"{len(faces)} faces, all with two corners at one place",
                expected="a mesh of triangles",
            )
        )
    faces, corners = faces[whole], corners[whole]
    kept = ~_stray(places, faces, name)
    faces, corners = faces[kept], corners[kept]
    turned = turned_faces(places, faces, name)
    faces[turned], corners[turned] = faces[turned, ::-1], corners[turned, ::-1]
    _tell_holes(faces, name)
    skin = trimesh.Trimesh(places, faces, process=False)
    points, triangles, normals = smooth_corners(skin)
    given = np.isfinite(mesh.normals).all(axis=1) & (np.abs(mesh.normals).max(axis=1) > 1e-6)
    triangles = np.where(given[corners], corners, triangles + len(mesh.vertices))[skin.area_faces > 0]
    points = np.concatenate([mesh.vertices, points])
    normals = np.concatenate([_outward(skin, corners, mesh.normals), normals])
    used, triangles = np.unique(triangles, return_inverse=True)
    return trimesh.Trimesh(
        points[used], triangles.reshape(-1, 3), vertex_normals=normals[used], process=False
    )


def welded_faces(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    """Merge vertices that are at one place: places of shape (P, 3), and the faces by places."""
    import trimesh

    extent = np.ptp(vertices, axis=0).max()
    first, inverse = trimesh.grouping.unique_rows((vertices - vertices.min(axis=0)) / extent, digits=_SAME)
    return vertices[first], np.asarray(inverse[faces], dtype=np.int64)


def _stray(places: Array, faces: Faces, name: str) -> NDArray[np.bool_]:
    """Which faces belong to small separate components that may be left out."""
    import trimesh

    label = trimesh.graph.connected_component_labels(
        np.concatenate([faces[:, :2], faces[:, 1:]]), node_count=len(places)
    )[faces[:, 0]]
    area = trimesh.triangles.area(places[faces])
    areas = np.bincount(label, area)
    small = (areas < _STRAY * areas.max()) & (np.bincount(label) > 0)
    stray = small[label]
    if not stray.any():
        return np.asarray(stray)
    share = float(area[stray].sum() / area.sum())
    what = f"{int(stray.sum())} of {len(faces)} triangles and {100 * share:.2g} % of the area"
    if share > _CRUMBS:
        _tell(f"{name}: {int(small.sum())} small separate components with {what} are kept")
        return np.zeros(len(faces), dtype=bool)
    _tell(f"{name}: {int(small.sum())} stray components with {what} are left out")
    return np.asarray(stray)


def _tell_holes(faces: Faces, name: str) -> None:
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    sides = np.unique(edges[:, 0] * (faces.max() + 1) + edges[:, 1], return_counts=True)[1]
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


def smooth_corners(mesh: trimesh.Trimesh) -> tuple[Array, Faces, Array]:
    """Split the vertices of a mesh at its sharp edges.

    Returns
    -------
    vertices : ndarray of shape (V, 3)
    faces : ndarray of shape (F, 3)
        In the order of the mesh.
    normals : ndarray of shape (V, 3)
        Of the faces around a vertex on one side of sharp edges, weighted by their angles.

    Examples
    --------
    >>> import trimesh
    >>> len(smooth_corners(trimesh.creation.box())[0]), len(smooth_corners(trimesh.creation.icosphere(2))[0])
    (24, 162)
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
    count = int(label.max()) + 1
    vertices = np.empty((count, 3))
    vertices[label] = mesh.vertices[faces.ravel()]
    weighted = (mesh.face_angles[:, :, np.newaxis] * mesh.face_normals[:, np.newaxis]).reshape(-1, 3)
    normals = np.stack([np.bincount(label, column, minlength=count) for column in weighted.T], axis=1)
    return vertices, label.reshape(-1, 3).astype(np.int64), _unit(normals)


def _outward(mesh: trimesh.Trimesh, corners: Faces, normals: Array) -> Array:
    """The given vertex normals, on the outer side of the faces around."""
    weighted = np.repeat(mesh.area_faces[:, np.newaxis] * mesh.face_normals, 3, axis=0)
    around = np.stack(
        [np.bincount(corners.ravel(), column, minlength=len(normals)) for column in weighted.T], axis=1
    )
    inwards = np.sum(normals * around, axis=1) < 0
    return _unit(np.where(inwards[:, np.newaxis], -normals, normals))


def _unit(vectors: NDArray[Any]) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1))


def _tell(text: str) -> None:
    warnings.warn(text, SceneNotice, stacklevel=5)


def turned_faces(vertices: Array, faces: Faces, name: str) -> Chosen:
    """Find the faces to turn: those against their neighbours, and parts that face inwards.

    Faces hang together across edges that exactly two of them share. Within such a part the winding of the larger
    area counts. A part faces inwards if the volume between it and its centroid is negative; a part that another
    encloses may be the wall of a cavity and stays as it is, relative to the whole.

    Parameters
    ----------
    vertices : ndarray of shape (V, 3)
        Merged.
    faces : ndarray of shape (F, 3)
        No vertex twice in a face.
    name
        Of the file, for notices.

    Returns
    -------
    ndarray of bool of shape (F,)

    Warns
    -----
    SceneNotice
        If faces were wound against their neighbours, or an open part is turned.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    >>> inside_out = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    >>> turned_faces(corners, inside_out, "tetrahedron")
    array([ True,  True,  True,  True])
    """
    import trimesh

    pairs, edges = trimesh.graph.face_adjacency(faces, return_edges=True)
    part, against, twisted = _parts(faces, pairs, edges)
    area = trimesh.triangles.area(vertices[faces])
    against ^= (2 * np.bincount(part, area * against) > np.bincount(part, area))[part]
    triangles = vertices[np.where(against[:, np.newaxis], faces[:, ::-1], faces)]
    closed = np.bincount(part, np.bincount(pairs.ravel(), minlength=len(faces)) < 3) == 0
    inwards = _inward(triangles, part, closed)[part]
    if twisted:
        _tell(
            f"{name} has a surface with one side only, like a Moebius strip: some of it shows its black back"
        )
    if against.any():
        _tell(
            f"{name}: {int(against.sum())} of {len(faces)} triangles were wound against their neighbours; they "
            "are turned"
        )
    if (open_ones := inwards & ~closed[part]).any():
        _tell(
            f"{name}: open parts with {int(open_ones.sum())} of {len(faces)} triangles had their front on the "
            "inner side; they are turned"
        )
    return np.asarray(against ^ inwards)


def _parts(faces: Faces, pairs: Faces, edges: Faces) -> tuple[NDArray[np.int64], Chosen, bool]:
    """Label of each face's part, which faces are wound against its first one, and whether that has no answer.

    Two nodes stand for each face, one as it is and one turned; neighbours are linked where they agree. A part that
    can be wound in one sense falls into two sets of nodes, each the other one turned.
    """
    import trimesh

    n = len(faces)
    along = [
        ((faces[face] == edges[:, :1]) & (np.roll(faces[face], -1, axis=1) == edges[:, 1:])).any(axis=1)
        for face in pairs.T
    ]
    other = np.where(along[0] != along[1], 0, n)
    first, second = pairs.T
    links = np.concatenate(
        [np.stack([first, second + other], 1), np.stack([first + n, (second + n + other) % (2 * n)], 1)]
    )
    label = trimesh.graph.connected_component_labels(links, node_count=2 * n).astype(np.int64)
    plain, turned = label[:n], label[n:]
    part = np.unique(np.minimum(plain, turned), return_inverse=True)[1].reshape(-1)
    return part, np.asarray(plain > turned), bool((plain == turned).any())


def _inward(triangles: Array, part: NDArray[np.int64], closed: Chosen) -> Chosen:
    """Which parts face inwards."""
    low, high = (np.full((len(closed), 3), bound) for bound in (np.inf, -np.inf))
    np.minimum.at(low, part, triangles.min(axis=1))
    np.maximum.at(high, part, triangles.max(axis=1))
    area_vectors = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    area = np.linalg.norm(area_vectors, axis=1)
    areas = np.bincount(part, area)
    middles = triangles.mean(axis=1)
    weights = np.maximum(areas, 1e-300)
    centroids = np.stack([np.bincount(part, area * column) / weights for column in middles.T], axis=1)
    volumes = np.bincount(part, np.sum((middles - centroids[part]) * area_vectors, axis=1)) / 3
    volumes[~closed & (np.abs(volumes) < _FLAT * areas**1.5)] = 0
    whole = volumes.sum() < 0
    inwards = (volumes > 0) if whole else (volumes < 0)
    for index in np.flatnonzero(inwards):
        around = np.flatnonzero(((low < low[index]) & (high > high[index])).all(axis=1))
        point = triangles[np.argmax(part == index), 0]
        inwards[index] = not any(_encloses(triangles[part == other], point) for other in around)
    return np.asarray(inwards ^ whole)


def _encloses(triangles: Array, point: Array) -> bool:
    """Whether triangles of shape (F, 3, 3), of a closed surface, enclose a point: they fill all directions from it.

    References
    ----------
    A. Van Oosterom, J. Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30(2), 1983.
    """
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    dots = [np.sum(x * y, axis=1) for x, y in ((a, b), (b, c), (c, a))]
    below = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    angles = 2 * np.arctan2(np.sum(a * np.cross(b, c), axis=1), below)
    return bool(abs(angles.sum()) > 2 * np.pi)
