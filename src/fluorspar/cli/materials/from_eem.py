"""`fluorspar materials from-eem`: from an excitation-emission matrix in relative units to a material file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from fluorspar.cli import console
from fluorspar.cli.options import LibraryOption, material_files
from fluorspar.cli.targets import check_material_target
from fluorspar.errors import OptionError, message

if TYPE_CHECKING:
    from fluorspar.bispectral.dye import Units

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
    from fluorspar.bispectral.files.material_csv import write_material
    from fluorspar.bispectral.lamp import WIDE
    from fluorspar.bispectral.library import material

    if units not in (None, "photon", "energy"):
        fault, expected = "there are no such units", "photon or energy"
        raise OptionError(message(fault, where="--units", got=units, expected=expected))
    check_material_target(
        output, eem, *filter(None, [reflectance]), *material_files(substrate, library or [])
    )
    try:
        base: float | str = float(substrate)
    except ValueError:
        base = substrate
    made = material_from_eem(
        read_eem(eem),
        quantum_yield,
        strength=strength,
        reflectance=reflectance,
        units=cast("Units | None", units),
        substrate=material(base, library or []) if isinstance(base, str) else base,
        scatter=scatter,
        name=output.stem,
        description=description,
        credit=credit,
    )
    made.on(WIDE)  # refuses what is impossible before it is written
    write_material(output, made)
    console.out.print(repr(made), markup=False, highlight=False)
    console.out.print(f"wrote {output}", markup=False, highlight=False)
