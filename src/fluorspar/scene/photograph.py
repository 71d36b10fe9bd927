"""Where points of a scene appear in a photograph, estimated from points whose pixels are known (correspondences).

Eqs. 15 and 16 are those of Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, message

__all__ = ["LARGEST_CONDITION", "MODELS", "Projection", "estimate_projection"]

Array = NDArray[np.float64]

MODELS = {"linear": 3, "affine": 4, "perspective": 6}
"""Kinds of projections that can be estimated, and how many correspondences each needs."""

LARGEST_CONDITION = {"linear": 50.0, "affine": 50.0, "perspective": 25.0}
"""Beyond these, pixels known to about 1 % of the image say nothing of the projection; 50 is a slab 2 % thick."""

_MISFIT = 0.5  # residuals over the spread of the pixels, beyond which they are not explained at all


@dataclass(frozen=True)
class Projection:
    """An estimated projection.

    Attributes
    ----------
    matrix : ndarray of shape (2, 3), (2, 4) or (3, 4)
        For "linear", "affine" and "perspective".
    residuals : ndarray of shape (n, 2)
        Projected minus given pixels.
    model : str
        One of `MODELS`.
    condition : float
        Condition number of the equations: how many times larger the relative error of the matrix may be than that
        of the pixels.
    """

    matrix: Array
    residuals: Array
    model: str
    condition: float = 1.0

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


def estimate_projection(
    points: ArrayLike,
    pixels: ArrayLike,
    model: str | None = None,
    *,
    largest_condition: float | None = None,
) -> Projection:
    """Estimate the projection of a photograph or a foreign render from corresponding points (Eq. 16).

    Parameters
    ----------
    points : array_like of shape (n, 3)
        In scene units.
    pixels : array_like of shape (n, 2)
        Where they appear.
    model : {"linear", "affine", "perspective"}, optional
        "linear": pixels = M x with M of 2 x 3, from 3 points on, for coordinates relative to a common origin
        (the paper's Eq. 16); "affine": 2 x 4, from 4 points on; "perspective": 3 x 4, from 6 points on, two
        of them off any plane, by the normalised direct linear transform. Default: the last of these for
        which there are enough different points.
    largest_condition : float, optional
        Largest condition number to accept, instead of that in `LARGEST_CONDITION`; raise it for pixels that were
        computed and not measured.

    Returns
    -------
    Projection
        With residuals: they are 0 where there are just enough points, and then say nothing.

    Raises
    ------
    OptionError
        If there are too few points; if they do not determine the projection, by the condition number, because they
        lie almost in one plane (for a perspective: all but one do) or on another critical surface; if the pixels are
        not explained by it; or if it has points behind the camera.

    References
    ----------
    R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2nd ed. 2004, algorithm 7.1.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    >>> projection = estimate_projection(corners, [[10, 20], [30, 20], [10, 0], [20, 10]], "affine")
    >>> projection.matrix.round(6)
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
    distinct = len(np.unique(x, axis=0))
    if model is None:
        model = next((name for name in reversed(MODELS) if distinct >= MODELS[name]), "linear")
    if model not in MODELS:
        raise OptionError(message("there is no such projection", got=repr(model), expected=", ".join(MODELS)))
    if distinct < MODELS[model]:
        raise OptionError(
            message(
                f"there are too few points for a projection that is {model}",
                got=f"{distinct} distinct points, {len(x)} in all",
                expected=f"{MODELS[model]} or more",
            )
        )
    matrix, sizes = {"linear": _linear, "affine": _affine, "perspective": _perspective}[model](x, u)
    condition = float(sizes[0] / sizes[-1]) if sizes[-1] > 0 else np.inf
    largest = LARGEST_CONDITION[model] if largest_condition is None else largest_condition
    if not condition <= largest:
        raise OptionError(
            message(
                "the points do not determine the projection: they lie almost in one plane, all but one do, or "
                "on another surface that leaves it open",
                got=f"a condition number of {condition:.3g}",
                expected=f"at most {largest:g}",
                fix="add correspondences, spread over depth, width and height, or use a simpler model",
            )
        )
    residuals = Projection(matrix, np.zeros((0, 2)), model).project(x) - u
    if model == "perspective" and (behind := int(np.isnan(residuals[:, 0]).sum())):
        raise OptionError(
            message(
                "the points do not determine a perspective: the best one has points behind the camera",
                got=f"{behind} of {len(x)} points behind it",
                expected="all points in front",
                fix="check that each pixel belongs to its point",
            )
        )
    projection = Projection(matrix, residuals, model, condition)
    spread = float(np.linalg.norm(u - u.mean(axis=0), axis=1).max())
    if not projection.rms < _MISFIT * spread:
        raise OptionError(
            message(
                "no projection explains the pixels, or they coincide",
                got=f"residuals of {projection.rms:.3g} pixels, {spread:.3g} pixels from their middle at most",
                expected=f"residuals below {_MISFIT:g} of that",
                fix="check that each pixel belongs to its point",
            )
        )
    return projection


def _linear(x: Array, u: Array) -> tuple[Array, Array]:
    """Least squares for a 2 x 3 matrix, and the singular values of the equations, largest first."""
    matrix, _, _, sizes = np.linalg.lstsq(x, u, rcond=None)
    return np.asarray(matrix.T, dtype=np.float64), np.asarray(sizes)


def _affine(x: Array, u: Array) -> tuple[Array, Array]:
    """The same for a 2 x 4 matrix."""
    part, sizes = _linear(x - x.mean(axis=0), u - u.mean(axis=0))
    return np.column_stack([part, u.mean(axis=0) - part @ x.mean(axis=0)]), sizes


def _perspective(x: Array, u: Array) -> tuple[Array, Array]:
    """The same for a 3 x 4 matrix, whose scale is free: its third row has unit length, for depths in scene units."""
    t3, t2 = _normalising(x), _normalising(u)
    xh = np.column_stack([x, np.ones(len(x))]) @ t3.T
    uh = np.column_stack([u, np.ones(len(u))]) @ t2.T
    zero = np.zeros_like(xh)
    rows = np.concatenate([np.hstack([xh, zero, -uh[:, :1] * xh]), np.hstack([zero, xh, -uh[:, 1:2] * xh])])
    _, sizes, vectors = np.linalg.svd(rows, full_matrices=False)
    matrix = np.linalg.inv(t2) @ vectors[-1].reshape(3, 4) @ t3
    matrix /= np.linalg.norm(matrix[2, :3])
    in_front = np.median(x @ matrix[2, :3] + matrix[2, 3]) >= 0
    return np.asarray(matrix if in_front else -matrix), np.asarray(sizes[:-1])


def _normalising(points: Array) -> Array:
    """Transform that moves the centre to the origin and the mean distance to sqrt(dimension)."""
    n = points.shape[1]
    centre = points.mean(axis=0)
    scale = np.sqrt(n) / max(np.linalg.norm(points - centre, axis=1).mean(), 1e-300)
    transform = np.eye(n + 1)
    transform[:n, :n] *= scale
    transform[:n, n] = -scale * centre
    return transform
