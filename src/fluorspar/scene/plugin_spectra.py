"""The spectra that Mitsuba plugins hold, read out as tables.

Inline and `.spd` spectra are taken as they stand. Whatever Mitsuba computes (`rgb`, `blackbody`, `d65`,
bitmaps) is evaluated in a spectral variant, over the range for which the plugin is meant.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, SpectrumError, message
from fluorspar.scene.averages import MESH_ATTRIBUTE, uses_mesh
from fluorspar.scene.nodes import build, copy_nodes
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["LONGEST", "SpatialVariation", "plugin_spectrum", "white_light"]

# The range over which Mitsuba's spectral upsampling of `rgb` values and its own tables are defined.
_MITSUBA_RANGE = (360.0, 830.0)


LONGEST = 1e5
"""Wavelengths in nm are shorter."""


class SpatialVariation(SceneError):
    """A spectrum is not the same all over a surface."""


def plugin_spectrum(
    state: Any, index: int, name: str, *, default: float, label: str, emissive: bool = False
) -> Spectrum:
    """Read the spectrum-valued property `name` of node `index`.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    default : float
        The value where the scene gives none, as in Mitsuba.
    label : str
        How the spectrum is called in messages.
    emissive : bool
        Whether plain numbers and `rgb` values mean a light, which Mitsuba multiplies by D65, or a surface.

    Raises
    ------
    SpatialVariation
        If the value is a texture that varies over the surface.
    """
    import mitsuba as mi

    props = state.nodes[index].props
    types = mi.Properties.Type
    value_type = props.type(name) if name in props else types.Float
    if value_type in (types.Float, types.Integer):
        number = float(props[name]) if name in props else default
        if emissive:  # Mitsuba's lights of a plain number are white, which means D65
            return white_light(number, label)
        return Spectrum.constant(number, name=label)
    if value_type == types.Spectrum:
        table = props[name]
        if table.is_uniform():
            return Spectrum.constant(float(table.values[0]), name=label)
        return Spectrum(np.array(table.wavelengths), np.array(table.values), name=label)
    if value_type == types.Color:
        rgb = [float(c) for c in props[name]]
        colour = {"type": "rgb", "value": rgb}
        if emissive:
            coloured = mi.load_dict({"type": "constant", "radiance": colour})
            return _with_ultraviolet(_tabulate(coloured, _MITSUBA_RANGE, label))
        if not 0 <= min(rgb) <= max(rgb) <= 1:
            what = "an rgb reflectance is outside 0 to 1"
            raise SpectrumError(message(what, where=label, got=rgb, expected="0 to 1"))
        return _tabulate(mi.load_dict(colour), _MITSUBA_RANGE, label)
    if value_type != types.ResolvedReference:
        raise SceneError(
            message(
                f"property '{name}' is not a spectrum",
                where=label,
                got=str(value_type),
                expected="a number, spectrum or texture",
            )
        )
    child = props[name].index()
    plugin = state.nodes[child].props.plugin_name()
    if plugin == "blackbody":
        state = copy_nodes(state)
        state.nodes[child].props["wavelength_min"] = 250.0
        state.nodes[child].props["wavelength_max"] = 1000.0
    texture = build(state, child)
    if plugin == MESH_ATTRIBUTE or uses_mesh(state, child) or texture.is_spatially_varying():
        raise SpatialVariation(
            message(
                f"'{plugin}' varies over the surface",
                where=label,
                expected="a spectrum that is the same all over the surface",
                fix="give one spectrum, or render it as its average with --matte (matte=True)",
            )
        )
    if plugin == "uniform":
        return Spectrum.constant(float(_evaluate(texture, np.array([550.0]))[0]), name=label)
    values = mi.traverse(texture)
    if plugin == "irregular":
        return Spectrum(np.array(values["wavelengths"]), np.array(values["values"]), name=label)
    low, high = (float(end) for end in texture.wavelength_range())
    table = _tabulate(texture, (low, high) if np.isfinite([low, high]).all() else _MITSUBA_RANGE, label)
    return _with_ultraviolet(table) if plugin == "d65" else table


def white_light(number: float, label: str) -> Spectrum:
    """The spectrum of Mitsuba's lights of a plain number, which is that of D65."""
    import mitsuba as mi

    white = mi.load_dict({"type": "constant", "radiance": 1.0})  # which takes no number of 0 or below
    return _with_ultraviolet(_tabulate(white, _MITSUBA_RANGE, label)).scaled(number)


def _with_ultraviolet(light: Spectrum) -> Spectrum:
    """Continue a light that Mitsuba makes of D65, whose table begins at 360 nm, by that of the CIE from 300 nm on."""
    d65, first = illuminant("D65"), light.support[0]
    below = d65.wavelengths < first
    scaled = d65.values[below] * (light.values[0] / d65.at(first))
    wavelengths = np.concatenate([d65.wavelengths[below], light.wavelengths])
    return replace(light, wavelengths=wavelengths, values=np.concatenate([scaled, light.values]))


def _evaluate(plugin: Any, wavelengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Evaluate a texture or an environment light at `wavelengths` (n,), four at a time."""
    import mitsuba as mi

    si = mi.SurfaceInteraction3f()
    si.uv = [0.5, 0.5]
    padded = np.concatenate([wavelengths, np.repeat(wavelengths[-1:], -len(wavelengths) % 4)])
    values = []
    for four in padded.reshape(-1, 4):
        si.wavelengths = four
        values.append(np.array(plugin.eval(si)))
    return np.concatenate(values)[: len(wavelengths)].astype(np.float64)


def _tabulate(plugin: Any, support: tuple[float, float], label: str) -> Spectrum:
    """Tabulate a plugin every nanometre over `support`."""
    if support[1] > LONGEST:
        raise SpectrumError(message("a wavelength is impossible", where=label, got=f"{support[1]:g} nm"))
    wavelengths = np.linspace(*support, round(support[1] - support[0]) + 1)
    # The ends are taken a hair inside: at the limit itself single precision may fall outside.
    inside = np.clip(wavelengths, support[0] + 1e-3, support[1] - 1e-3)
    return Spectrum(wavelengths, _evaluate(plugin, inside), name=label)
