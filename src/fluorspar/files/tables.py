"""Text tables: comment lines that may say `key: value`, a header, rows of numbers or of text."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import FluorsparError, SpectrumError, message

__all__ = ["Cells", "Table", "parse_table", "read_cells", "read_table", "refuse_huge"]

_LARGEST = 10_000_000  # bytes
_KEY = re.compile(r"^#\s*([A-Za-z][\w-]*)\s*:\s*(.*)$")


@dataclass(frozen=True, eq=False)
class Table:
    """What a table file holds.

    Attributes
    ----------
    keys : dict of str to str
        The `# key: value` lines, keys in lower case; a repeated key keeps its lines, one under the other.
    header : tuple of str
        The cells of the header line; empty if there is none.
    rows : ndarray of shape (M, N)
        The numbers.
    where : str
        The file, for error messages.
    lines : tuple of int
        Line of each row in the file.
    """

    keys: dict[str, str]
    header: tuple[str, ...]
    rows: NDArray[np.float64]
    where: str
    lines: tuple[int, ...] = ()


def refuse_huge(path: Path, error: type[FluorsparError]) -> None:
    """Refuse a file that was named by mistake, by its size, before it is read.

    Raises
    ------
    FluorsparError
        Of class `error`, if the file is larger than 10 MB, or a directory, device or pipe. A measured matrix
        has 25 kB.
    """
    if path.exists() and not path.is_file():
        fault, fix = "this is not a file that holds data", "name a file"
        raise error(message(fault, where=path, got="a directory or a device", fix=fix))
    if path.is_file() and (size := path.stat().st_size) > _LARGEST:
        fault, fix = "the file is too large for a table of spectra", "was another file meant?"
        expected = f"at most {_LARGEST:,} bytes"
        raise error(message(fault, where=path, got=f"{size:,} bytes", expected=expected, fix=fix))


def read_table(path: Path | Traversable, *, error: type[FluorsparError] = SpectrumError) -> Table:
    """Read a table file: `.csv`, `.spd` or `.txt`.

    Parameters
    ----------
    path
        A file, or a resource of the package.
    error
        The exception to raise.

    Raises
    ------
    FluorsparError
        Of class `error`, if the file is missing, larger than 10 MB, not text, or not a table of numbers.

    Examples
    --------
    >>> from importlib.resources import files
    >>> table = read_table(files("fluorspar") / "data" / "illuminants" / "D65.csv")
    >>> table.header, table.rows.shape
    (('wavelength', 'value'), (107, 2))
    """
    if isinstance(path, Path):
        refuse_huge(path, error)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as err:
        fix = "check the name and the folder"
        raise error(message("the file does not exist", where=path, fix=fix)) from err
    except (OSError, UnicodeDecodeError) as err:
        raise error(message("the file cannot be read as text", where=path, got=err)) from err
    return parse_table(text, where=str(path), error=error)


def parse_table(text: str, *, where: str, error: type[FluorsparError] = SpectrumError) -> Table:
    """Parse the text of a table; see `read_table`.

    Cells are separated by semicolons, commas or blanks; between semicolons a decimal comma is understood.

    Examples
    --------
    >>> table = parse_table("# name: grey\\nwavelength,reflectance\\n400,0.5\\n500,0.6", where="grey.csv")
    >>> table.keys, table.header, table.rows.tolist()
    ({'name': 'grey'}, ('wavelength', 'reflectance'), [[400.0, 0.5], [500.0, 0.6]])
    """
    keys: dict[str, str] = {}
    header: tuple[str, ...] = ()
    rows: list[list[float]] = []
    lines: list[int] = []
    width = 0
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if line.startswith("#"):
            if found := _KEY.match(line):
                key, value = found[1].lower(), found[2].strip()
                value = value.rstrip(",; \t")  # what spreadsheets pad a line with
                keys[key] = f"{keys[key]}\n{value}" if key in keys else value
            continue
        if not line:
            continue
        cells = _split(line)
        width = width or len(cells)
        numbers = [_number(cell) for cell in cells]
        if None in numbers and not header and not rows:
            header = tuple(cells)
        elif None in numbers:
            column = numbers.index(None)
            at = f"{where}, line {number}, cell {column + 1}"
            raise error(
                message("a cell is not a number", where=at, got=repr(cells[column]), expected="a number")
            )
        elif len(numbers) != width:
            fault = "a row has the wrong number of cells"
            raise error(message(fault, where=f"{where}, line {number}", got=len(numbers), expected=width))
        else:
            rows.append([value for value in numbers if value is not None])
            lines.append(number)
    if not rows:
        raise error(message("the file holds no rows of numbers", where=where))
    return Table(keys, header, np.array(rows, dtype=np.float64), where, tuple(lines))


def _split(line: str) -> list[str]:
    if ";" in line:
        cells = line.rstrip(";").replace(",", ".").split(";")
    elif "," in line:
        cells = line.rstrip(",").split(",")
    else:
        cells = line.split()
    return [cell.strip() for cell in cells]


def _number(cell: str) -> float | None:
    if cell.lower() in ("nan", "n/a", "na"):
        return math.nan  # named by the checks of whoever uses the table
    try:
        return float(cell)
    except ValueError:
        return None


@dataclass(frozen=True)
class Cells:
    """What a CSV file holds.

    Attributes
    ----------
    keys : dict of str to str
        The `# key: value` lines, keys in lower case.
    header : tuple of str
    rows : list of list of str
        As many cells as the header has, stripped.
    where : Path
        The file, for messages.
    error : type of FluorsparError
        What is raised.
    """

    keys: dict[str, str]
    header: tuple[str, ...]
    rows: list[list[str]]
    where: Path
    error: type[FluorsparError]

    def numbers(self, columns: slice) -> NDArray[np.float64]:
        """The cells of some columns as numbers, ndarray of shape (rows, columns).

        Raises
        ------
        FluorsparError
            Of class `error`, if one is not a number.
        """
        try:
            return np.array([[float(cell) for cell in row[columns]] for row in self.rows])
        except ValueError as err:
            raise self.error(message("a cell is not a number", where=self.where, got=err)) from err


def read_cells(path: Path, error: type[FluorsparError]) -> Cells:
    """Read a CSV file with a header; cells are separated by commas, semicolons or tabs.

    Lines that begin with # are comments as far as the header; below it a name may begin with #. Columns at the end
    that are empty, as spreadsheets leave them, do not count.

    Parameters
    ----------
    path : Path
    error : type of FluorsparError
        What to raise.

    Raises
    ------
    FluorsparError
        Of class `error`, if the file is missing, is not text, has no rows, a row has too few or too many cells,
        or a column has no name.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar.errors import OptionError
    >>> path = Path(tempfile.mkdtemp()) / "points.csv"
    >>> _ = path.write_text("# unit: mm\\npoint,x,y\\nleft wall,1,2\\n")
    >>> read_cells(path, OptionError).rows
    [['left wall', '1', '2']]
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as err:
        fix = "check the name and the folder"
        raise error(message("the file does not exist", where=path, fix=fix)) from err
    except (OSError, UnicodeDecodeError) as err:
        raise error(message("the file cannot be read as text", where=path, got=err)) from err
    keys: dict[str, str] = {}
    lines: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not lines and line.lstrip().startswith("#"):
            if found := _KEY.match(line.strip()):
                keys.setdefault(found[1].lower(), found[2].strip())
        elif line.strip():
            lines.append((number, line))
    if len(lines) < 2:
        raise error(message("the file holds no table", where=path, expected="a header line and rows"))
    delimiter = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    parsed = [(number, next(csv.reader([line], delimiter=delimiter))) for number, line in lines]
    cells = [[cell.strip() for cell in row] for _, row in parsed]
    header, rows = cells[0], cells[1:]
    for (number, _), row in zip(parsed[1:], rows, strict=True):
        if len(row) != len(header):
            fault, where = "a row has the wrong number of cells", f"{path}, line {number}"
            fix = "put comments before the header" if row[0].startswith("#") else ""
            raise error(message(fault, where=where, got=len(row), expected=len(header), fix=fix))
    while header and not any(row[-1] for row in (header, *rows)):
        header, rows = header[:-1], [row[:-1] for row in rows]
    if not all(header):
        where = f"{path}, line {parsed[0][0]}, column {header.index('') + 1}"
        raise error(message("a column has no name", where=where, fix="name it, or delete the column"))
    if delimiter == ";":
        rows = [
            [cell.replace(",", ".") if re.fullmatch(r"[-+\d,eE]+", cell) else cell for cell in row]
            for row in rows
        ]
    return Cells(keys, tuple(header), rows, path, error)
