"""Disney's BSDF, whose value is a polynomial in the root of its base colour."""

from __future__ import annotations

from fluorspar.errors import SceneError, message
from fluorspar.scene.lobes.lobe import DARK, FULL, HALF
from fluorspar.scene.lobes.side import Side
from fluorspar.scene.lobes.table import LobeTable

__all__ = ["principled"]


def principled(table: LobeTable, index: int, side: Side) -> None:
    props = table.state.nodes[index].props

    def used(name: str) -> bool:
        given = props.get(name, 0.0)
        return not isinstance(given, (int, float)) or given != 0.0  # else a texture

    for tint, counts in (("spec_tint", True), ("sheen_tint", used("sheen"))):
        if counts and used(tint):
            raise SceneError(
                message(
                    f"'{tint}' is not supported",
                    where=side.where,
                    got=props[tint],
                    expected="0, since its colour is defined for red, green and blue only",
                )
            )
    spectral = table.spectral(index, "base_color", 0.5, side)
    if used("spec_trans"):
        table.warn_of_interpolation(spectral, side.where)
    # The value is a polynomial of the second degree in the root of the base colour, so three of them tell it.
    nodes = ((FULL, 1.0), (DARK, 0.0), (HALF, 0.25))
    for channel, (operation, base) in enumerate(nodes):
        key = table.key(index, f"base_color, {operation}", side.shape)
        if key not in table.read:
            table.read[key] = table.operated(spectral, operation, base, 1.0)
        side.channel(table.read[key], channel)
    table.edit(index, {"base_color": (1.0, 0.0, 0.25)})
