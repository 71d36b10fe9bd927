"""What a row of a study may say: the options of a render by name, and `D.KEY`, `light.ID`, `material.ID`, ..."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from fluorspar.errors import OptionError, message
from fluorspar.scene.settings_text import size_of
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.scene.viewpoint import Viewpoint

__all__ = ["INDEX", "KINDS", "OPTIONS", "Value", "as_text", "check_key", "ids_of", "read_value"]

Value: TypeAlias = str | int | float | bool

KINDS = ("D", "light", "material", "concentration")
"""Of the keys that have an id behind a dot."""

INDEX = "-index"
"""What the name of an index ends with."""


def read_value(key: str, given: object, where: str) -> Value:
    """Read the value of a key, a TOML value or the text of a cell.

    Raises
    ------
    OptionError
        If there is no such key, or it cannot have this value.

    Examples
    --------
    >>> read_value("spp", "64", "row 1"), read_value("light.lamp", "0.5", "row 1"), read_value("size", "8x8", "row 1")
    (64, '0.5', '8x8')
    """
    check_key(key, where)
    if isinstance(given, np.generic):
        given = given.item()
    expected, read = _READERS[key.partition(".")[0]]
    try:
        return read(given)
    except (TypeError, ValueError, KeyError, OptionError) as err:
        raise OptionError(
            message("a value is not readable", where=f"{where}, {key}", got=repr(given), expected=expected)
        ) from err


def check_key(key: str, where: str) -> None:
    """Refuse a key that is none.

    Raises
    ------
    OptionError
        The message says which were meant perhaps.

    Examples
    --------
    >>> check_key("concentration.left-wall", "row 1")
    """
    kind, dot, name = key.partition(".")
    if (kind in KINDS and name and _is_kept(name)) or (kind in OPTIONS and not dot):
        return
    with_id = [f"{kind}.ID" for kind in KINDS]
    close = did_you_mean(kind if dot else key, [*OPTIONS, *(KINDS if dot else with_id)])
    if kind in KINDS and not name:
        close = f"say of what: {kind}.ID"
    elif dot and kind.removesuffix("s") in KINDS:
        close = f"did you mean {kind.removesuffix('s')}.{name}?"
    raise OptionError(
        message(
            f"there is no option {key!r}", where=where, expected=", ".join([*OPTIONS, *with_id]), fix=close
        )
    )


def ids_of(settings: Mapping[str, Value], kind: str) -> dict[str, Value]:
    """Return what settings say of one kind, by id.

    Examples
    --------
    >>> ids_of({"spp": 4, "light.lamp": "A", "light.sky": 0.5}, "light")
    {'lamp': 'A', 'sky': 0.5}
    """
    start = f"{kind}."
    return {key.removeprefix(start): value for key, value in settings.items() if key.startswith(start)}


def as_text(given: object) -> str:
    """Read a text, or a path as text.

    Raises
    ------
    TypeError
        If it is something else or empty.
    ValueError
        If no file and no index can hold it: with a NUL, or half a surrogate pair.

    Examples
    --------
    >>> as_text(" D65 ")
    'D65'
    """
    given = os.fspath(given) if isinstance(given, os.PathLike) else given
    if not isinstance(given, str) or not given.strip():
        raise TypeError
    if not _is_kept(given):
        raise ValueError("no file and no index can hold such a text")
    return given.strip()


def _is_kept(text: str) -> bool:
    """Whether the name of a file, and the index, can hold a text."""
    return "\0" not in text and text == text.encode(errors="replace").decode()


def _whole(given: object) -> int:
    if isinstance(given, bool) or not isinstance(given, int | float | str):
        raise TypeError
    if isinstance(given, float) and not given.is_integer():
        raise ValueError
    return int(given)


def _number(given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float | str):
        raise TypeError
    return float(given)


def _yes(given: object) -> bool:
    return {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}[
        str(given).strip().lower()
    ]


def _scalar(given: object) -> Value:
    return given if isinstance(given, bool | int | float) else as_text(given)


def _size(given: object) -> str:
    if isinstance(given, list | tuple):
        width, height = map(_whole, given)
        return f"{width}x{height}"
    size_of(as_text(given), "")
    return as_text(given)


def _camera(given: object) -> str:
    return str(Viewpoint.of(as_text(given)))


_TEXT, _WHOLE, _YES = ("a text", as_text), ("a whole number", _whole), ("true or false", _yes)

_READERS: Mapping[str, tuple[str, Callable[[object], Value]]] = {
    "scene": ("the name of a built-in scene, or a scene file (.xml)", as_text),
    "size": ('"WIDTHxHEIGHT" or [WIDTH, HEIGHT] in pixels, such as "512x512"', _size),
    "spp": _WHOLE,
    "seed": _WHOLE,
    "wavelengths": ('"START:STOP:STEP" in nm', as_text),
    "excitation": _TEXT,
    "stokes": _TEXT,
    "method": _TEXT,
    "max_depth": _WHOLE,
    "rr_depth": _WHOLE,
    "matte": _YES,
    "sensor": ("a number, or the id of a sensor", _scalar),
    "camera": ('"origin=X,Y,Z target=X,Y,Z up=X,Y,Z fov=DEGREES", or some of these', _camera),
    "component_errors": _YES,
    "until": _TEXT,
    "max_time": ("a time, such as 90s", _scalar),
    "variant": _TEXT,
    "library": ("a folder", as_text),
    "same_luminance": _YES,
    "denoise": _YES,
    "D": ("a number or a text", _scalar),
    "light": ("a name, a file, a factor, or NAMExFACTOR", _scalar),
    "material": ("a name, a file, or a mixture X:0.3,Y:0.7", as_text),
    "concentration": ("a number", _number),
}

OPTIONS = tuple(name for name in _READERS if name not in KINDS)
"""Keys without an id: the options of a render."""
