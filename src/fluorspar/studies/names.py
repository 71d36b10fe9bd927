"""Names of the files of a study, from patterns: `"{scene}-{light}-{concentration:.2f}.nc"`."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Formatter
from typing import Any

from fluorspar.errors import OptionError, message
from fluorspar.image.formats.registry import SUFFIXES_WRITTEN
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.studies.keys import Value, as_text

__all__ = ["name_outputs"]

_UNFIT = re.compile(r"[^\w.+=,:-]+")
_FILE = re.compile(r"\.(xml|csv|txt|spd|bfc|obj|ply|stl|gltf|glb)$", re.IGNORECASE)


def name_outputs(
    rows: Sequence[Mapping[str, Value]], patterns: Sequence[Any], folder: Path, study: str
) -> list[tuple[Path, ...]]:
    """Name the files of all rows.

    Parameters
    ----------
    rows : sequence of mapping
        The settings of each row.
    patterns : sequence of str, path or sequence of these
        One or several of each row, as of `str.format`. The fields are the keys of the rows (`{light.lamp}`), or only
        their kind where a row has one of it (`{light}`); `{number}`, that of the row; and `{study}`. Of files, their
        names without folder and suffix.
    folder : Path
        To which the names are relative.
    study : str

    Raises
    ------
    OptionError
        If what is given is no pattern or has other fields, or two rows have the same name.

    Examples
    --------
    >>> rows = [{"scene": "rooms/attic.xml", "concentration.wall": value} for value in (0.0, 0.5)]
    >>> [str(names[0]) for names in name_outputs(rows, ["{scene}-{concentration:.1f}.nc"] * 2, Path("out"), "s")]
    ['out/attic-0.0.nc', 'out/attic-0.5.nc']
    """
    digits = len(str(len(rows)))
    found = [
        tuple(
            Path(os.path.normpath(folder / _filled(pattern, row, f"{number:0{digits}}", study)))
            for pattern in _patterns(of_row, number)
        )
        for number, (row, of_row) in enumerate(zip(rows, patterns, strict=True), start=1)
    ]
    _check_unique(rows, found)
    return found


def _patterns(given: Any, number: int) -> list[str]:
    several = given if isinstance(given, list | tuple) and given else [given]
    try:
        return [as_text(each) for each in several]
    except (TypeError, ValueError) as err:
        expected = "a pattern of file names, such as '{number}.nc', or a list of some"
        where = f"output, row {number}"
        raise OptionError(
            message("the output is not readable", where=where, got=repr(given), expected=expected)
        ) from err


def _filled(pattern: str, row: Mapping[str, Value], number: str, study: str) -> str:
    if os.path.splitext(pattern)[1].lower() not in SUFFIXES_WRITTEN:
        fault, expected = "this kind of file cannot be written", ", ".join(SUFFIXES_WRITTEN)
        raise OptionError(message(fault, where="output", got=pattern, expected=expected))
    fields: dict[str, Any] = {
        key: _Word(value) if isinstance(value, str) else value for key, value in row.items()
    }
    for key in row:
        kind = key.partition(".")[0]
        if kind != key and sum(other.startswith(f"{kind}.") for other in row) == 1:
            fields.setdefault(kind, fields[key])
    fields |= {"number": _Number(number), "study": study}
    try:
        return as_text(_Fields().vformat(pattern, (), fields))
    except (KeyError, ValueError, IndexError, OverflowError) as err:
        name = str(err.args[0]) if isinstance(err, KeyError) else ""
        raise OptionError(
            message(
                f"there is no '{name}' in a row" if name else "a pattern of file names is not readable",
                where=f"output {pattern}, row {number}",
                got=None if name else err,
                expected=", ".join(fields),
                fix=did_you_mean(name, fields) if name else "",
            )
        ) from err


class _Fields(Formatter):
    """Takes a field by its whole name: the dots are part of it."""

    def get_field(self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        return kwargs[field_name], field_name


class _Number(str):
    """The number of a row, padded so that names are in order; or formatted as a number."""

    def __format__(self, spec: str) -> str:
        return format(int(self), spec) if spec else str(self)


class _Word(str):
    """A text that is part of a file name: of a file without folder and suffix; numbers in it may be formatted."""

    def __format__(self, spec: str) -> str:
        if spec.endswith(("f", "g", "e", "d")):
            return format(int(self) if spec.endswith("d") else float(self), spec)
        return format(_UNFIT.sub("_", _FILE.sub("", self.rpartition("/")[2])), spec)


def _check_unique(rows: Sequence[Mapping[str, Value]], names: Sequence[tuple[Path, ...]]) -> None:
    """Refuse two files of one name."""
    first: dict[Path, int] = {}
    for place, files in enumerate(names):
        for file in files:
            other = first.setdefault(file, place)
            if other != place or files.count(file) > 1:
                keys = {*rows[place], *rows[other]}
                differ = sorted(key for key in keys if rows[place].get(key) != rows[other].get(key))
                fix = "put what differs into the pattern: " + ", ".join(f"{{{key}}}" for key in differ)
                raise OptionError(
                    message(
                        "two renders have the same output",
                        where=f"rows {other + 1} and {place + 1}",
                        got=file,
                        fix=fix if differ else "the rows are the same: leave one out, or use {number}",
                    )
                )
