"""Figures fit for a paper: spectra at points, pictures, and maps with colour bars."""

from __future__ import annotations

import io
import math
import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.atomic import replacing
from fluorspar.measure.comparison import Comparison, ImageComparison
from fluorspar.measure.point_spectra import PointSpectra

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

# Okabe and Ito's colours, which most colour-blind readers can tell apart
_A, _B = "#0072B2", "#D55E00"
_STYLE = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "figure.dpi": 100.0,
}
_COLUMNS = 5
_MAP_PIXELS = 1024
_TOP = 98  # percentile at which colour bars end: a lamp may well be one per cent of the pixels


def _figure(width: float, height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _styled(draw: Any, *args: Any) -> Figure:
    from matplotlib import rc_context

    with rc_context(_STYLE):
        figure: Figure = draw(*args)
    return figure


def encode(figure: Figure, dpi: int = 200) -> bytes:
    """Encode a figure as PNG.

    Examples
    --------
    >>> encode(_figure(1, 1))[1:4]
    b'PNG'
    """
    from matplotlib import rc_context

    stream = io.BytesIO()
    with rc_context(_STYLE):
        # without the version of matplotlib, so that equal figures are equal files
        figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()


def write_figure(figure: Figure, path: str | os.PathLike[str], dpi: int = 200) -> None:
    """Write a figure as PNG.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> write_figure(_figure(1, 1), os.path.join(tempfile.mkdtemp(), "empty.png"))
    """
    content = encode(figure, dpi)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def spectra_figure(spectra: PointSpectra) -> Figure:
    """Draw measured spectra, one panel for each point; the band is two standard errors wide on each side.

    Examples
    --------
    >>> from fluorspar.measure.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> figure = spectra_figure(PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31))))
    >>> len(figure.axes)
    2
    """
    return _styled(_spectra, spectra)


def _spectra(spectra: PointSpectra) -> Figure:
    figure, panels = _panels(len(spectra.names))
    luminances = spectra.luminance() if spectra.unit == PointSpectra.unit else None
    for p, panel in enumerate(panels):
        error = None if spectra.standard_error is None else spectra.standard_error[p]
        _line(panel, spectra.grid.values, spectra.radiance[p], error, _A, "")
        said = "" if luminances is None else f"   {luminances[p]:.4g} cd/m²"
        panel.set_title(f"{spectra.names[p]}{said}", loc="left", fontsize=7.0)
    _label(figure, panels, _unit_label(spectra.unit))
    return figure


def points_figure(comparison: Comparison) -> Figure:
    """Draw the spectra of both sides, one panel for each point, each divided as for RMSE.

    Examples
    --------
    >>> from fluorspar.measure.bands import Bands
    >>> from fluorspar.measure.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31)))
    >>> len(points_figure(compare(spectra, spectra)).axes)
    2
    """
    return _styled(_points, comparison)


def _points(comparison: Comparison) -> Figure:
    found = comparison.points
    assert found is not None
    figure, panels = _panels(len(found.names))
    at = comparison.grid.values
    for p, panel in enumerate(panels):
        for values, error, mean, colour, name in (
            (found.a, found.error_a, comparison.mean_a, _A, "A"),
            (found.b, found.error_b, comparison.mean_b, _B, "B"),
        ):
            _line(panel, at, values[p] / mean, None if error is None else error[p] / mean, colour, name)
        numbers = f"RMSE {found.rmse[p]:.3f}, ΔE$_{{00}}$ {found.de00[p]:.2f}"
        panel.set_title(f"{found.names[p]}\n{numbers}", loc="left", fontsize=7.0)
    _label(figure, panels, "radiance, normalised")
    handles, labels = panels[0].get_legend_handles_labels()
    names = {"A": f"A: {_short(comparison.title_a)}", "B": f"B: {_short(comparison.title_b)}"}
    figure.legend(
        handles, [names[label] for label in labels], loc="outside upper left", ncols=2, frameon=False
    )
    return figure


def signed_picture(found: ImageComparison) -> tuple[NDArray[np.uint8], float]:
    """Show the signed difference of displayed R, G, B around grey, as in the paper's Figure 29.

    Parameters
    ----------
    found : ImageComparison

    Returns
    -------
    picture : ndarray of shape (Y, X, 3)
        uint8: grey + factor (B - A).
    factor : float
        A power of two, such that all but the greatest differences fit.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.measure.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> picture, factor = signed_picture(compare(image, image).images)
    >>> picture[0, 0]
    array([128, 128, 128], dtype=uint8)
    """
    factor = _gain(found.rgb_difference) / 2
    signed = np.clip(0.5 + factor * found.rgb_difference, 0, 1)
    return np.asarray(255 * signed + 0.5, np.uint8), factor


def maps_figure(comparison: Comparison) -> Figure:
    """Draw maps with colour bars: CIEDE2000, RMSE, and the signed differences of displayed R, G and B.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.measure.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> len(maps_figure(compare(image, image)).axes)  # six panels and five colour bars
    11
    """
    return _styled(_maps, _images(comparison))


def _maps(found: ImageComparison) -> Figure:
    figure = _sized(found, 3, rows=2, bars=True)
    panels = figure.subplots(2, 3).ravel()
    limit = max(float(np.percentile(np.abs(found.rgb_difference), _TOP)), 1 / 255)
    _magnitude(figure, panels[0], found.de00, "CIEDE2000")
    _magnitude(figure, panels[1], found.rmse, "RMSE (Eq. 14)")
    for panel, index, name in zip(panels[3:], range(3), "RGB", strict=True):
        drawn = panel.imshow(
            _thin(found.rgb_difference[..., index]),
            cmap="RdBu_r",
            vmin=-limit,
            vmax=limit,
            interpolation="nearest",
        )
        figure.colorbar(drawn, ax=panel, shrink=0.9, pad=0.02, extend="both")
        panel.set_title(f"displayed {name}, B − A (0 to 1)", loc="left")
    for panel in panels:
        panel.set_axis_off()
    panels[2].set_axis_on()
    _histogram(panels[2], found)
    return figure


def _histogram(panel: Axes, found: ImageComparison) -> None:
    values = found.de00[np.isfinite(found.de00)]
    share = np.linspace(0, 100, min(len(values), 1000))
    panel.plot(np.percentile(values, share), share, color=_A)
    panel.set(xlabel="CIEDE2000", ylim=(0, 100))
    panel.set_xlim(0, max(float(np.percentile(values, _TOP)), 1e-6))
    panel.set_title("pixels below, %", loc="left")
    panel.set_box_aspect(found.rmse.shape[0] / found.rmse.shape[1])
    panel.grid(linewidth=0.3)


def bands_figure(comparison: Comparison) -> Figure:
    """Draw the relative error and the bias of each band.

    Examples
    --------
    >>> from fluorspar.measure.bands import Bands
    >>> from fluorspar.measure.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31)))
    >>> bands_figure(compare(spectra, spectra)).axes[0].get_xlabel()
    'wavelength, nm'
    """
    return _styled(_bands, comparison)


def _bands(comparison: Comparison) -> Figure:
    figure = _figure(7.2, 2.2)
    panel = figure.subplots()
    found, at = comparison.main, comparison.grid.values
    panel.axhline(0, color="0.6", linewidth=0.6)
    panel.plot(at, 100 * found.band_error, color=_A, label="relative error, mean of |B − A|")
    panel.plot(at, 100 * found.band_bias, color=_B, label="bias, mean of B − A")
    panel.set(xlabel="wavelength, nm", ylabel="% of the mean of A", xlim=(at[0], at[-1]))
    panel.legend(frameon=False)
    return figure


def comparison_figure(comparison: Comparison) -> Figure:
    """Draw the main figure of a comparison: spectra at the points if there are any, else pictures and maps.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.measure.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> len(comparison_figure(compare(image, image)).axes)  # six panels and two colour bars
    8
    """
    if comparison.points is not None:
        return points_figure(comparison)
    return _styled(_overview, _images(comparison), comparison)


def _overview(found: ImageComparison, comparison: Comparison) -> Figure:
    figure = _sized(found, 3, rows=2, bars=True)
    panels = figure.subplots(2, 3).ravel()
    signed, factor = signed_picture(found)
    shown = (
        (found.rgb_a, f"A: {_short(comparison.title_a)}"),
        (found.rgb_b, f"B: {_short(comparison.title_b)}"),
        (signed, f"grey + {factor:g} (B − A)"),
    )
    for panel, (picture, title) in zip(panels[:3], shown, strict=True):
        panel.imshow(_thin(picture), interpolation="nearest")
        panel.set_title(title, loc="left")
    _magnitude(figure, panels[3], found.de00, "CIEDE2000")
    _magnitude(figure, panels[4], found.rmse, "RMSE (Eq. 14)")
    for panel in panels[:5]:
        panel.set_axis_off()
    _histogram(panels[5], found)
    return figure


def _magnitude(figure: Figure, panel: Axes, values: NDArray[np.float32], title: str) -> None:
    """A map from 0 on; the most different pixels, such as those of a lamp, must not take all of its colours."""
    greatest = float(np.nanmax(values))
    high = float(np.nanpercentile(values, _TOP)) or greatest or 1e-6
    drawn = panel.imshow(_thin(values), cmap="magma", vmin=0, vmax=high, interpolation="nearest")
    figure.colorbar(drawn, ax=panel, shrink=0.9, pad=0.02, extend="max" if greatest > high else "neither")
    panel.set_title(title, loc="left")


def _images(comparison: Comparison) -> ImageComparison:
    assert comparison.images is not None
    return comparison.images


def _sized(found: ImageComparison, columns: int, rows: int = 1, bars: bool = False) -> Figure:
    height, width = found.rmse.shape
    panel = 7.2 / columns * (0.82 if bars and columns == 3 else 0.96)
    return _figure(7.2, rows * (panel * height / width + 0.32) + (0.35 if bars and rows == 1 else 0.0))


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    columns = min(_COLUMNS, max(count, 1))
    columns = min(columns, math.ceil(count / math.ceil(count / columns)))
    rows = -(-count // columns)
    figure = _figure(7.2 if columns > 2 else 3.6 * columns, 0.3 + 1.55 * rows)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True)
    panels: list[Axes] = list(axes.ravel())
    for unused in panels[count:]:
        unused.remove()
    for column in range(columns):  # shared axes hide their labels, also above a gap
        lowest = panels[max(p for p in range(count) if p % columns == column)]
        lowest.tick_params(labelbottom=True)
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
    figure.supylabel(what, fontsize=8.0)


def _unit_label(unit: str) -> str:
    if unit == "1":
        return "radiance, normalised"
    return "radiance, W m⁻² sr⁻¹ nm⁻¹" if unit == PointSpectra.unit else f"radiance, {unit}"


def _gain(difference: NDArray[np.float32]) -> float:
    """A power of two that makes all but the greatest differences visible."""
    high = float(np.percentile(np.abs(difference), 99.5))
    return float(2.0 ** np.clip(np.floor(np.log2(1 / high)), 0, 7)) if high > 0 else 1.0


def _thin(values: NDArray[Any]) -> NDArray[Any]:
    """Every n-th pixel of what is larger than a figure can show."""
    every = -(-max(values.shape[:2]) // _MAP_PIXELS)
    return values[::every, ::every]


def _short(title: str) -> str:
    name = os.path.basename(title) or title
    return name if len(name) <= 28 else f"…{name[-27:]}"
