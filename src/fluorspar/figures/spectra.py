"""Figures fit for a paper: spectra at points, errors of bands, and what a comparison is about."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.comparing.comparison import Comparison
from fluorspar.figures.maps import images_figure, maps_figure, signed_picture
from fluorspar.figures.style import (
    COLOUR_A,
    COLOUR_B,
    blank,
    encode,
    put_title,
    short,
    styled,
    write_figure,
)
from fluorspar.image.units import is_unit_of_radiance
from fluorspar.measuring.point_spectra import PointSpectra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "bands_figure",
    "comparison_figure",
    "encode",
    "maps_figure",
    "points_figure",
    "signed_picture",
    "spectra_figure",
    "write_figure",
]

_COLUMNS = 5


def spectra_figure(spectra: PointSpectra) -> Figure:
    """Draw measured spectra, one panel for each point; the band is two standard errors wide on each side.

    Examples
    --------
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> figure = spectra_figure(PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31))))
    >>> len(figure.axes)
    2
    """
    return styled(_spectra, spectra)


def _spectra(spectra: PointSpectra) -> Figure:
    figure, panels = _panels(len(spectra.names))
    luminances = spectra.luminance() if is_unit_of_radiance(spectra.unit) else None
    for p, panel in enumerate(panels):
        error = None if spectra.standard_error is None else spectra.standard_error[p]
        _line(panel, spectra.grid.values, spectra.radiance[p], error, COLOUR_A, "")
        level = "" if luminances is None else f"   {luminances[p]:.4g} cd/m²"
        put_title(panel, f"{spectra.names[p]}{level}", fontsize=7.0)
    _label(figure, panels, _unit_label(spectra.unit))
    return figure


def points_figure(comparison: Comparison) -> Figure:
    """Draw the spectra of both sides, one panel for each point, each divided as for RMSE.

    Examples
    --------
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31)))
    >>> len(points_figure(compare(spectra, spectra)).axes)
    2
    """
    return styled(_points, comparison)


def _points(comparison: Comparison) -> Figure:
    points = comparison.points
    assert points is not None
    figure, panels = _panels(len(points.names))
    at = comparison.grid.values
    for p, panel in enumerate(panels):
        for values, error, mean, colour, name in (
            (points.a, points.error_a, comparison.mean_a, COLOUR_A, "A"),
            (points.b, points.error_b, comparison.mean_b, COLOUR_B, "B"),
        ):
            _line(panel, at, values[p] / mean, None if error is None else error[p] / mean, colour, name)
        numbers = f"RMSE {points.rmse[p]:.3f}\nΔE₀₀ {points.de00[p]:.2f}"
        put_title(panel, f"{points.names[p]}\n{numbers}", fontsize=7.0)
    _label(figure, panels, "radiance, normalised")
    handles, labels = panels[0].get_legend_handles_labels()
    names = {"A": f"A: {short(comparison.title_a)}", "B": f"B: {short(comparison.title_b)}"}
    legend = figure.legend(
        handles, [names[label] for label in labels], loc="outside upper left", ncols=2, frameon=False
    )
    for text in legend.get_texts():
        text.set_parse_math(False)
    return figure


def bands_figure(comparison: Comparison) -> Figure:
    """Draw the relative error and the bias of each band.

    Examples
    --------
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31)))
    >>> bands_figure(compare(spectra, spectra)).axes[0].get_xlabel()
    'wavelength, nm'
    """
    return styled(_bands, comparison)


def _bands(comparison: Comparison) -> Figure:
    figure = blank(7.2, 2.2)
    panel = figure.subplots()
    part, at = comparison.main, comparison.grid.values
    panel.axhline(0, color="0.6", linewidth=0.6)
    panel.plot(at, 100 * part.band_error, color=COLOUR_A, label="relative error, mean of |B − A|")
    panel.plot(at, 100 * part.band_bias, color=COLOUR_B, label="bias, mean of B − A")
    panel.set(xlabel="wavelength, nm", ylabel="% of the mean of A", xlim=(at[0], at[-1]))
    panel.legend(frameon=False)
    return figure


def comparison_figure(comparison: Comparison) -> Figure:
    """Draw the main figure of a comparison: spectra at the points if there are any, else pictures and maps.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> len(comparison_figure(compare(image, image)).axes)  # six panels; colour bars are parts of them
    6
    """
    if comparison.points is not None:
        return points_figure(comparison)
    return images_figure(comparison)


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    columns = min(_COLUMNS, max(count, 1))
    columns = min(columns, math.ceil(count / math.ceil(count / columns)))
    rows = -(-count // columns)
    figure = blank(7.2 if columns > 2 else 3.6 * columns, 0.3 + 1.65 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)  # shared axes would take three times as long
    panels: list[Axes] = list(axes.ravel())
    for unused in panels[count:]:
        unused.remove()
    for p, panel in enumerate(panels[:count]):
        panel.tick_params(labelbottom=p + columns >= count)  # also above a gap
    return figure, panels[:count]


def _line(
    panel: Axes,
    at: NDArray[np.float64],
    values: NDArray[np.float64],
    error: NDArray[np.float64] | None,
    colour: str,
    label: str,
) -> None:
    panel.plot(at, values, color=colour, label=label, linestyle="-" if label != "B" else (0, (4, 1.5)))
    if error is not None:
        panel.fill_between(at, values - 2 * error, values + 2 * error, color=colour, alpha=0.25, linewidth=0)


def _label(figure: Figure, panels: list[Axes], what: str) -> None:
    for panel in panels:
        panel.set_ylim(bottom=min(0.0, panel.get_ylim()[0]) if panel.get_ylim()[0] < 0 else 0)
        panel.margins(x=0)
        panel.grid(linewidth=0.3)
    figure.supxlabel("wavelength, nm", fontsize=8.0)
    figure.supylabel(what, fontsize=8.0, parse_math=False)


def _unit_label(unit: str) -> str:
    if unit == "1":
        return "radiance, normalised"
    return "radiance, W m⁻² sr⁻¹ nm⁻¹" if unit == PointSpectra.unit else f"radiance, {unit}"
