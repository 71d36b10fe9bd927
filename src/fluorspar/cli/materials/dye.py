"""`fluorspar materials dye`: from the spectra of a dye to a material file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli.materials.common import substrate_of, units_of, write_made
from fluorspar.cli.options import LibraryOption, material_files
from fluorspar.cli.targets import check_material_target

__all__ = ["dye"]


def dye(
    excitation: Annotated[
        Path, typer.Argument(metavar="EXCITATION", help="File: wavelength in nm, value; what is absorbed.")
    ],
    emission: Annotated[Path, typer.Argument(metavar="EMISSION", help="File: wavelength in nm, value.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.csv", help="Material file to write.")
    ],
    quantum_yield: Annotated[
        float, typer.Option(metavar="0-1", help="Photons given out per photon absorbed.")
    ],
    strength: Annotated[float, typer.Option(metavar="0-1", help="Share of the light absorbed at the peak.")],
    units: Annotated[
        str | None,
        typer.Option(metavar="photon|energy", help="What files without a line '# units: ...' count."),
    ] = None,
    substrate: Annotated[
        str, typer.Option(metavar="NAME|FILE|NUMBER", help="What is dyed: a material, or its reflectance.")
    ] = "0.85",
    description: Annotated[str, typer.Option(help="What it is.")] = "",
    credit: Annotated[str, typer.Option(help="Who measured it.")] = "",
    library: LibraryOption = None,
) -> None:
    """Make a material of a dye known by its excitation and emission spectrum.

    Example:  fluorspar materials dye ex.csv em.csv --quantum-yield 0.9 --strength 0.5 --units photon -o dyed.csv
    """
    from fluorspar.bispectral.dye import read_dye

    check_material_target(output, excitation, emission, *material_files(substrate, library or []))
    dyed = read_dye(
        excitation,
        emission,
        quantum_yield,
        strength,
        units=units_of(units),
        substrate=substrate_of(substrate, library or []),
        name=output.stem,
        description=description,
        credit=credit,
    )
    write_made(output, dyed)
