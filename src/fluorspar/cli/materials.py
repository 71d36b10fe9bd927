"""`fluorspar materials`: the library of materials."""

from __future__ import annotations

import typer

from fluorspar.cli import console

__all__ = ["materials"]

materials = typer.Typer(
    help="The library of materials.\n\nExample:  fluorspar materials list",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@materials.callback()
def _materials() -> None:
    """The library of materials."""


@materials.command("list")
def list_materials() -> None:
    """List the materials with their colour under D65.

    Example:  fluorspar materials list
    """
    from rich.table import Table

    from fluorspar.spectral.colour import srgb_from_xyz, white_xyz, xyz_from_radiance
    from fluorspar.spectral.illuminants import illuminant
    from fluorspar.spectral.library import material
    from fluorspar.spectral.library import materials as names
    from fluorspar.spectral.wavelengths import Wavelengths

    grid = Wavelengths(300, 780, 5)
    light = illuminant("D65").on(grid)
    white = white_xyz(light, grid)[1]
    table = Table("", "name", "fluorescent", "description", box=None, pad_edge=False)
    for name in names():
        made = material(name)
        rgb, _ = srgb_from_xyz(xyz_from_radiance(made.on(grid).apply(light), grid), exposure=1 / white)
        red, green, blue = (round(255 * float(c)) for c in rgb)
        table.add_row(
            f"[on rgb({red},{green},{blue})]    [/]",
            name,
            "yes" if made.fluorescent else "no",
            made.description,
        )
    console.out.print(table)
