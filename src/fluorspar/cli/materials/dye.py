"""`fluorspar materials dye`: from the spectra of a dye to a material file."""

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
    from fluorspar.bispectral.files.material_csv import write_material
    from fluorspar.bispectral.lamp import WIDE
    from fluorspar.bispectral.library import material

    if units not in (None, "photon", "energy"):
        fault, expected = "there are no such units", "photon or energy"
        raise OptionError(message(fault, where="--units", got=units, expected=expected))
    check_material_target(output, excitation, emission, *material_files(substrate, library or []))
    try:
        base: float | str = float(substrate)
    except ValueError:
        base = substrate
    dyed = read_dye(
        excitation,
        emission,
        quantum_yield,
        strength,
        units=cast("Units | None", units),
        substrate=material(base, library or []) if isinstance(base, str) else base,
        name=output.stem,
        description=description,
        credit=credit,
    )
    dyed.on(WIDE)  # refuses what is impossible before it is written
    write_material(output, dyed)
    console.out.print(repr(dyed), markup=False, highlight=False)
    console.out.print(f"wrote {output}", markup=False, highlight=False)
