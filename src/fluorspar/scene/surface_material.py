"""The material that a BSDF of a scene is: here it is decided what a BSDF may be."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from fluorspar.bispectral.dye import check_order
from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.errors import ApproximationWarning, FluorsparError, SceneError, message
from fluorspar.scene.averages import average_reflectance
from fluorspar.scene.nodes import below, build, label, resolved
from fluorspar.scene.plugin import FLUORESCENT, SPECTRA, STRINGS, check_properties, material_of_spectra
from fluorspar.scene.plugin_spectra import LONGEST, SpatialVariation, plugin_spectrum
from fluorspar.scene.recipe import Recipe
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.spectral.spectrum import Spectrum, trapezoid

__all__ = ["DEFAULT_REFLECTANCE", "read_material"]

DEFAULT_REFLECTANCE = 0.5
"""Mitsuba's, of `diffuse` and of a shape without BSDF."""

_MATTE = f"diffuse, twosided or {FLUORESCENT}, with spectra that are the same all over the surface"
_PROPERTIES = {"diffuse": ("reflectance",), FLUORESCENT: (*SPECTRA, *STRINGS, "concentration")}
_LEAST_STOKES = (
    0.4  # share of emission at longer wavelengths than excitation; 0.5 where both spectra are the same
)


def read_material(state: Any, index: int, shape: int, recipe: Recipe) -> Material:
    """Read the material of a `diffuse` or `fluorescent` node; average any other if `recipe.matte` says so.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    index : int
        The node.
    shape : int
        The node of a shape that it is on.
    recipe : Recipe
        Its folder, libraries and `matte`.

    Raises
    ------
    SceneError
        If it is no matte surface of one spectrum, or has a property that is not known or of the wrong type; if it
        transmits light, or holds a fluorescent BSDF.
    MaterialError, SpectrumError
        If its material is unknown or impossible.

    Warns
    -----
    ApproximationWarning
        If it is averaged.
    """
    import mitsuba as mi

    props = state.nodes[index].props
    plugin = props.plugin_name()
    where = f"BSDF {label(state.nodes[index], index)} of shape {label(state.nodes[shape], shape)}"
    name = props.id() or where
    if plugin in _PROPERTIES and (unknown := sorted(set(props.keys()) - set(_PROPERTIES[plugin]))):
        # The BSDF is never built, so Mitsuba does not see it.
        raise SceneError(
            message(
                f"there is no property '{unknown[0]}'",
                where=where,
                expected=", ".join(_PROPERTIES[plugin]),
                fix=did_you_mean(unknown[0], _PROPERTIES[plugin]),
            )
        )
    try:
        if plugin == "diffuse":
            return Material(name, _spectrum(state, index, "reflectance", where))
        if plugin == FLUORESCENT:
            return _fluorescent(state, index, name, where, recipe)
    except SpatialVariation as err:
        if plugin == FLUORESCENT and recipe.matte:
            raise SceneError(
                message("a fluorescent BSDF with a texture is not supported", where=where, expected=_MATTE)
            ) from err
        if not recipe.matte:
            raise
    except OSError as err:  # a name that is too long for a file, one that may not be read, ...
        raise SceneError(message("a file of a material cannot be read", where=where, got=err)) from err
    except FluorsparError as err:
        raise err if where in str(err) else type(err)(f"{err}\n  in:       {where}") from err
    if any(state.nodes[node].props.plugin_name() == FLUORESCENT for node in below(state, index)):
        raise SceneError(
            message(
                f"a fluorescent BSDF inside '{plugin}' would lose its luminescence",
                where=where,
                expected=f"'{FLUORESCENT}' by itself or inside 'twosided'",
                fix=f"take it out of '{plugin}'; <string name='material' value='A:0.3,B:0.7'/> mixes materials",
            )
        )
    bsdf = build(state, index)
    if mi.has_flag(bsdf.flags(), mi.BSDFFlags.Transmission) or mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null):
        raise SceneError(
            message(
                f"BSDF '{plugin}' lets light through, which is not supported",
                where=where,
                expected="a BSDF that only reflects",
                fix="replace it, give the shape a material from outside (--material ID=NAME), or remove it",
            )
        )
    if not recipe.matte:
        raise SceneError(
            message(
                f"BSDF '{plugin}' is not a matte surface of one spectrum",
                where=where,
                expected=_MATTE,
                fix="replace it, or render it diffuse, of its average reflectance, with --matte (matte=True)",
            )
        )
    warnings.warn(
        f"{where} is rendered as a diffuse surface of its average reflectance",
        ApproximationWarning,
        stacklevel=2,
    )
    return Material(name, average_reflectance(state, index, bsdf, shape, where))


def _fluorescent(state: Any, index: int, name: str, where: str, recipe: Recipe) -> Material:
    props = state.nodes[index].props
    check_properties(set(props.keys()), where)
    _check_types(props, where)
    if "material" in props:
        dyed = material(props["material"], recipe.library, base=recipe.base)
    elif "donaldson" in props:
        dyed = material(recipe.base / resolved(props["donaldson"]))
    else:
        has_dye = "emission" in props
        reflectance, emission, excitation = (
            _spectrum(state, index, part, f"{part} of {where}") if has_dye or part == "reflectance" else None
            for part in SPECTRA
        )
        assert reflectance is not None
        dyed = material_of_spectra(name, reflectance, emission, excitation)
        if emission is not None and excitation is not None:
            _check_order(where, emission, excitation)
    return dyed.with_concentration(float(props["concentration"])) if "concentration" in props else dyed


def _check_types(props: Any, where: str) -> None:
    """Refuse a spectrum in place of a name or number, and the like."""
    import mitsuba as mi

    types = mi.Properties.Type
    numbers = (types.Float, types.Integer)
    for name, known in (*((name, (types.String,)) for name in STRINGS), ("concentration", numbers)):
        if name in props and props.type(name) not in known:
            got = str(props.type(name)).rpartition(".")[2].lower()
            expected = "a number" if known is numbers else "text"
            raise SceneError(
                message(f"property '{name}' is of the wrong type", where=where, got=got, expected=expected)
            )


def _check_order(where: str, emission: Spectrum, excitation: Spectrum) -> None:
    """Refuse spectra that are swapped; their tables may be coarse, so every nanometre is looked at."""
    spectra = (emission, excitation)
    if any(s.is_constant or not s.values.any() or s.support[1] > LONGEST for s in spectra):
        return
    low, high = min(s.support[0] for s in spectra), max(s.support[1] for s in spectra)
    w = np.unique(np.concatenate([np.arange(low, high), emission.wavelengths, excitation.wavelengths]))
    alpha, beta = (np.interp(w, s.wavelengths, s.values, left=0, right=0) for s in spectra)
    photons = alpha * w
    check_order(where, w, beta, w, photons / trapezoid(photons, w), least=_LEAST_STOKES)


def _spectrum(state: Any, index: int, name: str, where: str) -> Spectrum:
    return plugin_spectrum(state, index, name, default=DEFAULT_REFLECTANCE, label=where)
