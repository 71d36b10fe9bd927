"""`fluorspar materials from-eem`: from an excitation-emission matrix in relative units to a material file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli.given import material_files
from fluorspar.cli.materials.common import substrate_of, units_of, write_made
from fluorspar.cli.options import LibraryOption
from fluorspar.cli.targets import check_material_target

__all__ = ["from_eem"]


def from_eem(
    eem: Annotated[
        Path,
        typer.Argument(
            metavar="EEM",
            help="Table of relative intensities over emission and excitation wavelengths in nm.",
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.csv", help="Material file to write.")
    ],
    quantum_yield: Annotated[float, typer.Option(metavar="0-1", help="Photons emitted per photon absorbed.")],
    strength: Annotated[
        float | None,
        typer.Option(
            metavar="0-1", help="Share of the light that is absorbed at the peak of the excitation."
        ),
    ] = None,
    reflectance: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Instead of --strength: table of the reflectance without luminescence, 0 to 1.",
        ),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(
            metavar="photon|energy",
            help="What the EEM counts. Needed for files without a line '# units: ...'.",
        ),
    ] = None,
    substrate: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE|NUMBER",
            help="With --strength: what is dyed, a material or a reflectance, 0 to 1.",
        ),
    ] = "0.85",
    scatter: Annotated[
        float,
        typer.Option(
            metavar="NM", help="Leave out cells within this distance of Rayleigh and Raman scatter."
        ),
    ] = 15.0,
    description: Annotated[str, typer.Option(help="What the material is, for its file.")] = "",
    credit: Annotated[str, typer.Option(help="Who measured it, for its file.")] = "",
    library: LibraryOption = None,
) -> None:
    """Make a material of an EEM and a quantum yield. EEM: excitation-emission matrix, in relative units.

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
