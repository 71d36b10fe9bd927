"""The material that a BSDF of a scene is."""

from __future__ import annotations

import warnings
from typing import Any

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.errors import ApproximationWarning, FluorsparError, SceneError, message
from fluorspar.scene.plugin import COAT, FLUORESCENT, SPECTRA, STRINGS, check_properties, material_of_spectra
from fluorspar.scene.plugin_spectra import SpatialVariation, average_reflectance, plugin_spectrum
from fluorspar.scene.recipe import Recipe
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["DEFAULT_REFLECTANCE", "read_material"]

DEFAULT_REFLECTANCE = 0.5
"""Mitsuba's, of `diffuse` and of a shape without BSDF."""

_PROPERTIES = {"diffuse": ("reflectance",), FLUORESCENT: (*SPECTRA, *STRINGS, "concentration", *COAT)}


def read_material(state: Any, index: int, where: str, recipe: Recipe) -> Material:
    """Read the material of a `diffuse` or `fluorescent` node; average any other if `recipe.matte` says so.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    index : int
        The node.
    where : str
        The surface, for messages.
    recipe : Recipe
        Its folder, libraries and `matte`.

    Raises
    ------
    SceneError
        If it is no matte surface of one spectrum, or has a property that is not known.
    MaterialError, SpectrumError
        If its material is unknown or impossible.

    Warns
    -----
    ApproximationWarning
        If it is averaged.
    """
    props = state.nodes[index].props
    plugin = props.plugin_name()
    name = props.id() or where
    if plugin in _PROPERTIES and (unknown := sorted(set(props.keys()) - set(_PROPERTIES[plugin]))):
        # The BSDF is never built, so Mitsuba does not see it.
        raise SceneError(
            message(
                f"there is no property '{unknown[0]}'",
                where=where,
                expected=", ".join(_PROPERTIES[plugin]),
            )
        )
    try:
        if plugin == "diffuse":
            return Material(name, _spectrum(state, index, "reflectance", where))
        if plugin == FLUORESCENT:
            return _fluorescent(state, index, name, where, recipe)
    except SpatialVariation:
        if not recipe.matte:
            raise
    except FluorsparError as err:
        raise err if where in str(err) else type(err)(f"{err}\n  in:       {where}") from err
    if plugin == FLUORESCENT or not recipe.matte:
        raise SceneError(
            message(
                f"BSDF '{plugin}' is not a matte surface of one spectrum",
                where=where,
                expected=f"diffuse, twosided or {FLUORESCENT}, with spectra that are the same all over the surface",
                fix="replace it, or render it diffuse, of its average reflectance, with --matte (matte=True)",
            )
        )
    warnings.warn(
        f"{where} is rendered as a diffuse surface of its average reflectance",
        ApproximationWarning,
        stacklevel=2,
    )
    return Material(name, average_reflectance(state, index, name))


def _fluorescent(state: Any, index: int, name: str, where: str, recipe: Recipe) -> Material:
    props = state.nodes[index].props
    check_properties(set(props.keys()), where)
    if "material" in props:
        dyed = material(props["material"], recipe.library, base=recipe.base)
    elif "donaldson" in props:
        dyed = material(recipe.base / props["donaldson"])
    else:
        has_dye = "emission" in props
        reflectance, emission, excitation = (
            _spectrum(state, index, part, f"{part} of {where}") if has_dye or part == "reflectance" else None
            for part in SPECTRA
        )
        assert reflectance is not None
        dyed = material_of_spectra(name, reflectance, emission, excitation)
    return dyed.with_concentration(float(props["concentration"])) if "concentration" in props else dyed


def _spectrum(state: Any, index: int, name: str, where: str) -> Spectrum:
    return plugin_spectrum(state, index, name, default=DEFAULT_REFLECTANCE, label=where)
