"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from fluorspar.image.formats.registry import SUFFIXES_WRITTEN as IMAGES_WRITTEN

__all__ = [
    "A_COMPONENT",
    "ApertureOption",
    "CameraOption",
    "ComponentErrorsOption",
    "DefineOption",
    "DenoiseOption",
    "ExcitationOption",
    "ExposureOption",
    "ImagesOption",
    "LibraryOption",
    "ObserverOption",
    "PicturesOption",
    "ResumeOption",
    "StokesOption",
    "ThreadsOption",
]

A_COMPONENT = (
    "a component ('fluorspar info' lists them); single_bounce, reflected or luminescent; or a sum: A+B."
)

ResumeOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Continue an interrupted run of the same command. Begins anew if there is none; does nothing "
        "if the file is complete.",
    ),
]
LibraryOption: TypeAlias = Annotated[
    list[Path] | None,
    typer.Option(
        "--library",
        metavar="DIR",
        help="A folder with materials of your own. May be repeated; the environment variable "
        "FLUORSPAR_MATERIALS does the same.",
    ),
]

ObserverOption: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="2|10|2-2015|10-2015",
        help="Standard observer of colours: CIE 1931 (2), CIE 1964 (10 degrees) or those of CIE 2015, or its full "
        "name. Luminance is always that of CIE 1931.",
    ),
]

ExcitationOption: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="full|grid",
        help="Which light excites. full: also that of shorter wavelengths than the grid's, as far down as lamps and "
        "materials reach; grid: only that of the grid.",
    ),
]

ApertureOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="DIAMETER",
        help="Diameter of the area that is measured around a point, such as 0.125deg or 3px. "
        "[default: 0.125deg if the scene is known, else 1px]",
    ),
]

CameraOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--scene",
        help="Scene that the image shows; needed for positions in it and for an aperture in degrees. [default: the "
        "built-in scene that the image names]",
    ),
]

DefineOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "-D",
        metavar="KEY=VALUE",
        help="Value of a $KEY in the scene file, as at the render. May be repeated.",
    ),
]

ImagesOption: TypeAlias = Annotated[
    list[Path],
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help=f"File to write; the suffix picks the format: {', '.join(IMAGES_WRITTEN)}. May be repeated.",
    ),
]

StokesOption: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="half|strict",
        help="Whether light excites emission of its own wavelength. half: with half the weight; strict: not at all.",
    ),
]

ComponentErrorsOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--component-errors", help="Compute a standard error for each component too, not only for the total."
    ),
]

DenoiseOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--denoise",
        help="Denoise the image. Needs 'pip install \"fluorspar[denoise]\"'; see 'fluorspar denoise'.",
    ),
]

PicturesOption: TypeAlias = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Also write a PNG of every component into this folder.")
]

ThreadsOption: TypeAlias = Annotated[
    int | None, typer.Option(help="Processor threads to use. [default: one for each core]")
]


ExposureOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="same|FACTOR|IMAGE",
        help="One exposure for all pictures. FACTOR: in m2/cd; IMAGE: that of the picture of this spectral image, so "
        "that two can be compared; same: that of the total, for components too. [default: each its own]",
    ),
]
