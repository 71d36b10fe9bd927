"""`fluorspar materials from-eem`: from an excitation-emission matrix in relative units to a material file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli.materials.common import substrate_of, units_of, write_made
from fluorspar.cli.options import LibraryOption, material_files
from fluorspar.cli.targets import check_material_target

__all__ = ["from_eem"]


def from_eem(
    eem: Annotated[
        Path,
        typer.Argument(
            metavar="EEM", help="File: a table of intensities over emission and excitation in nm."
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.csv", help="Material file to write.")
    ],
    quantum_yield: Annotated[
        float, typer.Option(metavar="0-1", help="Photons given out per photon absorbed.")
    ],
    strength: Annotated[
        float | None,
        typer.Option(metavar="0-1", help="Share of the light absorbed at the peak of the excitation."),
    ] = None,
    reflectance: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Instead of it: reflectance of the sample without its luminescence."
        ),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(metavar="photon|energy", help="What an EEM without a line '# units: ...' counts."),
    ] = None,
    substrate: Annotated[
        str, typer.Option(metavar="NAME|FILE|NUMBER", help="What is dyed, with --strength.")
    ] = "0.85",
    scatter: Annotated[
        float, typer.Option(metavar="NM", help="Leave out cells as near to Rayleigh and Raman scatter.")
    ] = 15.0,
    description: Annotated[str, typer.Option(help="What it is.")] = "",
    credit: Annotated[str, typer.Option(help="Who measured it.")] = "",
    library: LibraryOption = None,
) -> None:
    """Make a material of an EEM in relative units and a quantum yield.

    Example:  fluorspar materials from-eem dye.csv --quantum-yield 0.8 --strength 0.5 --units photon -o dyed.csv
    """
    from fluorspar.bispectral.eem import material_from_eem
    from fluorspar.bispectral.files.eem_file import read_eem

    check_material_target(
        output, eem, *filter(None, [reflectance]), *material_files(substrate, library or [])
    )
    made = material_from_eem(
        read_eem(eem),
        quantum_yield,
        strength=strength,
        reflectance=reflectance,
        units=units_of(units),
        substrate=substrate_of(substrate, library or []),
        scatter=scatter,
        name=output.stem,
        description=description,
        credit=credit,
    )
    write_made(output, made)
