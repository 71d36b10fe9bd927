"""Fluorescent surfaces: plain, coated, and printed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.errors import SceneError, message
from fluorspar.scene.lobes.lobe import CHANNELS, DyeMap
from fluorspar.scene.lobes.pictures import build_picture
from fluorspar.scene.lobes.plastic import check_index, internal_reflectance
from fluorspar.scene.lobes.rows import Coated, Luminescence, Reflection
from fluorspar.scene.lobes.side import Side, Spectral
from fluorspar.scene.lobes.table import LobeTable
from fluorspar.scene.nodes import copy_nodes
from fluorspar.scene.plugin import COAT, coat_plugin

__all__ = ["fluorescent"]


def fluorescent(table: LobeTable, index: int, side: Side) -> None:
    import mitsuba as mi

    props = table.state.nodes[index].props
    coat = {name: props[name] for name in COAT if name in props}
    maps = [
        name
        for name in ("reflectance", "concentration")
        if name in props
        and props.type(name) == mi.Properties.Type.ResolvedReference
        and _is_bitmap(table.state, props[name])
    ]
    if maps and coat:
        raise SceneError(
            message(
                "a coated fluorescent surface with a texture is not supported",
                where=side.where,
                got=f"{', '.join(coat)} and a texture as {', '.join(maps)}",
                expected="a coat, or a texture",
            )
        )
    key = index, "material"
    if key not in table.read:
        state = copy_nodes(table.state)
        for name in (*maps, *coat):
            del state.nodes[index].props[name]
        if "reflectance" in maps:
            state.nodes[index].props["reflectance"] = 0.0
        table.read[key] = table.of_material(table.read_material(state, index, side.shape))
    whole = table.read[key]
    if coat:
        _coated(table, index, side, whole, coat)
    elif maps:
        _dyed(table, index, side, whole, maps)
    else:
        table.become(index, whole, side)


def _is_bitmap(state: Any, reference: Any) -> bool:
    return bool(state.nodes[reference.index()].props.plugin_name() == "bitmap")


def _coated(table: LobeTable, index: int, side: Side, whole: Spectral, coat: dict[str, Any]) -> None:
    """A fluorescent base under the coat of a plastic, smooth or rough."""
    key = index, "coated"
    check_index(coat, side.where)
    plugin = coat_plugin(coat)
    table.edit(index, dict(coat), plugin=plugin)
    if key not in table.read:
        r = internal_reflectance({"type": plugin, **coat}, side.where)
        base = table.rows[whole.row]
        assert isinstance(base, Material)
        table.rows.append(Coated(base, r))
        # The probe is a linear plastic, whose base answers with 1 / (1 - r) to 1.
        table.read[key] = Spectral(len(table.rows) - 1, False, whole.mean, whole.mean / (1 - r))
    table.give(index, "diffuse_reflectance", table.read[key], side)
    table.give(index, "specular_reflectance", table.white, side)


def _dyed(table: LobeTable, index: int, side: Side, whole: Spectral, maps: list[str]) -> None:
    """A fluorescent surface whose reflectance, or the concentration of whose dye, is a picture."""
    key = index, "reflected"
    if key not in table.read:
        base = table.rows[whole.row]
        assert isinstance(base, Material)
        table.rows += [Luminescence(base), Reflection(base)]
        table.read[index, "dye"] = Spectral(len(table.rows) - 2, False, 1.0, 1.0)
        table.read[key] = (
            table.bitmap(
                table.state.nodes[index].props["reflectance"].index(), f"reflectance of {side.where}"
            )
            if "reflectance" in maps
            else replace(whole, row=len(table.rows) - 1)
        )
    reflected, dye = table.read[key], table.read[index, "dye"]
    first = side.channel(reflected, table.channel_of.get(key))
    second = side.channel(dye, table.channel_of.get((index, "dye")))
    table.channel_of[key], table.channel_of[index, "dye"] = first, second
    colour = [0.0] * CHANNELS
    colour[first], colour[second] = reflected.mean, 1.0
    table.edit(index, {"reflectance": (colour[0], colour[1], colour[2])}, plugin="diffuse")
    if "concentration" in maps:
        child = table.state.nodes[index].props["concentration"].index()
        build_picture(table.state, child, f"concentration of {side.where}")  # or it is said what is wrong
        table.maps[index] = DyeMap(child, second, first, reflected.mean)
