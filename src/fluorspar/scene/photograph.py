"""Where points of a scene appear in a photograph, estimated from points whose pixels are known (correspondences).

Noise of the pixels lets every linear system look regular, and a projection fitted to noise can have residuals of
0. So what is asked before one is used is how flat the points are, and how far noise is magnified between them.

Eqs. 15 and 16 are those of Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, message

__all__ = ["MODELS", "Projection", "estimate_projection"]

Array = NDArray[np.float64]
Design = Callable[[Array], Array]

MODELS = {"linear": 3, "affine": 4, "perspective": 6}
"""Kinds of projections that can be estimated, and how many correspondences each needs."""

_PLANAR = 1e-7  # smallest singular value over largest, of normalised coordinates
_ROUNDING = 1e-7  # smallest singular value over largest, of points computed to be in one plane
_EXACT = 1e-8  # residuals over the extent of the pixels, of pixels that were computed and not measured
_FLAT = 0.02  # thickness over length, of points measured to be in one plane
_THIN = 0.1  # thickness over length, at least, of the box in which noise must not be magnified
_MAGNIFIED = 10.0
_SCATTER = 3.0  # how far the second best solution must be from the best, in residuals

_SPREAD_OUT = "add correspondences, spread over depth, width and height"
_ANOTHER = f"{_SPREAD_OUT}, or use the affine model"


@dataclass(frozen=True)
class Projection:
    """An estimated projection.

    Attributes
    ----------
    matrix
        ndarray of shape (2, 3) for "linear", (2, 4) for "affine", (3, 4) for "perspective".
    residuals
        ndarray of shape (n, 2): projected minus given pixels.
    model
        One of `MODELS`.
    """

    matrix: Array
    residuals: Array
    model: str

    @property
    def rms(self) -> float:
        """Root mean square distance between projected and given pixels."""
        return float(np.sqrt(np.mean(np.sum(self.residuals**2, axis=1))))

    def project(self, points: ArrayLike) -> Array:
        """Find where points of shape (..., 3) appear, in pixels of shape (..., 2)."""
        points = np.asarray(points, dtype=np.float64)
        if points.shape[-1:] != (3,):
            raise OptionError(
                message("these are not points", got=f"shape {points.shape}", expected="shape (..., 3)")
            )
        if self.model == "linear":
            return np.asarray(points @ self.matrix.T)
        image = points @ self.matrix[:, :3].T + self.matrix[:, 3]
        if self.model == "affine":
            return np.asarray(image)
        depth = image[..., 2:]
        return np.asarray(image[..., :2] / np.where(depth > 0, depth, np.nan))


def estimate_projection(points: ArrayLike, pixels: ArrayLike, model: str | None = None) -> Projection:
    """Estimate the projection of a photograph or a foreign render from corresponding points (Eq. 16).

    Parameters
    ----------
    points : array_like of shape (n, 3)
        In scene units.
    pixels : array_like of shape (n, 2)
        Where they appear.
    model
        "linear": pixels = M x with M of 2 x 3, from 3 points on, for coordinates relative to a common origin
        (the paper's Eq. 16); "affine": 2 x 4, from 4 points on; "perspective": 3 x 4, from 6 points on, two
        of them off any plane, by the normalised direct linear transform. Default: the last of these for
        which there are enough different points. For points in one plane say "linear", if their coordinates are
        relative to the point at pixel (0, 0).

    Returns
    -------
    Projection
        With residuals: they are 0 where there are just enough points, and then say nothing.

    Raises
    ------
    OptionError
        If there are too few points, or they do not determine the projection: they lie in one plane (for a
        perspective: all but one do), on a critical surface, or so that the noise of a pixel is magnified more
        than 10 times in the box around the points, as estimated from the points and the residuals.

    References
    ----------
    R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2nd ed. 2004, algorithm 7.1.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    >>> found = estimate_projection(corners, [[10, 20], [30, 20], [10, 0], [20, 10]], "affine")
    >>> found.matrix.round(6)
    array([[ 20.,   0.,  10.,  10.],
           [  0., -20., -10.,  20.]])
    """
    x, u = np.asarray(points, dtype=np.float64), np.asarray(pixels, dtype=np.float64)
    if x.ndim != 2 or x.shape[1:] != (3,) or u.shape != (len(x), 2):
        raise OptionError(
            message(
                "points and pixels do not correspond",
                got=f"shapes {x.shape} and {u.shape}",
                expected="(n, 3) and (n, 2)",
            )
        )
    if not (np.isfinite(x).all() and np.isfinite(u).all()):
        raise OptionError(message("a coordinate is not a finite number", expected="finite points and pixels"))
    if model is None:
        possible = [name for name, least in MODELS.items() if len(distinct(x)) >= least]
        model = possible[-1] if possible else "linear"
    if model not in MODELS:
        raise OptionError(message("there is no such projection", got=repr(model), expected=", ".join(MODELS)))
    count = len(distinct(x)) if model == "perspective" else len(x)
    if count < MODELS[model]:
        raise OptionError(
            message(
                f"there are too few points for a projection that is {model}",
                got=count if count == len(x) else f"{count} distinct points, {len(x)} in all",
                expected=f"{MODELS[model]} or more",
            )
        )
    check_points(x, model)
    check_pixels(u, model)
    return _perspective(x, u) if model == "perspective" else _linear(x, u, model)


def _linear(x: Array, u: Array, model: str) -> Projection:
    """Least squares for 2 x 3 and 2 x 4 matrices."""
    if model == "linear":
        matrix = np.linalg.lstsq(x, u, rcond=None)[0].T
    else:
        centre = x.mean(axis=0)
        part = np.linalg.lstsq(x - centre, u - u.mean(axis=0), rcond=None)[0].T
        matrix = np.column_stack([part, u.mean(axis=0) - part @ centre])
    found = _with_residuals(matrix, x, u, model)
    if len(x) == MODELS[model] or not is_exact(found.residuals, u):
        check_points(x, model, exact=False)
        check_pixels(u, model, found.rms)

        def design(points: Array) -> Array:
            columns = [points] if model == "linear" else [points - centre, np.ones((len(points), 1))]
            return np.hstack(columns)[:, np.newaxis]

        check_magnification(x, design, MODELS[model])
    return found


def _perspective(x: Array, u: Array) -> Projection:
    """Normalised direct linear transform; the third row has unit length, so depths are in scene units."""
    t3, t2 = _normalising(x), _normalising(u)
    xh = np.column_stack([x, np.ones(len(x))]) @ t3.T
    uh = np.column_stack([u, np.ones(len(u))]) @ t2.T
    zero = np.zeros_like(xh)
    rows = np.concatenate([np.hstack([xh, zero, -uh[:, :1] * xh]), np.hstack([zero, xh, -uh[:, 1:2] * xh])])
    _, sizes, vectors = np.linalg.svd(rows, full_matrices=False)
    check_scatter(max(sizes[11], _PLANAR * sizes[0]), sizes[10])
    matrix = np.linalg.inv(t2) @ vectors[-1].reshape(3, 4) @ t3
    matrix /= np.linalg.norm(matrix[2, :3])
    depth = x @ matrix[2, :3] + matrix[2, 3]
    matrix = -matrix if np.median(depth) < 0 else matrix
    check_depths(x, matrix)
    found = _with_residuals(matrix, x, u, "perspective")
    if not is_exact(found.residuals, u):
        check_points(x, "perspective", exact=False)
        check_pixels(u, "perspective", found.rms)
        check_magnification(x, perspective_design(matrix, t3), 11, matrix[2])
    return found


def _with_residuals(matrix: NDArray[np.floating], x: Array, u: Array, model: str) -> Projection:
    found = Projection(np.asarray(matrix, dtype=np.float64), np.zeros((0, 2)), model)
    return Projection(found.matrix, found.project(x) - u, model)


def _normalising(points: Array) -> Array:
    """Transform that moves the centre to the origin and the mean distance to sqrt(dimension)."""
    n = points.shape[1]
    centre = points.mean(axis=0)
    scale = np.sqrt(n) / np.linalg.norm(points - centre, axis=1).mean()
    transform = np.eye(n + 1)
    transform[:n, :n] *= scale
    transform[:n, n] = -scale * centre
    return transform


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
