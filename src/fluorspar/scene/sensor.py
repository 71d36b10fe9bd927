"""The first camera of a parsed scene, its film and its sampler."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, SceneError, message
from fluorspar.scene.nodes import children, kind, label
from fluorspar.scene.settings import Settings
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.scene.viewpoint import Viewpoint

__all__ = ["choose_sensor", "film_node", "sampler_node", "sensor_node", "set_camera", "to_world_of"]


def sensor_node(state: Any) -> int:
    """Index of the first sensor of a parsed scene."""
    sensors = [index for _, index in children(state, 0) if kind(state.nodes[index]) == "Sensor"]
    supported = ("perspective", "thinlens", "orthographic")
    if not sensors:
        raise SceneError(
            message(
                "the scene has no camera",
                expected=f"a sensor, one of {', '.join(supported)}",
                fix="add a sensor to the scene",
            )
        )
    node = state.nodes[sensors[0]]
    if node.props.plugin_name() not in supported:
        raise SceneError(
            message(
                f"sensor '{node.props.plugin_name()}' is not supported",
                where=label(node, sensors[0]),
                expected=f"one of {', '.join(supported)}",
                fix=did_you_mean(node.props.plugin_name(), supported),
            )
        )
    return sensors[0]


def choose_sensor(state: Any, chosen: int | str) -> None:
    """Keep one sensor of a parsed scene.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        To be changed.
    chosen : int or str
        Number of the sensor, from 0 in the order of the scene, or its id.

    Raises
    ------
    OptionError
        If there is no such sensor.
    """
    props = state.nodes[0].props
    sensors = [(key, index) for key, index in children(state, 0) if kind(state.nodes[index]) == "Sensor"]
    ids = [state.nodes[index].props.id() for _, index in sensors]
    number = ids.index(str(chosen)) if str(chosen) in ids else None
    if number is None and str(chosen).isdecimal() and int(chosen) < len(sensors):
        number = int(chosen)
    if number is None:
        named = ", ".join(f"{k}: {label(state.nodes[index], index)}" for k, (_, index) in enumerate(sensors))
        raise OptionError(
            message(
                "the scene has no such sensor",
                got=chosen,
                expected=f"the number or id of one: {named}" if named else "a scene with sensors",
                fix=did_you_mean(str(chosen), ids),
            )
        )
    for k, (key, _) in enumerate(sensors):
        if k != number:
            del props[key]


def film_node(state: Any) -> int | None:
    """Index of the film of the first sensor, if the scene gives one."""
    return next((i for _, i in children(state, sensor_node(state)) if kind(state.nodes[i]) == "Film"), None)


def sampler_node(state: Any) -> int | None:
    """Index of the sampler of the first sensor, if the scene gives one."""
    return next(
        (i for _, i in children(state, sensor_node(state)) if kind(state.nodes[i]) == "Sampler"), None
    )


def set_camera(state: Any, settings: Settings) -> None:
    """Move the camera to where it is asked for, and give its film the size that is asked for and a box filter.

    A film without a filter has a Gaussian.
    """
    import mitsuba as mi

    film, sensor = film_node(state), sensor_node(state)
    if settings.viewpoint is not None:
        _move(state.nodes[sensor].props, settings.viewpoint)
    if "srf" in state.nodes[sensor].props:
        del state.nodes[sensor].props["srf"]  # images hold radiance, not what a camera makes of it
    size = {"width": settings.width, "height": settings.height}
    assert film is not None  # checked when the scene was loaded
    props = state.nodes[film].props
    _keep(props, ("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y"))
    props.set_plugin_name("hdrfilm")
    props["pixel_format"] = "luminance"
    props["rfilter"] = mi.load_dict({"type": "box"})
    cropped = "crop_width" in props or "crop_height" in props
    if not cropped:
        props["width"], props["height"] = size["width"], size["height"]
    crop = (
        props.get("crop_width", props.get("width", 768)),
        props.get("crop_height", props.get("height", 576)),
    )
    if cropped and crop != (size["width"], size["height"]):
        raise OptionError(
            message(
                "the size cannot be changed, because the film has a crop window",
                got=f"{size['width']} x {size['height']}",
                expected=f"{crop[0]} x {crop[1]}",
                fix="remove the crop window from the scene file, or leave out the size",
            )
        )


def to_world_of(props: Any) -> NDArray[np.float64]:
    """The matrix of a sensor as the scene gives it, (4, 4): it looks along z, y is upwards."""
    return np.array(props["to_world"].matrix, dtype=np.float64) if "to_world" in props else np.eye(4)


def _move(props: Any, viewpoint: Viewpoint) -> None:
    import mitsuba as mi

    props["to_world"] = mi.ScalarAffineTransform4d(viewpoint.to_world(to_world_of(props)))
    if viewpoint.fov is not None:
        if "focal_length" in props:
            del props["focal_length"]
        props["fov"] = viewpoint.fov


def _keep(props: Any, names: tuple[str, ...]) -> None:
    """Drop all properties but these (a film's file format, for one, means nothing here)."""
    for key in list(props.keys()):
        if key not in names:
            del props[key]
