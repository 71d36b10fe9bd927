"""Cut a planar, or nearly planar, mesh into the cells of a grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.staged.emitters.mesh import TriangleMesh

__all__ = ["grid_cells"]

Array = NDArray[np.float64]
_NO_AREA = 1e-9  # of the whole


def grid_cells(mesh: TriangleMesh, count: int) -> tuple[TriangleMesh, NDArray[np.int64]]:
    """Cut a planar mesh into the `count` x `count` cells of its smallest bounding rectangle.

    Parameters
    ----------
    mesh : TriangleMesh
        Planar; a height over the plane, where there is a little, is kept.
    count : int
        N; 1 or more.

    Returns
    -------
    mesh : TriangleMesh
        The same surface, cut along the cell borders, without vertex normals.
    cell : ndarray of shape (F,)
        Cell of each face, 0 to N N - 1 and in that order; cells outside the surface are left out.

    Raises
    ------
    OptionError
        If `count` is less than 1.

    Examples
    --------
    >>> triangle = TriangleMesh(np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0.0]]), np.array([[0, 1, 2]]))
    >>> cells, cell = grid_cells(triangle, 2)
    >>> bool(np.isclose(cells.areas.sum(), 2.0))
    True
    """
    if count < 1:
        raise OptionError(message("a surface needs at least one emitter", got=count, expected="1 or more"))
    origin, axes = _smallest_rectangle(mesh)
    flat = (mesh.vertices - origin) @ axes.T
    corners = flat[mesh.faces]
    low, width = corners.min(axis=(0, 1)), np.ptp(corners, axis=(0, 1)) / count
    low[2], width[2] = 0.0, 1.0
    polygons: list[Array] = []
    cells: list[int] = []
    for triangle in (corners - low) / width:
        for i, strip in _strips(triangle, 0, count):
            for j, piece in _strips(strip, 1, count):
                polygons.append(piece)
                cells.append(i * count + j)
    vertices: list[Array] = []
    faces: list[tuple[int, int, int]] = []
    of_face: list[int] = []
    for polygon, cell in zip(polygons, cells, strict=True):
        first = len(vertices)
        vertices.extend(polygon)
        fan = [(first, first + k, first + k + 1) for k in range(1, len(polygon) - 1)]
        faces += fan
        of_face += [cell] * len(fan)
    world = (np.array(vertices) * width + low) @ axes + origin
    cut = TriangleMesh(world, np.array(faces, dtype=np.int64))
    kept = cut.areas > _NO_AREA * cut.areas.sum()
    _, number = np.unique(np.array(of_face)[kept], return_inverse=True)
    return cut.submesh(kept), np.asarray(number, dtype=np.int64)


def _strips(polygon: Array, axis: int, count: int) -> list[tuple[int, Array]]:
    """Cut a convex polygon (n, 3), in units of cells, into the strips it meets along one axis."""
    first = int(np.clip(np.floor(polygon[:, axis].min()), 0, count - 1))
    last = int(np.clip(np.ceil(polygon[:, axis].max()), first + 1, count))
    strips = []
    for k in range(first, last):
        piece = _clip(_clip(polygon, axis, k, above=True), axis, k + 1, above=False)
        if len(piece) >= 3:
            strips.append((k, piece))
    return strips


def _clip(polygon: Array, axis: int, bound: float, *, above: bool) -> Array:
    """Keep the part of a convex polygon on one side of a line (Sutherland-Hodgman)."""
    if len(polygon) == 0:
        return polygon
    inside = (polygon[:, axis] - bound) * (1 if above else -1)
    kept = []
    for k, here in enumerate(polygon):
        last, d0, d1 = polygon[k - 1], inside[k - 1], inside[k]
        if (d0 < 0) != (d1 < 0):
            kept.append(last + (here - last) * (d0 / (d0 - d1)))
        if d1 >= 0:
            kept.append(here)
    return np.array(kept).reshape(-1, 3)


def _smallest_rectangle(mesh: TriangleMesh) -> tuple[Array, Array]:
    """Origin and axes (rows; the third is the normal) of the smallest rectangle around a planar mesh."""
    from scipy.spatial import ConvexHull

    normal = mesh.areas @ mesh.face_normals
    normal = normal / np.linalg.norm(normal)
    edges = (mesh.vertices[np.roll(mesh.faces, 1, axis=1)] - mesh.vertices[mesh.faces]).reshape(-1, 3)
    edge = edges[np.argmax((edges**2).sum(axis=1))]  # the first triangle may be a point
    u = edge - normal * (edge @ normal)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    origin = mesh.vertices[mesh.faces[0, 0]]
    flat = (mesh.vertices[np.unique(mesh.faces)] - origin) @ np.stack([u, v]).T
    hull = flat[ConvexHull(flat).vertices]
    smallest, along = np.inf, np.array([1.0, 0.0])
    for direction in np.roll(hull, -1, axis=0) - hull:
        direction = direction / np.linalg.norm(direction)
        area = np.ptp(hull @ direction) * np.ptp(hull @ [-direction[1], direction[0]])
        if area < smallest * (1 - 1e-9):
            smallest, along = area, direction
    x = along[0] * u + along[1] * v
    return origin, np.stack([x, np.cross(normal, x), normal])
