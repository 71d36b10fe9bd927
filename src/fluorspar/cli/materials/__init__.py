"""`fluorspar materials`: the library of materials, measured matrices, fits, dyes, and colours under lamps."""

from __future__ import annotations

import typer

from fluorspar.cli.materials.colour import colour
from fluorspar.cli.materials.dye import dye
from fluorspar.cli.materials.export import export
from fluorspar.cli.materials.fit import fit
from fluorspar.cli.materials.from_eem import from_eem
from fluorspar.cli.materials.inspect import inspect
from fluorspar.cli.materials.list import list_materials
from fluorspar.cli.materials.show import show

__all__ = ["materials"]

materials = typer.Typer(
    help="List, inspect, fit and export materials, and compute their colours under lamps.\n\n"
    "Example:  fluorspar materials list\n\n"
    "Example:  fluorspar materials colour poster-red --illuminant A",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@materials.callback()
def _materials() -> None:
    """List, inspect, fit and export materials, and compute their colours under lamps."""


materials.command("list")(list_materials)
materials.command("show")(show)
materials.command("inspect")(inspect)
materials.command("export")(export)
materials.command("fit")(fit)
materials.command("dye", short_help="Make a material of a dye of known spectra.")(dye)
materials.command("from-eem")(from_eem)
materials.command("colour")(colour)
