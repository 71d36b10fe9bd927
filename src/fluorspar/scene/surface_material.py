"""The material that a BSDF of a scene is: here it is decided what a BSDF may be."""

from __future__ import annotations

import warnings
from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.errors import ApproximationWarning, FluorsparError, SceneError, message
from fluorspar.scene.averages import average_reflectance
from fluorspar.scene.fluorescent_node import DEFAULT_REFLECTANCE, fluorescent_material
from fluorspar.scene.nodes import below, build, label
from fluorspar.scene.plugin import COAT, FLUORESCENT, SPECTRA, STRINGS
from fluorspar.scene.plugin_spectra import SpatialVariation, plugin_spectrum
from fluorspar.scene.recipe import Recipe
from fluorspar.scene.suggestion import did_you_mean

__all__ = ["DEFAULT_REFLECTANCE", "read_material"]

_MATTE = f"diffuse, twosided or {FLUORESCENT}, with spectra that are the same all over the surface"
_PROPERTIES = {"diffuse": ("reflectance",), FLUORESCENT: (*SPECTRA, *STRINGS, "concentration", *COAT)}


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
        If it is averaged, or loses its coat.
    """
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
            spectrum = plugin_spectrum(state, index, "reflectance", default=DEFAULT_REFLECTANCE, label=where)
            return Material(name, spectrum)
        if plugin == FLUORESCENT:
            if set(COAT) & set(props.keys()):
                text = f"the coat of {where} is left out: it is rendered as a matte surface"
                warnings.warn(text, ApproximationWarning, stacklevel=2)
            return fluorescent_material(state, index, name, where, recipe)
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
    return _averaged(state, index, shape, name, where, matte=recipe.matte)


def _averaged(state: Any, index: int, shape: int, name: str, where: str, *, matte: bool) -> Material:
    """The diffuse material of the average of a BSDF that is not matte, if it is asked for and exists."""
    import mitsuba as mi

    plugin = state.nodes[index].props.plugin_name()
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
    if not matte:
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
