"""`fluorspar materials export`: a material for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.given import material_files
from fluorspar.cli.materials.common import MaterialArgument, PlotOption, write_plot
from fluorspar.cli.options import LibraryOption, StokesOption
from fluorspar.cli.targets import check_material_target, check_plot
from fluorspar.errors import OptionError, message

__all__ = ["export"]


def export(
    name: MaterialArgument,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.csv", help="Table to write.")],
    matrix: Annotated[
        bool,
        typer.Option(
            "--matrix",
            help="Write the Donaldson matrix: rows are emission, columns excitation; reflectance on the diagonal, "
            "elsewhere D_L times the width of a band. Without it: the spectra, as a material file.",
        ),
    ] = False,
    density: Annotated[
        bool,
        typer.Option("--density", help="With --matrix: D_L itself off the diagonal, in 1/nm of excitation."),
    ] = False,
    wavelengths: Annotated[
        str, typer.Option(metavar="START:STOP:STEP", help="With --matrix: its wavelengths in nm.")
    ] = "300:780:5",
    stokes: StokesOption = "half",
    plot: PlotOption = None,
    library: LibraryOption = None,
) -> None:
    """Write a material for other programs. Its Donaldson matrix, or its spectra; --plot draws the matrix.

    Example:  fluorspar materials export poster-red --matrix --wavelengths 380:780:10 -o matrix.csv --plot matrix.png
    """
    from fluorspar.bispectral.files.donaldson_csv import write_donaldson
    from fluorspar.bispectral.files.material_csv import write_material
    from fluorspar.bispectral.library import material
    from fluorspar.spectral.wavelengths import Wavelengths

    check_plot(plot)
    check_material_target(output, *material_files(name, library or []))
    for option, given in (("--density", density), ("--plot", plot is not None)):
        if given and not matrix:
            raise OptionError(message(f"{option} is about the matrix", fix="add --matrix, or leave it out"))
    if stokes not in ("half", "strict"):
        raise OptionError(
            message("there is no such Stokes rule", where="--stokes", got=stokes, expected="half or strict")
        )
    sample = material(name, library or [])
    if not matrix:
        write_material(output, sample)
    else:
        grid = Wavelengths.parse(wavelengths)
        made = sample.on(grid, stokes="half" if stokes == "half" else "strict")
        write_donaldson(output, sample.name, made, density=density)
        if plot is not None:
            from fluorspar.figures.donaldson import donaldson_figure

            write_plot(donaldson_figure(made, sample.name), plot)
    console.out.print(f"wrote {output}", markup=False, highlight=False)
