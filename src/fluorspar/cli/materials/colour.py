"""`fluorspar materials colour`: a material under a lamp."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.materials.common import (
    MaterialArgument,
    PlotOption,
    hexadecimal,
    swatch,
    write_columns,
    write_plot,
)
from fluorspar.cli.options import LibraryOption, material_files
from fluorspar.cli.targets import check_plot
from fluorspar.errors import OptionError, message

if TYPE_CHECKING:
    from fluorspar.bispectral.lamp_colour import LampColour
    from fluorspar.spectral.spectrum import Spectrum

__all__ = ["colour"]


def colour(
    name: MaterialArgument,
    illuminant: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="D65, D50, A, FL11, LED-B1, ... or a file with a spectrum (.csv, .spd, .txt). [default: D65]",
        ),
    ] = None,
    uv_cut: Annotated[
        float | None, typer.Option(metavar="NM", help="Filter out what is below this wavelength.")
    ] = None,
    condition: Annotated[
        str | None,
        typer.Option(
            metavar="M0|M1|M2", help="Measured and calculated as ISO 13655 says, instead of an illuminant."
        ),
    ] = None,
    observer: Annotated[str, typer.Option(metavar="2|10", help="Standard observer, degrees.")] = "2",
    wavelengths: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Wavelength grid in nm. [default: 300:780:5, or as fine as the lamp]",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE.csv", help="Write the radiance factors to this file."),
    ] = None,
    plot: PlotOption = None,
    library: LibraryOption = None,
) -> None:
    """Say the colour under a lamp. XYZ, CIELAB, sRGB, whiteness, what is reflected and what luminesces.

    Example:  fluorspar materials colour paper-whitened --uv-cut 400
    """
    from fluorspar.bispectral.lamp import WIDE
    from fluorspar.bispectral.lamp_colour import colour_under_condition, colour_under_lamp
    from fluorspar.bispectral.library import material
    from fluorspar.files.writing import check_not_input, check_target
    from fluorspar.spectral.wavelengths import Wavelengths

    check_plot(plot)
    if output is not None:
        check_target(output)
        check_not_input(output, illuminant, *material_files(name, library or []))
    grid, seen_by = Wavelengths.parse(wavelengths) if wavelengths else None, _observer(observer)
    made = material(name, library or [])
    if condition is None:
        lamp = _lamp(illuminant or "D65")
        found = colour_under_lamp(made, lamp, uv_cut=uv_cut, observer=seen_by, wavelengths=grid)
    elif illuminant is None and uv_cut is None:
        found = colour_under_condition(made, condition, observer=seen_by, wavelengths=grid or WIDE)
    else:
        fault, fix = "a measurement condition has a lamp of its own", "leave --illuminant and --uv-cut out"
        raise OptionError(message(fault, where="--condition", got=condition, fix=fix))
    _print(found, made.name)
    if output is not None:
        _write(found, output)
        console.out.print(f"wrote {output}", markup=False, highlight=False)
    if plot is not None:
        from fluorspar.figures.materials import lamp_figure

        write_plot(lamp_figure(found, made.name), plot)
        console.out.print(f"wrote {plot}", markup=False, highlight=False)


def _lamp(text: str) -> str | Spectrum:
    from fluorspar.spectral.spectrum import read_spectrum

    return read_spectrum(text) if Path(text).suffix.lower() in (".csv", ".spd", ".txt") else text


def _observer(text: str) -> str:
    from fluorspar.colour.whiteness import CIE_1964
    from fluorspar.colour.xyz import CIE_1931

    names = {"2": CIE_1931, "10": CIE_1964}
    if text not in names:
        raise OptionError(
            message("there is no such observer", where="--observer", got=text, expected="2 or 10")
        )
    return names[text]


def _print(found: LampColour, name: str) -> None:
    def line(label: str, text: str) -> None:
        console.out.print(f"  {label + ':':<18}{text}", markup=False, highlight=False)

    console.out.print(f"{swatch(found.srgb)} ", end="")
    console.out.print(name, markup=False, highlight=False)
    line("light", found.lamp)
    line("observer", found.observer)
    for label, xyz, lab in (
        ("total", found.xyz, found.lab),
        ("reflected part", found.xyz_reflected, found.lab_reflected),
    ):
        line(label, f"XYZ {_three(xyz, 2)}   L*a*b* {_three(lab, 2)}")
    share = f"{100 * found.luminescent_share:.1f} % of the luminance"
    line("luminescent part", f"XYZ {_three(found.xyz_luminescent, 2)}   {share}")
    fits = "" if found.in_gamut else ", dimmed or desaturated to fit into sRGB"
    line("sRGB", f"{hexadecimal(found.srgb)}, eye adapted to the light{fits}")
    white = found.whiteness
    if white.valid:
        line("CIE whiteness", f"{white.whiteness:.1f}, tint {white.tint:.1f}")
    else:
        line("CIE whiteness", f"not defined: {'; '.join(white.outside)}")


def _three(values: object, digits: int) -> str:
    import numpy as np

    return " ".join(f"{value:.{digits}f}" for value in np.asarray(values).round(digits) + 0.0)  # no "-0.00"


def _write(found: LampColour, path: Path) -> None:
    """Write radiance factors as a table; empty cells where the lamp is dark."""
    columns = {
        "wavelength": found.grid.values,
        "light": found.light,
        "reflected": found.reflected_factor,
        "luminescent": found.luminescent_factor,
        "total": found.radiance_factor,
    }
    write_columns(path, f"light: {found.lamp}", columns)
