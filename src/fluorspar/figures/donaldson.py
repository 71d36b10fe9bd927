"""A whole Donaldson matrix with its diagonal: as a surface in space, and as a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.figures.style import blank, put_title, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["donaldson_figure"]

_DECADES = 1e-4  # of the largest cell: what is smaller is shown as this
_ELEVATION, _AZIMUTH = 32, -125  # degrees; from here the diagonal stands behind the luminescence


def donaldson_figure(matrix: DonaldsonMatrix, name: str) -> Figure:
    """Draw the cells of `matrix.band()`, reflectance on the diagonal: as a surface, and as a map of their logarithm.

    Parameters
    ----------
    matrix : DonaldsonMatrix
    name : str
        Of the material.

    Examples
    --------
    >>> from fluorspar.bispectral.library import material
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> figure = donaldson_figure(material("poster-red").on(Wavelengths(400, 700, 10)), "poster-red")
    >>> [axes.get_xlabel() for axes in figure.axes[:2]]
    ['excitation, nm', 'excitation, nm']
    """
    return styled(_donaldson, matrix, name)


def _donaldson(matrix: DonaldsonMatrix, name: str) -> Figure:
    from matplotlib.colors import LogNorm

    grid, cells = matrix.wavelengths, matrix.band()
    figure = blank(7.2, 3.2)
    space: Any = figure.add_subplot(1, 2, 1, projection="3d")
    x, y = np.meshgrid(grid.values, grid.values)
    space.plot_surface(x, y, cells, cmap="BuPu", rcount=len(grid), ccount=len(grid), linewidth=0)
    space.view_init(_ELEVATION, _AZIMUTH)
    space.set(xlabel="excitation, nm", ylabel="emission, nm")
    space.set_zlabel(f"band of {grid.step:g} nm")
    put_title(space, f"{name}, Donaldson matrix")
    panel = figure.add_subplot(1, 2, 2)
    high, half = float(cells.max()) or 1.0, grid.step / 2
    ends = (grid.start - half, grid.stop + half)
    drawn = panel.imshow(
        np.clip(cells, _DECADES * high, None),
        origin="lower",
        interpolation="nearest",
        cmap="BuPu",
        norm=LogNorm(_DECADES * high, high),
        extent=(*ends, *ends),
    )
    panel.set(xlabel="excitation, nm", ylabel="emission, nm")
    label = f"radiance out per radiance in, bands of {grid.step:g} nm"
    figure.colorbar(drawn, ax=panel, label=label, extend="min", format="{x:g}", shrink=0.8)
    return figure
