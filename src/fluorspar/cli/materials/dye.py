"""`fluorspar materials dye`: from the spectra of a dye to a material file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli.given import material_files
from fluorspar.cli.materials.common import substrate_of, units_of, write_made
from fluorspar.cli.options import LibraryOption
from fluorspar.cli.targets import check_material_target

__all__ = ["dye"]


def dye(
    excitation: Annotated[
        Path,
        typer.Argument(
            metavar="EXCITATION", help="Table: wavelength in nm, relative excitation (or absorption)."
        ),
    ],
    emission: Annotated[
        Path,
        typer.Argument(
            metavar="EMISSION", help="Table: wavelength in nm, relative emission. May be the same file."
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.csv", help="Material file to write.")
    ],
    quantum_yield: Annotated[float, typer.Option(metavar="0-1", help="Photons emitted per photon absorbed.")],
    strength: Annotated[
        float,
        typer.Option(
            metavar="0-1", help="Share of the light that the dye absorbs at the peak of the excitation."
        ),
    ],
    units: Annotated[
        str | None,
        typer.Option(
            metavar="photon|energy",
            help="What the spectra count. Needed for files without a line '# units: ...'.",
        ),
    ] = None,
    substrate: Annotated[
        str,
        typer.Option(metavar="NAME|FILE|NUMBER", help="What is dyed: a material, or a reflectance, 0 to 1."),
    ] = "0.85",
    description: Annotated[str, typer.Option(help="What the material is, for its file.")] = "",
    credit: Annotated[str, typer.Option(help="Who measured it, for its file.")] = "",
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
