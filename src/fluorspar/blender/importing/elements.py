"""Elements of a Mitsuba scene file."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["matrix", "plugin", "refer", "rgb", "value"]


def plugin(
    tag: str, kind: str, *children: Element, name: str | None = None, id: str | None = None
) -> Element:
    """A plugin with what belongs to it.

    Examples
    --------
    >>> from xml.etree.ElementTree import tostring
    >>> tostring(plugin("bsdf", "diffuse", rgb("reflectance", (1, 0, 0.5)), id="red")).decode()
    '<bsdf type="diffuse" id="red"><rgb name="reflectance" value="1, 0, 0.5" /></bsdf>'
    """
    made = Element(tag, {"type": kind, **({"id": id} if id else {}), **({"name": name} if name else {})})
    made.extend(children)
    return made


def value(tag: str, name: str, given: object) -> Element:
    """A `float`, `integer`, `boolean` or `string`."""
    text = str(given).lower() if isinstance(given, bool) else f"{given:.9g}" if tag == "float" else str(given)
    return Element(tag, {"name": name, "value": text})


def rgb(name: str, colour: Sequence[float]) -> Element:
    """A linear colour."""
    return Element("rgb", {"name": name, "value": _text(colour)})


def matrix(name: str, rows: ArrayLike | NDArray[np.float64]) -> Element:
    """A transform of shape (4, 4)."""
    made = Element("transform", {"name": name})
    made.append(
        Element("matrix", {"value": _text(np.asarray(rows, dtype=np.float64).ravel()).replace(",", "")})
    )
    return made


def refer(id: str) -> Element:
    """What has been given an id before."""
    return Element("ref", {"id": id})


def _text(numbers: Sequence[float] | NDArray[np.float64]) -> str:
    return ", ".join(f"{float(number):.9g}" for number in numbers)
