"""Figures of materials, fit for a paper: spectra, Donaldson matrices, a fit beside its measurement."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.fit.fit import MaterialFit
from fluorspar.bispectral.lamp_colour import LampColour, colour_under_lamp
from fluorspar.bispectral.material import Material
from fluorspar.errors import ExtrapolationWarning
from fluorspar.figures.style import COLOUR_A, COLOUR_B, blank, put_title, styled
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["fit_figure", "lamp_figure", "material_figure"]

Array = NDArray[np.float64]

_BLUE, _RED, _INK = COLOUR_A, COLOUR_B, "0.15"
_DOTS: dict[str, Any] = {"color": "0.55", "marker": ".", "linestyle": "", "markersize": 3}
_SAME = 1e-6  # nm
_DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (5, 1, 1, 1)))  # of the first, second, ... fluorophore
_WIDE = Wavelengths(300, 780, 5)


def material_figure(material: Material) -> Figure:
    """Draw S and what the material shows in daylight, alpha and beta, and the luminescent matrix.

    What does not fluoresce has the first panel only. Spectra reach from 300 to 780 nm; a measured matrix is
    drawn as it is, without factors.

    Examples
    --------
    >>> from fluorspar.bispectral.library import material
    >>> [len(material_figure(material(name)).axes) for name in ("gray-18", "poster-red")]
    [1, 5]
    """
    return styled(_material, material)


def fit_figure(fit: MaterialFit) -> Figure:
    """Draw a measured matrix, its fit, what is left, and the spectra of the fit.

    Examples
    --------
    >>> from fluorspar.bispectral.fit.fit import fit_material
    >>> from fluorspar.bispectral.measured import MeasuredMatrix
    >>> w = np.arange(400.0, 701.0, 10.0)
    >>> band = np.outer(np.exp(-(((w - 560) / 30) ** 2)), np.exp(-(((w - 490) / 40) ** 2)))
    >>> fit = fit_material(MeasuredMatrix(w, w, 0.3 * np.eye(31) + 0.05 * np.tril(band, -1), "sheet"))
    >>> fit_figure(fit).axes[0].get_title(loc="left")
    'measured'
    """
    return styled(_fit, fit)


def lamp_figure(colour: LampColour, name: str) -> Figure:
    """Draw the radiance factor of a material under a lamp, and the lamp.

    Examples
    --------
    >>> from fluorspar.bispectral.library import material
    >>> lamp_figure(colour_under_lamp(material("poster-red")), "poster-red").axes[0].get_ylabel()
    'radiance factor'
    """
    return styled(_lamp, colour, name)


def _material(material: Material) -> Figure:
    colour = _daylight(material)
    if not material.fluorescent:
        figure = blank(3.6, 2.4)
        _shown(figure.subplots(), colour, material.name)
        return figure
    factors = bool(material.fluorophores)
    figure = blank(7.2, 2.4)
    panels = figure.subplots(1, 3 if factors else 2, width_ratios=(1, 1, 1.05) if factors else (1, 1))
    _shown(panels[0], colour, material.name)
    if factors:
        _factors(panels[1], material)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        density = material.on(_WIDE).density()
    if (matrix := material.matrix) is not None:
        _matrix(panels[-1], matrix.density, matrix.excitation, matrix.emission, "luminescent part")
    else:
        _matrix(panels[-1], density, _WIDE.values, _WIDE.values, "luminescent part")
    return figure


def _fit(fit: MaterialFit) -> Figure:
    measured, material = fit.measured, fit.material
    em, ex = measured.emission, measured.excitation
    fitted = _fitted(fit)
    noise = fit.noise.white / measured.step
    limit = float(np.percentile(fitted[fitted > 0], 99)) if fitted.any() else 4 * noise
    figure = blank(7.2, 4.4)
    panels = figure.subplots(2, 3)
    _matrix(panels[0, 0], measured.density, ex, em, "measured", limit, bar="inside")
    _matrix(panels[0, 1], fitted, ex, em, f"fit: {_rank(fit.rank)}", limit, bar="inside")
    residual = np.where(np.abs(em[:, None] - ex[None, :]) < _SAME, 0.0, measured.density - fitted)
    _matrix(panels[0, 2], residual, ex, em, "measured − fit", 4 * noise, signed=True)
    panels[1, 0].plot(*_line(measured.reflectance), label="measured", **_DOTS)
    panels[1, 0].plot(*_line(material.reflectance), color=_INK, label="fit")
    _finish(panels[1, 0], "reflectance S", em)
    if fit.rank:
        _factors(panels[1, 1], material)
    else:
        panels[1, 1].set_axis_off()
        panels[1, 1].text(0.5, 0.5, "not fluorescent", ha="center", va="center")
    own = Wavelengths(min(em[0], ex[0]), max(em[-1], ex[-1]), measured.step)
    for sample, style in (
        (Material.from_matrix(material.name, measured), _DOTS | {"label": "measured"}),
        (material, {"color": _INK, "label": "fit"}),
    ):
        shown = _daylight(sample, own)
        inside = (own.values >= em[0] - _SAME) & (own.values <= em[-1] + _SAME)
        panels[1, 2].plot(own.values[inside], shown.radiance_factor[inside], **style)
    _finish(panels[1, 2], "radiance factor under D65", em)
    return figure


def _fitted(fit: MaterialFit) -> Array:
    """D_L of the fit in the cells of the measurement, 1/nm; 0 in the cells that hold S."""
    em, ex, step = fit.measured.emission, fit.measured.excitation, fit.measured.step
    own = Wavelengths(min(em[0], ex[0]), max(em[-1], ex[-1]), step)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        density = fit.material.on(own).density()
    rows, columns = (np.round((at - own.start) / step).astype(int) for at in (em, ex))
    return np.asarray(np.tril(density, -1)[np.ix_(rows, columns)])


def _lamp(colour: LampColour, name: str) -> Figure:
    from textwrap import fill

    figure = blank(3.6, 2.7)
    panel = figure.subplots()
    _parts(panel, colour)
    share = 0.85 * colour.light / colour.light.max()
    panel.fill_between(
        colour.grid.values, share * panel.get_ylim()[1], color="0.87", linewidth=0, zorder=0, label="lamp"
    )
    panel.set_ylim(0, 1.12 * panel.get_ylim()[1])
    _legend(panel, 3)
    put_title(panel, fill(f"{name}, {colour.lamp}", 54), fontsize=7.0)
    return figure


def _shown(panel: Axes, colour: LampColour, name: str) -> None:
    """S and what luminescence adds to it in daylight, with the colour as a patch."""
    from matplotlib.patches import Rectangle

    _parts(panel, colour)
    put_title(panel, f"     {name}, under D65")
    patch = Rectangle(
        (0.0, 1.03),
        0.055,
        0.065,
        transform=panel.transAxes,
        clip_on=False,
        facecolor=tuple(float(c) for c in colour.srgb),
        edgecolor="0.4",
        linewidth=0.4,
    )
    panel.add_patch(patch)


def _parts(panel: Axes, colour: LampColour) -> None:
    lit = colour.light > 0.01 * colour.light.max()  # a factor of next to nothing is noise
    w, S, total = colour.grid.values[lit], colour.reflected_factor[lit], colour.radiance_factor[lit]
    if np.any(total > S + 1e-4):
        panel.fill_between(w, S, total, color=_RED, alpha=0.25, linewidth=0)
        panel.plot(w, total, color=_RED, label="total")
    panel.plot(w, S, color=_INK, label="reflected, S")
    panel.set_ylabel("radiance factor")
    _finish(panel, "", w)


def _factors(panel: Axes, material: Material) -> None:
    """Draw alpha on the left, beta on the right scale, both from 0."""
    beside = panel.twinx()
    several = len(material.fluorophores) > 1
    for k, dye in enumerate(material.fluorophores):
        dash = _DASHES[k % len(_DASHES)]
        w, beta = _line(dye.excitation)
        for axes, line, colour in ((beside, (w, 1e3 * beta), _BLUE), (panel, _line(dye.emission), _RED)):
            axes.plot(*line, color=colour, linestyle=dash)
            if not several:
                axes.fill_between(*line, color=colour, alpha=0.15, linewidth=0)
        panel.plot([], [], color="0.3", linestyle=dash, label=f"{k + 1}")
    _finish(panel, "", _WIDE.values, legend=several)
    beside.set_ylim(0, 1.12 * beside.get_ylim()[1] if several else beside.get_ylim()[1])
    panel.set_ylabel("emission α", color=_RED)
    beside.set_ylabel("excitation β, 10⁻³ / nm", color=_BLUE)


def _matrix(
    panel: Axes,
    density: Array,
    excitation: Array,
    emission: Array,
    title: str,
    limit: float | None = None,
    *,
    signed: bool = False,
    bar: str = "right",
) -> None:
    """Draw D_L in 10^-3 / nm: excitation to the right, emission upwards, the diagonal as a line."""
    from matplotlib.patches import Rectangle

    values = 1e3 * density
    lit = values[values > 0]
    high = 1e3 * limit if limit else (float(np.percentile(lit, 99)) if lit.size else 1.0)
    half = 0.5 * (excitation[1] - excitation[0])
    drawn = panel.imshow(
        values,
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        cmap="RdBu_r" if signed else "BuPu",
        vmin=-high if signed else 0.0,
        vmax=high,
        extent=(excitation[0] - half, excitation[-1] + half, emission[0] - half, emission[-1] + half),
    )
    first, last = max(excitation[0], emission[0]), min(excitation[-1], emission[-1])
    panel.plot([first, last], [first, last], color="0.4", linewidth=0.6, linestyle=(0, (3, 2)))
    panel.set(xlabel="excitation, nm", ylabel="emission, nm")
    panel.set_title(title, loc="left")
    for axis in (panel.xaxis, panel.yaxis):
        _hundreds(axis)
    label, extend = "D_L, 10⁻³ / nm", "both" if signed else "max"
    if bar == "inside":  # above the diagonal there is nothing to see
        panel.add_patch(
            Rectangle(
                (0.5, 0.03), 0.49, 0.25, transform=panel.transAxes, color="white", alpha=0.85, linewidth=0
            )
        )
        inset = panel.inset_axes((0.56, 0.17, 0.38, 0.04))
        panel.figure.colorbar(drawn, cax=inset, orientation="horizontal", extend=extend)
        inset.set_title(label, fontsize=6.0, pad=2)
        inset.tick_params(labelsize=6.0, length=2, pad=1)
    else:
        panel.figure.colorbar(drawn, ax=panel, pad=0.02, label=label, extend=extend)


def _finish(panel: Axes, title: str, at: Array, legend: bool = True) -> None:
    panel.set_xlabel("wavelength, nm")
    panel.set_xlim(at[0], at[-1])
    panel.set_ylim(0, max(panel.get_ylim()[1], 0.05))
    panel.grid(linewidth=0.3)
    _hundreds(panel.xaxis)
    if title:
        panel.set_title(title, loc="left")
    if legend and len(panel.get_legend_handles_labels()[0]) > 1:
        panel.set_ylim(0, 1.12 * panel.get_ylim()[1])
        _legend(panel, 2)


def _legend(panel: Axes, columns: int) -> None:
    panel.legend(
        frameon=False, ncols=columns, loc="upper left", borderaxespad=0.2, columnspacing=1.2, handlelength=1.6
    )


def _hundreds(axis: Any) -> None:
    from matplotlib.ticker import MultipleLocator

    axis.set_major_locator(MultipleLocator(100))


def _daylight(material: Material, grid: Wavelengths = _WIDE) -> LampColour:
    with warnings.catch_warnings():  # the summary says where the data end
        warnings.simplefilter("ignore", ExtrapolationWarning)
        return colour_under_lamp(material, "D65", wavelengths=grid)


def _line(spectrum: Spectrum) -> tuple[Array, Array]:
    if spectrum.is_constant:
        return np.array([_WIDE.start, _WIDE.stop]), spectrum.values
    return spectrum.wavelengths, spectrum.values


def _rank(rank: int) -> str:
    return "not fluorescent" if rank == 0 else f"{rank} fluorophore{'s' if rank > 1 else ''}"
