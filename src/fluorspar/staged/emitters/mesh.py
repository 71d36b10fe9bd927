"""Triangle meshes: areas, points on the surface, splitting."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message

__all__ = ["TriangleMesh"]

Array = NDArray[np.float64]
_PLANAR = 1e-4  # height over extent, of surfaces with vertex normals
_NEARLY_PLANAR = 1e-2  # of surfaces without: walls of measured rooms are a little skew


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles in world coordinates.

    Parameters
    ----------
    vertices : ndarray of shape (V, 3)
    faces : ndarray of shape (F, 3)
        Counterclockwise seen from the front.
    normals : ndarray of shape (V, 3), optional
        Vertex normals of a smooth surface.
    deviation : float
        How far the surface may be from its triangles: 0, unless they stand for a curved shape.

    Raises
    ------
    SceneError
        If there is no triangle with an area.

    Examples
    --------
    >>> corner = TriangleMesh(np.eye(3), np.array([[0, 1, 2]]))
    >>> float(corner.areas[0].round(3)), corner.is_planar
    (0.866, True)
    """

    vertices: Array
    faces: NDArray[np.int64]
    normals: Array | None = None
    deviation: float = 0.0

    def __post_init__(self) -> None:
        if len(self.faces) == 0 or not np.isfinite(self.vertices).all() or not self.areas.sum() > 0:
            raise SceneError(
                message(
                    "a fluorescent surface has no triangle with an area",
                    got=f"{len(self.vertices)} vertices, {len(self.faces)} faces",
                    expected="a mesh of triangles with finite coordinates",
                )
            )

    @cached_property
    def _crosses(self) -> Array:
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return np.asarray(np.cross(b - a, c - a))

    @cached_property
    def areas(self) -> Array:
        """Areas of the faces, ndarray of shape (F,)."""
        return np.asarray(np.linalg.norm(self._crosses, axis=1) / 2)

    @cached_property
    def face_normals(self) -> Array:
        """Unit normals of the faces, ndarray of shape (F, 3); 0 for a face without area."""
        length = np.linalg.norm(self._crosses, axis=1, keepdims=True)
        return np.asarray(self._crosses / np.where(length > 0, length, 1))

    @cached_property
    def centroids(self) -> Array:
        """Centres of the faces, ndarray of shape (F, 3)."""
        return np.asarray(self.vertices[self.faces].mean(axis=1))

    @property
    def size(self) -> float:
        """Diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.vertices[self.faces].reshape(-1, 3), axis=0)))

    @property
    def is_planar(self) -> bool:
        """Whether the faces lie in one plane, or nearly so where no vertex normals round the surface off."""
        normal = self.areas @ self.face_normals
        normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
        heights = self.vertices[self.faces].reshape(-1, 3) @ normal
        same_way = (self.face_normals @ normal)[self.areas > 0].min() > 0
        limit = _NEARLY_PLANAR if self.normals is None else _PLANAR
        return bool(same_way and np.ptp(heights) <= limit * self.size)

    def flipped(self) -> TriangleMesh:
        """The same surface, front and back exchanged."""
        normals = None if self.normals is None else -self.normals
        return replace(self, faces=self.faces[:, ::-1], normals=normals)

    def submesh(self, faces: NDArray[np.integer] | NDArray[np.bool_]) -> TriangleMesh:
        """Some of the faces, with the vertices they need and those vertices' normals."""
        used, corners = np.unique(self.faces[faces], return_inverse=True)
        normals = None if self.normals is None else self.normals[used]
        return replace(self, vertices=self.vertices[used], faces=corners.reshape(-1, 3), normals=normals)

    def subdivided(self, cut: NDArray[np.bool_]) -> tuple[TriangleMesh, NDArray[np.int64]]:
        """The same surface, some faces cut into four; vertex normals are interpolated as a renderer does.

        Parameters
        ----------
        cut : ndarray of shape (F,), bool
            Which.

        Returns
        -------
        mesh : TriangleMesh
        parent : ndarray of shape (F',)
            The old face of each new one.
        """
        v, f = self.vertices, self.faces[cut]
        edges = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (inverse.reshape(3, -1) + len(v))[:]
        a, b, c = f.T
        faces = np.stack(
            [np.stack(corners, 1) for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))], 1
        ).reshape(-1, 3)
        vertices = np.concatenate([v, v[unique].mean(axis=1)])
        normals = None
        if self.normals is not None:
            normals = np.concatenate([self.normals, self.normals[unique].mean(axis=1)])
        parent = np.concatenate([np.flatnonzero(~cut), np.repeat(np.flatnonzero(cut), 4)])
        faces = np.concatenate([self.faces[~cut], faces])
        return replace(self, vertices=vertices, faces=faces, normals=normals), parent

    def points(self, face: NDArray[np.int64], u: Array) -> Array:
        """Points on the given faces, evenly distributed for random `u` of shape (n, 2); shape (n, 3)."""
        root = np.sqrt(u[:, :1])
        a, b, c = (self.vertices[self.faces[face, k]] for k in range(3))
        return np.asarray((1 - root) * a + root * (1 - u[:, 1:]) * b + root * u[:, 1:] * c)
