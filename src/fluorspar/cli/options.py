"""Options that several commands read the same way."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from fluorspar.bispectral.library import ENVIRONMENT
from fluorspar.errors import OptionError, message

__all__ = ["LibraryOption", "material_files", "pairs", "size_of", "white_of"]

LibraryOption: TypeAlias = Annotated[
    list[Path] | None,
    typer.Option(
        "--library",
        metavar="DIR",
        help="A folder with materials of your own. May be repeated; the variable FLUORSPAR_MATERIALS does the same.",
    ),
]


def size_of(text: str | None) -> tuple[int, int] | None:
    """Read `WIDTHxHEIGHT`.

    Examples
    --------
    >>> size_of("640x480")
    (640, 480)
    """
    if text is None:
        return None
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise OptionError(
            message(
                "the size is not readable",
                where="--size",
                got=text,
                expected="WIDTHxHEIGHT in pixels, such as 512x512",
            )
        )
    return int(width), int(height)


def pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """Read `KEY=VALUE` texts.

    Examples
    --------
    >>> pairs(["left-wall=poster-red"], "--material")
    {'left-wall': 'poster-red'}
    """
    read = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not (key and separator and value):
            raise OptionError(
                message("an option is not readable", where=option, got=text, expected="KEY=VALUE")
            )
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
    found = []
    for name in filter(None, names):
        found += [
            Path(name),
            *(folder / f"{name}{suffix}" for folder in known for suffix in (".csv", ".bfc")),
        ]
    return found
