"""Where points of a scene appear in its image.

Eq. 15 is that of Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, SceneError, message
from fluorspar.scene.nodes import build, copy_nodes, resolving
from fluorspar.scene.photograph import Projection
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import sensor_node, set_camera, to_world_of
from fluorspar.scene.variants import SPECTRUM_VARIANT, use_variant
from fluorspar.scene.viewpoint import Viewpoint, ViewpointSetting

__all__ = ["Camera", "camera_of", "seen_from"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: homogeneous pixels = matrix @ (x, y, z, 1) (Eq. 15).

    Parameters
    ----------
    matrix : ndarray of shape (3, 4)
        Its third row gives the depth along the viewing direction, in scene units.
    width, height : int
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
    >>> from fluorspar.scene.loading import load_scene
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
    with use_variant(SPECTRUM_VARIANT), resolving(*scene.folders):
        import mitsuba as mi

        set_camera(state, scene.settings)
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


def seen_from(scene: Scene, camera: ViewpointSetting) -> Scene:
    """Copy a scene whose camera stands elsewhere, or sees less or more.

    Parameters
    ----------
    scene : Scene
    camera : Viewpoint, str or mapping
        What changes: `origin`, `target`, `up`, `fov`; as text `"origin=278,273,-400 target=278,100,280 fov=60"`. The
        kind of the camera, its lens, its distance of focus and its film stay.

    Raises
    ------
    OptionError
        If it is not readable or impossible.
    SceneError
        If the scene holds no geometry, because its light paths are from a file.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> near = seen_from(load_scene("cornell-box"), "origin=278,273,-400 target=278,273,280")
    >>> camera_of(near).project([278, 273, 0])
    array([256., 256.])
    """
    viewpoint, before = Viewpoint.of(camera), scene.settings.viewpoint
    props = scene.nodes.nodes[sensor_node(scene.nodes)].props
    if viewpoint.fov is not None and props.plugin_name() == "orthographic":
        fix = "leave fov out; the scale of its to_world says how much it sees"
        raise OptionError(message("an orthographic camera has no fov", got=viewpoint, fix=fix))
    with use_variant(SPECTRUM_VARIANT):
        to_world = to_world_of(props)
    if before is not None:
        to_world = before.to_world(to_world)
    whole = viewpoint.completed(to_world)
    if before is not None:  # what was changed before and is not now
        kept = {name: getattr(before, name) for name, value in vars(whole).items() if value is None}
        whole = replace(whole, **kept)
    return scene.with_settings(viewpoint=whole)
