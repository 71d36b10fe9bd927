"""`fluorspar materials fit`: from a measured matrix to a material file."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fluorspar.bispectral.files.registry import SUFFIXES, read_matrix
from fluorspar.cli import console
from fluorspar.cli.materials.common import PlotOption, write_plot
from fluorspar.cli.targets import check_material_target, check_plot
from fluorspar.errors import ApproximationWarning, ExtrapolationWarning, OptionError, message
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    from fluorspar.bispectral.material import Material
    from fluorspar.bispectral.measured import MeasuredMatrix
    from fluorspar.spectral.spectrum import Spectrum

__all__ = ["fit"]

_MOST = 8  # fluorophores; more only fit noise
_LOST = 0.02  # of a spectrum, outside the wavelengths of the file


def fit(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help=f"A measured Donaldson matrix ({', '.join(SUFFIXES)}).")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.csv", help="Material file to write.")
    ],
    rank: Annotated[
        int | None,
        typer.Option(metavar="K", help="Number of fluorophores. [default: as many as the data justify]"),
    ] = None,
    wavelengths: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Wavelengths of the material file in nm. [default: those of the measurement, from 300 to 780]",
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="Title of the material. [default: the output file's name]")] = "",
    description: Annotated[str, typer.Option(help="What the material is, for its file.")] = "",
    credit: Annotated[str, typer.Option(help="Who measured it, for its file.")] = "",
    plot: PlotOption = None,
) -> None:
    """Fit a material to a measured matrix. Reflectance, emission and excitation spectra are fitted.

    Example:  fluorspar materials fit sheet.bfc -o my-paint.csv --rank 1
    """
    from fluorspar.bispectral.files.material_csv import write_material
    from fluorspar.bispectral.fit.fit import fit_material
    from fluorspar.bispectral.fit.report import fit_quality, report_fit
    from fluorspar.bispectral.resampling import resampled

    if rank is not None and not 0 <= rank <= _MOST:
        expected = f"0 to {_MOST}"
        raise OptionError(message("the rank is impossible", where="--rank", got=rank, expected=expected))
    check_material_target(output, file)
    check_plot(plot)
    grid = None if wavelengths is None else Wavelengths.parse(wavelengths)
    measured = read_matrix(file)
    with console.err.status(f"fitting {file}"):
        result = fit_material(
            measured,
            rank,
            name=name or output.stem,
            support=_support(grid, measured),
            description=description,
            credit=credit,
        )
        written = result.material if grid is None else resampled(result.material, grid)
        steps = (measured.step, measured.step / 2)
        coarse, fine = (report_fit(result.measured, written, step) for step in steps)
    quality = fit_quality(result, coarse, fine)
    if coarse.shortcoming:
        text = (
            f"'{written.name}': {coarse.shortcoming}; see `fluorspar materials inspect {file}`, or try --rank"
        )
        warnings.warn(text, ApproximationWarning, stacklevel=2)
    if result.rank and not written.fluorophores:
        quality = f"the luminescence of the measurement lies outside {grid}"
    _warn_of_range(result.material, measured, grid)
    written = replace(written, quality=quality)
    write_material(output, written)
    console.out.print(repr(written), markup=False, highlight=False)
    console.out.print(f"wrote {output}", markup=False, highlight=False)
    text = f"name it as {output}, or as {output.stem} with --library {output.parent}"
    console.out.print(text, markup=False, highlight=False)
    if plot is not None:
        from fluorspar.figures.materials import fit_figure

        write_plot(fit_figure(replace(result, material=written)), plot)


def _support(grid: Wavelengths | None, measured: MeasuredMatrix) -> tuple[float, float]:
    """Return a range that covers 300 to 780 nm and a grid, from one wavelength of the measurement, continued, on."""
    if grid is None:
        return 300.0, 780.0
    first, step = measured.emission[0], measured.step
    below = math.floor((min(300.0, grid.start) - first) / step + 1e-6)
    above = math.ceil((max(780.0, grid.stop) - first) / step - 1e-6)
    return first + below * step, first + above * step


def _warn_of_range(fitted: Material, measured: MeasuredMatrix, grid: Wavelengths | None) -> None:
    """Say what a table leaves out of a measurement, or goes beyond it without a word in the spectra themselves."""
    first = float(measured.excitation[0])
    if fitted.fluorophores and first > (300.0 if grid is None else grid.start) + 1e-6:
        text = f"excitation was not measured below {first:g} nm: ultraviolet light excites nothing in '{fitted.name}'"
        warnings.warn(text, ExtrapolationWarning, stacklevel=3)
    if grid is None:
        return
    if grid.step > measured.step + 1e-6:
        text = f"a table by {grid.step:g} nm is coarser than the measurement, by {measured.step:g} nm"
        warnings.warn(
            f"{text}: the report says what that costs in CIEDE2000", ApproximationWarning, stacklevel=3
        )
    for dye in fitted.fluorophores:
        for what, spectrum in (("excitation", dye.excitation), ("emission", dye.emission)):
            lost = 1 - _within(spectrum, grid).integral() / spectrum.integral()
            if lost > _LOST:
                text = f"{grid} leaves out {100 * lost:.0f} % of the {what} of '{fitted.name}'"
                warnings.warn(text, ApproximationWarning, stacklevel=3)


def _within(spectrum: Spectrum, grid: Wavelengths) -> Spectrum:
    """A spectrum that is 0 outside a grid."""
    inside = (spectrum.wavelengths >= grid.start) & (spectrum.wavelengths <= grid.stop)
    return replace(spectrum, values=spectrum.values * inside)
