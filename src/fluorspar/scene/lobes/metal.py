"""Conductors: rows for all angles of reflection."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from fluorspar.errors import ApproximationWarning
from fluorspar.scene.lobes.lobe import ANGLES, METAL
from fluorspar.scene.lobes.rows import Metal
from fluorspar.scene.lobes.side import Side, Spectral
from fluorspar.scene.lobes.table import LobeTable
from fluorspar.scene.nodes import build
from fluorspar.scene.plugin_spectra import LONGEST, plugin_spectrum
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["conductor"]

_PRIMARIES = np.array(
    [0.0, 450.0, 545.0, 610.0, LONGEST]
)  # nm; the three of an rgb index of refraction, held outside


def conductor(table: LobeTable, index: int, side: Side) -> None:
    name = "specular_reflectance"
    key = table.key(index, f"{name}, metal", side.shape)
    if key not in table.read:
        table.read[key] = _metal(table, index, side)
    table.edit(index, {"material": "none", "eta": None, "k": None})
    table.give(index, name, table.read[key], side)


def _metal(table: LobeTable, index: int, side: Side) -> Spectral:
    """Rows for all angles of a conductor, and for all texels of its specular reflectance."""
    import mitsuba as mi

    where, specular = side.where, table.spectral(index, "specular_reflectance", 1.0, side)
    props = table.state.nodes[index].props
    built = build(table.state, index)  # or Mitsuba says what is wrong
    eta, k = (
        (_index(table.state, index, part, default, where) for part, default in (("eta", 0.0), ("k", 1.0)))
        if "eta" in props or "k" in props
        else _preset(mi.traverse(built), props)
    )
    row = len(table.rows)
    cosines = [float(cosine) for cosine in np.linspace(0, 1, ANGLES) ** 2]
    if specular.in_colours:
        table.rows += [Metal(eta, k, Spectrum.constant(1.0, "white"), cosine) for cosine in cosines]
        return replace(table.operated(specular, METAL - row, 1.0, 1.0), angles=ANGLES)
    for factor in table.rows_of(specular):
        table.rows += [Metal(eta, k, factor.reflectance, cosine) for cosine in cosines]
    return Spectral(row, False, 1.0, 1.0, specular.texture, ANGLES)


def _preset(values: Any, props: Any) -> tuple[Spectrum, Spectrum]:
    """Index and extinction of a material that Mitsuba knows by name."""
    if "eta.wavelengths" not in values:  # "none": a perfect mirror
        return Spectrum.constant(0.0, "eta"), Spectrum.constant(1.0, "k")
    eta, k = (
        Spectrum(
            np.array(values[f"{part}.wavelengths"]),
            np.array(values[f"{part}.values"]),
            f"{part} of {props.get('material', 'Cu')}",
        )
        for part in ("eta", "k")
    )
    return eta, k


def _index(state: Any, index: int, name: str, default: float, where: str) -> Spectrum:
    """An index of refraction of a scene, numbers for red, green and blue included."""
    import mitsuba as mi

    props = state.nodes[index].props
    if name in props and props.type(name) == mi.Properties.Type.Color:
        rgb = [float(c) for c in props[name]]
        warnings.warn(
            f"{name} of {where} is given as rgb: taken at 610, 545 and 450 nm, linear in between",
            ApproximationWarning,
            stacklevel=2,
        )
        r, g, b = rgb
        return Spectrum(_PRIMARIES, np.array([b, b, g, r, r]), f"{name} of {where}")
    return plugin_spectrum(state, index, name, default=default, label=f"{name} of {where}")
