"""`fluorspar materials inspect`: what a file is, whether it is sound, how well factors describe it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from fluorspar.bispectral.files.registry import FORMATS, SUFFIXES, find_matrix
from fluorspar.cli import console
from fluorspar.cli.given import material_files
from fluorspar.cli.materials.common import PlotOption, hexadecimal, swatch, write_columns, write_plot
from fluorspar.cli.options import LibraryOption
from fluorspar.cli.targets import check_plot
from fluorspar.files.writing import check_not_input, check_target

if TYPE_CHECKING:
    from rich.table import Table

    from fluorspar.bispectral.donaldson import DonaldsonMatrix
    from fluorspar.bispectral.fit.fit import MaterialFit
    from fluorspar.bispectral.fit.report import FitReport
    from fluorspar.bispectral.material import Material
    from fluorspar.bispectral.measured import MeasuredMatrix

__all__ = ["inspect"]

_LIGHTS = (("D65", None), ("D65", 400.0), ("D50", None), ("A", None), ("FL11", None))


def inspect(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE|NAME",
            help=f"A measured matrix or a material file ({', '.join(SUFFIXES)}), or the name of a material.",
        ),
    ],
    plot: PlotOption = None,
    yields: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Write the photon and energy yield of every excitation wavelength to this table.",
        ),
    ] = None,
    library: LibraryOption = None,
) -> None:
    """Inspect a measured matrix. Checks, noise, yields, fits of 1, 2, ... fluorophores, colours.

    Example:  fluorspar materials inspect sheet.bfc --plot sheet.png --yields yields.csv
    """
    from fluorspar.bispectral.library import material
    from fluorspar.bispectral.material import Material

    check_plot(plot)
    path = Path(file)
    if yields is not None:
        check_target(yields)
        check_not_input(yields, *material_files(file, library or []))
    measured = find_matrix(path) if path.suffix.lower() in SUFFIXES or path.is_file() else None
    best = None
    if measured is None:
        sample = material(file, library or [])
        colours = _colours(sample)
        console.out.print(repr(sample), markup=False, highlight=False)
        _yields(sample)
    else:
        with console.err.status("fitting") as status:
            fits = _fits(measured, path, status.update)
        best = fits[0]
        sample = Material.from_matrix(path.stem, measured)
        colours = _colours(sample, best.fit.material)  # before anything is printed: it may find faults
        _describe(measured, path, best.fit)
        console.out.print(_qualities(fits))
        if best.coarse.shortcoming:
            _line("shortcoming", best.coarse.shortcoming)
    console.out.print(colours)
    if yields is not None:
        _write_yields(yields, sample, None if best is None else best.coarse)
    if plot is not None:
        from fluorspar.figures.materials import fit_figure, material_figure

        write_plot(material_figure(sample) if best is None else fit_figure(best.fit), plot)


class _Fit(NamedTuple):
    """A fit of so many fluorophores, and how good it is at the step of the measurement and at half of it."""

    asked: int | None
    fit: MaterialFit
    coarse: FitReport
    fine: FitReport


def _line(label: str, text: str) -> None:
    console.out.print(f"  {label + ':':<15}{text}", markup=False, highlight=False)


def _fits(measured: MeasuredMatrix, path: Path, tell: Callable[[str], None]) -> list[_Fit]:
    """Fit as many fluorophores as the data call for, which comes first, and 1 and 2."""
    from fluorspar.bispectral.fit.fit import fit_material
    from fluorspar.bispectral.fit.report import report_fit

    fits: list[_Fit] = []
    for rank in (None, 1, 2):
        tell(f"fitting {rank or 'as many'} fluorophores")
        fit = fit_material(measured, rank, name=path.stem)
        if rank is None or (fits[0].fit.rank and rank != fits[0].fit.rank):
            steps = (measured.step, measured.step / 2)
            fits.append(_Fit(rank, fit, *(report_fit(fit.measured, fit.material, step) for step in steps)))
    return fits


def _describe(measured: MeasuredMatrix, path: Path, fit: MaterialFit) -> None:
    """Print what a matrix is and its checks."""
    import numpy as np

    em, ex, h = measured.emission, measured.excitation, measured.step
    console.out.print(
        f"{path.name}: measured matrix, {FORMATS[path.suffix.lower()].name}", markup=False, highlight=False
    )
    _line("emission", f"{em[0]:g}-{em[-1]:g} nm by {h:g}, {len(em)} rows")
    _line("excitation", f"{ex[0]:g}-{ex[-1]:g} nm by {h:g}, {len(ex)} columns")
    shift = em[:, None] - ex[None, :]
    cells = h * measured.density
    above, below = float(cells[shift < -1e-6].sum()), float(cells[shift > 1e-6].sum())
    rows = "rows are emission" if fit.rank else "not known without luminescence"
    _line("orientation", f"{rows}: {below:.3g} below the diagonal, {above:.3g} above")
    S = measured.reflectance
    _line(
        "diagonal", f"{S.support[0]:g}-{S.support[1]:g} nm, from {S.values.min():.3g} to {S.values.max():.3g}"
    )
    for label, values in (
        ("photon yield", measured.photon_yield()),
        ("energy yield", measured.energy_yield()),
    ):
        worst = int(np.argmax(values))
        reflected = S.support[0] <= ex[worst] <= S.support[1]
        counted = "what is reflected included" if reflected else "reflectance not measured there"
        _line(label, f"at most {values[worst]:.3f}, at {ex[worst]:g} nm; {counted}")
    noise = fit.noise
    _line(
        "noise",
        f"{noise.white:.4f} per cell, {noise.near:.4f} beside the diagonal, {noise.offset:.4f} per column",
    )
    if noise.common:
        _line("zero error", f"{noise.common:.4f} in all cells; taken off")
    _line(
        "fluorophores",
        f"{fit.rank}, as the data call for" if fit.rank else "none: no luminescence beyond noise",
    )


def _qualities(fits: list[_Fit]) -> Table:
    from rich.table import Table

    lights = list(fits[0].coarse.delta_e)
    headings = [*lights, f"D65, {fits[0].fine.grid.step:g} nm", "unexplained"]
    table = Table("rank", *headings, box=None, pad_edge=False)
    title = "CIEDE2000 between fit and measurement: its diagonal and what is below"
    table.title, table.title_justify, table.title_style = title, "left", ""
    for asked, fit, coarse, fine in sorted(
        fits, key=lambda one: one.fit.rank if one.asked is None else one.asked
    ):
        differences = [*(coarse.delta_e[light] for light in lights), fine.delta_e["D65"]]
        mark = f"{fit.rank} chosen" if asked is None else f"{asked}"
        table.add_row(mark, *(f"{value:.2f}" for value in differences), f"{100 * fit.unexplained:.0f} %")
    every = fits[0].coarse.delta_e_all_cells
    table.add_row(f"{fits[0].fit.rank}, all cells", *(f"{every[light]:.2f}" for light in lights))
    return table


def _write_yields(path: Path, sample: Material, report: FitReport | None) -> None:
    """Write yields by excitation wavelength: of a material, or of a fit and of the measurement."""
    if report is None:
        D = _wide(sample)
        columns = {
            "excitation": D.wavelengths.values,
            "photon_yield": D.photon_yield(),
            "energy_yield": D.energy_yield(),
        }
    else:
        columns = {
            "excitation": report.grid.values,
            "photon_yield_measured": report.measured_photon_yield,
            "photon_yield_fit": report.photon_yield,
            "energy_yield_measured": report.measured_energy_yield,
            "energy_yield_fit": report.energy_yield,
        }
    about = "what is reflected is included; empty where the reflectance was not measured"
    write_columns(path, about, columns)


def _yields(sample: Material) -> None:
    D = _wide(sample)
    for label, values in (("photon yield", D.photon_yield()), ("energy yield", D.energy_yield())):
        worst = int(values.argmax())
        _line(label, f"at most {values[worst]:.3f}, at {D.wavelengths.values[worst]:g} nm; S included")


def _wide(sample: Material) -> DonaldsonMatrix:
    """The matrix of a material from the ultraviolet on; what it assumes there is told by its description."""
    from fluorspar.bispectral.lamp import WIDE
    from fluorspar.errors import ExtrapolationWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        return sample.on(WIDE)


def _colours(sample: Material, fitted: Material | None = None) -> Table:
    """Colours under several lights; of measurement and fit if there are both."""
    from rich.table import Table

    from fluorspar.bispectral.lamp_colour import colour_under_lamp
    from fluorspar.errors import ExtrapolationWarning

    table = Table("", "light", "L*", "a*", "b*", "sRGB", "lumin.", box=None, pad_edge=False)
    for column in table.columns[2:5]:
        column.justify = "right"
    if fitted is not None:
        table.add_column("fit L* a* b*")
        table.title, table.title_justify, table.title_style = (
            "Colours of all measured cells, and of the fit",
            "left",
            "",
        )
    for lamp, cut in _LIGHTS:
        with warnings.catch_warnings():  # said once, in words, above
            warnings.simplefilter("ignore", ExtrapolationWarning)
            seen = colour_under_lamp(sample, lamp, uv_cut=cut)
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
