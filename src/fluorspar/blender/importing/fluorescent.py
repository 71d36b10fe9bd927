"""A material of the library in place of what Blender shows."""

from __future__ import annotations

from math import inf
from typing import Any
from xml.etree.ElementTree import Element

from fluorspar.bispectral.library import material
from fluorspar.blender.importing.elements import plugin, value
from fluorspar.errors import MaterialError, SceneError, message

__all__ = ["PREFIX", "fluorescent_bsdf"]

PREFIX = "fluorspar:"
"""What begins the name of a material in Blender that is one of the library."""


def fluorescent_bsdf(name: str, concentration: Any, where: str) -> Element:
    """The BSDF of a material of the library.

    Parameters
    ----------
    name : str
        Its name, perhaps with `PREFIX`.
    concentration : float, optional
        Factor on its luminescence; of any type, as Blender keeps it.
    where : str
        What to call the material of Blender in a message.

    Raises
    ------
    MaterialError
        If there is no such material.
    SceneError
        If the concentration is not a number of 0 or more.
    """
    name = name.removeprefix(PREFIX).strip()
    if concentration is not None and not (
        isinstance(concentration, (int, float)) and 0 <= concentration < inf
    ):
        fault = "the concentration of a material is wrong"
        expected = "a number from 0 on, in the custom property fluorspar_concentration"
        raise SceneError(message(fault, where=where, got=repr(concentration), expected=expected))
    try:
        material(name)
    except MaterialError as err:
        raise MaterialError(f"{err}\n  asked for by {where}") from err
    more = [] if concentration is None else [value("float", "concentration", concentration)]
    return plugin("bsdf", "fluorescent", value("string", "material", name), *more)
