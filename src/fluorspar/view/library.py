"""What the menus of lamps and dyes hold, and materials by the names in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fluorspar.bispectral.lamp_colour import colour_under_lamp
from fluorspar.bispectral.library import material, materials
from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparError, MaterialError, message
from fluorspar.spectral.illuminants import illuminant, illuminants
from fluorspar.view.heard import heard

__all__ = ["known_material", "menus", "swatch"]


def menus(folders: Sequence[Path]) -> dict[str, Any]:
    """Illuminants, and materials with their colour under D65; files that are no materials are left out.

    Examples
    --------
    >>> "D65" in [row["name"] for row in menus([])["illuminants"]]
    True
    """
    listed = []
    for name in materials(folders):
        try:
            read = material(name, folders)
            colour = swatch(read)
        except FluorsparError:
            continue
        row = {"name": name, "description": read.description, "fluorescent": read.fluorescent, "srgb": colour}
        listed.append(row)
    lamps = [{"name": name, "description": illuminant(name).title} for name in illuminants()]
    return {"illuminants": lamps, "materials": listed}


def swatch(shown: Material) -> str:
    """The colour of a material under D65, as `#rrggbb`.

    Raises
    ------
    FluorsparError
        If it has none.

    Examples
    --------
    >>> swatch(material("white-85"))
    '#ededed'
    """
    with heard():  # `fluorspar materials show` says what is assumed
        rgb = colour_under_lamp(shown, "D65").srgb
    return "#" + "".join(f"{round(255 * float(channel)):02x}" for channel in rgb)


def known_material(name: str, folders: Sequence[Path]) -> Material:
    """A material of the library, or a mixture of some; a file of this computer is none of the names.

    Raises
    ------
    MaterialError
        If there is no such material.

    Examples
    --------
    >>> known_material("poster-red:0.5,poster-green:0.5", []).fluorescent
    True
    """
    known = {each.casefold() for each in materials(folders)}
    parts = (
        [name] if name.casefold() in known else [part.rpartition(":")[0].strip() for part in name.split(",")]
    )
    for part in parts:
        if part.casefold() not in known:
            expected = f"a mixture A:0.3,B:0.7, or one of: {', '.join(materials(folders))}"
            raise MaterialError(message("there is no such material", got=repr(name), expected=expected))
    return material(name, folders)
