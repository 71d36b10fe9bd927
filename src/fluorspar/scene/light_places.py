"""Where the lights are that are on no surface, and where they shine."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message
from fluorspar.scene.scene import Scene

__all__ = ["LightPlace", "light_places"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LightPlace:
    """A light that is on no surface.

    Attributes
    ----------
    plugin : str
        `constant`, `point`, `spot` or `directional`.
    position : ndarray of shape (3,)
        In scene units.
    direction : ndarray of shape (3,)
        Unit vector along which it shines.
    cutoff, beam : float
        Of a spot light: angles from its axis at which it ends and begins to fade, in radians.
    """

    plugin: str
    position: Array
    direction: Array
    cutoff: float = math.pi
    beam: float = math.pi


def light_places(scene: Scene) -> dict[int, LightPlace]:
    """Find the places of the lights of a scene by row of its table, without those on surfaces.

    Raises
    ------
    SceneError
        If a spot light has a texture.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> light_places(load_scene("cornell-box"))
    {}
    """
    on_surfaces = {surface.light for surface in scene.surfaces}
    return {
        row: _place(scene.nodes.nodes[light.node], light.plugin, light.name)
        for row, light in enumerate(scene.lights)
        if row not in on_surfaces
    }


def _place(node: Any, plugin: str, name: str) -> LightPlace:
    props = node.props
    world = np.array(props["to_world"].matrix, dtype=np.float64) if "to_world" in props else np.eye(4)
    position, direction = world[:3, 3], world[:3, 2]
    if plugin == "point" and "position" in props:
        position = np.array(props["position"], dtype=np.float64).ravel()
    if plugin == "directional" and "direction" in props:
        direction = np.array(props["direction"], dtype=np.float64).ravel()
    direction = direction / np.linalg.norm(direction)
    if plugin != "spot":
        return LightPlace(
            "constant" if plugin not in ("point", "directional") else plugin, position, direction
        )
    if "texture" in props:
        raise SceneError(message("a spot light with a texture is not supported here", where=name))
    cutoff = float(props["cutoff_angle"]) if "cutoff_angle" in props else 20.0
    beam = float(props["beam_width"]) if "beam_width" in props else 0.75 * cutoff
    return LightPlace(plugin, position, direction, math.radians(cutoff), math.radians(beam))
