"""`fluorspar materials list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.materials.common import swatch
from fluorspar.cli.options import LibraryOption

if TYPE_CHECKING:
    from fluorspar.bispectral.material import Material

__all__ = ["list_materials"]


def list_materials(
    credit: Annotated[bool, typer.Option("--credit", help="Also say whose measurement each one is.")] = False,
    library: LibraryOption = None,
) -> None:
    """List the materials. Colour under D65, name, peaks of excitation and emission in nm; files that cannot be read.

    Example:  fluorspar materials list --library ~/paints
    """
    import warnings

    from rich.table import Table
    from rich.text import Text

    from fluorspar.bispectral.lamp_colour import colour_under_lamp
    from fluorspar.bispectral.library import material, materials
    from fluorspar.errors import FluorsparError, FluorsparWarning

    folders = library or []
    unread: list[str] = []
    table = Table("", "name", "fluoresces, nm", "description", box=None, pad_edge=False)
    for name in materials(folders):
        try:
            listed = material(name, folders)
            with warnings.catch_warnings():  # `show` says what is assumed and adjusted; a list has no room
                warnings.simplefilter("ignore", FluorsparWarning)
                rgb = colour_under_lamp(listed, "D65").srgb
        except FluorsparError as err:  # one file that is no material must not hide the others
            fault, *rest = str(err).splitlines()
            where = next(
                (line.partition(":")[2].strip() for line in rest if line.strip().startswith("where:")), ""
            )
            unread.append(f"not listed: {name}: {fault}" + f" ({where})" * bool(where))
            continue
        words = "\n".join(part for part in (listed.description, listed.credit if credit else "") if part)
        table.add_row(swatch(rgb), Text(name), _peaks(listed), Text(words))
    console.out.print(table)
    for line in unread:
        console.err.print(line, markup=False, highlight=False, soft_wrap=True)


def _peaks(listed: Material) -> str:
    """Excitation and emission peak of the strongest fluorophore, or of a measured matrix."""
    if not listed.fluorescent:
        return ""
    if (matrix := listed.matrix) is not None:
        i, j = divmod(int(matrix.density.argmax()), matrix.density.shape[1])
        return f"{matrix.excitation[j]:.0f} → {matrix.emission[i]:.0f}"
    if not listed.fluorophores:
        return "yes"
    dye = max(listed.fluorophores, key=lambda one: one.emission.integral())
    return f"{dye.excitation.peak:.0f} → {dye.emission.peak:.0f}"
