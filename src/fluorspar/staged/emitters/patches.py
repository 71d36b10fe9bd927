"""Emitter arrays: a fluorescent surface cut into patches that each emit evenly."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, OptionError, message
from fluorspar.staged.emitters.grid_cells import grid_cells
from fluorspar.staged.emitters.mesh import TriangleMesh

__all__ = ["EmitterArray", "decimated_patches", "mesh_patches", "planar_patches", "split_patches"]

Array = NDArray[np.float64]
_FACES_PER_PATCH = 8
_SAME_PLACE = 1e-6  # of the size of a mesh: corners nearer than that are one
_DECIMATED_SIZE = 3.5  # diagonal of a mesh when it is decimated, about that of a ball of radius 1
# How much the direction of a surface counts against its place. On the Stanford bunny with 100 patches under a
# lamp, the light varies within patches by 0.69 of its mean for 0, 0.57 for 0.5, 0.52 for 1 and 1.5, 0.58 for
# 2.5.
_NORMAL_WEIGHT = 1.2


@dataclass(frozen=True, eq=False)
class EmitterArray:
    """One side of a fluorescent surface, cut into K patches.

    Attributes
    ----------
    mesh : TriangleMesh
        The surface itself.
    patch : ndarray of shape (F,)
        The patch of each of its faces.
    copy : TriangleMesh, optional
        A decimated copy whose face k emits for patch k, if it is not the surface that emits.
    surface, back, row : int, bool, int
        Number of the surface in the scene, whether this is its back, and its material row.
    """

    mesh: TriangleMesh
    patch: NDArray[np.int64]
    copy: TriangleMesh | None = None
    surface: int = 0
    back: bool = False
    row: int = 0

    def __len__(self) -> int:
        return int(self.patch.max()) + 1

    @cached_property
    def areas(self) -> Array:
        """Areas of the pieces of the true surface, ndarray of shape (K,)."""
        return np.bincount(self.patch, self.mesh.areas, minlength=len(self)).astype(np.float64)

    @cached_property
    def gain(self) -> Array:
        """Factors on the radiance of the emitters that conserve the emitted power, ndarray of shape (K,).

        1 where the surface itself emits; else area of the piece over area of the face that emits for it.
        """
        return np.ones(len(self)) if self.copy is None else self.areas / self.copy.areas

    @property
    def emitting(self) -> TriangleMesh:
        """The mesh that emits: the copy if there is one, else the surface itself."""
        return self.mesh if self.copy is None else self.copy

    @cached_property
    def patch_of_face(self) -> NDArray[np.int64]:
        """The patch of each face of the mesh that emits, ndarray of shape (F,)."""
        return self.patch if self.copy is None else np.arange(len(self))

    def emitters(self) -> list[TriangleMesh]:
        """The K pieces that emit."""
        if self.copy is not None:
            return [self.copy.submesh(np.array([face])) for face in range(len(self))]
        return [self.mesh.submesh(faces) for faces in _faces_by_patch(self.patch, len(self))]

    def sample(self, per_patch: int, seed: int) -> tuple[Array, Array, NDArray[np.int64]]:
        """Spread points evenly over each patch of the true surface.

        Parameters
        ----------
        per_patch : int
            Points on each.
        seed : int
            The same seed gives the same points.

        Returns
        -------
        points, normals : ndarray of shape (K per_patch, 3)
        patch : ndarray of shape (K per_patch,)
        """
        rng = np.random.default_rng(seed)
        patch = np.repeat(np.arange(len(self)), per_patch)
        order = np.argsort(self.patch, kind="stable")
        # Faces by patch, in a row as long as the area; strata within each patch keep the noise low.
        ends = np.cumsum(self.mesh.areas[order])
        start = np.concatenate([[0.0], np.cumsum(self.areas)[:-1]])
        stratum = np.tile(np.arange(per_patch), len(self))
        along = start[patch] + (stratum + rng.random(len(patch))) / per_patch * self.areas[patch]
        face = order[np.minimum(np.searchsorted(ends, along), len(order) - 1)]
        return self.mesh.points(face, rng.random((len(face), 2))), self.mesh.face_normals[face], patch


def planar_patches(mesh: TriangleMesh, count: int) -> EmitterArray:
    """Cut a planar surface into the cells of a `count` x `count` grid over its bounding rectangle.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0.0]])
    >>> square = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> planar_patches(square, 2).areas
    array([1., 1., 1., 1.])
    """
    cells, patch = grid_cells(mesh, count)
    return EmitterArray(cells, patch)


def mesh_patches(mesh: TriangleMesh, count: int) -> EmitterArray:
    """Cut any surface into `count` compact patches of about the same area.

    The largest piece is halved, across its longest extent in space and in direction of the normal, until
    there are enough. Faces that are large for a patch are subdivided first, so any count is possible.

    Examples
    --------
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(2)
    >>> array = mesh_patches(TriangleMesh(ball.vertices, ball.faces), 10)
    >>> len(array), bool(abs(array.areas.sum() - ball.area) < 1e-9)
    (10, True)
    """
    largest_face = mesh.areas.sum() / (_FACES_PER_PATCH * count)
    while (large := mesh.areas > largest_face).any():
        mesh, _ = mesh.subdivided(large)
    pieces = [np.arange(len(mesh.faces))]
    areas = [float(mesh.areas.sum())]
    while len(pieces) < count:
        largest = int(np.argmax(areas))
        for half in _halves(mesh, pieces.pop(largest)):
            pieces.append(half)
            areas.append(float(mesh.areas[half].sum()))
        del areas[largest]
    return EmitterArray(mesh, _labels(len(mesh.faces), pieces))


def split_patches(array: EmitterArray, halved: NDArray[np.bool_]) -> tuple[EmitterArray, NDArray[np.int64]]:
    """Halve some patches of a surface.

    Parameters
    ----------
    array : EmitterArray
        Not a decimated one.
    halved : ndarray of shape (K,), bool
        Which.

    Returns
    -------
    array : EmitterArray
    parent : ndarray of shape (K',)
        The old patch of each new one.

    Examples
    --------
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(2)
    >>> array = mesh_patches(TriangleMesh(ball.vertices, ball.faces), 3)
    >>> split_patches(array, np.array([True, False, False]))[1]
    array([0, 0, 1, 2])
    """
    mesh, patch = array.mesh, array.patch
    while (few := halved & (np.bincount(patch, minlength=len(array)) < _FACES_PER_PATCH)).any():
        mesh, parent_face = mesh.subdivided(few[patch])
        patch = patch[parent_face]
    pieces, parent = [], []
    for number, faces in enumerate(_faces_by_patch(patch, len(array))):
        for piece in _halves(mesh, faces) if halved[number] else (faces,):
            pieces.append(piece)
            parent.append(number)
    return replace(array, mesh=mesh, patch=_labels(len(mesh.faces), pieces)), np.array(parent)


def decimated_patches(mesh: TriangleMesh, count: int) -> EmitterArray:
    """Decimate a mesh to `count` faces; each emits for the part of the surface nearest to it (the paper's
    way).

    Raises
    ------
    OptionError
        If the mesh has fewer faces than that, or so few are asked for that nothing with an area is left.

    Warns
    -----
    ApproximationWarning
        If more faces are left than asked for.

    Examples
    --------
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(3)
    >>> array = decimated_patches(TriangleMesh(ball.vertices, ball.faces), 60)
    >>> power = (array.gain * array.copy.areas).sum()
    >>> bool(abs(power - array.mesh.areas.sum()) < 1e-9)
    True
    """
    import fast_simplification
    from scipy.spatial import cKDTree

    if count > len(mesh.faces):
        raise OptionError(
            message(
                "there are more emitters than the mesh has faces",
                got=f"{count} emitters, {len(mesh.faces)} faces",
                expected=f"1 to {len(mesh.faces)}",
                fix="lower the number of patches, or use mode 'true', which cuts faces where it has to",
            )
        )
    # Simplification works on shared corners; a mesh may come with a vertex per face corner.
    places = (mesh.vertices / (_SAME_PLACE * mesh.size)).round()
    _, first, inverse = np.unique(places, axis=0, return_index=True, return_inverse=True)
    # It also stops at an error in units of length: brought to one size, all meshes are decimated alike.
    centre, unit = mesh.vertices[first].mean(axis=0), mesh.size / _DECIMATED_SIZE
    vertices, faces = fast_simplification.simplify(
        ((mesh.vertices[first] - centre) / unit).astype(np.float32),
        inverse.reshape(-1)[mesh.faces].astype(np.int32),
        target_count=count,
    )
    corners = np.asarray(vertices, dtype=np.float64) * unit + centre
    if len(faces) > count:
        text = f"the mesh was decimated to {len(faces)} faces, not to {count}"
        warnings.warn(text, ApproximationWarning, stacklevel=2)
    a, b, c = corners[np.asarray(faces, dtype=np.int64).reshape(-1, 3).T]
    solid = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0
    if not solid.any():
        raise OptionError(
            message(
                "no face of the decimated mesh has an area",
                got=f"{count} asked for",
                expected="4 or more, to enclose a volume",
                fix="raise the number of patches, or use mode 'true'",
            )
        )
    copy = TriangleMesh(corners, np.asarray(faces, dtype=np.int64)[solid])
    patch = cKDTree(copy.centroids).query(mesh.centroids)[1]
    # A face to which no part of the surface is nearest has nothing to emit.
    used, patch = np.unique(patch, return_inverse=True)
    return EmitterArray(mesh, np.asarray(patch, dtype=np.int64), copy.submesh(used))


def _halves(mesh: TriangleMesh, faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Halve a set of faces by area across its longest extent."""
    areas = mesh.areas[faces]
    scale = _NORMAL_WEIGHT * np.sqrt(areas.sum())
    place = np.hstack([mesh.centroids[faces], scale * mesh.face_normals[faces]])
    place = place - np.average(place, axis=0, weights=areas + 1e-300)
    along = place @ np.linalg.eigh((place * areas[:, np.newaxis]).T @ place)[1][:, -1]
    order = np.argsort(along, kind="stable")
    cut = int(np.clip(np.searchsorted(np.cumsum(areas[order]), areas.sum() / 2), 1, len(faces) - 1))
    return faces[order[:cut]], faces[order[cut:]]


def _faces_by_patch(patch: NDArray[np.int64], count: int) -> list[NDArray[np.int64]]:
    order = np.argsort(patch, kind="stable")
    return np.split(order, np.cumsum(np.bincount(patch, minlength=count))[:-1])


def _labels(faces: int, pieces: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    patch = np.empty(faces, dtype=np.int64)
    for number, piece in enumerate(pieces):
        patch[piece] = number
    return patch
