"""Blender's lamps: their power in watts as radiance, intensity or irradiance, their size and shape."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from fluorspar.blender.importing.elements import matrix, plugin, value
from fluorspar.blender.importing.emitted import Emitted
from fluorspar.blender.importing.sockets import Sockets

__all__ = ["faded", "lamp"]

_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # lamps shine along -z, Mitsuba's shapes and spots along z
_BLENDER_WHITE = (1.0, 1.0, 1.0)
_WIDEST = math.radians(85)  # half the cone of a spot: its picture is on a plane
_PIXELS = 512

Array = NDArray[np.float64]


def lamp(
    light: dict[str, Any], sockets: Sockets, name: str, folder: Path, version: Sequence[int]
) -> Element | None:
    """A lamp as an emitter, or as a shape that emits; None for one without light.

    A point has an intensity of P / (4 pi), so has a spot within its cone; an area a radiance of P / (pi A), before
    Blender 4.0 P / (4 A). A sun has its irradiance.

    Parameters
    ----------
    light : dict
        As the script inside Blender says it.
    sockets : Sockets
    name : str
        Its id.
    folder : Path
        Of the scene, which gets a picture of how a spot fades.
    version : sequence of int
        Of Blender.
    """
    old = tuple(version) < (4, 0)
    where, listing = sockets.where, sockets.listing
    if light["is_portal"]:
        listing.add(where, "is a portal, which guides rays and gives no light: it is left out")
        return None
    given = _given(light, sockets)
    if given.is_dark:
        listing.add(where, "gives no light: it is left out")
        return None
    place = np.array(light["matrix"], dtype=np.float64)
    if light["type"] == "AREA":
        width = light["size"]
        height = light["size_y"] if light["shape"] in ("RECTANGLE", "ELLIPSE") else width
        place = place @ np.diag([width / 2, height / 2, 1.0, 1.0]) @ _DOWN
    axes = np.linalg.norm(place[:3, :3], axis=0)
    if light["type"] != "POINT" and min(axes) < 1e-9:
        listing.add(where, "has no size, or is scaled to nothing: it is left out")
        return None
    if light["type"] == "AREA":
        given = given.times(math.pi / 4 if old else 1)
        return _area(light, place, given, sockets, name)
    if not light.get("normalize", True):
        listing.add(where, "has a strength that grows with its size: it is taken for that of all sizes")
    if light["type"] == "POINT":
        return _point(light, place, given.times(1 / (4 * math.pi)), sockets, name)
    turned = place.copy()
    turned[:3, :3] /= axes
    if light["type"] == "SUN":
        if light.get("angle", 0) > 0:
            listing.add(
                where,
                f"is {math.degrees(light['angle']):.3g} degrees wide: its rays are parallel, shadows sharp",
            )
        direction = Element(
            "vector", {"name": "direction", "value": " ".join(f"{x:.9g}" for x in -turned[:3, 2])}
        )
        return plugin(
            "emitter", "directional", direction, given.element("irradiance", where, listing), id=name
        )
    given = given.times(1 / (4 * math.pi))
    radius = light["shadow_soft_size"]
    if radius > 0:
        listing.add(where, f"has a radius of {radius:g}: Mitsuba's spots are points, shadows are sharp")
    if np.ptp(axes) > 1e-4 * axes.max():
        listing.add(where, "is an elliptic spot: it is round")
    cutoff = light["spot_size"] / 2
    if cutoff > _WIDEST:
        listing.add(where, f"is wider than {2 * math.degrees(_WIDEST):.0f} degrees: it is that wide")
        cutoff = _WIDEST
    file = f"textures/spot-{len(list(folder.glob('textures/spot-*')))}.exr"
    _write_fading(folder / file, cutoff, light["spot_blend"], old=old)
    fading = plugin(
        "texture", "bitmap", value("string", "filename", file), value("boolean", "raw", True), name="texture"
    )
    return plugin(
        "emitter",
        "spot",
        matrix("to_world", turned @ _DOWN),
        given.element("intensity", where, listing),
        value("float", "cutoff_angle", math.degrees(cutoff)),
        value("float", "beam_width", 0.9999 * math.degrees(cutoff)),
        fading,
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
    if not light.get("cast_shadow", True):
        sockets.listing.add(sockets.where, "casts no shadows: here it does")
    if ways := light.get("hidden"):
        sockets.listing.add(sockets.where, f"does not light all surfaces ({', '.join(ways)}): here it does")
    return given.times(light["color"]).times(light["energy"] * 2.0 ** light.get("exposure", 0.0))


def _area(light: dict[str, Any], place: Array, given: Emitted, sockets: Sockets, name: str) -> Element:
    where, listing = sockets.where, sockets.listing
    x, y = place[:3, 0], place[:3, 1]
    around = light["shape"] in ("DISK", "ELLIPSE")
    area = float(np.linalg.norm(np.cross(x, y))) * (math.pi if around else 4.0)
    if light.get("normalize", True):
        given = given.times(1 / area)
    if light.get("spread", math.pi) < 0.999 * math.pi:
        listing.add(
            where,
            f"is bundled to {math.degrees(light['spread']):.3g} degrees: it shines into all directions here",
        )
    # its thickness means nothing, but a matrix must have an inverse
    normal = np.cross(x, y)
    place[:3, 2] = normal / np.linalg.norm(normal)
    shape = "disk" if around else "rectangle"
    return _shining(shape, [matrix("to_world", place)], given.times(1 / math.pi), light, sockets, name)


def _point(light: dict[str, Any], place: Array, given: Emitted, sockets: Sockets, name: str) -> Element:
    at = " ".join(f"{x:.9g}" for x in place[:3, 3])
    radius = light["shadow_soft_size"] * float(np.linalg.norm(place[:3, :3], axis=0).mean())
    if radius == 0:
        intensity = given.element("intensity", sockets.where, sockets.listing)
        position = Element("point", {"name": "position", "value": at})
        return plugin("emitter", "point", position, intensity, id=name)
    centre = Element("point", {"name": "center", "value": at})
    given = given.times(1 / (math.pi * radius**2))
    return _shining("sphere", [centre, value("float", "radius", radius)], given, light, sockets, name)


def _shining(
    shape: str, parts: list[Element], given: Emitted, light: dict[str, Any], sockets: Sockets, name: str
) -> Element:
    """A shape that gives light, reflects nothing, and lets rays through."""
    if not light["seen"]:
        sockets.listing.add(
            sockets.where, "is not seen by the camera in Blender: here it is, as part of 'source'"
        )
    radiance = plugin("emitter", "area", given.element("radiance", sockets.where, sockets.listing))
    return plugin("shape", shape, *parts, plugin("bsdf", "null"), radiance, id=name)


def faded(cosine: Array, cutoff: float, blend: float, *, old: bool) -> Array:
    """How Cycles' spot fades, by the cosine of the angle to its axis.

    Parameters
    ----------
    cosine : ndarray
    cutoff : float
        In radians, from the axis.
    blend : float
        Share of the cone that fades, 0 to 1.
    old : bool
        Whether it is one of Blender before 4.0, which is also weaker by the cosine.

    Examples
    --------
    >>> faded(np.array([1.0, 0.875, 0.75]), np.arccos(0.75), 1.0, old=False)
    array([1. , 0.5, 0. ])
    """
    edge = math.cos(cutoff)
    ramp = np.clip((cosine - edge) / max(blend * (1 - edge), 1e-6), 0, 1)
    return np.asarray(ramp**2 * (3 - 2 * ramp) * (cosine if old else 1))


def _write_fading(file: Path, cutoff: float, blend: float, *, old: bool) -> None:
    """The picture that Mitsuba's spot throws onto a plane across its axis."""
    steps = ((np.arange(_PIXELS) + 0.5) / _PIXELS * 2 - 1) * math.tan(cutoff)
    cosine = 1 / np.sqrt(1 + steps**2 + steps[:, np.newaxis] ** 2)
    grey = faded(cosine, cutoff, blend, old=old).astype(np.float32)
    file.parent.mkdir(exist_ok=True)
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": np.stack([grey] * 3, axis=-1)}) as out:
        out.write(str(file))
