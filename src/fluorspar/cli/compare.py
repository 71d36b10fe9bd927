"""`fluorspar compare`: two images, two tables of measured spectra, or an image with a table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.options import (
    A_COMPONENT,
    ApertureOption,
    CameraOption,
    DefineOption,
    ObserverOption,
)
from fluorspar.figures.style import FORMATS
from fluorspar.files import tables
from fluorspar.image.formats.registry import SUFFIXES

__all__ = ["compare"]

EXCEEDED = 1

_WRITTEN = (".json", ".html", *FORMATS)

_EXAMPLES = """Examples:

  fluorspar compare paths.nc staged.nc --component single_bounce -o report.html

  fluorspar compare measured.csv render.nc --points points.csv --match 12 -o report.html -o numbers.json

  fluorspar compare reference.nc new.nc --fail-above rmse=0.05 --fail-above de00=1

The exit code is 1 if a limit is exceeded, 2 after an error."""


def compare(
    a: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help=f"The reference: an image ({', '.join(SUFFIXES)}) or a table of spectra "
            f"({', '.join(tables.SUFFIXES)}).",
        ),
    ],
    b: Annotated[str, typer.Argument(metavar="B", help="What is compared with it, of either kind.")],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help=f"File to write: {', '.join(_WRITTEN)}. May be repeated."
        ),
    ] = None,
    points: Annotated[
        Path | None,
        typer.Option(
            help="CSV file with columns point, x, y (pixels) or point, x, y, z (scene), as for 'fluorspar measure'."
        ),
    ] = None,
    match: Annotated[
        str,
        typer.Option(
            metavar="none|luminance|POINT",
            help="How the scale of B is matched to that of A: not at all; by the mean luminance; or at a POINT, where "
            "each side is divided by its own mean (Eq. 14).",
        ),
    ] = "none",
    white: Annotated[
        str | None,
        typer.Option(
            metavar="POINT|ILLUMINANT",
            help="White of CIELAB, for both sides. [default: the point of --match, else D65]",
        ),
    ] = None,
    observer: ObserverOption = "2",
    wavelengths: Annotated[
        str | None,
        typer.Option(
            metavar="START:STOP:STEP",
            help="Grid in nm, within the data of both. [default: the coarser grid of both]",
        ),
    ] = None,
    bandwidth_a: Annotated[
        float | None,
        typer.Option(help="FWHM in nm of the bands of A; 0: samples. [default: what the file says]"),
    ] = None,
    bandwidth_b: Annotated[
        float | None,
        typer.Option(help="FWHM in nm of the bands of B; 0: samples. [default: what the file says]"),
    ] = None,
    aperture: ApertureOption = None,
    scene: CameraOption = None,
    define: DefineOption = None,
    component: Annotated[
        str | None,
        typer.Option(
            help=f"Of images, compare only {A_COMPONENT} "
            "[default: all, or single_bounce if only one image holds reexcitation]"
        ),
    ] = None,
    adapt: Annotated[
        bool,
        typer.Option(
            "--adapt", help="Show the white of CIELAB as white in the pictures, by Bradford adaptation."
        ),
    ] = False,
    fail_above: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NUMBER=LIMIT",
            help="Exit with 1 above a limit: rmse (mean over points or pixels), rmse_eq14 (one root over all points), "
            "rmse_max, de00 (mean CIEDE2000), de00_max, bias, noise_z (greatest deviation in standard errors). May be "
            "repeated.",
        ),
    ] = None,
) -> None:
    """Compare the spectra of two images or tables: RMSE (Eq. 14), CIEDE2000, bias, and how much of it is noise."""
    from fluorspar.cli.given import limits_of, scene_named
    from fluorspar.cli.targets import check_files
    from fluorspar.colour.observers import observer_named
    from fluorspar.comparing.compare import compare as compare_spectra
    from fluorspar.errors import OptionError
    from fluorspar.figures.report import write_report
    from fluorspar.figures.spectra import comparison_figure, write_figure
    from fluorspar.files.names import text_of
    from fluorspar.files.writing import check_not_input

    outputs = output or []
    check_files(outputs, _WRITTEN)
    for path in outputs:
        check_not_input(path, a, b, points, scene)
    limits = limits_of(fail_above or [])
    seen_by = observer_named(observer, "--observer")
    with console.err.status("comparing"):
        comparison = compare_spectra(
            a,
            b,
            points=points,
            match=match,
            white=white,
            observer=seen_by,
            wavelengths=wavelengths,
            bandwidth_a=bandwidth_a,
            bandwidth_b=bandwidth_b,
            aperture=aperture,
            scene=scene_named(scene, define),
            component=component,
            adapt=adapt,
        )
    try:
        values = {name: comparison.value(name) for name in limits}
    except OptionError:
        console.out.print(comparison.text(), markup=False, highlight=False)
        raise
    for path in outputs:
        with console.err.status(f"writing {text_of(path)}"):
            if path.suffix.lower() == ".json":
                comparison.save_json(path)
            elif path.suffix.lower() == ".html":
                write_report(comparison, path)
            else:
                write_figure(comparison_figure(comparison), path)
    console.out.print(comparison.text(), markup=False, highlight=False)
    for path in outputs:
        console.out.print(f"wrote {text_of(path)}", markup=False, highlight=False)
    exceeded = {name: value for name, value in values.items() if not value <= limits[name]}
    for name, value in exceeded.items():
        console.err.print(f"{name} is {value:.5g}, above {limits[name]:g}", markup=False, highlight=False)
    if exceeded:
        raise typer.Exit(EXCEEDED)


compare.__doc__ = f"{compare.__doc__}\n\n{_EXAMPLES}"
