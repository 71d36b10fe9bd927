"""What the commands on materials share: options, swatches, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias, cast

import typer
from numpy.typing import ArrayLike

from fluorspar.bispectral.files.registry import SUFFIXES
from fluorspar.cli import console
from fluorspar.errors import OptionError, message
from fluorspar.figures.style import FORMATS, write_figure
from fluorspar.files.writing import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fluorspar.bispectral.dye import Units
    from fluorspar.bispectral.material import Material

__all__ = [
    "MaterialArgument",
    "PlotOption",
    "hexadecimal",
    "substrate_of",
    "swatch",
    "units_of",
    "write_columns",
    "write_made",
    "write_plot",
]

MaterialArgument: TypeAlias = Annotated[
    str,
    typer.Argument(
        metavar="NAME|FILE",
        help=f"A material of the library, a file ({', '.join(SUFFIXES)}), or a mixture such as A:0.3,B:0.7.",
    ),
]
PlotOption: TypeAlias = Annotated[
    Path | None, typer.Option(metavar="FILE", help=f"Draw a figure into this file ({', '.join(FORMATS)}).")
]


def swatch(rgb: ArrayLike) -> str:
    """Return rich markup for a patch of a colour, sRGB from 0 to 1.

    Examples
    --------
    >>> swatch([1, 0, 0])
    '[on rgb(255,0,0)]    [/]'
    """
    red, green, blue = _bytes(rgb)
    return f"[on rgb({red},{green},{blue})]    [/]"


def hexadecimal(rgb: ArrayLike) -> str:
    """Return an sRGB colour as web pages write it.

    Examples
    --------
    >>> hexadecimal([1, 0.5, 0])
    '#ff8000'
    """
    return "#" + "".join(f"{value:02x}" for value in _bytes(rgb))


def _bytes(rgb: ArrayLike) -> list[int]:
    import numpy as np

    return [round(255 * float(value)) for value in np.asarray(rgb)]


def write_columns(path: Path, about: str, columns: Mapping[str, ArrayLike]) -> None:
    """Write a table with a comment line above it, and say so; cells that are NaN stay empty.

    Raises
    ------
    ImageError
        If the file cannot be written; what was there before then stays.
    """
    import numpy as np

    lines = [f"# {about}", ",".join(columns)]
    for row in zip(*map(np.asarray, columns.values()), strict=True):
        lines.append(",".join("" if np.isnan(value) else f"{value:.6g}" for value in row))
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    console.out.print(f"wrote {path}", markup=False, highlight=False)


def write_plot(figure: Figure, path: Path) -> None:
    """Write a figure, and say so; what was there before stays if that fails.

    Raises
    ------
    ImageError
        If the file cannot be written.
    """
    write_figure(figure, path)
    console.out.print(f"wrote {path}", markup=False, highlight=False)


def units_of(text: str | None) -> Units | None:
    """Check what `--units` says.

    Examples
    --------
    >>> units_of("photon")
    'photon'
    """
    if text not in (None, "photon", "energy"):
        fault, expected = "there are no such units", "photon or energy"
        raise OptionError(message(fault, where="--units", got=text, expected=expected))
    return cast("Units | None", text)


def substrate_of(text: str, library: Sequence[Path]) -> float | Material:
    """What `--substrate` is: a reflectance, or a material by its name or file.

    Examples
    --------
    >>> substrate_of("0.85", [])
    0.85
    """
    from fluorspar.bispectral.library import material

    try:
        return float(text)
    except ValueError:
        return material(text, library)


def write_made(path: Path, made: Material) -> None:
    """Write a material that was made of spectra, and describe it."""
    from fluorspar.bispectral.files.material_csv import write_material
    from fluorspar.bispectral.lamp import WIDE

    made.on(WIDE)  # refuses what is impossible before it is written
    write_material(path, made)
    console.out.print(repr(made), markup=False, highlight=False)
    console.out.print(f"wrote {path}", markup=False, highlight=False)
