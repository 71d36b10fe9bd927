"""Which way round triangles are: each with its neighbours, and with their front on the outer side.

Of trimesh's own repairs, `fix_winding` needs another package, walks from triangle to triangle in Python and winds all
like the first one; `fix_inversion` skips open bodies and turns the walls of cavities.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneNotice

if TYPE_CHECKING:
    import trimesh

__all__ = ["turned_faces"]

Array = NDArray[np.float64]
Labels = NDArray[np.int64]
Mask = NDArray[np.bool_]

_FLAT = 0.01  # volume over area^1.5 of an open part (0.09 for a ball) below which it has no outer side


def turned_faces(mesh: trimesh.Trimesh, name: str) -> Mask:
    """Find the faces to turn: those against their neighbours, and parts that face inwards.

    Faces hang together across edges that exactly two of them share. Within such a part the winding of the larger
    area counts. A part faces inwards if the volume between it and its centroid is negative; a part that another
    encloses may be the wall of a cavity and stays as it is, relative to the whole.

    Parameters
    ----------
    mesh : trimesh.Trimesh
        With merged vertices, and no vertex twice in a face.
    name : str
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
    >>> import trimesh
    >>> ball = trimesh.creation.icosahedron()
    >>> inside_out = trimesh.Trimesh(ball.vertices, ball.faces[:, ::-1], process=False)
    >>> bool(turned_faces(inside_out, "ball").all())
    True
    """
    part, against, one_sided = _parts(mesh)
    area = mesh.area_faces
    against ^= (2 * np.bincount(part, area * against) > np.bincount(part, area))[part]
    triangles = np.where(against[:, np.newaxis, np.newaxis], mesh.triangles[:, ::-1], mesh.triangles)
    neighbours = np.bincount(mesh.face_adjacency.ravel(), minlength=len(area))
    closed = np.bincount(part, neighbours < 3) == 0
    inwards = _inward(triangles, part, closed)[part]
    if one_sided:
        text = (
            f"{name} has a surface with one side only, like a Moebius strip: some of it shows its black back"
        )
        warnings.warn(text, SceneNotice, stacklevel=4)
    if against.any():
        text = f"{int(against.sum())} of {len(area)} triangles were wound against their neighbours; they are turned"
        warnings.warn(f"{name}: {text}", SceneNotice, stacklevel=4)
    if (open_ones := inwards & ~closed[part]).any():
        text = f"open parts with {int(open_ones.sum())} of {len(area)} triangles had their front on the inner side"
        warnings.warn(f"{name}: {text}; they are turned", SceneNotice, stacklevel=4)
    return np.asarray(against ^ inwards)


def _parts(mesh: trimesh.Trimesh) -> tuple[Labels, Mask, bool]:
    """Label of each face's part, which faces are wound against its first one, and whether that has no answer.

    Two nodes stand for each face, one as it is and one turned; neighbours are linked where they agree. A part that
    can be wound in one sense falls into two sets of nodes, each the other one turned.
    """
    import trimesh

    faces, edges, n = mesh.faces, mesh.face_adjacency_edges, len(mesh.faces)
    first, second = mesh.face_adjacency.T
    along = [
        ((faces[face] == edges[:, :1]) & (np.roll(faces[face], -1, axis=1) == edges[:, 1:])).any(axis=1)
        for face in (first, second)
    ]
    other = np.where(along[0] != along[1], 0, n)
    links = np.concatenate(
        [np.stack([first, second + other], 1), np.stack([first + n, (second + n + other) % (2 * n)], 1)]
    )
    label = trimesh.graph.connected_component_labels(links, node_count=2 * n).astype(np.int64)
    plain, turned = label[:n], label[n:]
    part = np.unique(np.minimum(plain, turned), return_inverse=True)[1].reshape(-1)
    return part, np.asarray(plain > turned), bool((plain == turned).any())


def _inward(triangles: Array, part: Labels, closed: Mask) -> Mask:
    """Which parts face inwards, of triangles of shape (F, 3, 3) with a part each."""
    low, high = (np.full((len(closed), 3), bound) for bound in (np.inf, -np.inf))
    np.minimum.at(low, part, triangles.min(axis=1))
    np.maximum.at(high, part, triangles.max(axis=1))
    area_vectors = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    area = np.linalg.norm(area_vectors, axis=1)
    areas = np.bincount(part, area)
    middles = triangles.mean(axis=1)
    weights = np.maximum(areas, 1e-300)
    centroids = np.stack([np.bincount(part, area * column) / weights for column in middles.T], axis=1)
    # about the centroid, because that of an open part depends on where it is
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
