"""`Study`: a table of renders, read from a TOML or CSV file, or made of a dict."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from fluorspar.errors import OptionError, message
from fluorspar.files.tables import read_table, read_text
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.studies.keys import INDEX, KINDS, Value, read_value
from fluorspar.studies.names import name_outputs

__all__ = ["Row", "Study", "read_study"]

_TABLES = ("output", "render", "product", "rows")
_RANGE = {"start", "stop", "number"}


@dataclass(frozen=True)
class Row:
    """One render of a study.

    Attributes
    ----------
    number : int
        From 1, in the order of the study.
    settings : mapping of str to str, int, float or bool
        What was asked for, by the keys of `fluorspar.studies.keys`, as it was written.
    outputs : tuple of Path
        The files to be written.
    folder : Path
        Of the study: where files that are named in the settings are looked for.
    """

    number: int
    settings: Mapping[str, Value]
    outputs: tuple[Path, ...]
    folder: Path

    @property
    def canonical(self) -> str:
        """The settings as JSON, the same text for the same settings in any order.

        Examples
        --------
        >>> Row(1, {"spp": 4, "scene": "furnace"}, (), Path()).canonical
        '{"scene": "furnace", "spp": 4}'
        """
        return json.dumps(dict(self.settings), sort_keys=True, ensure_ascii=False)


@dataclass(frozen=True)
class Study:
    """A table of renders.

    Attributes
    ----------
    rows : tuple of Row
        All renders, no two with the same output.
    file : Path or None
        It was read from.
    """

    rows: tuple[Row, ...]
    file: Path | None = None

    @property
    def index(self) -> Path | None:
        """Name of the index without suffix; a study without a file has none."""
        return None if self.file is None else self.file.with_name(f"{self.file.stem}{INDEX}")

    @property
    def keys(self) -> tuple[str, ...]:
        """All keys that some row has, in order of appearance."""
        return tuple(dict.fromkeys(key for row in self.rows for key in row.settings))


def read_study(
    source: str | os.PathLike[str] | Mapping[str, Any], output: str | Sequence[str] | None = None
) -> Study:
    """Read a study; nothing is rendered, and no scene is looked at.

    Parameters
    ----------
    source : path or mapping
        A TOML file, or a dict of the same tables: `output`, patterns of file names; `render`, what all rows share;
        `product`, lists of values or ranges `{start, stop, number}`, every one combined with every other; `rows`, each
        combined with every combination, and perhaps with an `output` of its own. Or a CSV file, a row for each render.
    output : str or sequence of str, optional
        Patterns of the file names, instead of the study's.

    Raises
    ------
    OptionError
        If it cannot be read, a key or value is impossible, or two rows have the same output.

    Examples
    --------
    >>> study = read_study({"render": {"scene": "furnace"}, "product": {"seed": [1, 2]}, "output": "{seed}.nc"})
    >>> [(row.settings["seed"], row.outputs[0].name) for row in study.rows]
    [(1, '1.nc'), (2, '2.nc')]
    """
    if isinstance(source, Mapping):
        where, file, folder, name = "the study", None, Path.cwd(), "render"
        tables: Mapping[str, Any] = source
    else:
        file = Path(os.path.abspath(source))
        where, folder, name = str(source), file.parent, file.stem
        tables = _tables_of(file)
    _check_tables(tables, where)
    settings, names = zip(*_combined(tables, where), strict=True)
    default = f"{name}-{{number}}.nc"
    patterns = [
        next(given for given in (output, own, tables.get("output"), default) if given is not None)
        for own in names
    ]
    outputs = name_outputs(settings, patterns, folder, name)
    rows = [
        Row(number, given, files, folder)
        for number, (given, files) in enumerate(zip(settings, outputs, strict=True), start=1)
    ]
    return Study(tuple(rows), file)


def _tables_of(path: Path) -> Mapping[str, Any]:
    """Read the file of a study."""
    if path.suffix.lower() == ".toml":
        try:
            return tomllib.loads(read_text(path, OptionError, any_size=True))
        except tomllib.TOMLDecodeError as err:
            raise OptionError(message("the study is not valid TOML", where=path, got=err)) from err
    if path.suffix.lower() != ".csv":
        raise OptionError(message("this kind of file cannot be a study", where=path, expected=".toml, .csv"))
    table = read_table(path, error=OptionError, named_rows=True)
    if len(set(table.header)) < len(table.header):
        twice = next(key for key in table.header if table.header.count(key) > 1)
        raise OptionError(message("two columns have the same name", where=path, got=twice))
    return {"rows": [{k: v for k, v in zip(table.header, row, strict=True) if v} for row in table.rows]}


def _check_tables(tables: Mapping[str, Any], where: str) -> None:
    for name, given in tables.items():
        if name not in _TABLES:
            fix = did_you_mean(str(name), _TABLES) or "options that all rows share belong below [render]"
            expected = ", ".join(_TABLES)
            raise OptionError(message(f"a study has no '{name}'", where=where, expected=expected, fix=fix))
        if name in ("render", "product") and not isinstance(given, Mapping):
            raise OptionError(message("this is not a table", where=f"{where}, {name}", got=repr(given)))
        if name == "rows" and not (
            isinstance(given, Sequence) and given and all(isinstance(row, Mapping) for row in given)
        ):
            expected = "a list of tables: [[rows]]"
            raise OptionError(
                message("the rows are not readable", where=where, got=repr(given), expected=expected)
            )


def _combined(tables: Mapping[str, Any], where: str) -> Iterator[tuple[dict[str, Value], Any]]:
    """Go through the settings and the own outputs of all rows: each with every combination of the product."""
    shared = _settings(tables.get("render", {}), f"{where}, render")
    axes = {
        key: _values(key, given, f"{where}, product")
        for key, given in _flat(tables.get("product", {}), axes=True).items()
    }
    for number, given in enumerate(tables.get("rows") or [{}], start=1):
        at = f"{where}, row {number}"
        own = _settings({key: value for key, value in given.items() if key != "output"}, at)
        if both := own.keys() & axes.keys():
            fault, fix = "a key is both in a row and in the product", "leave one of them out"
            raise OptionError(message(fault, where=at, got=", ".join(sorted(both)), fix=fix))
        for chosen in product(*axes.values()):
            settings = shared | own | dict(zip(axes, chosen, strict=True))
            if "scene" not in settings:
                fix = 'say which, such as scene = "cornell-box"'
                raise OptionError(message("a row has no scene", where=at, fix=fix))
            yield settings, given.get("output")


def _settings(given: Mapping[str, Any], where: str) -> dict[str, Value]:
    return {key: read_value(key, value, where) for key, value in _flat(given).items()}


def _flat(given: Mapping[str, Any], *, axes: bool = False) -> dict[str, Any]:
    """Write tables of ids (`light.lamp = "A"`) as keys with a dot."""
    flat: dict[str, Any] = {}
    for key, value in ((str(key), value) for key, value in given.items()):
        is_range = axes and isinstance(value, Mapping) and value.keys() == _RANGE
        if key.rstrip("s") in KINDS and isinstance(value, Mapping) and not is_range:
            flat |= {f"{key}.{name}": each for name, each in value.items()}
        else:
            flat[key] = value
    return flat


def _values(key: str, given: Any, where: str) -> list[Value]:
    """Read an axis of the product: a list, or a range with both its ends."""
    if isinstance(given, Mapping) and given.keys() == _RANGE:
        try:
            ends = float(given["start"]), float(given["stop"])
            given = [value.item() for value in np.linspace(*ends, int(given["number"])).round(12)]
        except (TypeError, ValueError) as err:
            raise OptionError(
                message("a range is not readable", where=f"{where}, {key}", got=dict(given))
            ) from err
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, str) or not isinstance(given, Sequence) or not given:
        expected = "a list of values, or { start = 0, stop = 1, number = 5 }"
        got = dict(given) if isinstance(given, Mapping) else repr(given)
        raise OptionError(
            message("this is not a list of values", where=f"{where}, {key}", got=got, expected=expected)
        )
    return [read_value(key, value, where) for value in given]
