"""Vertex normals that a mesh lacks, the same each time.

Mitsuba computes them when it loads the mesh, with several threads that add up the parts in an order that is never the
same, so that their last bits differ from run to run, and the images with them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["settle_normals", "vertex_normals"]

_FEW = 500  # triangles that one thread does alone
_ALIKE = 1e-3  # what the normals of Mitsuba differ from ours, if it has computed them
_NEARLY_ALL = 0.99  # of them: where triangles have hardly an area, rounding decides


def settle_normals(shape: Any) -> None:
    """Give a built mesh normals of ours, if Mitsuba has computed those that it has."""
    import mitsuba as mi

    if not shape.is_mesh() or not shape.has_vertex_normals() or shape.face_count() < _FEW:
        return
    params = mi.traverse(shape)
    faces, positions, found = (
        np.array(params[name]).reshape(-1, 3) for name in ("faces", "vertex_positions", "vertex_normals")
    )
    ours = vertex_normals(positions.astype(np.float64), faces)
    for normals in (ours, -ours):  # flipped
        if np.mean(np.abs(found - normals).max(axis=1) < _ALIKE) > _NEARLY_ALL:
            params["vertex_normals"] = normals.astype(np.float32).ravel()
            params.update()
            return


def vertex_normals(positions: NDArray[np.float64], faces: NDArray[np.integer[Any]]) -> NDArray[np.float64]:
    """Normals of the vertices of a mesh: means of those of its triangles, weighted by their angles.

    Parameters
    ----------
    positions : ndarray of shape (V, 3)
    faces : ndarray of shape (F, 3)
        Vertices of each triangle.

    Returns
    -------
    ndarray of shape (V, 3)
        (1, 0, 0) where there is no triangle with an area.

    Notes
    -----
    As Mitsuba: G. Thürmer, C. A. Wüthrich, "Computing vertex normals from polygonal facets", J. Graphics Tools 3, 1998.

    Examples
    --------
    >>> corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    >>> vertex_normals(corner, np.array([[0, 1, 2]]))[0]
    array([0., 0., 1.])
    """
    corners = positions[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    of_face = _unit(across)
    sums = np.zeros_like(positions)
    for k in range(3):
        a, b = (_unit(corners[:, (k + step) % 3] - corners[:, k]) for step in (1, 2))
        angle = np.arccos(np.clip((a * b).sum(axis=1), -1, 1))
        for axis in range(3):
            sums[:, axis] += np.bincount(faces[:, k], of_face[:, axis] * angle, len(positions))
    none = ~sums.any(axis=1)
    normals = _unit(sums)
    normals[none] = (1, 0, 0)
    return normals


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: NDArray[np.float64] = np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0)
    return unit
