"""Scene dicts in plain values, which can be pickled: Mitsuba's transforms cannot, and belong to a variant."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np

from fluorspar.errors import SceneError, message

__all__ = ["plain_dict"]


def plain_dict(scene: dict[str, Any]) -> dict[str, Any]:
    """Copy a scene dict, with plain values in place of what belongs to a Mitsuba variant.

    Transforms become Dr.Jit matrices, points lists, and colours dicts of type `rgb`; `mitsuba.load_dict` takes them all
    the same. What is already built stays as it is, to be refused with its place in the scene. A variant must be set.

    Raises
    ------
    SceneError
        If a value cannot be pickled.

    Examples
    --------
    >>> import mitsuba as mi
    >>> mi.set_variant("scalar_rgb")
    >>> plain_dict({"type": "point", "position": mi.ScalarPoint3f(1, 2, 3)})
    {'type': 'point', 'position': [1.0, 2.0, 3.0]}
    """
    plain = {name: _plain(value, name) for name, value in scene.items()}
    if plain.get("type") == "rgb" and isinstance(plain.get("value"), dict):
        return dict(plain["value"])  # a colour in an `rgb` dict
    return plain


def _plain(value: Any, name: str) -> Any:
    import drjit as dr
    import mitsuba as mi

    if isinstance(value, dict):
        return plain_dict(value)
    if isinstance(value, (list, tuple)):
        return [_plain(item, name) for item in value]
    if value is None or isinstance(value, (bool, int, float, str, mi.Object)):
        return value
    if "Transform" in type(value).__name__ and np.size(value.matrix) == 16:  # of any variant
        return dr.scalar.Matrix4f64(np.reshape(value.matrix, (4, 4)).tolist())
    properties = mi.Properties()
    try:
        properties[name] = value
        kind = properties.type(name)
    except Exception:  # whatever it is, Mitsuba's parser says what it minds
        return value
    if kind == mi.Properties.Type.Transform:
        return dr.scalar.Matrix4f64(np.array(properties[name].matrix).tolist())
    if kind == mi.Properties.Type.Vector:
        return [float(part) for part in properties[name]]
    if kind == mi.Properties.Type.Color:
        return {"type": "rgb", "value": [float(part) for part in properties[name]]}
    try:
        return pickle.loads(pickle.dumps(value))
    except Exception as err:
        raise SceneError(
            message(
                "the scene dict holds a value that cannot be given to another process",
                where=f"'{name}'",
                got=type(value).__name__,
                expected="plain values, transforms and dicts",
            )
        ) from err
