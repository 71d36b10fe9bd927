"""Shadows that what is transparent throws in the light of points and directions."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from fluorspar.blender.importing.listing import Listing

__all__ = ["list_solid_shadows"]

_POINTED = ("point", "spot", "directional")
_MASKS = ".//bsdf[@type='null']"


def list_solid_shadows(scene: Element, listing: Listing) -> None:
    """Say what throws one: such light is looked for on straight lines, which what is transparent blocks."""
    if not any(emitter.get("type") in _POINTED for emitter in scene.iter("emitter")):
        return
    masks = {bsdf.get("id") for bsdf in scene.iter("bsdf") if bsdf.find(_MASKS) is not None}
    masks |= {bsdf.get("id") for bsdf in scene.iter("bsdf") if bsdf.get("type") == "mask"}
    for name in sorted(filter(None, masks)):
        what = "is transparent in parts, but throws an opaque shadow in the light of points, spots and suns"
        listing.add(f"material '{name}'", what)
    for shape in scene.findall("shape/bsdf[@type='null']/.."):
        what = "throws a shadow in the light of points, spots and suns, which a lamp of Blender does not"
        listing.add(f"light '{shape.get('id')}'", what)
