"""Blender's Principled BSDF as Mitsuba's, which goes back to the same model of Disney's."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from fluorspar.blender.importing.elements import plugin, value
from fluorspar.blender.importing.shading import Shading, masked
from fluorspar.blender.importing.sockets import Sockets

__all__ = ["principled"]

# Of what is not taken over: names of the inputs, and how it is called
_LEFT_OUT = {
    "subsurface scattering": ("Subsurface", "Subsurface Weight"),
    "the tint of its sheen": ("Sheen Tint",),
    "the tint of its highlight": ("Specular Tint",),
    "thin films": ("Thin Film Thickness",),
    "the roughness of its matte part": ("Diffuse Roughness",),
    "the tint of its coat": ("Coat Tint",),
}
_PRINCIPLED_COAT = (0.1, 0.001)  # Mitsuba's roughness of a clear coat of gloss 0 and 1


def principled(node: dict[str, Any], sockets: Sockets) -> Shading:
    """The inputs of all versions from 3.4 on; what is left out is listed."""
    where, listing = sockets.where, sockets.listing

    def number(*names: str, default: float = 0.0) -> float:
        return sockets.number(sockets.first(node, *names), default)

    def given(*names: str) -> bool:
        socket = sockets.first(node, *names)
        return socket is not None and ("from" in socket or sockets.number(socket) > 0)

    sheen, transmission = ("Sheen", "Sheen Weight"), ("Transmission", "Transmission Weight")
    coat = ("Clearcoat", "Coat Weight")
    lone = {"Sheen Tint": sheen, "Coat Tint": coat}
    for what, names in _LEFT_OUT.items():
        socket = sockets.first(node, *names)
        tint = "Tint" in names[0]
        if tint and isinstance((socket or {}).get("value"), list):  # from 4.0 on a colour, white by default
            used = not np.allclose(socket["value"][:3], 1) if socket else False
        else:
            used = given(*names)
        if used and not (names[0] in lone and not given(*lone[names[0]])):
            listing.add(where, f"has {what}: left out")
    parts = [
        sockets.element("base_color", sockets.first(node, "Base Color"), (0.8, 0.8, 0.8)),
        sockets.element("roughness", sockets.first(node, "Roughness"), 0.5),
        sockets.element("metallic", sockets.first(node, "Metallic"), 0.0),
    ]
    ior = number("IOR", default=1.45)
    parts.append(value("float", "eta", _index(node, sockets, ior, clear=given(*transmission))))
    if given(*transmission):
        parts.append(sockets.element("spec_trans", sockets.first(node, *transmission)))
    if given("Anisotropic"):
        parts.append(sockets.element("anisotropic", sockets.first(node, "Anisotropic")))
        if number("Anisotropic Rotation") != 0:
            listing.add(where, "has a rotation of its anisotropy: left out")
    if given(*sheen):
        parts.append(sockets.element("sheen", sockets.first(node, *sheen)))
        if "Sheen Weight" in node["inputs"]:
            listing.add(where, "has the sheen of Blender 4: it is that of Disney's model")
    if given(*coat):
        parts += _coat(
            node, sockets, number(*coat), number("Clearcoat Roughness", "Coat Roughness", default=0.03)
        )
    emitted = sockets.emitted(sockets.first(node, "Emission", "Emission Color")).times(
        number("Emission Strength", default=1.0)
    )
    for name in ("Clearcoat Normal", "Coat Normal", "Tangent"):
        if "from" in node["inputs"].get(name, {}):
            listing.add(where, f"computes its {name.lower()}: left out")
    clear = given(*transmission)
    shading = Shading(plugin("bsdf", "principled", *parts), clear, None if emitted.is_dark else emitted)
    return _faded(shading, sockets.element("opacity", sockets.first(node, "Alpha"), 1.0), sockets)


def _faded(shading: Shading, opacity: Element, sockets: Sockets) -> Shading:
    """As opaque as its alpha, which counts for its own light too."""
    made = masked(shading, opacity)
    if shading.emitted is None:
        return made
    if opacity.tag != "float":
        sockets.listing.add(sockets.where, "shines through an alpha of an image: its light is everywhere")
        return made
    light = shading.emitted.times(min(max(float(opacity.get("value", "1")), 0.0), 1.0))
    return replace(made, emitted=None if light.is_dark else light)


def _index(node: dict[str, Any], sockets: Sockets, ior: float, *, clear: bool) -> float:
    """Mitsuba has one index of refraction, Blender a highlight of its own strength beside it."""
    if "Specular IOR Level" in node["inputs"]:
        level = sockets.number(node["inputs"]["Specular IOR Level"], 0.5)
        facing = 2 * level * ((ior - 1) / (ior + 1)) ** 2
    else:
        level = 0.5
        facing = 0.08 * sockets.number(sockets.first(node, "Specular"), 0.5)
    if clear:
        if abs(level - 0.5) > 1e-3:
            sockets.listing.add(
                sockets.where, "is clear and has a specular level: its index of refraction alone counts"
            )
        return max(ior, 1.001)
    root = math.sqrt(min(max(facing, 0.0), 0.9))
    return max((1 + root) / (1 - root), 1.001)


def _coat(node: dict[str, Any], sockets: Sockets, weight: float, roughness: float) -> list[Any]:
    where, listing = sockets.where, sockets.listing
    if "Coat Weight" in node["inputs"]:  # Disney's is a quarter of a layer
        if weight > 0.25:
            listing.add(
                where, "has a coat of Blender 4: Mitsuba's is four times weaker, and takes nothing from below"
            )
        weight = 4 * weight
    rough, glossy = _PRINCIPLED_COAT
    gloss = (rough - roughness**2) / (rough - glossy)
    if not 0 <= gloss <= 1:
        listing.add(
            where,
            f"has a coat of roughness {roughness:g}: it is {math.sqrt(rough if gloss < 0 else glossy):.2g}",
        )
    return [
        value("float", "clearcoat", min(weight, 1.0)),
        value("float", "clearcoat_gloss", min(max(gloss, 0.0), 1.0)),
    ]
