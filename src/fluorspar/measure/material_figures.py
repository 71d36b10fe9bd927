"""Figures of materials, fit for a paper: spectra, Donaldson matrices, a fit beside its measurement."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ExtrapolationWarning
from fluorspar.spectral.fitting import MaterialFit
from fluorspar.spectral.lamp_colour import LampColour, colour_under_lamp
from fluorspar.spectral.material import Material
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["fit_figure", "lamp_figure", "material_figure"]

Array = NDArray[np.float64]

# Okabe and Ito's colours, which most colour-blind readers can tell apart
_BLUE, _RED, _GREEN, _INK = "#0072B2", "#D55E00", "#009E73", "0.15"
_DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (5, 1, 1, 1)))  # of the first, second, ... fluorophore
_WIDE = Wavelengths(300, 780, 5)
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
}


def material_figure(material: Material) -> Figure:
    """Draw S and what the material shows in daylight, alpha and beta, and the luminescent matrix.

    What does not fluoresce has the first panel only. Spectra reach from 300 to 780 nm; a measured matrix is
    drawn as it is, without factors.

    Examples
    --------
    >>> from fluorspar.spectral.library import material
    >>> [len(material_figure(material(name)).axes) for name in ("gray-18", "poster-red")]
    [1, 5]
    """
    return _styled(_material, material)


def fit_figure(fit: MaterialFit) -> Figure:
    """Draw a measured matrix, its fit, what is left, and the spectra of the fit.

    Examples
    --------
    >>> from fluorspar.spectral.fitting import fit_material
    >>> from fluorspar.spectral.measured import MeasuredMatrix
    >>> w = np.arange(400.0, 701.0, 10.0)
    >>> band = np.outer(np.exp(-(((w - 560) / 30) ** 2)), np.exp(-(((w - 490) / 40) ** 2)))
    >>> fit = fit_material(MeasuredMatrix(w, w, 0.3 * np.eye(31) + 0.05 * np.tril(band, -1), "sheet"))
    >>> fit_figure(fit).axes[0].get_title(loc="left")
    'measured'
    """
    return _styled(_fit, fit)


def lamp_figure(colour: LampColour, name: str) -> Figure:
    """Draw the radiance factor of a material under a lamp, and the lamp.

    Examples
    --------
    >>> from fluorspar.spectral.library import material
    >>> lamp_figure(colour_under_lamp(material("poster-red")), "poster-red").axes[0].get_ylabel()
    'radiance factor'
    """
    return _styled(_lamp, colour, name)


def _styled(draw: Any, *args: Any) -> Figure:
    from matplotlib import rc_context

    with rc_context(_STYLE):
        figure: Figure = draw(*args)
    return figure


def _new(width: float, height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _material(material: Material) -> Figure:
    colour = _daylight(material)
    if not material.fluorescent:
        figure = _new(3.6, 2.4)
        _shown(figure.subplots(), colour, material.name)
        return figure
    factors = bool(material.fluorophores)
    figure = _new(7.2, 2.4)
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
    own = Wavelengths(min(em[0], ex[0]), max(em[-1], ex[-1]), measured.step)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        whole = material.on(own).density()
    rows, columns = ((own.values >= a[0] - 1e-6) & (own.values <= a[-1] + 1e-6) for a in (em, ex))
    fitted = whole[np.ix_(rows, columns)]
    below = em[:, None] > ex[None, :] + 1e-6
    limit = float(np.percentile(fitted[below], 99.8)) if fitted.any() else 3 * fit.noise.white / measured.step
    residual = np.where(em[:, None] == ex[None, :], 0.0, measured.density - fitted)
    figure = _new(7.2, 4.5)
    panels = figure.subplots(2, 3)
    _matrix(panels[0, 0], measured.density, ex, em, "measured", limit, bar=False)
    _matrix(panels[0, 1], np.where(below, fitted, 0.0), ex, em, f"fit, {_rank(fit.rank)}", limit)
    scale = max(4 * fit.noise.white / measured.step, 1e-9)
    _matrix(panels[0, 2], residual, ex, em, "measured − fit", scale, signed=True)
    panels[1, 0].plot(*_line(measured.reflectance), ".", color="0.6", markersize=3, label="measured")
    panels[1, 0].plot(*_line(material.reflectance), color=_INK, label="fit")
    _finish(panels[1, 0], "reflectance S", "S")
    panels[1, 0].set_xlim(em[0], em[-1])
    if fit.rank:
        _factors(panels[1, 1], material)
    else:
        panels[1, 1].set_axis_off()
        panels[1, 1].text(0.5, 0.5, "not fluorescent", ha="center", va="center")
    seen = Material.from_matrix(material.name, measured)
    for sample, style, label in (
        (seen, {"color": "0.6", "marker": ".", "linestyle": ""}, "measured"),
        (material, {"color": _INK}, "fit"),
    ):
        shown = _daylight(sample, Wavelengths(own.start, own.stop, own.step))
        inside = (shown.grid.values >= em[0]) & (shown.grid.values <= em[-1])
        panels[1, 2].plot(
            shown.grid.values[inside], shown.radiance_factor[inside], markersize=3, label=label, **style
        )
    _finish(panels[1, 2], "total radiance factor under D65", "radiance factor")
    panels[1, 2].set_xlim(em[0], em[-1])
    return figure


def _lamp(colour: LampColour, name: str) -> Figure:
    figure = _new(3.6, 2.6)
    panel = figure.subplots()
    w, light = colour.grid.values, colour.light
    beside = panel.twinx()
    beside.fill_between(w, light / light.max(), color="0.88", linewidth=0)
    beside.set(ylim=(0, 1.02), yticks=[], ylabel="")
    panel.set_zorder(beside.get_zorder() + 1)
    panel.patch.set_visible(False)
    _parts(panel, colour)
    panel.set_title(f"{name} under {colour.lamp.removeprefix('illuminant ')}", loc="left", fontsize=7.5)
    panel.text(
        0.99,
        0.02,
        "grey: the lamp",
        transform=panel.transAxes,
        ha="right",
        va="bottom",
        fontsize=6.5,
        color="0.45",
    )
    return figure


def _shown(panel: Axes, colour: LampColour, name: str) -> None:
    """S and what luminescence adds to it in daylight, with the colour as a patch."""
    from matplotlib.patches import Rectangle

    _parts(panel, colour)
    panel.set_title(f"     {name}, under D65", loc="left")
    patch = Rectangle(
        (0.0, 1.025),
        0.055,
        0.07,
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
    panel.plot(w, S, color=_INK, label="reflectance S")
    _finish(panel, "", "radiance factor")
    panel.set_xlim(w[0], w[-1])


def _factors(panel: Axes, material: Material) -> None:
    """alpha on the left, beta on the right scale, both from 0."""
    beside = panel.twinx()
    several = len(material.fluorophores) > 1
    for k, dye in enumerate(material.fluorophores):
        index, dash = (f"$_{{{k + 1}}}$" if several else ""), _DASHES[k % len(_DASHES)]
        (a,) = panel.plot(*_line(dye.emission), color=_RED, linestyle=dash, label=f"emission α{index}")
        (b,) = beside.plot(
            *_scaled(dye.excitation, 1e3), color=_BLUE, linestyle=dash, label=f"excitation β{index}"
        )
        if not several:
            panel.fill_between(*_line(dye.emission), color=_RED, alpha=0.15, linewidth=0)
            beside.fill_between(*_scaled(dye.excitation, 1e3), color=_BLUE, alpha=0.15, linewidth=0)
    lines = [*beside.get_lines(), *panel.get_lines()]
    _finish(panel, "", "α", legend=False)
    beside.set_ylim(0, beside.get_ylim()[1])
    beside.set_ylabel("β, 10$^{-3}$ / nm", color=_BLUE)
    panel.yaxis.label.set_color(_RED)
    top = panel.get_ylim()[1]
    panel.set_ylim(0, top * 1.18)  # room for the legend
    beside.set_ylim(0, beside.get_ylim()[1] * 1.18)
    panel.legend(
        lines,
        [str(line.get_label()) for line in lines],
        frameon=False,
        ncols=2,
        loc="upper left",
        borderaxespad=0.2,
        columnspacing=1.0,
        handlelength=1.6,
    )
    panel.set_xlim(_WIDE.start, _WIDE.stop)


def _matrix(
    panel: Axes,
    density: Array,
    excitation: Array,
    emission: Array,
    title: str,
    limit: float | None = None,
    *,
    signed: bool = False,
    bar: bool = True,
) -> None:
    """Draw D_L in 10^-3 / nm: excitation to the right, emission upwards, the diagonal as a line."""
    values = 1e3 * density
    high = (
        1e3 * limit
        if limit is not None
        else float(np.percentile(values[values > 0], 99.8))
        if np.any(values > 0)
        else 1.0
    )
    half = 0.5 * (excitation[1] - excitation[0])
    drawn = panel.imshow(
        values,
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        cmap="RdBu_r" if signed else "magma_r",
        vmin=-high if signed else 0.0,
        vmax=high,
        extent=(excitation[0] - half, excitation[-1] + half, emission[0] - half, emission[-1] + half),
    )
    first, last = max(excitation[0], emission[0]), min(excitation[-1], emission[-1])
    panel.plot([first, last], [first, last], color="0.4", linewidth=0.6, linestyle=(0, (3, 2)))
    panel.set(xlabel="excitation, nm", ylabel="emission, nm")
    panel.set_title(title, loc="left")
    if bar:
        figure = panel.figure
        figure.colorbar(
            drawn, ax=panel, pad=0.02, label="D$_L$, 10$^{-3}$ / nm", extend="both" if signed else "max"
        )


def _finish(panel: Axes, title: str, label: str, legend: bool = True) -> None:
    panel.set(xlabel="wavelength, nm", ylabel=label)
    panel.set_ylim(0, max(panel.get_ylim()[1], 0.05))
    panel.grid(linewidth=0.3)
    if title:
        panel.set_title(title, loc="left")
    if legend and len(panel.get_lines()) > 1:
        panel.legend(frameon=False)


def _daylight(material: Material, grid: Wavelengths = _WIDE) -> LampColour:
    with warnings.catch_warnings():  # the summary says where the data end
        warnings.simplefilter("ignore", ExtrapolationWarning)
        return colour_under_lamp(material, "D65", wavelengths=grid)


def _line(spectrum: Any) -> tuple[Array, Array]:
    if spectrum.is_constant:
        return np.array([_WIDE.start, _WIDE.stop]), spectrum.values
    return spectrum.wavelengths, spectrum.values


def _scaled(spectrum: Any, factor: float) -> tuple[Array, Array]:
    w, v = _line(spectrum)
    return w, factor * v


def _rank(rank: int) -> str:
    return "not fluorescent" if rank == 0 else f"{rank} fluorophore{'s' if rank > 1 else ''}"
