"""Text tables: comment lines that may say `key: value`, a header, rows of cells."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import FluorsparError, SpectrumError, message

__all__ = ["SUFFIXES", "Table", "parse_table", "read_table", "read_text", "table_of_lines"]

SUFFIXES = (".csv", ".txt")
"""Of files that hold a table."""

_LARGEST = 10_000_000  # bytes; a measured matrix has 25 kB
_KEY = re.compile(r"^#\s*([A-Za-z][\w-]*)\s*:\s*(.*)$")
_DECIMAL_COMMA = re.compile(r"[-+\d,eE]+")


@dataclass(frozen=True, eq=False)
class Table:
    """What a table file holds.

    Attributes
    ----------
    keys : dict of str to str
        The `# key: value` lines, keys in lower case; a repeated key keeps its lines, one under the other.
    header : tuple of str
        The N cells of the header line; empty if there is none.
    rows : list of list of str
        M rows of N cells, stripped.
    where : Path
        The file, for error messages.
    error : type of FluorsparError
        What is raised.
    lines : tuple of int
        Line in the file of each row, before them that of the header (0 if there is none).
    """

    keys: dict[str, str]
    header: tuple[str, ...]
    rows: list[list[str]]
    where: Path
    error: type[FluorsparError] = SpectrumError
    lines: tuple[int, ...] = ()

    def numbers(self) -> NDArray[np.float64]:
        """The rows as numbers, ndarray of shape (M, N); what is written as "nan" or "n/a" is nan.

        Raises
        ------
        FluorsparError
            Of class `error`, if a cell is not a number.

        Examples
        --------
        >>> parse_table("nm,S\\n400,0.5\\n410,n/a", where="grey.csv").numbers()
        array([[400. ,   0.5],
               [410. ,   nan]])
        """
        values = [[_number(cell) for cell in row] for row in self.rows]
        for line, row, cells in zip(self.lines[1:], values, self.rows, strict=True):
            if None in row:
                at = row.index(None)
                where, got = f"{self.where}, line {line}, cell {at + 1}", repr(cells[at])
                raise self.error(message("a cell is not a number", where=where, got=got, expected="a number"))
        return np.array(values, dtype=np.float64)


def read_text(
    path: Path | Traversable,
    error: type[FluorsparError],
    *,
    encoding: str = "utf-8-sig",
    any_size: bool = False,
) -> str:
    """Read a text file.

    Parameters
    ----------
    path : Path or Traversable
        A file, or a resource of the package.
    error : type of FluorsparError
        The exception to raise.
    encoding : str
        Of the text.
    any_size : bool
        Whether it may be larger than 10 MB, or a device or pipe. Else such a file is refused before it is read: it
        was named by mistake.

    Returns
    -------
    str
        Lines end with LF, whatever they end with in the file.

    Raises
    ------
    FluorsparError
        Of class `error`, if the file is missing, too large, or not text.
    """
    if isinstance(path, Path) and path.exists() and not any_size:
        if not path.is_file():
            fault, fix = "this is not a file that holds data", "name a file"
            raise error(message(fault, where=path, got="a directory or a device", fix=fix))
        if (size := path.stat().st_size) > _LARGEST:
            fault, fix = "the file is too large for a table of spectra", "was another file meant?"
            expected = f"at most {_LARGEST:,} bytes"
            raise error(message(fault, where=path, got=f"{size:,} bytes", expected=expected, fix=fix))
    try:
        return path.read_text(encoding=encoding)
    except FileNotFoundError as err:
        fix = "check the name and the folder"
        raise error(message("the file does not exist", where=path, fix=fix)) from err
    except (OSError, UnicodeDecodeError) as err:
        raise error(message("the file cannot be read as text", where=path, got=err)) from err


def read_table(
    path: Path | Traversable, *, error: type[FluorsparError] = SpectrumError, named_rows: bool = False
) -> Table:
    """Read a table file: `.csv`, `.spd` or `.txt`.

    Parameters
    ----------
    path : Path or Traversable
        A file, or a resource of the package.
    error : type of FluorsparError
        The exception to raise.
    named_rows : bool
        Whether rows hold names beside numbers (see `parse_table`). Such a table may have any size.

    Raises
    ------
    FluorsparError
        Of class `error`, if the file is missing, larger than 10 MB, not text, or not a table.

    Examples
    --------
    >>> from importlib.resources import files
    >>> table = read_table(files("fluorspar") / "data" / "illuminants" / "D65.csv")
    >>> table.header, table.numbers().shape
    (('wavelength', 'value'), (107, 2))
    """
    text = read_text(path, error, any_size=named_rows)
    return parse_table(text, where=str(path), error=error, named_rows=named_rows)


def parse_table(
    text: str, *, where: str, error: type[FluorsparError] = SpectrumError, named_rows: bool = False
) -> Table:
    """Parse the text of a table; see `read_table`.

    Cells are separated by semicolons, commas or blanks; between semicolons a decimal comma is understood. Lines that
    begin with # are comments. Where rows have names, these may begin with # and hold blanks: the first line that is
    no comment is the header, below it there are no comments, and a tab separates cells, empty ones too.

    Examples
    --------
    >>> table = parse_table("# name: grey\\nwavelength,reflectance\\n400,0.5\\n500,0.6", where="grey.csv")
    >>> table.keys, table.header, table.rows
    ({'name': 'grey'}, ('wavelength', 'reflectance'), [['400', '0.5'], ['500', '0.6']])
    >>> parse_table("point,x,y\\nleft wall,1,2\\n#2,3,4", where="points.csv", named_rows=True).rows
    [['left wall', '1', '2'], ['#2', '3', '4']]
    """
    keys: dict[str, str] = {}
    lines: list[tuple[int, list[str]]] = []
    separator: str | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if line.lstrip().startswith("#") and not (named_rows and lines):
            if match := _KEY.match(line.strip()):
                key, value = match[1].lower(), match[2].rstrip(",; \t")  # what spreadsheets pad a line with
                keys[key] = f"{keys[key]}\n{value}" if key in keys else value
        elif line.strip():
            if separator is None or separator not in line:
                separator = next((mark for mark in (";\t," if named_rows else ";,") if mark in line), None)
            try:
                lines.append((number, _split(line, separator)))
            except csv.Error as err:
                raise error(
                    message("a line is not part of a table", where=f"{where}, line {number}", got=err)
                ) from err
    first = lines[0][1] if lines else []
    while first[-1:] == [""]:  # separators at the end of a line of numbers make no header of it
        first = first[:-1]
    has_header = named_rows or any(_number(cell) is None for cell in first)
    return table_of_lines(keys, lines, has_header=has_header, where=Path(where), error=error)


def table_of_lines(
    keys: dict[str, str],
    lines: Sequence[tuple[int, list[str]]],
    *,
    has_header: bool,
    where: Path,
    error: type[FluorsparError],
) -> Table:
    """Make a table of lines cut into cells, each with its number in the file.

    Empty columns at the end, as spreadsheets leave them, do not count.

    Raises
    ------
    FluorsparError
        Of class `error`, if there are no rows, a row has too few or too many cells, or a column has no name.
    """
    if len(lines) <= has_header:
        fault, fix = "the file holds no rows of numbers", "an empty file or a header alone is no table"
        raise error(message(fault, where=where, fix=fix))
    width = len(lines[0][1])
    while width > 1 and not any("".join(cells[width - 1 :]) for _, cells in lines):
        width -= 1
    for number, cells in lines:
        if len(cells) < width or any(cells[width:]):
            fault, fix = "a row has the wrong number of cells", "was the file truncated or edited?"
            fix = "put comments before the header" if cells[0].startswith("#") else fix
            place = f"{where}, line {number}"
            raise error(message(fault, where=place, got=len(cells), expected=width, fix=fix))
    rows = [cells[:width] for _, cells in lines]
    header = tuple(rows.pop(0)) if has_header else ()
    if "" in header[1:]:
        place = f"{where}, line {lines[0][0]}, column {header.index('', 1) + 1}"
        raise error(message("a column has no name", where=place, fix="name it, or delete the column"))
    at = tuple(number for number, _ in lines)
    return Table(keys, header, rows, where, error, at if has_header else (0, *at))


def _split(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    cells = [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    if separator == ";":
        cells = [cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell for cell in cells]
    return cells


def _number(cell: str) -> float | None:
    if cell.lower() in ("nan", "n/a", "na"):
        return math.nan  # named by the checks of whoever uses the table
    try:
        return float(cell)
    except ValueError:
        return None
