"""`fluorspar sheet`: combinations of lights and materials side by side."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.changes import (
    GridOption,
    PathsArgument,
    SameLuminanceOption,
    concentration_of,
    files_named,
    light_of,
    listed,
    split_lights,
    split_materials,
    split_numbers,
)
from fluorspar.cli.options import (
    ApertureOption,
    CameraOption,
    DefineOption,
    DenoiseOption,
    LibraryOption,
    ThreadsOption,
)
from fluorspar.errors import OptionError, message

__all__ = ["sheet"]

_WRITTEN = (".png", ".csv")

_EXAMPLES = """Examples:

  fluorspar sheet box.paths --light light=D65,A,mylamp.csv --material left-wall=poster-red,poster-orange -o sheet.png

  fluorspar sheet box.paths --light light=D65,FL11x0.5 --concentration left-wall=0,0.5,1 --points p.csv -o table.csv

A mixture is one entry of a list: left-wall=poster-red,poster-red:0.3,poster-green:0.7 are two materials, the second a
mixture. An option that is repeated for the same id adds to its list."""


def sheet(
    paths: PathsArgument,
    output: Annotated[
        list[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write: .png, the pictures; .csv, a table of XYZ in cd/m2, L*a*b*, CIEDE2000 from the first "
            "combination, and the luminescent share of the luminance. May be repeated.",
        ),
    ],
    light: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID=A,B,...",
            help="Lights to combine, by the id of the light: names, files, factors, or NAMExFACTOR, such as "
            "lamp=D65,A,lamp.csv,0.5,FL11x2. "
            "May be repeated.",
        ),
    ] = None,
    material: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID=A,B,...",
            help="Materials to combine, by the id of the shape or BSDF: names, files, or mixtures X:0.3,Y:0.7. May be "
            "repeated.",
        ),
    ] = None,
    concentration: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID=A,B,...",
            help="Factors on the luminescence of a surface to combine; 0: none. May be repeated.",
        ),
    ] = None,
    same_luminance: SameLuminanceOption = False,
    library: LibraryOption = None,
    points: Annotated[
        Path | None,
        typer.Option(
            help="Measure at these points: CSV file with columns point, x, y (pixels) or point, x, y, z (scene). "
            "[default: the whole picture]"
        ),
    ] = None,
    scene: CameraOption = None,
    define: DefineOption = None,
    aperture: ApertureOption = None,
    white: Annotated[
        str | None,
        typer.Option(
            metavar="POINT|ILLUMINANT",
            help="White of CIELAB, for all combinations: a point of the first one, or an illuminant. [default: D65]",
        ),
    ] = None,
    exposure: Annotated[
        str,
        typer.Option(
            metavar="same|each|FACTOR",
            help="same: one exposure for all pictures; each: every picture has its own; or a factor in m2/cd.",
        ),
    ] = "same",
    wavelengths: GridOption = None,
    denoise: DenoiseOption = False,
    threads: ThreadsOption = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Compute more than 64 combinations without asking.")
    ] = False,
) -> None:
    """Show and measure all combinations of lights, materials and concentrations of kept light paths."""
    from fluorspar.cli.given import scene_named
    from fluorspar.cli.targets import check_files
    from fluorspar.paths.light_paths import load_paths
    from fluorspar.sheets.combinations import axes_of, count_combinations
    from fluorspar.sheets.sheet import MOST
    from fluorspar.sheets.sheet import sheet as make_sheet
    from fluorspar.sheets.sheet_picture import write_sheet_picture
    from fluorspar.sheets.sheet_table import write_sheet_table

    lights = listed(light, "--light", split_lights, light_of)
    materials = listed(material, "--material", split_materials, str)
    concentrations = listed(concentration, "--concentration", split_numbers, concentration_of)
    named = files_named(lights, materials, library or [])
    check_files(output, _WRITTEN, (paths, points, scene, *named))
    count = count_combinations(axes_of(lights, materials, concentrations))
    kept = load_paths(paths)
    if count > MOST and not yes and sys.stdin.isatty():
        typer.confirm(f"Compute {count} combinations?", abort=True, err=True)
        yes = True
    with console.progress_bar(f"{count} combinations") as progress:
        found = make_sheet(
            kept,
            lights=lights,
            materials=materials,
            concentration=concentrations,
            same_luminance=same_luminance,
            library=library or [],
            points=points,
            scene=scene_named(scene, define),
            aperture=aperture,
            white=white,
            exposure=_exposure_of(exposure),
            wavelengths=wavelengths,
            denoise=denoise,
            threads=threads,
            most=count if yes else MOST,
            progress=progress,
        )
    said = found.attrs
    if denoise:
        console.out.print(f"denoised: {said['denoised']}", markup=False, highlight=False)
    facts = (
        f"{count} combinations on {said['wavelengths']}; measured: {said['measured']}; white: {said['white']}"
    )
    console.out.print(facts, markup=False, highlight=False)
    for path in output:
        if path.suffix.lower() == ".csv":
            write_sheet_table(found, path)
        else:
            write_sheet_picture(found, path)
        console.out.print(f"wrote {path}", markup=False, highlight=False)


def _exposure_of(text: str) -> str | float:
    try:
        return text if text in ("same", "each") else float(text)
    except ValueError as err:
        expected = "same, each, or a factor on luminance in m2/cd"
        raise OptionError(
            message("the exposure is not readable", where="--exposure", got=text, expected=expected)
        ) from err


sheet.__doc__ = f"{sheet.__doc__}\n\n{_EXAMPLES}"
