"""`fluorspar measure`: spectra at points of an image, as a spectroradiometer has them."""

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
from fluorspar.errors import OptionError, message
from fluorspar.figures.style import FORMATS
from fluorspar.files import tables
from fluorspar.image.formats.registry import SUFFIXES

__all__ = ["measure"]

_EXAMPLES = """Example:  fluorspar measure box.nc points.csv -o spectra.csv -o spectra.png --normalise 12

A points file is a table such as:

\b
  point,x,y
  1,18,90
  12,96,176

x and y are pixels, from the left and from the top; with a column z they are a position in the scene."""


def measure(
    image: Annotated[Path, typer.Argument(help=f"A spectral image ({', '.join(SUFFIXES)}).")],
    points: Annotated[
        Path,
        typer.Argument(
            help="CSV file with columns point, x, y (pixels) or point, x, y, z (scene); also white, note."
        ),
    ],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help=f"File to write: .csv, a row for each point and wavelength; or {', '.join(FORMATS)}, a panel for each "
            "point. May be repeated.",
        ),
    ] = None,
    scene: CameraOption = None,
    define: DefineOption = None,
    aperture: ApertureOption = None,
    bandwidth: Annotated[
        float, typer.Option(help="FWHM in nm of the instrument's triangular bands; 0: samples as they are.")
    ] = 0.0,
    normalise: Annotated[
        str,
        typer.Option(
            metavar="none|luminance|POINT",
            help="Divide all spectra by the mean of a POINT over 400-700 nm, or by the mean luminance.",
        ),
    ] = "none",
    component: Annotated[str | None, typer.Option(help=f"Measure only {A_COMPONENT}")] = None,
    observer: ObserverOption = "2",
) -> None:
    """Measure the spectra at points of an image, as a spectroradiometer does: means over an aperture, with errors."""
    from math import isfinite

    from rich.markup import escape
    from rich.table import Table

    from fluorspar.cli.given import scene_named
    from fluorspar.cli.targets import check_files
    from fluorspar.colour.observers import observer_named
    from fluorspar.figures.spectra import spectra_figure, write_figure
    from fluorspar.files.names import text_of
    from fluorspar.files.writing import check_not_input
    from fluorspar.image.units import is_unit_of_radiance
    from fluorspar.measuring.measure import measure as measure_spectra
    from fluorspar.measuring.normalised import normalised
    from fluorspar.measuring.point_spectra import write_point_spectra
    from fluorspar.measuring.points import read_points

    check_files(output or [], (".csv", *FORMATS))
    for path in output or []:
        check_not_input(path, image, points, scene)
    seen_by = observer_named(observer, "--observer")
    if points.suffix.lower() in SUFFIXES and image.suffix.lower() in tables.SUFFIXES:
        fault, fix = "the image and the points are in the wrong order", "fluorspar measure IMAGE POINTS"
        raise OptionError(message(fault, got=f"{text_of(image)} {text_of(points)}", fix=fix))
    read = read_points(points)
    measured = measure_spectra(
        image,
        read,
        scene=scene_named(scene, define),
        aperture=aperture,
        bandwidth=bandwidth,
        component=component,
    )
    spectra = normalised(measured, normalise)
    for path in output or []:
        if path.suffix.lower() == ".csv":
            write_point_spectra(spectra, path)
        else:
            write_figure(spectra_figure(spectra), path)
    absolute = is_unit_of_radiance(measured.unit)
    illuminances = measured.illuminance() if absolute else {}
    level = "luminance, cd/m2" if absolute else "luminance, relative"
    table = Table("point", level, "x", "y", "illuminance, lx", "note", box=None, pad_edge=False)
    for point, value, xy in zip(read, measured.luminance(), measured.chromaticity(seen_by), strict=True):
        lux = f"{illuminances[point.name]:.5g}" if point.name in illuminances else ""
        coordinates = (f"{c:.4f}" if isfinite(c) else "" for c in xy)
        table.add_row(escape(point.name), f"{value:.5g}", *coordinates, lux, escape(point.note))
    console.out.print(table)
    for note in measured.notes:
        console.out.print(note, markup=False, highlight=False)
    for path in output or []:
        console.out.print(f"wrote {text_of(path)}", markup=False, highlight=False)


measure.__doc__ = f"{measure.__doc__}\n\n{_EXAMPLES}"
