"""The scene that light paths are traced in: the user's geometry, lights of unit spectrum, no materials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.scene.nodes import build, children, copy_nodes, kind, resolving
from fluorspar.scene.scene import Scene, film_node, sensor_node
from fluorspar.scene.surfaces import ABSORBS

__all__ = ["NO_ROW", "TraceScene", "build_trace_scene"]

NO_ROW = 0xFFFF  # in the row table: this side of the shape absorbs everything


@dataclass(frozen=True)
class TraceScene:
    """A built Mitsuba scene, and what its pointers mean.

    Attributes
    ----------
    mitsuba_scene, sensor, sampler
        Objects of the variant that was set.
    row_of_shape
        ndarray of shape (2 P,), uint32: material row of the front (2 p) and back (2 p + 1) of the shape whose
        Dr.Jit pointer is p; `NO_ROW` absorbs.
    light_of_emitter
        ndarray of shape (P,), uint32: light row of the emitter whose Dr.Jit pointer is p.
    """

    mitsuba_scene: Any
    sensor: Any
    sampler: Any
    row_of_shape: NDArray[np.uint32]
    light_of_emitter: NDArray[np.uint32]


def build_trace_scene(scene: Scene) -> TraceScene:
    """Build the scene in the variant that is set, at the size and samples of `scene.settings`.

    Raises
    ------
    OptionError
        If the size is changed although the film has a crop window.
    """
    import mitsuba as mi

    state = copy_nodes(scene.nodes)
    nodes = state.nodes
    for light in scene.lights:
        props = nodes[light.node].props
        if light.plugin not in ("area", "constant", "point", "spot", "directional"):
            _replace(props, "constant")
        props[{"point": "intensity", "spot": "intensity", "directional": "irradiance"}.get(props.plugin_name(), "radiance")] = 1.0
        props.set_id(f"light-{light.node}")
    for surface in scene.surfaces:
        props = nodes[surface.node].props
        for key, child in list(children(state, surface.node)):
            if kind(nodes[child]) != "Emitter":
                del props[key]
        props.set_id(f"surface-{surface.node}")
    for key, child in list(children(state, 0)):
        if kind(nodes[child]) in ("Integrator", "BSDF", "Texture"):
            del nodes[0].props[key]
    _set_film(state, scene)

    with resolving(scene.base):
        built = build(state)
    sensor = built.sensors()[0]
    sampler = sensor.sampler().clone()
    sampler.set_sample_count(scene.settings.spp)
    surface_of_id = {f"surface-{surface.node}": surface for surface in scene.surfaces}
    row_of_id = {f"light-{light.node}": row for row, light in enumerate(scene.lights)}

    shapes = [(_pointer(mi.ShapePtr(shape)), surface_of_id[shape.id()]) for shape in built.shapes()]
    row_of_shape = np.full(2 * (max(p for p, _ in shapes) + 1) if shapes else 2, NO_ROW, dtype=np.uint32)
    for pointer, surface in shapes:
        for side, row in enumerate((surface.front, surface.back)):
            row_of_shape[2 * pointer + side] = NO_ROW if row == ABSORBS else row
    emitters = [(_pointer(mi.EmitterPtr(emitter)), row_of_id[emitter.id()]) for emitter in built.emitters()]
    light_of_emitter = np.zeros(max(p for p, _ in emitters) + 1, dtype=np.uint32)
    for pointer, row in emitters:
        light_of_emitter[pointer] = row
    return TraceScene(built, sensor, sampler, row_of_shape, light_of_emitter)


def _pointer(pointer: Any) -> int:
    """The number under which Dr.Jit knows an object inside vectorised code."""
    import drjit as dr
    import mitsuba as mi

    return int(dr.reinterpret_array(mi.UInt32, pointer)[0])


def _replace(props: Any, plugin: str) -> None:
    """Turn a node into another plugin without properties."""
    for key in list(props.keys()):
        del props[key]
    props.set_plugin_name(plugin)


def _set_film(state: Any, scene: Scene) -> None:
    """Give the film the size that is asked for, and a box filter."""
    film = film_node(state)
    size = {"width": scene.settings.width, "height": scene.settings.height}
    if film is None:
        sensor = state.nodes[sensor_node(state)].props
        raise OptionError(message("the camera has no film", where=sensor.id() or sensor.plugin_name(), expected="a film with width and height"))
    props = state.nodes[film].props
    for key, child in list(children(state, film)):
        if kind(state.nodes[child]) == "ReconstructionFilter":
            state.nodes[child].props.set_plugin_name("box")
            for parameter in list(state.nodes[child].props.keys()):
                del state.nodes[child].props[parameter]
        else:
            del props[key]
    _keep(props, ("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y"))
    props.set_plugin_name("hdrfilm")
    props["pixel_format"] = "luminance"
    cropped = "crop_width" in props or "crop_height" in props
    if not cropped:
        props["width"], props["height"] = size["width"], size["height"]
    elif (props.get("crop_width", 0), props.get("crop_height", 0)) != (size["width"], size["height"]):
        raise OptionError(
            message(
                "the size cannot be changed, because the film has a crop window",
                got=f"{size['width']} x {size['height']}",
                expected=f"{props.get('crop_width', 0)} x {props.get('crop_height', 0)}",
                fix="remove the crop window from the scene file, or leave out the size",
            )
        )


def _keep(props: Any, names: tuple[str, ...]) -> None:
    """Drop all plain properties but these (a film's file format, for one, means nothing here)."""
    import mitsuba as mi

    for key in list(props.keys()):
        if key not in names and props.type(key) != mi.Properties.Type.ResolvedReference:
            del props[key]
