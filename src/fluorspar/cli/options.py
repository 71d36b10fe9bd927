"""Options that several commands have, and what is given as text, read: pairs, sizes, whites, limits, scenes."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from fluorspar.bispectral.files.registry import SUFFIXES
from fluorspar.bispectral.library import ENVIRONMENT
from fluorspar.errors import ImageError, OptionError, message
from fluorspar.image.formats.registry import SUFFIXES as IMAGES_READ
from fluorspar.image.formats.registry import SUFFIXES_WRITTEN as IMAGES_WRITTEN
from fluorspar.scene.settings_text import size_of

if TYPE_CHECKING:
    from fluorspar.scene.scene import Scene
    from fluorspar.staged.options import StagedOptions

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
    "exposure_of",
    "limits_of",
    "material_files",
    "pairs",
    "scene_named",
    "size_of",
    "staged_options",
    "white_of",
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
        help="Scene that the image shows, for points in the scene and angles. [default: the built-in it names]",
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


def exposure_of(
    text: str | None,
    outputs: Sequence[Path] = (Path("a.png"),),
    pictures: Path | None = None,
    *,
    white: Any = None,
    unit: str | None = None,
) -> float | str | None:
    """Read an exposure: "same", a factor in m2/cd, or the image whose picture, adapted to `white`, has it.

    `pictures` is a folder for pictures, `unit` that of the image that is shown, by default of radiance.

    Raises
    ------
    OptionError
        If it is none of these, or no output is a picture or a folder for pictures.
    ImageError
        If the image cannot be read, is dark, or has another unit.

    Examples
    --------
    >>> exposure_of("0.001"), exposure_of("same"), exposure_of(None)
    (0.001, 'same', None)
    """
    if text is None:
        return None
    if pictures is None and not any(path.suffix.lower() == ".png" for path in outputs):
        got = ", ".join(map(str, outputs))
        raise OptionError(message("only a picture has an exposure", where="--exposure", got=got))
    if text == "same":
        return text
    if Path(text).suffix.lower() in IMAGES_READ:
        from fluorspar.image.spectral_image import SpectralImage
        from fluorspar.image.units import UNITS, same_unit, unit_of

        with SpectralImage.open(text) as image:
            if not same_unit(there := unit_of(image.attrs), expected := unit or UNITS):
                fault = "the exposure is that of an image with another unit"
                raise ImageError(
                    message(fault, where=text, got=there, expected=expected, fix="give a factor")
                )
            shown = image.srgb(white=white)
        if not (shown > 0).any():
            fault, fix = (
                "the image shows no light, so its picture has no exposure",
                "give another, or a factor",
            )
            raise ImageError(message(fault, where=text, fix=fix))
        return float(shown.attrs["exposure"])
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 0 < factor < math.inf:
        expected = "same, a positive factor in m2/cd, or a spectral image"
        raise OptionError(
            message("the exposure is not readable", where="--exposure", got=text, expected=expected)
        )
    return factor


def pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """Read `KEY=VALUE` texts.

    Examples
    --------
    >>> pairs(["left-wall=poster-red"], "--material")
    {'left-wall': 'poster-red'}
    """
    read: dict[str, str] = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not (key and separator and value):
            raise OptionError(
                message("an option is not readable", where=option, got=text, expected="KEY=VALUE")
            )
        if key in read:
            got = f"{key}={read[key]} and {text}"
            raise OptionError(message("a key is given twice", where=option, got=got, fix="give it once"))
        read[key] = value
    return read


def white_of(text: str) -> str | tuple[float, ...]:
    """Read a white: the name of an illuminant, or `X,Y,Z`.

    Examples
    --------
    >>> white_of("109.85,100,35.58"), white_of("D50")
    ((109.85, 100.0, 35.58), 'D50')
    """
    if "," not in text:
        return text
    try:
        return tuple(float(number) for number in text.split(","))
    except ValueError as err:
        expected = "the name of an illuminant, or X,Y,Z"
        raise OptionError(
            message("a white is not readable", where="--white", got=text, expected=expected)
        ) from err


def material_files(text: str, folders: Sequence[Path]) -> list[Path]:
    """The files a material may be read from: itself, the parts of a mixture, files in the folders of the library.

    Examples
    --------
    >>> [path.as_posix() for path in material_files("mine", [Path("lib")])][:2]
    ['mine', 'lib/mine.csv']
    """
    names = [text, *(part.rpartition(":")[0].strip() for part in text.split(","))]
    known = [
        *folders,
        *(Path(folder) for folder in os.environ.get(ENVIRONMENT, "").split(os.pathsep) if folder),
    ]
    paths = []
    for name in filter(None, names):
        paths += [
            Path(name),
            *(folder / f"{name}{suffix}" for folder in known for suffix in SUFFIXES),
        ]
    return paths


def limits_of(texts: Sequence[str]) -> dict[str, float]:
    """Read the limits of `--fail-above`.

    Raises
    ------
    OptionError
        If a number is not known or named twice, or its limit is not a number of 0 or more.

    Examples
    --------
    >>> limits_of(["rmse=0.05"])
    {'rmse': 0.05}
    """
    from fluorspar.comparing.comparison import LIMITS

    option = "--fail-above"
    limits: dict[str, float] = {}
    for name, text in (pair for each in texts for pair in pairs([each], option).items()):
        if name not in LIMITS:
            raise OptionError(
                message("there is no such number", where=option, got=name, expected=", ".join(LIMITS))
            )
        if name in limits:
            raise OptionError(
                message("a number has two limits", where=f"{option} {name}", fix="give it once")
            )
        try:
            limits[name] = float(text)
        except ValueError as err:
            raise OptionError(message("a limit is not a number", where=f"{option} {name}", got=text)) from err
        if not 0 <= limits[name] < math.inf:
            expected = "a finite number of 0 or more: no number of a comparison is negative"
            raise OptionError(
                message("a limit is impossible", where=f"{option} {name}", got=text, expected=expected)
            )
    return limits


def scene_named(name: str | None, define: Sequence[str] | None = None) -> Scene | None:
    """Load a scene by its name or file.

    Parameters
    ----------
    name : str or None
    define : sequence of str, optional
        `KEY=VALUE` of the `$KEY` substitutions of its file.

    Raises
    ------
    OptionError
        If there are values and no scene.
    SceneError
        If the scene cannot be used.

    Examples
    --------
    >>> scene_named("cornell-box").name
    'cornell-box'
    """
    if name is None:
        if define:
            raise OptionError(
                message(
                    "values for a scene file are given without the scene",
                    where="-D",
                    got=", ".join(define),
                    fix="name the scene (--scene)",
                )
            )
        return None
    from fluorspar.scene.loading import load_scene

    return load_scene(name, parameters=pairs(define or [], "-D"))


def staged_options(method: str, **given: Any) -> StagedOptions | None:
    """Collect the options of the staged method that were given; None for another method.

    Raises
    ------
    OptionError
        If one is given for another method, or out of range.
    """
    options = {name: value for name, value in given.items() if value is not None}
    if method != "staged":
        if options:
            option = "--" + next(iter(options)).replace("_", "-").replace("mode", "emitter-mode")
            raise OptionError(
                message(
                    "an option of the staged method is given",
                    where=option,
                    fix="add --method staged, or leave it out",
                )
            )
        return None
    from fluorspar.staged.options import StagedOptions

    return StagedOptions(**options)
