"""What lights and materials of light paths become, given as text: one setting each, or lists of them for a sheet."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar

import typer

from fluorspar.cli.given import material_files, pairs
from fluorspar.errors import OptionError, message
from fluorspar.files.names import file_and_column
from fluorspar.scene.settings_text import light_of

__all__ = [
    "GridOption",
    "LightOption",
    "PathsArgument",
    "SameLuminanceOption",
    "TracedExcitationOption",
    "concentration_of",
    "files_named",
    "light_of",
    "listed",
    "settings",
    "split_lights",
    "split_materials",
    "split_numbers",
]

Setting = TypeVar("Setting")

PathsArgument: TypeAlias = Annotated[
    Path, typer.Argument(metavar="PATHS", help="A file of light paths, written by 'fluorspar trace'.")
]

LightOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ID=NAME|FILE|FACTOR",
        help="Give a light another spectrum (an illuminant or a file), multiply it, or both: ID=NAMExFACTOR, such as "
        "lamp=FL11x0.5. ID is that of the light or of its shape. An illuminant gets the luminance of the light it "
        "replaces. "
        "May be repeated.",
    ),
]

SameLuminanceOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--same-luminance",
        help="Scale lamps from files to the luminance of the light that they replace, as illuminants always are.",
    ),
]

GridOption: TypeAlias = Annotated[
    str | None,
    typer.Option(metavar="START:STOP:STEP", help="Wavelength grid in nm. [default: as traced]"),
]

TracedExcitationOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="full|grid",
        help="Which light excites. full: also that of shorter wavelengths than the grid's, as far down as lamps and "
        "materials reach; grid: only that of the grid. [default: as traced]",
    ),
]

_SHARE = re.compile(r":\s*(?P<weight>[0-9.eE+-]+)$")
_WHOLE = 1e-3  # weights of a mixture add up to 1 within this


def concentration_of(text: str) -> float:
    """Read a factor on luminescence.

    Examples
    --------
    >>> concentration_of("0.5")
    0.5
    """
    try:
        return float(text)
    except ValueError as err:
        expected = "a number of 0 or more; 1 is as it is"
        raise OptionError(
            message("a concentration is not a number", where="--concentration", got=text, expected=expected)
        ) from err


def settings(texts: Sequence[str] | None, option: str, read: Callable[[str], Setting]) -> dict[str, Setting]:
    """Read `ID=SETTING` texts.

    Raises
    ------
    OptionError
        If one is not readable, or an id is given twice.

    Examples
    --------
    >>> settings(["lamp=FL11"], "--light", light_of)
    {'lamp': 'FL11'}
    """
    return {key: read(value) for key, value in pairs(texts or [], option).items()}


def listed(
    texts: Sequence[str] | None,
    option: str,
    split: Callable[[str], Sequence[str]],
    read: Callable[[str], Setting],
) -> dict[str, list[Setting]]:
    """Read `ID=SETTING,SETTING,...` texts; those of the same id are one list.

    Raises
    ------
    OptionError
        If one is not readable.

    Examples
    --------
    >>> listed(["lamp=D65,0.5", "lamp=A"], "--light", split_lights, light_of)
    {'lamp': ['D65', 0.5, 'A']}
    """
    lists: dict[str, list[Setting]] = {}
    for text in texts or []:
        for key, value in pairs([text], option).items():
            parts = split(value)
            if not all(parts):
                fault, expected = "a list has an empty place", "ID=SETTING,SETTING,..."
                raise OptionError(message(fault, where=option, got=text, expected=expected))
            lists.setdefault(key, []).extend(map(read, parts))
    return lists


def split_numbers(text: str) -> list[str]:
    """Split a list at its commas."""
    return [part.strip() for part in text.split(",")]


def split_lights(text: str) -> list[str]:
    """Split a list of lights at its commas; a file whose name holds some is one light.

    Examples
    --------
    >>> split_lights("D65,A,mylamp.csv")
    ['D65', 'A', 'mylamp.csv']
    """
    return [text] if os.path.isfile(file_and_column(text)[0]) else split_numbers(text)


def split_materials(text: str) -> list[str]:
    """Split a list of materials; parts with a weight are a mixture, up to the one with which they add up to 1.

    Examples
    --------
    >>> split_materials("poster-red,a:0.3,b:0.7,c:0.5,d:0.5,poster-green")
    ['poster-red', 'a:0.3,b:0.7', 'c:0.5,d:0.5', 'poster-green']
    """
    if os.path.isfile(text):
        return [text]
    found: list[str] = []
    mixture: list[str] = []
    whole = 0.0
    for part in split_numbers(text):
        share = None if os.path.isfile(part) else _SHARE.search(part)
        if share is None or abs(whole - 1) <= _WHOLE:
            found += [",".join(mixture)] if mixture else []
            mixture, whole = [], 0.0
        if share is None:
            found.append(part)
            continue
        mixture.append(part)
        with suppress(ValueError):  # said where the mixture is made
            whole += float(share["weight"])
    return [*found, ",".join(mixture)] if mixture else found


def files_named(
    lights: Mapping[str, Any], materials: Mapping[str, Any], library: Sequence[Path]
) -> Iterator[Path]:
    """Go through the files that lights and materials, or lists of them, may be read from.

    Examples
    --------
    >>> [path.name for path in files_named({"lamp": ["mine.csv", 0.5]}, {}, [])]
    ['mine.csv']
    """
    for setting in _flat(lights.values()):
        if isinstance(setting, str):
            yield file_and_column(setting)[0]
    for setting in _flat(materials.values()):
        yield from material_files(setting, library)


def _flat(values: Any) -> Iterator[Any]:
    for value in values:
        if isinstance(value, list | tuple):
            yield from _flat(value)
        else:
            yield value
