"""Whether the camera sees a point of a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, message
from fluorspar.paths.tracing.lobe_scene import build_lobe_scene
from fluorspar.paths.tracing.trace_scene import build_trace_scene
from fluorspar.scene.camera import camera_of
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import LOBE_VARIANTS, TRACE_VARIANTS, use_variant

__all__ = ["first_hits"]

Array = NDArray[np.float64]


def first_hits(scene: Scene, points: ArrayLike) -> Array:
    """Find what the camera sees first on its way to each point.

    Parameters
    ----------
    scene : Scene
        With a perspective camera; a thin lens looks from its centre.
    points : array_like of shape (P, 3)
        In scene units.

    Returns
    -------
    ndarray of shape (P, 3)
        The first surface on the ray from the camera to the point, or beyond it; NaN where there is none.

    Raises
    ------
    SceneError
        If the camera is of another kind.
    OptionError
        If the points are not of shape (P, 3).

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> first_hits(load_scene("cornell-box"), [[150, 400, 400]]).round(1)  # in mid-air, before the back wall
    array([[133. , 416.8, 559.2]])
    """
    targets = np.asarray(points, dtype=np.float64)
    if targets.ndim != 2 or targets.shape[1] != 3:
        raise OptionError(
            message("these are not points", got=f"shape {targets.shape}", expected="shape (P, 3)")
        )
    matrix = camera_of(scene).matrix
    eye = -np.linalg.solve(matrix[:, :3], matrix[:, 3])
    ways = targets - eye
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    matte = scene.lobes is None
    with use_variant((TRACE_VARIANTS if matte else LOBE_VARIANTS)["llvm"]):
        import mitsuba as mi

        traced = (build_trace_scene(scene) if matte else build_lobe_scene(scene)).mitsuba_scene
        origin = mi.Point3f(*(np.full(len(ways), c, np.float32) for c in eye))
        ray = mi.Ray3f(o=origin, d=mi.Vector3f(*(ways[:, axis].astype(np.float32) for axis in range(3))))
        distance = np.array(traced.ray_intersect_preliminary(ray, coherent=True).t, dtype=np.float64)
    distance[~np.isfinite(distance)] = np.nan
    return np.asarray(eye + distance[:, np.newaxis] * ways)
