"""The Donaldson matrix of a surface, as numbers and as a picture."""

from __future__ import annotations

from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.image.display.picture import png_bytes
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.view.false_colour import coloured
from fluorspar.view.pictures import EFFORT, data_url

__all__ = ["matrix_of"]


def matrix_of(material: Material, grid: Wavelengths) -> dict[str, Any]:
    """The matrix on a grid of N wavelengths.

    Returns
    -------
    dict
        `excitation` and `emission`, the N wavelengths; `matrix`, D_L in 1/nm, a row for each emission wavelength;
        `reflectance`, S; `png`, D_L as a data URL, a pixel for each cell, the longest emission at the top, and its
        `range`.

    Examples
    --------
    >>> from fluorspar.bispectral.library import material
    >>> matrix_of(material("poster-red"), Wavelengths(400, 700, 100))["matrix"].shape
    (4, 4)
    """
    D = material.on(grid)
    density = D.density()
    rgb, limits = coloured(
        density[::-1], "matrix", (min(0.0, float(density.min())), float(density.max()) or 1.0)
    )
    return {
        "name": material.name,
        "excitation": grid.values,
        "emission": grid.values,
        "matrix": density,
        "reflectance": D.reflectance,
        "png": data_url(png_bytes(rgb, EFFORT)),
        "range": limits,
    }
