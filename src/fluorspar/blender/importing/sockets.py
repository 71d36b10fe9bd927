"""Inputs of shader nodes: constants, images, or - said - a mean in place of what cannot be computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from fluorspar.blender.importing.elements import rgb, value
from fluorspar.blender.importing.emitted import Emitted
from fluorspar.blender.importing.listing import Listing
from fluorspar.blender.importing.textures import Textures

__all__ = ["Sockets"]

Said = dict[str, Any]

_GREY = (0.5, 0.5, 0.5)
_LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
# What gives a colour through, and the names that its input has had
_PASSES_ON = {
    "Gamma",
    "HueSaturation",
    "BrightContrast",
    "Invert",
    "RGBCurve",
    "RGBToBW",
    "Clamp",
    "MapRange",
    "Math",
    "LightFalloff",
}
_MIXED, _MIX_RGB = ("Color", "Float", "Vector"), ("Color1", "Color2")
_BLENDINGS = ("MIX", "MULTIPLY")
_COLOUR_INPUTS = ("Color", "Image", "Value", "Fac", "Strength")


@dataclass
class Sockets:
    """Reads inputs of the nodes of one material, light or world.

    Attributes
    ----------
    nodes : list
        All nodes.
    textures : Textures
    listing : Listing
    where : str
        Whose nodes, for the listing.
    """

    nodes: list[Said]
    textures: Textures
    listing: Listing
    where: str

    def node(self, socket: Said | None) -> Said | None:
        """The node that an input comes from."""
        return self.nodes[socket["from"]] if socket is not None and "from" in socket else None

    def first(self, node: Said, *names: str) -> Said | None:
        """The input that has one of these names, which differ between versions."""
        return next((node["inputs"][name] for name in names if name in node["inputs"]), None)

    def element(self, name: str, socket: Said | None, default: float | tuple[float, ...] = 0.0) -> Element:
        """A property of a BSDF, a number or colour by what the default is: a texture if an image is plugged in."""
        source = self.node(socket)
        if source is not None and socket is not None and source["kind"] == "TexImage":
            if socket["output"] == "Alpha":
                return self.textures.alpha(source, self.where, name)
            made = self.textures.bitmap(source, self.where, name)
            if made is not None:
                return made
        if isinstance(default, tuple):
            colour = np.asarray(self.colour(socket, default))
            if colour.max() > 1 + 1e-6 or colour.min() < 0:
                shown = ", ".join(f"{part:.3g}" for part in colour)
                self.listing.add(self.where, f"has a colour beyond 0 to 1 ({shown}): it is clipped")
            return rgb(name, np.clip(colour, 0, 1).tolist())
        return value("float", name, self.number(socket, default))

    def number(self, socket: Said | None, default: float = 0.0) -> float:
        """A constant, or said, a mean."""
        if socket is None:
            return default
        if "value" in socket:
            given = socket["value"]
            if isinstance(given, list):
                return float(np.asarray(given[:3]) @ _LUMINANCE)
            return default if given is None else float(given)
        return float(np.asarray(self.colour(socket, (default,) * 3)) @ _LUMINANCE / _LUMINANCE.sum())

    def colour(self, socket: Said | None, default: tuple[float, ...] = _GREY) -> tuple[float, float, float]:
        """A constant, or said, a mean."""
        if socket is None:
            return _three(default)
        if "value" in socket:
            return _three(default if socket["value"] is None else socket["value"])
        node = self.nodes[socket["from"]]
        if node["kind"] in ("RGB", "Value"):
            return _three(node["outputs"]["Color" if node["kind"] == "RGB" else "Value"])
        mean = _three(self._mean(node))
        blending = node["properties"].get("blend_type", "MIX")
        if "Mix" not in node["kind"] or blending not in _BLENDINGS or not self._is_constant(node):
            shown = ", ".join(f"{part:.3g}" for part in mean)
            text = f"has the node '{node['name']}' ({node['kind']}), which Fluorspar cannot compute: ({shown}) instead"
            self.listing.add(self.where, text)
        return mean

    def emitted(self, socket: Said | None) -> Emitted:
        """A colour of light, perhaps that of a black body."""
        node = self.node(socket)
        if node is not None and node["kind"] == "Blackbody" and "value" in node["inputs"]["Temperature"]:
            return Emitted((1.0, 1.0, 1.0), float(node["inputs"]["Temperature"]["value"]))
        return Emitted(self.colour(socket, (1.0, 1.0, 1.0)))

    def _is_constant(self, node: Said) -> bool:
        return all("value" in socket for socket in node["inputs"].values())

    def _mean(self, node: Said) -> Any:
        """A colour for a node that gives different ones."""
        kind, inputs = node["kind"], node["inputs"]
        if "ramp" in node:
            return np.mean([stop[1:4] for stop in node["ramp"]], axis=0)
        if kind in ("TexChecker", "TexBrick"):
            return np.mean([self.colour(inputs["Color1"]), self.colour(inputs["Color2"])], axis=0)
        if kind in ("MixRGB", "Mix"):
            a, b = (
                self.first(node, *(f"{x}_{kind}" for kind in _MIXED), y)
                for x, y in zip("AB", _MIX_RGB, strict=True)
            )
            share = min(max(self.number(self.first(node, "Factor_Float", "Fac"), 0.5), 0.0), 1.0)
            first, second = np.array(self.colour(a)), np.array(self.colour(b))
            if node["properties"].get("blend_type") == "MULTIPLY":
                second = first * second
            return (1 - share) * first + share * second
        if kind in _PASSES_ON and (passed := self.first(node, *_COLOUR_INPUTS)) is not None:
            return self.colour(passed)
        return _GREY


def _three(given: Any) -> tuple[float, float, float]:
    values = np.atleast_1d(np.asarray(given, dtype=np.float64))
    red, green, blue = values[:3] if len(values) >= 3 else (float(values[0]),) * 3
    return float(red), float(green), float(blue)
