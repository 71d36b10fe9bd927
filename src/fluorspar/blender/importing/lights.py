"""Blender's lamps: their power in watts as radiance, intensity or irradiance, their size and shape."""

from __future__ import annotations

import math
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from fluorspar.blender.importing.elements import matrix, plugin, value
from fluorspar.blender.importing.emitted import Emitted
from fluorspar.blender.importing.sockets import Sockets

__all__ = ["lamp"]

_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # lamps shine along -z, Mitsuba's shapes and spots along z
_BLENDER_WHITE = (1.0, 1.0, 1.0)

Array = NDArray[np.float64]


def lamp(light: dict[str, Any], sockets: Sockets, name: str) -> Element | None:
    """A lamp as an emitter, or as a shape that emits; None for one without light.

    Its power is thought of as going out into all directions: an area of Lambert's law has a radiance of P / (pi A), a
    point an intensity of P / (4 pi). A sun has its irradiance.
    """
    where, listing = sockets.where, sockets.listing
    if light["is_portal"]:
        listing.add(where, "is a portal, which guides rays and gives no light: it is left out")
        return None
    given = _given(light, sockets)
    if given.is_dark:
        listing.add(where, "gives no light: it is left out")
        return None
    place = np.array(light["matrix"])
    if light["type"] == "AREA":
        return _area(light, place, given, sockets, name)
    axes = np.linalg.norm(place[:3, :3], axis=0)
    turned = place.copy()
    turned[:3, :3] /= axes
    if light["type"] == "SUN":
        if light.get("angle", 0) > 0:
            listing.add(where, f"is {math.degrees(light['angle']):.3g} degrees wide: its rays are parallel, shadows sharp")
        direction = Element("vector", {"name": "direction", "value": " ".join(f"{x:.9g}" for x in -turned[:3, 2])})
        return plugin("emitter", "directional", direction, given.element("irradiance", where, listing), id=name)
    given = given.times(1 / (4 * math.pi))
    radius = light["shadow_soft_size"]
    if light["type"] == "POINT":
        if radius > 0:
            return _ball(place, radius * float(axes.mean()), given, light, sockets, name)
        position = Element("point", {"name": "position", "value": " ".join(f"{x:.9g}" for x in place[:3, 3])})
        return plugin("emitter", "point", position, given.element("intensity", where, listing), id=name)
    if radius > 0:
        listing.add(where, f"has a radius of {radius:g}: Mitsuba's spots are points, shadows are sharp")
    cutoff = light["spot_size"] / 2
    if cutoff > math.radians(89):
        listing.add(where, "is wider than 178 degrees: it is 178 degrees wide")
        cutoff = math.radians(89)
    if light["spot_blend"] > 0:
        listing.add(where, "fades out along another curve than Mitsuba's, which is linear in the angle; its power is the same")
    return plugin(
        "emitter",
        "spot",
        matrix("to_world", turned @ _DOWN),
        given.element("intensity", where, listing),
        value("float", "cutoff_angle", math.degrees(cutoff)),
        value("float", "beam_width", math.degrees(beam_of(cutoff, light["spot_blend"]))),
        id=name,
    )


def _given(light: dict[str, Any], sockets: Sockets) -> Emitted:
    """Power, times the colours of the lamp and of its nodes."""
    given = Emitted(_BLENDER_WHITE)
    if light["nodes"] is not None:
        node = sockets.node(light["nodes"].get("Surface"))
        if node is None or node["kind"] != "Emission":
            sockets.listing.add(sockets.where, "has nodes other than Emission: they are left out")
        else:
            strength = sockets.number(node["inputs"]["Strength"], 1.0)
            given = sockets.emitted(node["inputs"]["Color"]).times(strength)
    if light.get("use_temperature") and given.kelvin is None:
        given = Emitted(given.colour, light["temperature"])
    elif light.get("use_temperature"):
        given = given.times(light["temperature_color"])
    for name in ("cast_shadow", "use_shadow"):
        if light.get(name, True) is False:
            sockets.listing.add(sockets.where, "casts no shadows: here it does")
    return given.times(light["color"]).times(light["energy"] * 2.0 ** light.get("exposure", 0.0))


def _area(light: dict[str, Any], place: Array, given: Emitted, sockets: Sockets, name: str) -> Element:
    where, listing = sockets.where, sockets.listing
    width = light["size"]
    height = light["size_y"] if light["shape"] in ("RECTANGLE", "ELLIPSE") else width
    place = place @ np.diag([width / 2, height / 2, 1.0, 1.0]) @ _DOWN
    x, y = place[:3, 0], place[:3, 1]
    around = light["shape"] in ("DISK", "ELLIPSE")
    area = float(np.linalg.norm(np.cross(x, y))) * (math.pi if around else 4.0)
    if light.get("normalize", True):
        given = given.times(1 / area)
    if light.get("spread", math.pi) < 0.999 * math.pi:
        listing.add(where, f"is bundled to {math.degrees(light['spread']):.3g} degrees: it shines into all directions here")
    # its thickness means nothing, but a matrix must have an inverse
    normal = np.cross(x, y)
    place[:3, 2] = normal / np.linalg.norm(normal)
    shape = "disk" if around else "rectangle"
    return _shining(shape, [matrix("to_world", place)], given.times(1 / math.pi), light, sockets, name)


def _ball(
    place: Array, radius: float, given: Emitted, light: dict[str, Any], sockets: Sockets, name: str
) -> Element:
    centre = Element("point", {"name": "center", "value": " ".join(f"{x:.9g}" for x in place[:3, 3])})
    given = given.times(1 / (math.pi * radius**2))
    return _shining("sphere", [centre, value("float", "radius", radius)], given, light, sockets, name)


def _shining(
    shape: str, parts: list[Element], given: Emitted, light: dict[str, Any], sockets: Sockets, name: str
) -> Element:
    """A shape that gives light, reflects nothing, and lets rays through."""
    if not light["seen"]:
        sockets.listing.add(sockets.where, "is not seen by the camera in Blender: here it is, as part of 'source'")
    radiance = plugin("emitter", "area", given.element("radiance", sockets.where, sockets.listing))
    return plugin("shape", shape, *parts, plugin("bsdf", "null"), radiance, id=name)


def beam_of(cutoff: float, blend: float) -> float:
    """The beam width of Mitsuba's spot that gives as much light as Blender's of the same cone, in radians.

    Blender fades by smoothstep((cos t - cos cutoff) / (blend (1 - cos cutoff))), Mitsuba linearly in the angle t.

    Examples
    --------
    >>> round(beam_of(0.5, 0.0), 6), round(beam_of(0.5, 1.0), 2)
    (0.5, 0.1)
    """
    if blend <= 0:
        return cutoff
    angle = np.linspace(0, cutoff, 4001)
    ramp = np.clip((np.cos(angle) - math.cos(cutoff)) / (blend * (1 - math.cos(cutoff))), 0, 1)
    wanted = float(np.trapezoid(ramp**2 * (3 - 2 * ramp) * np.sin(angle), angle))
    low, high = 0.0, cutoff
    for _ in range(40):
        beam = (low + high) / 2
        faded = np.clip((cutoff - angle) / max(cutoff - beam, 1e-9), 0, 1)
        low, high = (beam, high) if np.trapezoid(faded * np.sin(angle), angle) < wanted else (low, beam)
    return (low + high) / 2
