"""`fluorspar materials fit`: from a measured matrix to a material file."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.materials.common import PlotOption, check_plot, write_plot
from fluorspar.errors import ApproximationWarning, ExtrapolationWarning, OptionError, message
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    from fluorspar.spectral.material import Material
    from fluorspar.spectral.measured import MeasuredMatrix

__all__ = ["fit"]

_MOST = 8  # fluorophores; more only fit noise
_LOST = 0.02  # of a spectrum, outside the wavelengths of the file


def fit(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A measured Donaldson matrix: .bfc or .csv.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.csv", help="Material file to write.")
    ],
    rank: Annotated[
        int | None, typer.Option(metavar="K", help="Number of fluorophores. [default: the data decide]")
    ] = None,
    wavelengths: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Wavelengths of the file in nm. [default: the measured, 300 to 780]",
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="Title of the material. [default: the output file's name]")] = "",
    description: Annotated[str, typer.Option(help="What it is.")] = "",
    credit: Annotated[str, typer.Option(help="Who measured it.")] = "",
    plot: PlotOption = None,
) -> None:
    """Make a material of a measured matrix. Reflectance, emission and excitation spectra are fitted to it.

    Example:  fluorspar materials fit sheet.bfc -o my-paint.csv --rank 1
    """
    from dataclasses import replace

    from fluorspar.cli.materials.matrices import read_matrix
    from fluorspar.image.atomic import check_not_input, check_target
    from fluorspar.spectral.fit_quality import fit_quality
    from fluorspar.spectral.fit_report import report_fit
    from fluorspar.spectral.fitting import fit_material
    from fluorspar.spectral.material_file import write_material
    from fluorspar.spectral.material_resampling import resampled

    if output.suffix.lower() != ".csv":
        fault = "a material file is a .csv file"
        raise OptionError(message(fault, where="--output", got=output, fix=f"write {output.stem}.csv"))
    if rank is not None and not 0 <= rank <= _MOST:
        expected = f"0 to {_MOST}"
        raise OptionError(message("the rank is impossible", where="--rank", got=rank, expected=expected))
    check_target(output)
    check_not_input(output, file)
    check_plot(plot)
    grid = None if wavelengths is None else Wavelengths.parse(wavelengths)
    measured = read_matrix(file)
    with console.err.status(f"fitting {file}"):
        found = fit_material(
            measured,
            rank,
            name=name or output.stem,
            support=_support(grid, measured),
            description=description,
            credit=credit,
        )
        made = found.material if grid is None else resampled(found.material, grid)
        coarse, fine = (report_fit(found.measured, made, step) for step in (measured.step, measured.step / 2))
    quality = fit_quality(found, coarse, fine)
    if found.rank and not made.fluorophores:
        quality = f"the luminescence of the measurement lies outside {grid}"
    _warn_of_range(found.material, measured, grid)
    found = replace(found, material=replace(made, quality=quality))
    write_material(output, found.material)
    console.out.print(repr(found.material), markup=False, highlight=False)
    console.out.print(f"wrote {output}", markup=False, highlight=False)
    text = f"name it as {output}, or as {output.stem} with --library {output.parent}"
    console.out.print(text, markup=False, highlight=False)
    if plot is not None:
        from fluorspar.measure.material_figures import fit_figure

        write_plot(fit_figure(found), plot)
        console.out.print(f"wrote {plot}", markup=False, highlight=False)


def _support(grid: Wavelengths | None, measured: MeasuredMatrix) -> tuple[float, float]:
    """Return a range of measured wavelengths, extended, that covers 300 to 780 nm and a grid."""
    first, step = measured.emission[0], measured.step
    start, stop = (300.0, 780.0) if grid is None else (min(300.0, grid.start), max(780.0, grid.stop))
    if grid is None:
        return start, stop
    below, above = math.floor((start - first) / step + 1e-6), math.ceil((stop - first) / step - 1e-6)
    return first + below * step, first + above * step


def _warn_of_range(fitted: Material, measured: MeasuredMatrix, grid: Wavelengths | None) -> None:
    """Say what a table leaves out of a measurement, or goes beyond it without a word in the spectra themselves."""
    if grid is not None and grid.step > measured.step + 1e-6:
        text = f"a table by {grid.step:g} nm is coarser than the measurement, by {measured.step:g} nm"
        warnings.warn(f"{text}: see the CIEDE2000 it costs", ApproximationWarning, stacklevel=3)
    import numpy as np

    from fluorspar.spectral.spectrum import trapezoid

    for dye in fitted.fluorophores:
        for what, spectrum in (("excitation", dye.excitation), ("emission", dye.emission)):
            w, values = spectrum.wavelengths, spectrum.values
            inside = values if grid is None else np.where((w >= grid.start) & (w <= grid.stop), values, 0.0)
            lost = 1 - trapezoid(inside, w) / trapezoid(values, w)
            if lost > _LOST:
                text = f"{grid} leaves out {100 * lost:.0f} % of the {what} of '{fitted.name}'"
                warnings.warn(text, ApproximationWarning, stacklevel=3)
    first = float(measured.excitation[0])
    if fitted.fluorophores and first > (300.0 if grid is None else grid.start) + 1e-6:
        text = f"excitation was not measured below {first:g} nm: ultraviolet light excites nothing in '{fitted.name}'"
        warnings.warn(text, ExtrapolationWarning, stacklevel=3)
