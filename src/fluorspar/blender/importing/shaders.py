"""Trees of Blender's shader nodes as BSDFs and light."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element

from fluorspar.blender.importing.elements import plugin, rgb, value
from fluorspar.blender.importing.emitted import Emitted
from fluorspar.blender.importing.principled import principled
from fluorspar.blender.importing.shading import Shading, masked, matte, mixed
from fluorspar.blender.importing.sockets import Sockets

__all__ = ["shading_of"]

Said = dict[str, Any]

_SMOOTH = 1e-3  # roughness below which a surface is a mirror
_AS_MATTE = {  # shaders that have a colour, and no counterpart
    "BsdfTranslucent": "translucent",
    "SubsurfaceScattering": "subsurface scattering",
    "BsdfVelvet": "velvet",
    "BsdfSheen": "sheen",
    "BsdfToon": "toon",
    "BsdfHair": "hair",
    "BsdfHairPrincipled": "hair",
    "BsdfRayPortal": "a portal for rays",
}


def shading_of(outputs: Said, sockets: Sockets) -> Shading:
    """What is plugged into the output of a material; what is left out is listed."""
    for name in ("Volume", "Displacement"):
        if name in outputs:
            sockets.listing.add(sockets.where, f"has a {name.lower()}: it is left out")
    return _shading(outputs.get("Surface"), sockets)


def _shading(socket: Said | None, sockets: Sockets) -> Shading:
    node = sockets.node(socket)
    if node is None:
        return Shading()
    where, listing, inputs = sockets.where, sockets.listing, node["inputs"]
    match node["kind"]:
        case "BsdfPrincipled":
            shading = principled(node, sockets)
        case "BsdfDiffuse":
            if sockets.number(inputs.get("Roughness")) > 0:
                listing.add(where, "is rough in the sense of Oren and Nayar: it is matte in that of Lambert")
            shading = Shading(matte(sockets.element("reflectance", inputs["Color"], (0.8, 0.8, 0.8))))
        case "BsdfGlossy" | "BsdfAnisotropic":
            shading = _glossy(node, sockets)
        case "BsdfGlass" | "BsdfRefraction":
            shading = _glass(node, sockets)
        case "BsdfMetallic":
            shading = _glossy(node, sockets, "Base Color")
            given = (
                "a colour of its edge" if "Base Color" in inputs else "an index of refraction of each colour"
            )
            listing.add(where, f"is metallic with {given}: it has one colour")
        case "BsdfTransparent":
            if min(sockets.colour(inputs["Color"], (1.0, 1.0, 1.0))) < 0.999:
                listing.add(where, "is transparent with a colour: it is transparent without one")
            return Shading(absent=True)
        case "Emission":
            strength = sockets.number(inputs["Strength"], 1.0)
            return Shading(emitted=sockets.emitted(inputs["Color"]).times(strength))
        case "MixShader":
            return _mix(inputs, sockets)
        case "AddShader":
            return _add(inputs, sockets)
        case kind if kind in _AS_MATTE:
            listing.add(where, f"has the shader {_AS_MATTE[kind]}: it is matte instead")
            colour = sockets.element("reflectance", sockets.first(node, "Color"), (0.8, 0.8, 0.8))
            return Shading(matte(colour))
        case kind:
            listing.add(
                where, f"has the node '{node['name']}' ({kind}), which is unknown: it is matte and grey"
            )
            return Shading(matte(rgb("reflectance", (0.5, 0.5, 0.5))))
    return _bumped(shading, inputs.get("Normal"), sockets)


def _roughness(node: Said, sockets: Sockets) -> float:
    """Blender's roughness squared, the width of the distribution of facets."""
    return (
        0.0
        if node["properties"].get("distribution") == "SHARP"
        else sockets.number(sockets.first(node, "Roughness"), 0.5) ** 2
    )


def _distribution(node: Said, sockets: Sockets, alpha: float) -> list[Element]:
    kind = node["properties"].get("distribution", "GGX")
    if kind == "ASHIKHMIN_SHIRLEY":
        sockets.listing.add(sockets.where, "has facets of Ashikhmin and Shirley: they are those of GGX")
    elif kind == "MULTI_GGX":
        sockets.listing.add(sockets.where, "counts light that facets send to each other: it is lost here")
    name = "beckmann" if kind == "BECKMANN" else "ggx"
    return [value("string", "distribution", name), value("float", "alpha", alpha)]


def _glossy(node: Said, sockets: Sockets, colour: str = "Color") -> Shading:
    """A mirror of a colour, without Fresnel's equations."""
    alpha = _roughness(node, sockets)
    parts = [
        value("string", "material", "none"),
        sockets.element("specular_reflectance", sockets.first(node, colour), (0.8, 0.8, 0.8)),
    ]
    if abs(sockets.number(sockets.first(node, "Anisotropy"))) > 0:
        sockets.listing.add(sockets.where, "is anisotropic: the roughness is the same in all directions")
    if alpha < _SMOOTH:
        return Shading(plugin("bsdf", "conductor", *parts))
    return Shading(plugin("bsdf", "roughconductor", *parts, *_distribution(node, sockets, alpha)))


def _glass(node: Said, sockets: Sockets) -> Shading:
    """Both what is reflected and what is refracted has the colour in Blender."""
    alpha = _roughness(node, sockets)
    if node["kind"] == "BsdfRefraction":
        sockets.listing.add(sockets.where, "refracts without reflecting: it is glass, which reflects")
    parts = [
        value("float", "int_ior", sockets.number(node["inputs"]["IOR"], 1.45)),
        value("float", "ext_ior", 1.0),
    ]
    for name in ("specular_reflectance", "specular_transmittance"):
        colour = sockets.element(name, node["inputs"]["Color"], (1.0, 1.0, 1.0))
        parts.append(colour)
    if alpha < _SMOOTH:
        return Shading(plugin("bsdf", "dielectric", *parts), True)
    return Shading(plugin("bsdf", "roughdielectric", *parts, *_distribution(node, sockets, alpha)), True)


def _mix(inputs: Said, sockets: Sockets) -> Shading:
    factor = inputs.get("Fac", inputs.get("Factor"))
    first, second = _shading(inputs["Shader"], sockets), _shading(inputs["Shader_001"], sockets)
    weight = _weight(factor, sockets)
    share = min(max(float(weight.get("value", "0.5")), 0.0), 1.0)
    lights = [
        part.emitted.times(s) for part, s in ((first, 1 - share), (second, share)) if part.emitted is not None
    ]
    if lights and weight.tag != "float":
        sockets.listing.add(sockets.where, "mixes light by an image: it is half as strong everywhere")
    emitted = _together(lights, sockets)
    if first.absent and second.absent:
        made = Shading(absent=True)
    elif first.absent and weight.tag == "float":
        made = masked(second, value("float", "opacity", share))
    elif second.absent and weight.tag == "float":
        made = masked(first, value("float", "opacity", 1 - share))
    elif first.absent:
        weight.set("name", "opacity")
        made = masked(second, weight)
    else:
        made = mixed(first, second, weight)
    return Shading(made.bsdf, made.clear, emitted, made.absent)


def _weight(factor: Said | None, sockets: Sockets) -> Element:
    source = sockets.node(factor)
    if source is not None and source["kind"] in ("Fresnel", "LayerWeight"):
        ior = sockets.number(source["inputs"].get("IOR"), 1.45)
        if source["kind"] == "LayerWeight":
            ior = 1 / max(1 - sockets.number(source["inputs"].get("Blend"), 0.5), 1e-3)
        share = ((ior - 1) / (ior + 1)) ** 2
        sockets.listing.add(
            sockets.where,
            f"mixes by angle ('{source['name']}'): it mixes as seen from the front, by {share:.3g}",
        )
        return value("float", "weight", share)
    return sockets.element("weight", factor, 0.5)


def _add(inputs: Said, sockets: Sockets) -> Shading:
    first, second = _shading(inputs["Shader"], sockets), _shading(inputs["Shader_001"], sockets)
    emitted = _together([part.emitted for part in (first, second) if part.emitted is not None], sockets)
    solid = [part for part in (first, second) if part.bsdf is not None or part.absent]
    if len(solid) == 2:
        sockets.listing.add(sockets.where, "adds two shaders: each counts half")
        made = mixed(solid[0], solid[1], value("float", "weight", 0.5))
    else:
        made = solid[0] if solid else Shading()
    return Shading(made.bsdf, made.clear, emitted, made.absent)


def _together(lights: list[Emitted], sockets: Sockets) -> Emitted | None:
    lights = [light for light in lights if not light.is_dark]
    if len(lights) == 2 and lights[0].kelvin is None and lights[1].kelvin is None:
        red, green, blue = (a + b for a, b in zip(lights[0].colour, lights[1].colour, strict=True))
        return Emitted((red, green, blue))
    if len(lights) == 2:
        sockets.listing.add(sockets.where, "adds the lights of two shaders: the second is left out")
    return lights[0] if lights else None


def _bumped(shading: Shading, socket: Said | None, sockets: Sockets) -> Shading:
    """With the normals of an image around it."""
    node = sockets.node(socket)
    if node is None or shading.bsdf is None:
        return shading
    where, listing = sockets.where, sockets.listing
    image = sockets.node(node["inputs"].get("Color")) if node["kind"] == "NormalMap" else None
    if image is None or image["kind"] != "TexImage":
        listing.add(where, f"has normals by '{node['name']}' ({node['kind']}): they are left out")
        return shading
    if node["properties"]["space"] != "TANGENT" or sockets.number(node["inputs"]["Strength"], 1.0) != 1:
        listing.add(where, "has a normal map in another space or of another strength than 1: it is left out")
        return shading
    texture = sockets.textures.bitmap(image, where, "normalmap", data=True)
    if texture is None:
        return shading
    return Shading(
        plugin("bsdf", "normalmap", texture, shading.bsdf), shading.clear, shading.emitted, shading.absent
    )
