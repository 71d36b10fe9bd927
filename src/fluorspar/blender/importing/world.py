"""Blender's world as a constant light or an environment map."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from fluorspar.blender.importing.elements import matrix, plugin, value
from fluorspar.blender.importing.emitted import Emitted
from fluorspar.blender.importing.sockets import Sockets
from fluorspar.blender.importing.textures import is_plain, mapped

__all__ = ["world_light"]

# Mitsuba's maps have y up and their middle at z; Blender's z up and theirs at x
_UPRIGHT = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)


def world_light(world: dict[str, Any], sockets: Sockets, name: str) -> Element | None:
    """The light of the surroundings; None where it is black."""
    where, listing = sockets.where, sockets.listing
    if world["nodes"] is None:
        return _constant(Emitted(tuple(world["colour"])), sockets, name)
    if "Volume" in world["nodes"]:
        listing.add(where, "has a volume: it is left out")
    node = sockets.node(world["nodes"].get("Surface"))
    if node is None:
        return None
    if node["kind"] != "Background":
        listing.add(where, f"has the node '{node['name']}' ({node['kind']}), not Background: it is left out")
        return None
    strength = sockets.number(node["inputs"]["Strength"], 1.0)
    source = sockets.node(node["inputs"]["Color"])
    if source is not None and source["kind"] == "TexEnvironment":
        return _map(source, strength, sockets, name)
    return _constant(sockets.emitted(node["inputs"]["Color"]).times(strength), sockets, name)


def _constant(given: Emitted, sockets: Sockets, name: str) -> Element | None:
    if given.is_dark:
        return None
    return plugin("emitter", "constant", given.element("radiance", sockets.where, sockets.listing), id=name)


def _map(node: dict[str, Any], strength: float, sockets: Sockets, name: str) -> Element | None:
    where, listing = sockets.where, sockets.listing
    file = sockets.textures.file(node, where)
    if file is None or strength <= 0:
        return None
    if node["properties"]["projection"] != "EQUIRECTANGULAR":
        listing.add(where, "has a mirror ball as environment: it is left out")
        return None
    turned = mapped(node, sockets.nodes, where, listing)
    if not is_plain(turned):
        listing.add(where, "moves or stretches its environment: only its rotation is kept")
        left, _, right = np.linalg.svd(turned[:3, :3])
        turned = np.eye(4)
        turned[:3, :3] = left @ right
    parts = [value("string", "filename", file), value("float", "scale", strength)]
    return plugin("emitter", "envmap", *parts, matrix("to_world", turned.T @ _UPRIGHT), id=name)
