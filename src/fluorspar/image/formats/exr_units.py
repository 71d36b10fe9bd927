"""Quantity and unit of an image in a spectral EXR file: the kind of its channels, and `emissiveUnits`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fluorspar.image.units import NOT_STATED, UNITS, quantity_of, same_unit, stated, unit_of

__all__ = ["channel_kind", "emissive_units", "stated_by"]

_EMISSIVE_UNITS = "W.m^-2.sr^-1"  # the layout's spelling; a channel is a density, per nm


def channel_kind(attrs: Mapping[str, Any]) -> str:
    """How the channels of an image are named, by its attributes: "T" for reflectance, "S0" for light.

    Examples
    --------
    >>> channel_kind({}), channel_kind({"unit": "1", "quantity": "reflectance"})
    ('S0', 'T')
    """
    return "T" if quantity_of(attrs) == "reflectance" else "S0"


def emissive_units(attrs: Mapping[str, Any]) -> dict[str, str]:
    """The header attribute for the unit of an image; none if no unit is known, or for reflectance.

    Examples
    --------
    >>> emissive_units({}), emissive_units({"unit": "1", "quantity": "reflectance"})
    ({'emissiveUnits': 'W.m^-2.sr^-1'}, {})
    """
    unit = unit_of(attrs)
    if channel_kind(attrs) == "T" or unit == NOT_STATED:
        return {}
    return {"emissiveUnits": _EMISSIVE_UNITS if same_unit(unit, UNITS) else unit}


def stated_by(header: Mapping[str, Any], kind: str) -> dict[str, str]:
    """The attributes `unit` and `quantity` of an image, by the header of its part and the kind of its channels.

    Examples
    --------
    >>> stated_by({"emissiveUnits": "W.m^-2.sr^-1"}, "S0"), stated_by({}, "S0")
    ({}, {'unit': 'not stated', 'quantity': 'radiance'})
    """
    if kind == "T":
        return stated("1", "reflectance")
    unit = str(header.get("emissiveUnits", NOT_STATED))
    return stated(UNITS if same_unit(unit, _EMISSIVE_UNITS) else unit)
