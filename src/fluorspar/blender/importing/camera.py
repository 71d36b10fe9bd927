"""Blender's camera as Mitsuba's, with film and sampler."""

from __future__ import annotations

import math
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from fluorspar.blender.importing.elements import matrix, plugin, value
from fluorspar.blender.importing.listing import Listing
from fluorspar.errors import SceneError, message

__all__ = ["sensor"]

_TURNED = np.diag(
    [-1.0, 1.0, -1.0, 1.0]
)  # Blender looks along -z with x to the right, Mitsuba along z with x to the left


def sensor(camera: dict[str, Any], settings: dict[str, Any], listing: Listing) -> Element:
    """The sensor of a scene file.

    Raises
    ------
    SceneError
        If the camera is a panoramic one.
    """
    where = f"camera '{camera['name']}'"
    if camera["type"] not in ("PERSP", "ORTHO"):
        expected = "a perspective or orthographic camera"
        raise SceneError(
            message("there is no such camera", where=where, got=camera["type"].lower(), expected=expected)
        )
    width, height = settings["width"], settings["height"]
    if settings["aspect"] != 1:
        listing.add(where, "has pixels that are not square: they are rendered as squares")
    for name, what in (
        ("region", "a region of the image"),
        ("motion_blur", "motion blur"),
        ("transparent", "a transparent background"),
    ):
        if settings[name]:
            listing.add(where, f"renders with {what}: that is left out")
    if settings["exposure"] != 1:
        listing.add(where, f"has an exposure of {settings['exposure']:g} in Cycles: it is left out")
    fit = camera["sensor_fit"]
    axis = ("x" if width >= height else "y") if fit == "AUTO" else {"HORIZONTAL": "x", "VERTICAL": "y"}[fit]
    size = camera["sensor_height" if fit == "VERTICAL" else "sensor_width"]
    fitted = width if axis == "x" else height
    place = np.array(camera["matrix"], dtype=np.float64)
    place[:3, :3] /= np.linalg.norm(place[:3, :3], axis=0)  # the scale of a camera means nothing
    place = place @ _TURNED
    shift = camera["shift_x"] * fitted / width, camera["shift_y"] * fitted / height
    film = plugin(
        "film",
        "hdrfilm",
        value("integer", "width", width),
        value("integer", "height", height),
        plugin("rfilter", "box"),
    )
    sampler = plugin("sampler", "independent", value("integer", "sample_count", settings["samples"]))
    clip = [
        value("float", "near_clip", max(camera["clip_start"], 1e-6)),
        value("float", "far_clip", camera["clip_end"]),
    ]
    if camera["type"] == "ORTHO":
        scale = camera["ortho_scale"] / 2 * (1 if axis == "x" else width / height)
        # the place is moved instead of the picture
        moved = np.eye(4)
        moved[:2, 3] = -2 * shift[0], 2 * shift[1] * height / width
        grown = np.diag([scale, scale, 1.0, 1.0])
        if camera["focus"] is not None:
            listing.add(where, "has a depth of field without perspective: it is left out")
        return plugin(
            "sensor", "orthographic", matrix("to_world", place @ grown @ moved), *clip, film, sampler
        )
    parts = [
        value("float", "fov", math.degrees(2 * math.atan(size / (2 * camera["lens"])))),
        value("string", "fov_axis", axis),
        *clip,
        matrix("to_world", place),
    ]
    kind, focus = "perspective", camera["focus"]
    if focus is not None and (shift != (0, 0) or focus["distance"] <= 0):
        listing.add(where, "has a depth of field, and is shifted or focused on no distance: it is left out")
    elif focus is not None:
        kind = "thinlens"
        if not focus["round"]:
            listing.add(where, "has an aperture of blades, or a squeezed one: it is round")
        radius = camera["lens"] * 1e-3 / (2 * max(focus["fstop"], 1e-5))
        parts.append(value("float", "aperture_radius", radius))
        parts.append(value("float", "focus_distance", focus["distance"]))
    if shift != (0, 0):
        parts.append(value("float", "principal_point_offset_x", shift[0]))
        parts.append(value("float", "principal_point_offset_y", -shift[1]))
    return plugin("sensor", kind, *parts, film, sampler)
