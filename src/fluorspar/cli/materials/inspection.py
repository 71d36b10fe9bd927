"""`fluorspar materials inspect`: what a file is, whether it is sound, how well factors describe it."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.materials.common import (
    LibraryOption,
    PlotOption,
    check_plot,
    hexadecimal,
    swatch,
    write_plot,
)

if TYPE_CHECKING:
    from rich.table import Table

    from fluorspar.spectral.fit_report import FitReport
    from fluorspar.spectral.fitting import MaterialFit
    from fluorspar.spectral.material import Material
    from fluorspar.spectral.measured import MeasuredMatrix

__all__ = ["inspect"]

_LIGHTS = (("D65", None), ("D65", 400.0), ("D50", None), ("A", None), ("FL11", None))


def inspect(
    file: Annotated[
        str,
        typer.Argument(metavar="FILE|NAME", help="A measured matrix (.bfc, .csv), a material file or name."),
    ],
    plot: PlotOption = None,
    library: LibraryOption = None,
) -> None:
    """Say what a file holds. Checks, noise, yields, how well 1, 2, ... fluorophores fit, colours under lamps.

    Example:  fluorspar materials inspect sheet.bfc --plot sheet.png
    """
    from fluorspar.cli.materials.matrices import find_matrix
    from fluorspar.spectral.library import material
    from fluorspar.spectral.material import Material

    check_plot(plot)
    path = Path(file)
    measured = find_matrix(path) if path.suffix.lower() in (".bfc", ".csv") else None
    if measured is None:
        made = material(file, library or [])
        console.out.print(repr(made), markup=False, highlight=False)
        _yields(made)
        console.out.print(_colours(made))
        chosen = None
    else:
        fits = _describe(measured, path)
        chosen = fits[None][0]
        made = Material.from_matrix(path.stem, measured)
        console.out.print(_qualities(fits))
        console.out.print(_colours(made, chosen.material))
    if plot is not None:
        from fluorspar.measure.material_figures import fit_figure, material_figure

        write_plot(material_figure(made) if chosen is None else fit_figure(chosen), plot)
        console.out.print(f"wrote {plot}", markup=False, highlight=False)


def _line(label: str, text: str) -> None:
    console.out.print(f"  {label + ':':<15}{text}", markup=False, highlight=False)


def _describe(
    measured: MeasuredMatrix, path: Path
) -> dict[int | None, tuple[MaterialFit, FitReport, FitReport]]:
    """Print what a matrix is and its checks; return fits by rank, the one that the data choose under None."""
    import numpy as np

    from fluorspar.spectral.fit_report import report_fit
    from fluorspar.spectral.fitting import fit_material

    em, ex, h = measured.emission, measured.excitation, measured.step
    kind = "Labsphere BFC-450 matrix" if path.suffix.lower() == ".bfc" else "Donaldson matrix"
    console.out.print(f"{path.name}: {kind}, band-weighted", markup=False, highlight=False)
    _line("emission", f"{em[0]:g}-{em[-1]:g} nm by {h:g}, {len(em)} rows")
    _line("excitation", f"{ex[0]:g}-{ex[-1]:g} nm by {h:g}, {len(ex)} columns")
    shift = em[:, None] - ex[None, :]
    cells = h * measured.density
    above, below = float(cells[shift < -1e-6].sum()), float(cells[shift > 1e-6].sum())
    _line("orientation", f"rows are emission: {below:.3g} below the diagonal, {above:.3g} above")
    S = measured.reflectance
    _line(
        "diagonal", f"{S.support[0]:g}-{S.support[1]:g} nm, from {S.values.min():.3g} to {S.values.max():.3g}"
    )
    photons = measured.photon_yield()
    energy = np.array(measured.cells.sum(axis=0))
    for label, values in (("photon yield", photons), ("energy yield", energy)):
        worst = int(values.argmax())
        _line(label, f"at most {values[worst]:.3f}, at {ex[worst]:g} nm; S included")
    fits: dict[int | None, tuple[MaterialFit, FitReport, FitReport]] = {}
    with console.err.status("fitting") as status:
        for rank in (None, 1, 2):
            status.update(f"fitting {rank or 'as many'} fluorophores")
            found = fit_material(measured, rank, name=path.stem)
            if not fits or rank != fits[None][0].rank:
                coarse, fine = (report_fit(measured, found.material, step) for step in (h, h / 2))
                fits[rank] = (found, coarse, fine)
    noise = fits[None][0].noise
    _line(
        "noise",
        f"{noise.white:.4f} per cell, {noise.near:.4f} beside the diagonal, {noise.offset:.4f} per column",
    )
    chosen = fits[None][0].rank
    _line(
        "fluorophores", f"{chosen}, as the data call for" if chosen else "none: no luminescence beyond noise"
    )
    return fits


def _qualities(fits: dict[int | None, tuple[MaterialFit, FitReport, FitReport]]) -> Table:
    from rich.table import Table

    lights = list(fits[None][1].delta_e)
    table = Table(
        "rank", *lights, f"D65, {fits[None][2].grid.step:g} nm", "unexplained", box=None, pad_edge=False
    )
    table.title, table.title_justify, table.title_style = "CIEDE2000 between fit and measurement", "left", ""
    for key, (fit, coarse, fine) in sorted(fits.items(), key=lambda item: item[1][0].rank):
        differences = [f"{coarse.delta_e[light]:.2f}" for light in lights]
        unexplained = f"{100 * fit.unexplained:.0f} %"
        mark = f"{fit.rank} chosen" if key is None else f"{fit.rank}"
        table.add_row(mark, *differences, f"{fine.delta_e['D65']:.2f}", unexplained)
    return table


def _yields(made: Material) -> None:
    from fluorspar.errors import ExtrapolationWarning
    from fluorspar.spectral.wavelengths import Wavelengths

    grid = Wavelengths(300, 780, 5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        D = made.on(grid)
    for label, values in (("photon yield", D.photon_yield()), ("energy yield", D.energy_yield())):
        worst = int(values.argmax())
        _line(label, f"at most {values[worst]:.3f}, at {grid.values[worst]:g} nm; S included")


def _colours(made: Material, fitted: Material | None = None) -> Table:
    """Colours under several lights; of measurement and fit if there are both."""
    from rich.table import Table

    from fluorspar.errors import ExtrapolationWarning
    from fluorspar.spectral.lamp_colour import colour_under_lamp

    table = Table("", "light", "L*", "a*", "b*", "sRGB", "lumin.", box=None, pad_edge=False)
    for column in table.columns[2:5]:
        column.justify = "right"
    if fitted is not None:
        table.add_column("fit L* a* b*")
    for lamp, cut in _LIGHTS:
        with warnings.catch_warnings():  # said once, in words, above
            warnings.simplefilter("ignore", ExtrapolationWarning)
            seen = colour_under_lamp(made, lamp, uv_cut=cut)
            other = None if fitted is None else colour_under_lamp(fitted, lamp, uv_cut=cut)
        cells = [f"{value:.1f}" for value in seen.lab.round(1) + 0.0]
        light = lamp if cut is None else f"{lamp} above {cut:g} nm"
        row = [
            swatch(seen.srgb),
            light,
            *cells,
            hexadecimal(seen.srgb),
            f"{round(100 * seen.luminescent_share)} %",
        ]
        if other is not None:
            row.append(" ".join(f"{value:.1f}" for value in other.lab.round(1) + 0.0))
        table.add_row(*row)
    return table
