"""Small text tables: comment lines that may say `key: value`, an optional header, rows of numbers."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import FluorsparError, SpectrumError, message

__all__ = ["Table", "parse_table", "read_table", "refuse_huge"]

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
