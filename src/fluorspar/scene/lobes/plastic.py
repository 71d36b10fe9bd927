"""Plastics and glass: highlights, and a base under a coat."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fluorspar.errors import SceneError, message
from fluorspar.scene.lobes.side import Side
from fluorspar.scene.lobes.table import LobeTable
from fluorspar.scene.plugin import COAT

__all__ = ["check_index", "dielectric", "internal_reflectance", "plastic"]


def plastic(table: LobeTable, index: int, side: Side) -> None:
    check_index(table.state.nodes[index].props, side.where)
    key = index, "diffuse_reflectance"
    spectral = table.spectral(*key, 0.5, side)
    if table.state.nodes[index].props.get("nonlinear", False):
        table.warn_of_interpolation(spectral, side.where)
        nonlinear = table.key(index, "diffuse_reflectance, nonlinear", side.shape)
        if nonlinear not in table.read:
            r, m = _internal_reflectance_of(table.state, index, side.where), spectral.mean
            table.read[nonlinear] = table.operated(spectral, r, m, m * (1 - r) / (1 - r * m))
        spectral = table.read[nonlinear]
    table.give(*key, spectral, side)
    _specular(table, index, side, "specular_reflectance")


def _internal_reflectance_of(state: Any, index: int, where: str) -> float:
    """The r of a plastic of the scene."""
    props = state.nodes[index].props
    coat = {name: props[name] for name in COAT if name in props}
    return internal_reflectance({"type": props.plugin_name(), **coat}, where)


def check_index(props: Any, where: str) -> None:
    """Refuse an index of refraction of 0, which Mitsuba takes, and makes no number of."""
    for name in ("int_ior", "ext_ior"):
        if name in props and not isinstance(value := props[name], str) and value <= 0:
            raise SceneError(
                message(
                    "an index of refraction is not positive",
                    where=f"{name} of {where}",
                    got=value,
                    expected="above 0",
                )
            )


def internal_reflectance(plastic: dict[str, Any], where: str) -> float:
    """The r of a plastic, from its value with two colours: S / (1 - r S) for S = 1/2 and 1, without highlight."""
    import mitsuba as mi

    two = {
        "type": "spectrum",
        "value": [(400.0, 0.5), (500.0, 1.0)],
    }  # one plugin: a rough one takes long to build
    black = {"diffuse_reflectance": two, "specular_reflectance": 0.0, "nonlinear": True}
    try:
        bsdf = mi.load_dict({**plastic, **black})
    except RuntimeError as err:
        raise SceneError(message("Mitsuba cannot build this", where=where, got=err)) from err
    si = mi.SurfaceInteraction3f()
    si.wi = [0.0, 0.0, 1.0]
    si.wavelengths = [400.0, 500.0, 400.0, 500.0]
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0.6, 0.0, 0.8))
    ratio = float(value[0]) / float(value[1])
    return (1 - 2 * ratio) / (1 - ratio)


def dielectric(table: LobeTable, index: int, side: Side) -> None:
    """Read smooth, thin or rough glass."""
    check_index(table.state.nodes[index].props, side.where)
    _specular(table, index, side, "specular_reflectance")
    _specular(table, index, side, "specular_transmittance")


def _specular(table: LobeTable, index: int, side: Side, name: str) -> None:
    table.give(index, name, replace(table.spectral(index, name, 1.0, side), gloss=True), side)
