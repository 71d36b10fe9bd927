"""A scene as Mitsuba's rgb variants are to build it: rows of the material table as BSDFs, lights by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fluorspar.scene.lights import give_spectrum
from fluorspar.scene.nodes import children, copy_nodes, kind
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import film_node, sensor_node, set_camera
from fluorspar.scene.surfaces import ABSORBS

__all__ = [
    "bsdf",
    "name_lights",
    "one_sample_camera",
    "remove_lights",
    "remove_shape",
    "with_materials",
]


def with_materials(scene: Scene) -> tuple[Any, list[Any]]:
    """Copy the nodes of a scene; every row of the material table becomes one `diffuse` BSDF."""
    import mitsuba as mi

    state = copy_nodes(scene.nodes)
    for key, child in list(children(state, 0)):
        if kind(state.nodes[child]) in ("Integrator", "BSDF", "Texture"):
            del state.nodes[0].props[key]
    materials = [
        mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}})
        for _ in scene.materials
    ]
    for surface in scene.surfaces:
        props = state.nodes[surface.node].props
        for key, child in list(children(state, surface.node)):
            if kind(state.nodes[child]) != "Emitter":
                del props[key]
        props["bsdf"] = bsdf((surface.front, surface.back), materials)
        props.set_id(f"surface-{surface.node}")
    return state, materials


def bsdf(sides: Sequence[int], materials: list[Any]) -> Any:
    """The BSDF of a surface with these material rows on front and back."""
    import mitsuba as mi

    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    front, back = (black if row == ABSORBS else materials[row] for row in sides)
    if sides[1] == ABSORBS:
        return mi.load_dict(front) if isinstance(front, dict) else front
    return mi.load_dict({"type": "twosided", "front": front, "back": back})


def name_lights(state: Any, scene: Scene) -> None:
    import mitsuba as mi

    for light in scene.lights:
        props = state.nodes[light.node].props
        give_spectrum(props, light, mi.ScalarColor3f(1.0))
        props.set_id(f"light-{light.node}")


def one_sample_camera(state: Any, scene: Scene) -> None:
    """Make every small pixel one independent sample: other samplers take more than one, other filters mix."""
    import mitsuba as mi

    set_camera(state, scene.settings)
    film, sensor = film_node(state), sensor_node(state)
    assert film is not None  # checked when the scene was loaded
    state.nodes[film].props["pixel_format"] = "rgb"
    for key, child in list(children(state, sensor)):
        if kind(state.nodes[child]) == "Sampler":
            del state.nodes[sensor].props[key]
    state.nodes[sensor].props["sampler"] = mi.load_dict({"type": "independent", "sample_count": 1})


def remove_lights(state: Any, scene: Scene) -> None:
    lights = {light.node for light in scene.lights}
    for parent in (0, *(surface.node for surface in scene.surfaces)):
        for key, child in list(children(state, parent)):
            if child in lights:
                del state.nodes[parent].props[key]


def remove_shape(state: Any, node: int) -> None:
    for key, child in list(children(state, 0)):
        if child == node:
            del state.nodes[0].props[key]
