"""What a tree of shaders makes of a surface: BSDF, light and transparency."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

from fluorspar.blender.importing.elements import plugin, rgb, value
from fluorspar.blender.importing.emitted import Emitted

__all__ = ["Shading", "black", "matte", "two_sided"]


@dataclass(frozen=True)
class Shading:
    """Part of a surface.

    Attributes
    ----------
    bsdf : Element, optional
        None where nothing is reflected.
    clear : bool
        Whether light passes through: then its two sides differ, and it is not wrapped in `twosided`.
    emitted : Emitted, optional
    absent : bool
        Whether it is not there at all: transparent.
    """

    bsdf: Element | None = None
    clear: bool = False
    emitted: Emitted | None = None
    absent: bool = False


def matte(colour: Element) -> Element:
    """A diffuse BSDF; the colour is its `reflectance`."""
    return plugin("bsdf", "diffuse", colour)


def black() -> Element:
    return matte(rgb("reflectance", (0, 0, 0)))


def two_sided(shading: Shading) -> Element:
    """Its BSDF, the same on both sides, as surfaces are in Blender."""
    if shading.absent:
        return plugin("bsdf", "null")
    bsdf = shading.bsdf if shading.bsdf is not None else black()
    return bsdf if shading.clear else plugin("bsdf", "twosided", bsdf)


def masked(shading: Shading, opacity: Element) -> Shading:
    """Transparent where the opacity, a property of that name, is below 1."""
    if opacity.tag == "float" and float(opacity.get("value", "1")) >= 1:
        return shading
    if opacity.tag == "float" and float(opacity.get("value", "1")) <= 0:
        return Shading(absent=True, emitted=shading.emitted)
    return Shading(plugin("bsdf", "mask", opacity, two_sided(shading)), True, shading.emitted)


def mixed(first: Shading, second: Shading, weight: Element) -> Shading:
    """The first where the weight, a property of that name, is 0, the second where it is 1."""
    if weight.tag == "float":
        share = min(max(float(weight.get("value", "0")), 0.0), 1.0)
        weight = value("float", "weight", share)
        if share in (0, 1):
            return second if share else first
    clear = first.clear or second.clear or first.absent or second.absent
    if clear:
        bsdf = plugin("bsdf", "blendbsdf", weight, two_sided(first), two_sided(second))
    else:
        bsdf = plugin("bsdf", "blendbsdf", weight, first.bsdf or black(), second.bsdf or black())
    return Shading(bsdf, clear)
