"""What is checked in a parsed scene before anything is built of it: numbers, transforms and files of meshes."""

from __future__ import annotations

import os
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import FluorsparWarning, SceneError, message
from fluorspar.scene.nodes import copy_nodes, kind, label, resolved

__all__ = ["LARGEST", "check_meshes", "check_numbers", "warn_of_rotations"]

LARGEST = 1e30
"""Numbers of a scene are smaller: Mitsuba computes in single precision, which ends at 3.4e38."""

_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
_ROTATE = re.compile(rb"<rotate\b[^>]*>")
_ATTRIBUTE = re.compile(rb"""\b(x|y|z|value)\s*=\s*["']([^"']*)["']""")


def check_numbers(state: Any) -> None:
    """Refuse numbers that no image can be computed from.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene.

    Raises
    ------
    SceneError
        If a number is not finite or not below `LARGEST`, a direction has length 0, or a transform flattens space.
    """
    for index, node in enumerate(
        copy_nodes(state).nodes
    ):  # Mitsuba finds misspelt properties by who reads them
        for key in node.props.keys():  # noqa: SIM118 (not a dict)
            values = _numbers(node.props, key)
            where = f"'{key}' of {label(node, index)}"
            bad = values[~(np.abs(values) < LARGEST)]
            if bad.size:
                fault = "a number is too large" if np.isfinite(bad[0]) else "this is not a finite number"
                where += _wavelength_of(node.props, key, bad[0])
                expected = f"a number between -{LARGEST:g} and {LARGEST:g}"
                raise SceneError(message(fault, where=where, got=f"{bad[0]:g}", expected=expected))
            if key == "direction" and not values.any():
                raise SceneError(
                    message("a direction has length 0", where=where, expected="a vector that is not 0")
                )
            if key == "to_world" and np.linalg.matrix_rank(_scaled(values)) < 4:
                raise SceneError(
                    message(
                        "a transform maps space onto a plane, line or point",
                        where=where,
                        got="a matrix that cannot be inverted",
                        expected="one that can be, such as <scale> by other numbers than 0",
                    )
                )


def _numbers(props: Any, key: str) -> NDArray[np.float64]:
    """All numbers of a property, of a transform as (4, 4); none of what holds no numbers."""
    import mitsuba as mi

    types = mi.Properties.Type
    value_type = props.type(key)
    if value_type == types.Spectrum:
        return np.concatenate([props[key].wavelengths, props[key].values])
    if value_type == types.Transform:
        return np.array(props[key].matrix, dtype=np.float64)
    if value_type in (types.Float, types.Integer, types.Vector, types.Color):
        return np.array(props[key], dtype=np.float64).ravel()
    return np.zeros(0)


def _wavelength_of(props: Any, key: str, value: float) -> str:
    """Where in a spectrum a value is, in words."""
    import mitsuba as mi

    if props.type(key) != mi.Properties.Type.Spectrum:
        return ""
    table = props[key]
    pairs = zip(table.wavelengths, table.values, strict=False)
    return next((f", {w:g} nm" for w, v in pairs if v == value or (np.isnan(v) and np.isnan(value))), "")


def _scaled(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Columns of length 1, so that small objects and far places are no reason to call it singular."""
    lengths = np.linalg.norm(matrix[:3], axis=0)
    scaled = np.eye(4)
    scaled[:3, :3] = matrix[:3, :3] / np.where(lengths[:3] > 0, lengths[:3], 1)
    return scaled


def check_meshes(state: Any) -> None:
    """Find out whether the files of all shapes exist; the folders of the scene must be those of Mitsuba's resolver.

    Raises
    ------
    SceneError
        If one does not.
    """
    import mitsuba as mi

    for index, node in enumerate(state.nodes):
        if kind(node) != "Shape" or "filename" not in node.props:
            continue
        if not os.path.isfile(
            resolved(name := str(node.props["filename"]))
        ):  # False for what is too long for a name
            raise SceneError(
                message(
                    "the file of a shape does not exist",
                    where=f"shape {label(node, index)}",
                    got=name,
                    expected=f"a file in one of {', '.join(map(str, mi.file_resolver()))}",
                    fix="check the name, or add <path value='FOLDER'/> to the scene",
                )
            )


def warn_of_rotations(state: Any) -> None:
    """Warn of rotations in scene files about axes that are not of unit length.

    Warns
    -----
    FluorsparWarning
        Mitsuba's rotation matrix then scales and shears what is rotated.
    """
    for file in map(Path, map(str, state.files)):
        for tag in _ROTATE.findall(_COMMENT.sub(b"", file.read_bytes())):
            given = {name.decode(): value.decode(errors="replace") for name, value in _ATTRIBUTE.findall(tag)}
            try:
                whole = given.get("value", "").replace(",", " ").split()
                axis = [float(x) for x in (whole or [given.get(name, "0") for name in "xyz"])]
            except ValueError:  # a parameter, $NAME
                continue
            if abs((length := float(np.linalg.norm(axis))) - 1) > 1e-3:
                text = (
                    f"{file.name}: {tag.decode(errors='replace')} turns about an axis of length {length:.4g}: Mitsuba "
                    "distorts what is turned about an axis that is not of length 1"
                )
                warnings.warn(text, FluorsparWarning, stacklevel=3)
