"""Where points of a scene appear in the image: the scene's own camera, and that of a photograph.

Eqs. 15 and 16 are those of Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, SceneError, message
from fluorspar.scene.correspondences import (
    check_depths,
    check_magnification,
    check_pixels,
    check_points,
    check_scatter,
    distinct,
    is_exact,
    perspective_design,
)
from fluorspar.scene.nodes import build, copy_nodes, resolving
from fluorspar.scene.renderer import SPECTRUM_VARIANT, use_variant
from fluorspar.scene.scene import Scene, sensor_node
from fluorspar.scene.trace_scene import set_film

__all__ = ["MODELS", "Camera", "Projection", "camera_of", "estimate_projection"]

Array = NDArray[np.float64]

_PLANAR = 1e-7  # smallest singular value over largest, of normalised coordinates
MODELS = {"linear": 3, "affine": 4, "perspective": 6}
"""Kinds of projections that can be estimated, and how many correspondences each needs."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: homogeneous pixels = matrix @ (x, y, z, 1) (Eq. 15).

    Parameters
    ----------
    matrix : ndarray of shape (3, 4)
        Its third row gives the depth along the viewing direction, in scene units.
    width, height
        Pixels of the image.
    """

    matrix: Array
    width: int
    height: int

    def project(self, points: ArrayLike) -> Array:
        """Find where points appear (Eq. 15).

        Parameters
        ----------
        points : array_like of shape (..., 3)
            In scene units.

        Returns
        -------
        ndarray of shape (..., 2)
            x to the right and y down, in pixels; (0, 0) is the upper left corner of the image and (0.5, 0.5)
            the centre of its first pixel. NaN for points that are not in front of the camera; points outside
            the image or hidden by something are projected too.

        Examples
        --------
        >>> camera = Camera(np.array([[100.0, 0, 64, 0], [0, 100.0, 48, 0], [0, 0, 1, 0]]), 128, 96)
        >>> camera.project([0.1, 0.0, 1.0])
        array([74., 48.])
        """
        return Projection(self.matrix, np.zeros((0, 2)), "perspective").project(points)


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


def camera_of(scene: Scene) -> Camera:
    """Get the camera of a scene, at the size in its settings.

    Raises
    ------
    SceneError
        If it is not a perspective camera (`perspective` or `thinlens`, then of the lens centre).
    OptionError
        If the size is changed although the film has a crop window.

    Examples
    --------
    >>> from fluorspar.scene.scene import load_scene
    >>> camera = camera_of(load_scene("cornell-box"))
    >>> camera.project([278, 273, 0]).round(6)
    array([256., 256.])
    """
    state = copy_nodes(scene.nodes)
    index = sensor_node(state)
    plugin = state.nodes[index].props.plugin_name()
    if plugin not in ("perspective", "thinlens"):
        raise SceneError(
            message(
                "points cannot be projected by this camera", got=plugin, expected="perspective or thinlens"
            )
        )
    with use_variant(SPECTRUM_VARIANT), resolving(scene.base):
        import mitsuba as mi

        set_film(state, scene)
        sensor = build(state, index)
        values = mi.traverse(sensor)
        size = np.array(sensor.film().size(), dtype=np.float64)
        offset = np.array(sensor.film().crop_offset(), dtype=np.float64)
        fov = float(np.array(values["x_fov"]).ravel()[0])
        keys = [f"principal_point_offset_{axis}" for axis in "xy"]
        # a thin lens has none
        shift = [float(np.array(values[key]).ravel()[0]) if key in values else 0.0 for key in keys]
        to_world = np.array(sensor.world_transform().matrix, dtype=np.float64).reshape(4, 4)
    focal = size[0] / (2 * np.tan(np.radians(fov) / 2))
    # Mitsuba's camera looks along +z with x to the left and y up.
    intrinsic = np.array(
        [
            [-focal, 0.0, size[0] / 2 - shift[0] * size[0] - offset[0]],
            [0.0, -focal, size[1] / 2 - shift[1] * size[1] - offset[1]],
            [0.0, 0.0, 1.0],
        ]
    )
    return Camera(intrinsic @ np.linalg.inv(to_world)[:3], scene.settings.width, scene.settings.height)


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
