"""Plastics and glass: highlights, and a base under a coat."""

from __future__ import annotations

from typing import Any

from fluorspar.scene.lobes.side import Side
from fluorspar.scene.lobes.table import LobeTable
from fluorspar.scene.plugin import COAT

__all__ = ["dielectric", "internal_reflectance", "plastic"]


def plastic(table: LobeTable, index: int, side: Side) -> None:
    key = index, "diffuse_reflectance"
    spectral = table.spectral(*key, 0.5, f"diffuse_reflectance of {side.where}")
    if table.state.nodes[index].props.get("nonlinear", False):
        nonlinear = index, "diffuse_reflectance, nonlinear"
        if nonlinear not in table.read:
            r, m = _internal_reflectance_of(table.state, index), spectral.mean
            table.read[nonlinear] = table.operated(spectral, r, m, m * (1 - r) / (1 - r * m))
        spectral = table.read[nonlinear]
    table.give(*key, spectral, side)
    _specular(table, index, side, "specular_reflectance")


def _internal_reflectance_of(state: Any, index: int) -> float:
    """The r of a plastic of the scene."""
    props = state.nodes[index].props
    coat = {name: props[name] for name in COAT if name in props}
    return internal_reflectance({"type": props.plugin_name(), **coat})


def internal_reflectance(plastic: dict[str, Any]) -> float:
    """The r of a plastic, from its value with two colours: S / (1 - r S) for S = 1/2 and 1, without highlight."""
    import mitsuba as mi

    values = []
    for S in (0.5, 1.0):
        bsdf = mi.load_dict(
            {**plastic, "diffuse_reflectance": S, "specular_reflectance": 0.0, "nonlinear": True}
        )
        si = mi.SurfaceInteraction3f()
        si.wi = [0.0, 0.0, 1.0]
        si.wavelengths = [550.0] * 4
        values.append(float(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0.6, 0.0, 0.8))[0]))
    ratio = values[0] / values[1]
    return (1 - 2 * ratio) / (1 - ratio)


def dielectric(table: LobeTable, index: int, side: Side) -> None:
    _specular(table, index, side, "specular_reflectance")
    _specular(table, index, side, "specular_transmittance")


def _specular(table: LobeTable, index: int, side: Side, name: str) -> None:
    table.give(index, name, table.spectral(index, name, 1.0, f"{name} of {side.where}"), side)
