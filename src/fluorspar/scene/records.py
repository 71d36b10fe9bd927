"""What light paths refer to, as plain values for a file: materials, lights, surfaces and lobes of a scene.

A record is JSON in which objects are numbered, so that what two of them share stays shared, and arrays are kept apart.
Only classes that are listed here are read back: a file cannot name any other.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.factored import FactoredMatrix, Fluorophore
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.scene.lights import Light
from fluorspar.scene.lobes.lobe import DyeMap, Lobe, Lobes, Texture
from fluorspar.scene.lobes.rows import Coated, Luminescence, Metal, Operated, Reflection
from fluorspar.scene.settings import Settings
from fluorspar.scene.surfaces import Surface
from fluorspar.scene.viewpoint import Viewpoint
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["from_record", "to_record"]

_CLASSES: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (
        Coated,
        DyeMap,
        FactoredMatrix,
        Fluorophore,
        Light,
        Lobe,
        Lobes,
        Luminescence,
        Material,
        MeasuredMatrix,
        Metal,
        Operated,
        Reflection,
        Settings,
        Spectrum,
        Surface,
        Texture,
        Viewpoint,
        Wavelengths,
    )
}
_LEFT_OUT = {"Lobes": ("edits", "replaced", "skies", "maps")}  # what only tracing needs


def to_record(value: Any) -> tuple[str, list[NDArray[Any]]]:
    """Make a record of a value: a tree of the classes above, dicts, lists, arrays, numbers and text.

    Returns
    -------
    text : str
        JSON.
    arrays : list of ndarray

    Examples
    --------
    >>> text, arrays = to_record({"grey": Material("grey", Spectrum.constant(0.5))})
    >>> from_record(text, arrays)["grey"].reflectance.at(550)
    0.5
    """
    writer = _Writer()
    root = writer.plain(value)
    return json.dumps({"objects": writer.objects, "root": root}), writer.arrays


def from_record(text: str, arrays: Sequence[NDArray[Any]]) -> Any:
    """Make the value that a record is of.

    Raises
    ------
    ValueError, KeyError, TypeError, IndexError, FluorsparError
        If it is none, or what it describes is impossible.
    """
    record = json.loads(text)
    made: list[Any] = []
    for described in record["objects"]:  # what an object refers to comes before it
        made.append(_made(described, made, arrays))
    return _value(record["root"], made, arrays)


class _Writer:
    def __init__(self) -> None:
        self.objects: list[dict[str, Any]] = []
        self.arrays: list[NDArray[Any]] = []
        self._number: dict[int, int] = {}
        self._kept: list[Any] = []  # so that no `id` is used twice

    def plain(self, value: Any) -> Any:
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, Path):
            return str(value)
        if isinstance(value, np.ndarray):
            self.arrays.append(value)
            return {"array": len(self.arrays) - 1}
        if isinstance(value, Mapping):
            return {"pairs": [[self.plain(key), self.plain(item)] for key, item in value.items()]}
        if isinstance(value, tuple | list):
            return [self.plain(item) for item in value]
        kind = type(value).__name__
        if _CLASSES.get(kind) is not type(value):
            raise TypeError(f"a {kind} has no record")
        if id(value) not in self._number:
            fields = {
                field.name: self.plain(getattr(value, field.name))
                for field in dataclasses.fields(value)
                if field.name not in _LEFT_OUT.get(kind, ())
            }
            self._kept.append(value)
            self.objects.append({"class": kind, "fields": fields})
            self._number[id(value)] = len(self.objects) - 1
        return {"object": self._number[id(value)]}


def _value(plain: Any, made: list[Any], arrays: Sequence[NDArray[Any]]) -> Any:
    if isinstance(plain, list):
        return tuple(_value(item, made, arrays) for item in plain)
    if isinstance(plain, dict):
        if "array" in plain:
            return arrays[plain["array"]]
        if "object" in plain:
            return made[plain["object"]]
        return {_value(key, made, arrays): _value(item, made, arrays) for key, item in plain["pairs"]}
    return plain


def _made(described: Mapping[str, Any], made: list[Any], arrays: Sequence[NDArray[Any]]) -> Any:
    kind = _CLASSES[described["class"]]
    return kind(**{name: _value(item, made, arrays) for name, item in described["fields"].items()})
