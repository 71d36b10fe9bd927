"""What a page is told of a scene: its lights and surfaces, by the ids under which they can be changed."""

from __future__ import annotations

from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparError, OptionError, message
from fluorspar.scene.relit import exchangeable, light_ids
from fluorspar.scene.scene import Scene
from fluorspar.scene.surfaces import ABSORBS
from fluorspar.view.curves import curve_of
from fluorspar.view.library import swatch

__all__ = ["light_facts", "material_on", "surface_facts"]


def light_facts(scene: Scene) -> list[dict[str, Any]]:
    """Every light: the id by which it can be changed, its kind, unit and spectrum.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> [light["id"] for light in light_facts(load_scene("cornell-box"))]
    ['light']
    """
    id_of = {row: name for name, row in reversed(light_ids(scene).items())}
    return [
        {
            "id": id_of.get(row, light.name),
            "name": light.name,
            "plugin": light.plugin,
            "unit": light.unit,
            "spectrum": curve_of(light.spectrum),
        }
        for row, light in enumerate(scene.lights)
    ]


def surface_facts(scene: Scene) -> list[dict[str, Any]]:
    """Every shape and BSDF by its id: the materials of its sides, and why these cannot be changed, if so.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> next(row for row in surface_facts(load_scene("cornell-box")) if row["id"] == "left-wall")["front"]
    'poster-red'
    """
    rows, colours = [], dict[int, str | None]()
    for name, held in exchangeable(scene).items():
        front, back = (_side(scene, name, held, side) for side in ("front", "back"))
        seen = front or back
        if seen is not None and id(seen) not in colours:
            colours[id(seen)] = _swatch(seen)
        rows.append(
            {
                "id": name,
                "ids": [name],
                "front": None if front is None else front.name,
                "back": None if back is None else back.name,
                "fluorescent": any(side is not None and side.fluorescent for side in (front, back)),
                "srgb": None if seen is None else colours[id(seen)],
                "why_not": held if isinstance(held, str) else "",
            }
        )
    return rows


def _swatch(material: Material) -> str | None:
    try:
        return swatch(material)
    except FluorsparError:
        return None


def material_on(scene: Scene, name: str, side: str) -> Material:
    """The material of a side of a surface, by its id.

    Raises
    ------
    OptionError
        If there is no such surface, or its colour is not that of a material.
    """
    held = exchangeable(scene)
    if name not in held:
        fault, expected = f"there is no surface '{name}'", f"one of {', '.join(held)}"
        raise OptionError(message(fault, expected=expected))
    found = _side(scene, name, held[name], side)
    if found is None:
        reason = held[name] if isinstance(held[name], str) else "that side absorbs all light"
        raise OptionError(message(f"the {side} of '{name}' has no Donaldson matrix", got=reason))
    return found


def _side(scene: Scene, name: str, held: Material | str, side: str) -> Material | None:
    """The material of a side, as far as a scene tells them apart."""
    surface = next((surface for surface in scene.surfaces if surface.name == name), None)
    if scene.lobes is None and surface is not None:
        row = surface.front if side == "front" else surface.back
        return None if row == ABSORBS else scene.materials[row]
    return held if isinstance(held, Material) else None
