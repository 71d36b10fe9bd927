"""CSV tables whose cells may be text: comment lines that may say `key: value`, a header, rows."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import FluorsparError, message

__all__ = ["Cells", "read_cells"]

_KEY = re.compile(r"^#\s*([A-Za-z][\w-]*)\s*:\s*(.*)$")


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
