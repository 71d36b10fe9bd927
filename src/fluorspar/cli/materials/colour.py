"""`fluorspar materials colour`: a material under a lamp."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.given import material_files
from fluorspar.cli.materials.common import (
    MaterialArgument,
    PlotOption,
    hexadecimal,
    swatch,
    write_columns,
    write_plot,
)
from fluorspar.cli.options import ExcitationOption, LibraryOption
from fluorspar.cli.targets import check_plot
from fluorspar.errors import OptionError, message
from fluorspar.spectral.spectrum import SUFFIXES

if TYPE_CHECKING:
    from fluorspar.bispectral.lamp_colour import LampColour

__all__ = ["colour"]


def colour(
    name: MaterialArgument,
    illuminant: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE[:COLUMN]",
            help="D65, D50, A, FL11, LED-B1, ... "
            f"or a file with a spectrum ({', '.join(SUFFIXES)}). [default: D65]",
        ),
    ] = None,
    uv_cut: Annotated[
        float | None,
        typer.Option(
            metavar="NM", help="Put a filter before the lamp that blocks shorter wavelengths than this."
        ),
    ] = None,
    condition: Annotated[
        str | None,
        typer.Option(
            metavar="M0|M1|M2", help="Instead of an illuminant: measurement condition of ISO 13655."
        ),
    ] = None,
    observer: Annotated[
        str,
        typer.Option(
            metavar="2|10|2-2015|10-2015",
            help="Standard observer: CIE 1931 (2), CIE 1964 (10 degrees) or those of CIE 2015, or its full name.",
        ),
    ] = "2",
    wavelengths: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Wavelength grid in nm. [default: 300:780:5, with the step of the lamp's table if that is finer]",
        ),
    ] = None,
    plain_srgb: Annotated[
        bool,
        typer.Option(
            "--plain-srgb",
            help="sRGB of XYZ without adaptation to the lamp, and without fitting into the gamut.",
        ),
    ] = False,
    stokes_side: Annotated[
        bool,
        typer.Option(
            "--stokes-side",
            help="Leave out the cells of a measured matrix above its diagonal, which are noise.",
        ),
    ] = False,
    excitation: ExcitationOption = "full",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE.csv", help="Write the radiance factors to this table."),
    ] = None,
    plot: PlotOption = None,
    library: LibraryOption = None,
) -> None:
    """Compute the colour under a lamp. XYZ, CIELAB, sRGB, whiteness, the reflected and the luminescent part.

    Example:  fluorspar materials colour paper-whitened --uv-cut 400
    """
    from fluorspar.bispectral.lamp import WIDE
    from fluorspar.bispectral.lamp_colour import colour_under_condition, colour_under_lamp
    from fluorspar.bispectral.library import material
    from fluorspar.colour.observers import observer_named
    from fluorspar.files.writing import check_not_input, check_target
    from fluorspar.spectral.illuminants import illuminant as light_named
    from fluorspar.spectral.wavelengths import Wavelengths

    check_plot(plot)
    if output is not None:
        check_target(output)
        check_not_input(output, illuminant, *material_files(name, library or []))
    grid = Wavelengths.parse(wavelengths) if wavelengths else None
    seen_by = observer_named(observer, "--observer")
    sample = material(name, library or [])
    if stokes_side:
        sample = sample.stokes_side()
    if condition is None:
        lamp = light_named(illuminant or "D65")
        shown = colour_under_lamp(
            sample, lamp, uv_cut=uv_cut, observer=seen_by, wavelengths=grid, excitation=excitation
        )
    elif illuminant is None and uv_cut is None:
        shown = colour_under_condition(
            sample, condition, observer=seen_by, wavelengths=grid or WIDE, excitation=excitation
        )
    else:
        fault, fix = "a measurement condition has a lamp of its own", "leave --illuminant and --uv-cut out"
        raise OptionError(message(fault, where="--condition", got=condition, fix=fix))
    _print(shown, sample.name, plain_srgb)
    if output is not None:
        _write(shown, output)
    if plot is not None:
        from fluorspar.figures.materials import lamp_figure

        write_plot(lamp_figure(shown, sample.name), plot)


def _print(shown: LampColour, name: str, plain_srgb: bool) -> None:
    def line(label: str, text: str) -> None:
        console.out.print(f"  {label + ':':<18}{text}", markup=False, highlight=False)

    console.out.print(f"{swatch(shown.plain_srgb.clip(0, 1) if plain_srgb else shown.srgb)} ", end="")
    console.out.print(name, markup=False, highlight=False)
    line("light", shown.lamp)
    line("observer", shown.observer)
    for label, xyz, lab in (
        ("total", shown.xyz, shown.lab),
        ("reflected part", shown.xyz_reflected, shown.lab_reflected),
    ):
        line(label, f"XYZ {_three(xyz, 2)}   L*a*b* {_three(lab, 2)}")
    share = f"{100 * shown.luminescent_share:.1f} % of the luminance"
    line("luminescent part", f"XYZ {_three(shown.xyz_luminescent, 2)}   {share}")
    line("sRGB", _plain_in_words(shown) if plain_srgb else _srgb_in_words(shown))
    white = shown.whiteness
    if white.valid:
        line("CIE whiteness", f"{white.whiteness:.1f}, tint {white.tint:.1f}")
    else:
        line("CIE whiteness", f"not defined: {'; '.join(white.outside)}")


def _srgb_in_words(shown: LampColour) -> str:
    fits = "" if shown.in_gamut else ", dimmed or desaturated to fit into sRGB"
    return f"{hexadecimal(shown.srgb)}, eye adapted to the light{fits}"


def _plain_in_words(shown: LampColour) -> str:
    rgb = shown.plain_srgb
    numbers = " ".join(str(round(255 * float(value))) for value in rgb)
    cut = ", out of range: #... is clipped to 0-255" if rgb.min() < 0 or rgb.max() > 1 else ""
    return f"{hexadecimal(rgb.clip(0, 1))}, {numbers}, of XYZ as it is{cut}"


def _three(values: object, digits: int) -> str:
    import numpy as np

    return " ".join(f"{value:.{digits}f}" for value in np.asarray(values).round(digits) + 0.0)  # no "-0.00"


def _write(shown: LampColour, path: Path) -> None:
    """Write radiance factors as a table; empty cells where the lamp is dark."""
    columns = {
        "wavelength": shown.grid.values,
        "light": shown.light,
        "reflected": shown.reflected_factor,
        "luminescent": shown.luminescent_factor,
        "total": shown.radiance_factor,
    }
    write_columns(path, f"light: {shown.lamp}", columns)
