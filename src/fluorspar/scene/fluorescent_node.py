"""The material of a `fluorescent` BSDF of a scene."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from fluorspar.bispectral.dye import check_order
from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.errors import SceneError, message
from fluorspar.scene.nodes import resolved
from fluorspar.scene.plugin import SPECTRA, STRINGS, check_properties, material_of_spectra
from fluorspar.scene.plugin_spectra import LONGEST, plugin_spectrum
from fluorspar.scene.recipe import Recipe
from fluorspar.spectral.spectrum import Spectrum, trapezoid

__all__ = ["DEFAULT_REFLECTANCE", "fluorescent_material"]

DEFAULT_REFLECTANCE = 0.5
"""Mitsuba's, of `diffuse` and of a shape without BSDF."""

# Share of emission at longer wavelengths than excitation; it is half where both spectra are the same.
_LEAST_STOKES = 0.4


def fluorescent_material(state: Any, index: int, name: str, where: str, recipe: Recipe) -> Material:
    """Read the material of a `fluorescent` node; see `read_material` for the parameters.

    Raises
    ------
    SceneError
        If a property is of the wrong type.
    SpatialVariation
        If a spectrum varies over the surface.
    MaterialError, SpectrumError
        If the material is unknown or impossible, or its spectra are swapped.
    """
    props = state.nodes[index].props
    check_properties(set(props.keys()), where)
    _check_types(props, where)
    if "material" in props:
        file = resolved(props["material"])
        named = file if file.suffix and os.path.isfile(file) else props["material"]
        dyed = material(named, recipe.library, base=recipe.base)
    elif "donaldson" in props:
        dyed = material(recipe.base / resolved(props["donaldson"]))
    else:
        has_dye = "emission" in props
        reflectance, emission, excitation = (
            plugin_spectrum(state, index, part, default=DEFAULT_REFLECTANCE, label=f"{part} of {where}")
            if has_dye or part == "reflectance"
            else None
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
