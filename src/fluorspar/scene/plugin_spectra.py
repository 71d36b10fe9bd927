"""The spectra that Mitsuba plugins hold, read out as tables.

Inline and `.spd` spectra are taken as they stand. Whatever Mitsuba computes (`rgb`, `blackbody`, `d65`,
bitmaps) is evaluated in a spectral variant, over the range for which the plugin is meant.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, SpectrumError, message
from fluorspar.scene.nodes import build, copy_nodes
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["SpatialVariation", "average_light", "average_reflectance", "plugin_spectrum"]

# The range over which Mitsuba's spectral upsampling of `rgb` values and its own tables are defined.
_MITSUBA_RANGE = (360.0, 830.0)
_AVERAGE_SAMPLES = 512


class SpatialVariation(SceneError):
    """A spectrum is not the same all over a surface."""


def plugin_spectrum(
    state: Any, index: int, name: str, *, default: float, label: str, emissive: bool = False
) -> Spectrum:
    """Read the spectrum-valued property `name` of node `index`.

    Parameters
    ----------
    state
        Parsed scene; the variant set is `scalar_spectral`.
    default
        The value where the scene gives none, as in Mitsuba.
    label
        How the spectrum is called in messages.
    emissive
        Whether `rgb` values mean the colour of a light (multiplied by D65) or of a surface.

    Raises
    ------
    SpatialVariation
        If the value is a texture that varies over the surface.
    """
    import mitsuba as mi

    props = state.nodes[index].props
    if name not in props:
        return Spectrum.constant(default, name=label)
    types = mi.Properties.Type
    found = props.type(name)
    if found in (types.Float, types.Integer):
        return Spectrum.constant(float(props[name]), name=label)
    if found == types.Spectrum:
        table = props[name]
        if table.is_uniform():
            return Spectrum.constant(float(table.values[0]), name=label)
        return Spectrum(np.array(table.wavelengths), np.array(table.values), name=label)
    if found == types.Color:
        rgb = [float(c) for c in props[name]]
        colour = {"type": "rgb", "value": rgb}
        if emissive:
            return _tabulate(mi.load_dict({"type": "constant", "radiance": colour}), _MITSUBA_RANGE, label)
        if not 0 <= min(rgb) <= max(rgb) <= 1:
            what = "an rgb reflectance is outside 0 to 1"
            raise SpectrumError(message(what, where=label, got=rgb, expected="0 to 1"))
        return _tabulate(mi.load_dict(colour), _MITSUBA_RANGE, label)
    if found != types.ResolvedReference:
        raise SceneError(
            message(
                f"property '{name}' is not a spectrum",
                where=label,
                got=str(found),
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
    if texture.is_spatially_varying():
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
    return _tabulate(texture, (low, high) if np.isfinite([low, high]).all() else _MITSUBA_RANGE, label)


def average_reflectance(state: Any, index: int, label: str) -> Spectrum:
    """Estimate the bihemispherical reflectance of a BSDF node, averaged over its texture (for `--matte`).

    Light arrives evenly from the hemisphere; what is transmitted counts as lost. 512 random
    directions and texture positions, the same at every wavelength.
    """
    import mitsuba as mi

    bsdf = build(state, index)
    random = np.random.default_rng(0).random((_AVERAGE_SAMPLES, 7))
    wavelengths = np.arange(360.0, 831.0, 10.0)
    total = np.zeros(len(wavelengths))
    si = mi.SurfaceInteraction3f()
    si.t = 1.0
    si.sh_frame = mi.Frame3f([0, 0, 1])
    si.n = [0, 0, 1]
    context = mi.BSDFContext()
    for u in random:
        si.uv = u[:2]
        si.wi = mi.warp.square_to_cosine_hemisphere(u[2:4])
        for first in range(0, len(wavelengths), 4):
            si.wavelengths = wavelengths[first : first + 4]
            sample, weight = bsdf.sample(context, si, u[4], u[5:7])
            if sample.pdf > 0 and sample.wo.z > 0:
                total[first : first + 4] += np.array(weight)
    return Spectrum(wavelengths, np.clip(total / _AVERAGE_SAMPLES, 0, 1), name=label)


def average_light(state: Any, index: int, label: str) -> Spectrum:
    """Average the radiance of a light node over its directions and its texture (for `--matte`)."""
    import mitsuba as mi

    light = build(state, index)
    random = np.random.default_rng(0).random((_AVERAGE_SAMPLES, 4))
    wavelengths = np.arange(360.0, 831.0, 10.0)
    total = np.zeros(len(wavelengths))
    si = mi.SurfaceInteraction3f()
    for u in random:
        si.uv = u[:2]
        si.wi = mi.warp.square_to_uniform_sphere(u[2:4])
        if state.nodes[index].props.plugin_name() == "area":
            si.wi = [0, 0, 1]
        for first in range(0, len(wavelengths), 4):
            si.wavelengths = wavelengths[first : first + 4]
            total[first : first + 4] += np.array(light.eval(si))
    return Spectrum(wavelengths, total / _AVERAGE_SAMPLES, name=label)


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
    wavelengths = np.linspace(*support, round(support[1] - support[0]) + 1)
    # The ends are taken a hair inside: at the limit itself single precision may fall outside.
    inside = np.clip(wavelengths, support[0] + 1e-3, support[1] - 1e-3)
    return Spectrum(wavelengths, _evaluate(plugin, inside), name=label)
