"""Values of Blender as JSON has them."""

from __future__ import annotations

from typing import Any

__all__ = ["Said", "plain", "rows", "simple_properties"]

SIMPLE = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")

Said = dict[str, Any]


def plain(value: Any) -> Any:
    """A value of Blender as JSON has it; None for what has none."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    try:
        return [float(v) for v in value]
    except (TypeError, ValueError):
        return None


def rows(matrix: Any) -> list[list[float]]:
    return [list(row) for row in matrix]


def simple_properties(thing: Any, kind: Any) -> Said:
    """The properties of a thing that are single values, but for those that all of its kind have."""
    common = set(kind.bl_rna.properties.keys())
    return {
        prop.identifier: plain(getattr(thing, prop.identifier))
        for prop in thing.bl_rna.properties
        if prop.identifier not in common and prop.type in SIMPLE
    }
