"""Text tables: comment lines that may say `key: value`, titles, a header, rows of cells, what instruments add below."""

from __future__ import annotations

import csv
import math
import re
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, FluorsparError, SpectrumError, message

__all__ = ["SUFFIXES", "Table", "parse_number", "parse_table", "read_table", "read_text", "table_of_lines"]

SUFFIXES = (".csv", ".txt")
"""Of files that hold a table."""

_LARGEST = 10_000_000  # bytes; a measured matrix has 25 kB
_KEY = re.compile(r"^#\s*([A-Za-z][\w-]*)\s*:\s*(.*)$")
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
_UNITS = ("nm", "(nm)", "[nm]", "um", "µm")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")  # of no text

Line: TypeAlias = tuple[int, list[str]]
"""The number of a line in its file, and its cells."""


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

    def numbers(self, *, blanks: bool = False) -> NDArray[np.float64]:
        """The rows as numbers, ndarray of shape (M, N); what is written as "nan" or "n/a" is nan.

        Parameters
        ----------
        blanks : bool
            Whether a cell may be empty, which is nan, too.

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
        values = [[parse_number(cell or "nan" * blanks) for cell in row] for row in self.rows]
        for line, row, cells in zip(self.lines[1:], values, self.rows, strict=True):
            if None in row:
                at = row.index(None)
                where, got = f"{self.where}, line {line}, cell {at + 1}", repr(cells[at])
                fix = "correct it; if the line is no part of the table, begin it with #"
                raise self.error(
                    message("a cell is not a number", where=where, got=got, expected="a number", fix=fix)
                )
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
        if isinstance(err, UnicodeDecodeError) and not any_size:
            text = path.read_text(encoding="latin-1")  # instruments write µ and ° so
            if not _CONTROL.search(text):
                return text
        fix = "if it is a text file, save it as UTF-8" if isinstance(err, UnicodeDecodeError) else ""
        raise error(message("the file cannot be read as text", where=path, got=err, fix=fix)) from err


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

    Cells are separated by tabs, semicolons, commas or blanks; a decimal comma is understood where commas do not
    separate. Lines that begin with # are comments. The table is what stands from the first to the last line of numbers;
    the line above it is the header if it has as many cells, and the one above that, too, where the names are not
    enough. Text further up and below, which instruments write around their tables, is passed over.

    Where rows have names, these may begin with # and hold blanks: the first line that is no comment is the header, all
    lines below it are rows, none of them comments, and a tab separates cells, empty ones too. A line without any cell
    is none.

    Examples
    --------
    >>> table = parse_table("# name: grey\\nwavelength,reflectance\\n400,0.5\\n500,0.6", where="grey.csv")
    >>> table.keys, table.header, table.rows
    ({'name': 'grey'}, ('wavelength', 'reflectance'), [['400', '0.5'], ['500', '0.6']])
    >>> parse_table("point,x,y\\nleft wall,1,2\\n#2,3,4", where="points.csv", named_rows=True).rows
    [['left wall', '1', '2'], ['#2', '3', '4']]
    """
    keys: dict[str, str] = {}
    lines: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.lstrip().startswith("#") and not (named_rows and lines):
            if match := _KEY.match(line.strip()):
                key, value = match[1].lower(), match[2].rstrip(",; \t")  # what spreadsheets pad a line with
                keys[key] = f"{keys[key]}\n{value}" if key in keys else value
        elif line.strip():
            lines.append((number, line))
    try:
        header, rows = _named(lines) if named_rows else _numeric(lines, where)
    except _NoLine as err:
        where = f"{where}, line {err.args[0]}"
        raise error(message("a line is not part of a table", where=where, got=err.__cause__)) from err
    if named_rows and not rows:
        expected = "a line with the names of the columns, and below it a line for each row"
        raise error(message("the file holds no rows", where=where, expected=expected))
    found = [*header, *rows]
    return table_of_lines(keys, found, has_header=bool(header), where=Path(where), error=error)


def table_of_lines(
    keys: dict[str, str],
    lines: Sequence[Line],
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
        fault, expected = (
            "the file holds no rows of numbers",
            "lines such as '400, 0.5': a wavelength, then values",
        )
        fix = "export it as a table; an empty file or a header alone is none"
        raise error(message(fault, where=where, expected=expected, fix=fix))
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


class _NoLine(Exception):
    """A line, whose number is the argument, cannot be cut into cells."""


def _named(lines: Sequence[tuple[int, str]]) -> tuple[list[Line], list[Line]]:
    """Cut a table whose rows have names: its header line and its rows."""
    cut: list[Line] = []
    separator: str | None = None
    for number, line in lines:
        if separator is None or separator not in line:
            separator = next((mark for mark in ";\t," if mark in line), None)
        cut.append((number, _split(number, line, separator)))
    cut = [(number, cells) for number, cells in cut if any(cells)]  # spreadsheets leave rows of separators
    return cut[:1], cut[1:]


def _numeric(lines: Sequence[tuple[int, str]], where: str) -> tuple[list[Line], list[Line]]:
    """Find the table of numbers in a text: its header line, if it has one, and its rows."""
    marks = [mark for mark in "\t;," if any(mark in line for _, line in lines)]
    cuts = {mark: [(at, _split(at, line, mark)) for at, line in lines] for mark in (*marks, None)}
    counts = {mark: sum(_is_row(cells) for _, cells in cut) for mark, cut in cuts.items()}
    counts[None] //= 2  # between blanks an empty first cell of a header is not seen
    mark = max(counts, key=lambda mark: counts[mark])
    cut = cuts[mark]
    widths = Counter(len(cells) for _, cells in cut if _is_row(cells))
    if not widths:
        return [], []
    width = max(widths, key=lambda count: widths[count])
    first = next(k for k, (_, cells) in enumerate(cut) if _is_row(cells) and len(cells) == width)
    while first > 0 and parse_number(cut[first - 1][1][0]) is not None:
        first -= 1  # a row gone wrong
    if others := [str(number) for number, cells in cut[:first] if _is_row(cells)]:
        text = f"{where}: not read: rows of other numbers above the table, line {', '.join(others)}"
        warnings.warn(text, ApproximationWarning, stacklevel=4)
    last = max(
        k
        for k, (_, cells) in enumerate(cut)
        if parse_number(cells[0]) is not None
        and (mark is not None or _is_row(cells) or len(cells) in (1, width))  # not "3 scans were averaged"
        and k >= first
    )
    rows = cut[first : last + 1]
    width = max(len(_stripped(cells)) for _, cells in rows if len(cells) == width)
    above = [
        (number, (cells if len(cells) > 1 else line.split()))
        for (number, cells), (_, line) in zip(cut[:first], lines, strict=False)
    ]
    return _header(above, width), rows


def _header(above: Sequence[Line], width: int) -> list[Line]:
    """Make a header of the last of the lines above a table, and of the one before where its names are not enough."""
    names = []
    for number, cells in above[-2:]:
        fits = len(_stripped(cells)) <= width <= len(cells) and any(cells[1:])
        names.append((number, cells[:width]) if fits else None)
    if not names or (header := names[-1]) is None:
        return []
    if len(names) < 2 or names[0] is None:
        return [header]
    are_units = header[1][0] in _UNITS and parse_number(header[1][1]) is None
    if len(set(header[1][1:])) == width - 1 and not are_units:
        return [header]
    title, joined = "", []
    for upper, lower in zip(names[0][1], header[1], strict=True):
        title = upper or title
        joined.append(title if parse_number(title) is not None else f"{title} {lower}".strip())
    return [(header[0], joined)]


def _is_row(cells: Sequence[str]) -> bool:
    """Whether cells are two or more, the first a number, the others numbers or empty."""
    return (
        len(cells) > 1
        and parse_number(cells[0]) is not None
        and all(parse_number(cell) is not None for cell in cells if cell)
    )


def _stripped(cells: Sequence[str]) -> Sequence[str]:
    """Cells without the empty ones at the end."""
    return cells[: max((k for k, cell in enumerate(cells, start=1) if cell), default=0)]


def _split(number: int, line: str, separator: str | None) -> list[str]:
    if separator is None:
        cells = line.split()
    else:
        try:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
        except csv.Error as err:
            raise _NoLine(number) from err
    if separator == ",":
        return cells
    return [cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell for cell in cells]


def parse_number(cell: str) -> float | None:
    """Return the number that a cell is, None if it is none.

    Examples
    --------
    >>> parse_number("1e3"), parse_number("n/a"), parse_number("a.u.")
    (1000.0, nan, None)
    """
    if cell.lower() in ("nan", "n/a", "na"):
        return math.nan  # named by the checks of whoever uses the table
    try:
        return float(cell)
    except ValueError:
        return None
