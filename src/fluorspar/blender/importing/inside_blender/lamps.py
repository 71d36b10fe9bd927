"""Lamps: Blender's objects of the type light."""

from __future__ import annotations

from typing import Any

from .node_table import Nodes
from .values import Said, simple_properties

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["light_of"]


def light_of(thing: Any, nodes: Nodes) -> Said:
    """The settings of a light, which rays do not see it, and its nodes."""
    light = thing.data
    said = simple_properties(light, bpy.types.ID)
    cycles = getattr(light, "cycles", None)
    said["cast_shadow"] = getattr(
        cycles, "cast_shadow", said.get("use_shadow", True)
    )  # Cycles' own until 4.2
    said["is_portal"] = bool(getattr(cycles, "is_portal", False))
    said["hidden"] = [
        way for way in ("diffuse", "glossy", "transmission") if not getattr(thing, f"visible_{way}")
    ]
    return {**said, "seen": thing.visible_camera, "nodes": nodes.outputs(light)}
