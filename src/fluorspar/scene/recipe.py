"""What a scene was loaded from: plain values, from which another process can read it again."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.errors import OptionError, SceneError, message
from fluorspar.scene.builtin import BUILTIN, builtin_parameters, builtin_path
from fluorspar.scene.node_checks import check_numbers
from fluorspar.scene.nodes import parse_scene
from fluorspar.scene.scene_dict import plain_dict
from fluorspar.scene.sensor import choose_sensor

__all__ = ["Recipe", "check_library", "recipe_of"]

_NUMBERS = re.compile(r"[-+.,\d\seE]*\d[-+.,\d\seE]*")
_EMPTY_PLACE = re.compile(r"^\s*,|,\s*,|,\s*$")


@dataclass(frozen=True, eq=False)
class Recipe:
    """What a scene was loaded from; see `load_scene`.

    Attributes
    ----------
    name : str
        What the user called it: a path as it was given, a built-in name, or "dict".
    source : Path, str or dict
        Absolute path of an XML file, name of a built-in scene, or a scene dict of plain values.
    parameters : mapping of str to str
        Values for the `$key` substitutions; that of a mesh of `cornell-mesh` is an absolute path.
    materials : mapping of str to Material
        Materials from outside, by shape or BSDF id.
    matte : bool
        Whether what is not matte is rendered as its average.
    library : tuple of Path
        Folders with materials of the user's, absolute.
    sensor : int, str or None
        Number or id of the sensor; None: the first one.
    folder : Path
        The working folder when the scene was loaded: that of the file names in a dict.
    """

    name: str
    source: Path | str | dict[str, Any]
    parameters: Mapping[str, str]
    materials: Mapping[str, Material]
    matte: bool
    library: tuple[Path, ...]
    sensor: int | str | None
    folder: Path

    @property
    def file(self) -> Path | None:
        """The XML file, None for a dict."""
        if isinstance(self.source, dict):
            return None
        return builtin_path(self.source) if isinstance(self.source, str) else self.source

    @property
    def base(self) -> Path:
        """Folder against which file names of the scene are resolved."""
        return self.folder if self.file is None else self.file.parent

    def parse(self) -> Any:
        """Parse it into a `mitsuba.parser.ParserState`; the variant must be `scalar_spectral`.

        Raises
        ------
        SceneError
            As `parse_scene` and `check_numbers`; or if a mesh of the user's cannot be read.
        OptionError
            If it has no such sensor.
        """
        values = dict(self.parameters)
        if isinstance(self.source, dict):
            state = parse_scene(self.source, {}, where="scene dict")
        else:
            if isinstance(self.source, str):
                values = builtin_parameters(self.source, values)
            state = parse_scene(self.file or self.source, values, where=self.name)
        check_numbers(state)
        if self.sensor is not None:
            choose_sensor(state, self.sensor)
        return state


def recipe_of(
    source: str | Path | dict[str, Any],
    *,
    materials: Mapping[str, str | Path | Material] | None = None,
    matte: bool = False,
    parameters: Mapping[str, object] | None = None,
    library: Sequence[str | Path] = (),
    sensor: int | str | None = None,
) -> Recipe:
    """Make the recipe of what `load_scene` is given; the variant must be `scalar_spectral`.

    Raises
    ------
    SceneError
        If it is none of these, or a dict holds a value that cannot be pickled.
    OptionError
        If materials, parameters or library are of another type, or a parameter is a list of numbers with an empty
        place.
    MaterialError, SpectrumError
        If a material from outside is unknown or impossible.

    Examples
    --------
    >>> recipe_of("furnace", parameters={"spp": 4}).parameters
    {'spp': '4'}
    """
    if not isinstance(source, str | os.PathLike | dict):
        import mitsuba as mi

        kind = type(source).__name__
        if isinstance(source, mi.Object):
            raise SceneError(
                message(
                    "the scene is already built by Mitsuba, which keeps no record of plugins and spectra",
                    got=f"a mitsuba.{kind}",
                    expected=f"the path of an XML file, a built-in scene ({', '.join(BUILTIN)}), or a dict",
                    fix="give the dict or the file itself, without mitsuba.load_dict or mitsuba.load_file",
                )
            )
        loaded = kind == "Scene"
        raise SceneError(
            message(
                "the scene is loaded already" if loaded else "this is not a scene",
                got="a Scene" if loaded else f"{source!r} ({kind})",
                expected=f"the path of an XML file, a built-in scene ({', '.join(BUILTIN)}), or a dict",
                fix="use it as it is: render, trace, measure and compare take it" if loaded else "",
            )
        )
    for name, given in (("materials", materials), ("parameters", parameters)):
        if given is not None and not isinstance(given, Mapping):
            raise OptionError(
                message(f"the {name} are not readable", got=repr(given), expected="a dict, name: value")
            )
    for key, outer in (materials or {}).items():
        if not isinstance(outer, str | os.PathLike | Material):
            expected = "a Material, a name or mixture from the library, or a file"
            raise OptionError(
                message("this is not a material", where=key, got=repr(outer), expected=expected)
            )
    check_library(library)
    values = {name: str(value) for name, value in (parameters or {}).items()}
    for name, text in values.items():
        if _EMPTY_PLACE.search(text) and _NUMBERS.fullmatch(text):  # Mitsuba would read 1,2,,3 as 1,2,3
            fault = f"the parameter {name} is a list of numbers with an empty place"
            raise OptionError(message(fault, got=text, expected="numbers with one comma between two of them"))
    absolute: Path | str | dict[str, Any]
    if isinstance(source, dict):
        absolute = plain_dict(source)
    elif str(source) in BUILTIN:
        absolute = str(source)
        if "mesh" in values:
            values["mesh"] = os.path.realpath(values["mesh"])
    else:
        absolute = Path(os.path.realpath(source))  # Path.resolve fails at a link to itself
    outside = {
        name: given if isinstance(given, Material) else material(given, library)
        for name, given in (materials or {}).items()
    }
    name = "dict" if isinstance(source, dict) else str(source)
    return Recipe(
        name,
        absolute,
        values,
        outside,
        matte,
        tuple(Path(os.path.realpath(folder)) for folder in library),
        sensor,
        Path.cwd(),
    )


def check_library(library: Any) -> None:
    """Refuse what is no sequence of folders, a single name above all."""
    if isinstance(library, str) or not isinstance(library, Sequence):
        raise OptionError(
            message("the library is not readable", got=repr(library), expected="a sequence of folders")
        )
