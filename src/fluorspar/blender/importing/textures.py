"""Images as bitmap textures: their colour space, filter, repetition and place on the surface."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from fluorspar.blender.importing.alphas import alpha_of, write_alpha
from fluorspar.blender.importing.elements import matrix, plugin, value
from fluorspar.blender.importing.listing import Listing

__all__ = ["Textures", "is_plain", "mapped"]

_WRAP = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "clamp", "MIRROR": "mirror"}
_DATA = (
    "Non-Color",
    "Raw",
    "Linear",
    "Linear Rec.709",
    "Linear BT.709",
)  # no curve; images of floats never have one
_COLOURS = ("sRGB", *_DATA)


class Textures:
    """The images of a scene as elements of its file.

    Parameters
    ----------
    images : list
        As the script inside Blender says them.
    nodes : list
        All shader nodes.
    listing : Listing
    folder : Path
        Of the scene, which has the images already.
    """

    def __init__(
        self, images: list[dict[str, Any]], nodes: list[dict[str, Any]], listing: Listing, folder: Path
    ) -> None:
        self._images, self._nodes, self._listing, self._folder = images, nodes, listing, folder
        sockets = [socket for node in nodes for socket in node["inputs"].values()]
        self._used_alphas = {id(nodes[s["from"]]) for s in sockets if s.get("output") == "Alpha"}

    def file(self, node: dict[str, Any], where: str) -> str | None:
        """Name of the image of a node, relative to the scene; None, and said, if there is none."""
        image = self._images[node["image"]] if "image" in node else None
        if image is not None and image["file"] is not None:
            return f"textures/{image['file']}"
        if image is None:
            self._listing.add(where, "has an image texture without an image")
        elif "missing" in image:
            self._listing.add(where, f"has the image '{image['name']}', which is missing: {image['missing']}")
        else:
            kind = image["source"].lower()
            self._listing.add(
                where, f"has the image '{image['name']}', a {kind} image: only single ones are read"
            )
        return None

    def bitmap(self, node: dict[str, Any], where: str, name: str, *, data: bool = False) -> Element | None:
        """A texture; None, and said, if there is no image.

        Parameters
        ----------
        node : dict
            An Image Texture.
        where : str
            For the listing.
        name : str
            The property that it is for.
        data : bool
            Whether its numbers count as they are, whatever its colour space.
        """
        file = self.file(node, where)
        if file is None:
            return None
        image = self._images[node["image"]]
        see_through = image["alpha"] == "STRAIGHT" and alpha_of(self._folder / file) is not None
        if see_through and not data and id(node) not in self._used_alphas:
            self._listing.add(
                where,
                f"has the image '{image['name']}', which is transparent in parts: they are not darker here",
            )
        return self._placed(node, file, where, name, data=data)

    def alpha(self, node: dict[str, Any], where: str, name: str) -> Element:
        """The transparency of an image as a texture, or as 1 where there is none."""
        file = self.file(node, where)
        alpha = None
        if file is not None and self._images[node["image"]]["alpha"] != "NONE":
            alpha = alpha_of(self._folder / file)
        if file is None or alpha is None:
            return value("float", name, 1.0)
        grey = f"{file.rpartition('.')[0]}-alpha.png"
        write_alpha(alpha, self._folder / grey)
        return self._placed(node, grey, where, name, data=True)

    def _placed(self, node: dict[str, Any], file: str, where: str, name: str, *, data: bool) -> Element:
        image, properties = self._images[node["image"]], node["properties"]
        floats = file.endswith((".exr", ".hdr"))
        if image["space"] not in _COLOURS and not data:
            self._listing.add(
                where, f"has an image in the colour space {image['space']}: it is taken for sRGB"
            )
        if properties["projection"] != "FLAT":
            self._listing.add(
                where, f"projects an image ({properties['projection'].lower()}): its UV map is used"
            )
        if properties["extension"] == "CLIP":
            self._listing.add(where, "clips an image: its border is continued instead")
        raw = data or (image["space"] in _DATA and not floats)
        parts = [
            value("string", "filename", file),
            value(
                "string", "filter_type", "nearest" if properties["interpolation"] == "Closest" else "bilinear"
            ),
            value("string", "wrap_mode", _WRAP[properties["extension"]]),
            value("boolean", "raw", raw),
        ]
        # Blender counts v from the lower edge of an image, Mitsuba from the upper one
        place = np.diag([1.0, -1.0, 1.0, 1.0]) @ mapped(node, self._nodes, where, self._listing)
        place[1, 3] += 1
        parts.append(matrix("to_uv", place))
        return plugin("texture", "bitmap", *parts, name=name)

    def uv_map(self, numbers: set[int]) -> str | None:
        """The UV map that some nodes ask for, the first if there are several."""
        for number in sorted(numbers):
            if self._nodes[number]["kind"] == "UVMap":
                return str(self._nodes[number]["properties"]["uv_map"]) or None
        return None


def mapped(
    node: dict[str, Any], nodes: list[dict[str, Any]], where: str, listing: Listing
) -> NDArray[np.float64]:
    """How the place at which an image is looked up comes from coordinates, of shape (4, 4)."""
    vector = node["inputs"].get("Vector", {})
    place = np.eye(4)
    while "from" in vector:
        source = nodes[vector["from"]]
        if source["kind"] == "Mapping":
            place = place @ _mapping(source, where, listing)
            vector = source["inputs"]["Vector"]
            continue
        known = {
            "UVMap": ("UV",),
            "TexCoord": ("UV", "Generated") if node["kind"] == "TexEnvironment" else ("UV",),
        }
        if vector["output"] not in known.get(source["kind"], ()):
            given = f"'{source['name']}' ({vector['output']})"
            listing.add(where, f"places an image by {given}: its own coordinates are used")
        break
    return place


def _mapping(node: dict[str, Any], where: str, listing: Listing) -> NDArray[np.float64]:
    inputs = node["inputs"]
    if any("from" in inputs[name] for name in ("Location", "Rotation", "Scale") if name in inputs):
        listing.add(where, f"computes numbers of '{node['name']}': the mapping is left out")
        return np.eye(4)
    location, rotation, scale = (
        inputs.get(name, {}).get("value") for name in ("Location", "Rotation", "Scale")
    )
    turn, moved = np.eye(4), np.eye(4)
    for axis, angle in enumerate(rotation or (0, 0, 0)):
        turn = _about(axis, angle) @ turn
    moved[:3, 3] = location or (0, 0, 0)
    grown = np.diag([*(scale or (1, 1, 1)), 1.0])
    kind = node["properties"].get("vector_type", "POINT")
    if kind == "TEXTURE":
        return np.asarray(np.linalg.inv(moved @ turn @ grown))
    return np.asarray((moved if kind == "POINT" else np.eye(4)) @ turn @ grown)


def _about(axis: int, angle: float) -> NDArray[np.float64]:
    turn = np.eye(4)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn[a, a] = turn[b, b] = math.cos(angle)
    turn[b, a], turn[a, b] = math.sin(angle), -math.sin(angle)
    return turn


def is_plain(place: NDArray[np.float64]) -> bool:
    """Whether a transform is a rotation alone."""
    return bool(np.allclose(place @ place.T, np.eye(4), atol=1e-6))
