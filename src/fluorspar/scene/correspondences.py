"""Whether corresponding points and pixels determine a projection, whatever the noise of the pixels.

Noise of the pixels lets every linear system look regular, and a projection fitted to noise can have residuals of
0. So what is asked here is how flat the points are, and how far noise is magnified between them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message

__all__ = [
    "check_depths",
    "check_magnification",
    "check_pixels",
    "check_points",
    "check_scatter",
    "distinct",
    "is_exact",
    "perspective_design",
    "spread",
]

Array = NDArray[np.float64]
Design = Callable[[Array], Array]

_ROUNDING = 1e-7  # smallest singular value over largest, of points computed to be in one plane
_EXACT = 1e-8  # residuals over the extent of the pixels, of pixels that were computed and not measured
_FLAT = 0.02  # thickness over length, of points measured to be in one plane
_THIN = 0.1  # thickness over length, at least, of the box in which noise must not be magnified
_MAGNIFIED = 10.0
_SCATTER = 3.0  # how far the second best solution must be from the best, in residuals

_SPREAD_OUT = "add correspondences, spread over depth, width and height"
_ANOTHER = f"{_SPREAD_OUT}, or use the affine model"


def distinct(points: Array) -> Array:
    """The points without repetitions."""
    return np.asarray(np.unique(points, axis=0))


def spread(vectors: Array) -> Array:
    """Singular values, as many as columns, relative to the first: the last is 0 for vectors in one plane.

    Examples
    --------
    >>> spread(np.array([[2.0, 0, 0], [0, 1, 0]]))
    array([1. , 0.5, 0. ])
    """
    sizes = np.linalg.svd(vectors, compute_uv=False)
    full = np.zeros(vectors.shape[1])
    full[: len(sizes)] = sizes
    return np.asarray(full / max(full[0], 1e-300))


def is_exact(residuals: Array, pixels: Array) -> bool:
    """Whether pixels are projections up to rounding, with more of them than unknowns to show it."""
    return bool(np.abs(residuals).max() <= _EXACT * np.ptp(pixels, axis=0).max())


def check_points(points: Array, model: str, exact: bool = True) -> None:
    """Refuse points in one plane, for a perspective also where all but one are.

    Raises
    ------
    OptionError
        If they are in one plane up to rounding or, where pixels are not exact, up to 2 % of their extent.
    """
    if model == "linear":
        _check_thickness(spread(points)[2], "lie in one plane with the origin", _ROUNDING)
        return
    limit = _ROUNDING if exact else _FLAT
    _check_thickness(spread(points - points.mean(axis=0))[2], "lie in one plane", limit)
    if model == "perspective":
        fault = "lie in one plane, or all but one of them do, and that leaves a perspective open"
        _check_thickness(_thickness_without_one(distinct(points)), fault, limit, _ANOTHER)


def _check_thickness(thickness: float, fault: str, limit: float, fix: str = _SPREAD_OUT) -> None:
    if not thickness > limit:
        raise OptionError(
            message(
                f"the points {fault}",
                got=f"a thickness of {thickness:.2g} of their length",
                expected=f"points that span all three dimensions, thicker than {limit:g}",
                fix=fix,
            )
        )


def _thickness_without_one(points: Array) -> float:
    """Relative thickness of the points without that one that contributes most to it."""
    n = len(points)
    away = points - points.mean(axis=0)
    without = away.T @ away - n / (n - 1) * away[:, :, np.newaxis] * away[:, np.newaxis]
    sizes = np.sqrt(np.clip(np.linalg.eigvalsh(without), 0, None))
    return float((sizes[:, 0] / np.maximum(sizes[:, 2], 1e-300)).min())


def check_pixels(pixels: Array, model: str, rms: float = 0.0) -> None:
    """Refuse pixels that coincide or lie on one line, up to the root mean square of the residuals."""
    centred = pixels if model == "linear" else pixels - pixels.mean(axis=0)
    sizes = np.linalg.svd(centred, compute_uv=False)
    width = sizes[-1] / np.sqrt(len(pixels))
    if not (sizes[-1] > _ROUNDING * np.abs(pixels).max() and width > rms):
        raise OptionError(
            message(
                "the pixels coincide or lie on one line",
                got=f"an extent of {width:.3g} pixels across it, residuals of {rms:.3g}",
                expected="pixels spread over the width and height of the image",
                fix=f"check that each pixel belongs to its point, or {_SPREAD_OUT}",
            )
        )


def check_depths(points: Array, matrix: Array) -> None:
    """Refuse a perspective that has some of its points behind the camera."""
    depth = points @ matrix[2, :3] + matrix[2, 3]
    behind = int(len(depth) - (depth > 0).sum())
    if behind:
        raise OptionError(
            message(
                "the points do not determine a perspective: the best one has points behind the camera",
                got=f"{behind} of {len(points)} points behind it",
                expected="all points in front",
                fix=f"check that each pixel belongs to its point; {_ANOTHER}",
            )
        )


def check_scatter(best: float, second: float) -> None:
    """Refuse a perspective where another, quite different one fits nearly as well (two singular values)."""
    if not second > _SCATTER * best:
        raise OptionError(
            message(
                "the points do not determine a perspective: quite another one fits nearly as well",
                got=f"residuals {max(second / best, 1):.2g} times as large",
                expected=f"more than {_SCATTER:g} times (the points may lie on a critical surface)",
                fix=f"measure the pixels better; {_ANOTHER}",
            )
        )


def check_magnification(points: Array, design: Design, unknowns: int, near: Array | None = None) -> None:
    """Refuse a projection that magnifies the noise of the pixels more than 10 times near its points.

    Parameters
    ----------
    points : ndarray of shape (n, 3)
    design
        Derivatives of shape (m, k, unknowns or more) of m projected points by the elements of the matrix.
    unknowns
        How many combinations of the elements matter.
    near : ndarray of shape (4,), optional
        Row of a perspective matrix that gives depths.

    Raises
    ------
    OptionError
        If the standard error of a projected corner of the box around the points is more than 10 times that
        of a pixel. For a perspective in pixels as large as at the middle depth of the points, and without
        corners that are nearer than all points.
    """
    corners = _box(points)
    scale = np.ones(len(corners))
    if near is not None:
        depths, at_corners = (x @ near[:3] + near[3] for x in (points, corners))
        front = at_corners >= depths.min()
        corners, scale = corners[front], np.minimum(1, at_corners[front] / np.median(depths))
    derivatives = design(points)
    _, sizes, vectors = np.linalg.svd(derivatives.reshape(-1, derivatives.shape[2]), full_matrices=False)
    magnified = np.inf
    if sizes[unknowns - 1] > 1e-14 * sizes[0]:
        per_noise = design(corners) @ (vectors[:unknowns].T / sizes[:unknowns])
        magnified = float((scale * np.sqrt(np.mean(np.sum(per_noise**2, axis=2), axis=1))).max())
    if not magnified <= _MAGNIFIED:
        raise OptionError(
            message(
                "the points do not determine the projection between them",
                got=f"an error of one pixel becomes {magnified:.3g} in the box around the points",
                expected=f"at most {_MAGNIFIED:g}",
                fix=_SPREAD_OUT if near is None else _ANOTHER,
            )
        )


def _box(points: Array) -> Array:
    """Corners of the box around the points, along their principal axes, of a tenth of its length at least."""
    centre = points.mean(axis=0)
    axes = np.linalg.eigh(np.cov(points.T))[1].T
    along = (points - centre) @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    half = np.maximum(high - low, _THIN * (high - low).max()) / 2
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.asarray(((low + high) / 2 + signs * half) @ axes + centre)


def perspective_design(matrix: Array, transform: Array) -> Design:
    """Derivatives of projected points by the 12 elements of the matrix, for points under a transform.

    Examples
    --------
    >>> design = perspective_design(np.eye(3, 4), np.eye(4))
    >>> design(np.array([[1.0, 0.0, 2.0]]))[0, 0]  # of x / z
    array([ 0.5 ,  0.  ,  1.  ,  0.5 ,  0.  ,  0.  ,  0.  ,  0.  , -0.25,
           -0.  , -0.5 , -0.25])
    """

    def design(points: Array) -> Array:
        own = np.column_stack([points, np.ones(len(points))])
        image = own @ matrix.T
        x, zero = own @ transform.T, np.zeros_like(own)
        u = image[:, :2] / image[:, 2:]
        rows = [np.hstack([x, zero, -u[:, :1] * x]), np.hstack([zero, x, -u[:, 1:] * x])]
        return np.asarray(np.stack(rows, axis=1) / image[:, 2:, np.newaxis])

    return design
