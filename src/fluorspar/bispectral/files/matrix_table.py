"""Tables of a matrix over emission and excitation: wide, either way round, in pairs of columns, or long."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, message
from fluorspar.files.curves import LONGEST_IN_MICROMETRES, is_wavelength, says
from fluorspar.files.tables import Table, parse_number

__all__ = ["matrix_of_table"]

Array = NDArray[np.float64]

_SAME = 0.05  # nm, between the emission wavelengths of two scans
_UNIT = re.compile(r"\s*(nm|\(nm\)|\[nm\])$", re.IGNORECASE)
_EXCITED = re.compile(r"(?<![a-z])ex(?:citation)?[ _:=@]*(\d+(?:\.\d+)?)(?!\d)", re.IGNORECASE)


def matrix_of_table(table: Table) -> tuple[Array, Array, Array]:
    """Return the wavelengths and cells of a matrix; faults are named by line and cell.

    Parameters
    ----------
    table : Table
        Wide: its first column holds emission, its header excitation wavelengths in nm. The other way round if the
        corner or a line `# rows: excitation` says so, or if columns reach further to the red than rows and hold more
        light on the side of shorter wavelengths. A heading may be a sample that says the wavelength
        ("Paint_EX_350.00"), beside a column of wavelengths each. Long: three columns, whose headings say excitation
        and emission.

    Returns
    -------
    emission : ndarray of shape (M,)
    excitation : ndarray of shape (P,)
        Both ascending.
    cells : ndarray of shape (M, P)
        Empty cells above the diagonal are 0: light is not shifted to shorter wavelengths.

    Raises
    ------
    FluorsparError
        Of the class of the table, if a wavelength or cell is not a finite number, wavelengths neither ascend nor
        descend, the header does not name every column, or a cell on or below the diagonal is empty.

    Warns
    -----
    ApproximationWarning
        If rows are taken for excitation wavelengths, which nothing in the file says.

    Examples
    --------
    >>> from fluorspar.files.tables import parse_table
    >>> matrix_of_table(parse_table("nm,400,410\\n400,0.5,0\\n410,0.1,0.4", where="sheet.csv"))[1]
    array([400., 410.])
    >>> text = "ex,em,D\\n400,400,0.5\\n400,410,0.1\\n410,410,0.4"
    >>> matrix_of_table(parse_table(text, where="sheet.csv"))[2]
    array([[0.5, 0. ],
           [0.1, 0.4]])
    """
    values = table.numbers(blanks=True)
    if _is_long(table):
        return _complete(table, *_gathered(table, values))
    columns, places = _columns(table, values)
    rows, cells = values[:, 0], values[:, places]
    _check_cells(table, values, places, columns)
    _check_order(table, "rows", rows, [f"line {line}" for line in table.lines[1:]])
    _check_order(table, "columns", columns, [f"line {table.lines[0]}, header, cell {k + 1}" for k in places])
    cells = cells[np.argsort(rows)][:, np.argsort(columns)]
    rows, columns = np.sort(rows), np.sort(columns)
    if _has_excitation_rows(table, rows, columns, cells):
        rows, columns, cells = columns, rows, cells.T
    return _complete(table, rows, columns, cells)


def _is_long(table: Table) -> bool:
    numbers = [_wavelength(cell) for cell in table.header[1:]]
    return len(table.header) == 3 and numbers == [None, None]


def _gathered(table: Table, values: Array) -> tuple[Array, Array, Array]:
    """Put the rows of a long table into a matrix; cells without a row are nan."""
    named = {
        what: [k for k, cell in enumerate(table.header) if says(cell, what)]
        for what in ("excitation", "emission")
    }
    if [len(found) for found in named.values()] != [1, 1] or named["excitation"] == named["emission"]:
        fault, expected = "the columns of a long table are not named", "excitation, emission and a value"
        fix = "write such a header, for example 'excitation,emission,value'"
        got = ", ".join(table.header)
        raise table.error(message(fault, where=table.where, got=got, expected=expected, fix=fix))
    ex, em = named["excitation"][0], named["emission"][0]
    for line, row, cells in zip(table.lines[1:], values, table.rows, strict=True):
        if not np.all(np.isfinite(row)):
            at = int(np.argmin(np.isfinite(row)))
            where = f"{table.where}, line {line}, cell {at + 1}"
            fault, fix = (
                "a matrix holds a value that is not a finite number",
                "measure it, or delete the line",
            )
            raise table.error(message(fault, where=where, got=repr(cells[at]), fix=fix))
    emission, i = np.unique(values[:, em], return_inverse=True)
    excitation, j = np.unique(values[:, ex], return_inverse=True)
    matrix = np.full((len(emission), len(excitation)), np.nan)
    for line, a, b, value in zip(table.lines[1:], i, j, values[:, 3 - ex - em], strict=True):
        if np.isfinite(matrix[a, b]):
            got, fix = (
                f"emission {emission[a]:g} nm, excitation {excitation[b]:g} nm",
                "remove one of the lines",
            )
            where = f"{table.where}, line {line}"
            raise table.error(message("a cell of a matrix occurs twice", where=where, got=got, fix=fix))
        matrix[a, b] = value
    return emission, excitation, matrix


def _columns(table: Table, values: Array) -> tuple[Array, list[int]]:
    """Wavelengths that a header names, and in which columns of the table their cells stand."""
    named = [k for k, cell in enumerate(table.header) if k and is_wavelength(cell)]
    axes = [k for k in named if np.allclose(values[:, k], values[:, 0], atol=_SAME, equal_nan=True)]
    places = [k for k in range(1, values.shape[1]) if k not in axes]
    if not table.header or len(places) < 2:
        fault, fix = "the header of a matrix does not name every column", "name each excitation wavelength"
        got = f"{max(len(table.header) - 1, 0)} wavelengths for {len(places)} columns of cells"
        expected = "a wavelength for each of two or more columns"
        raise table.error(message(fault, where=table.where, got=got, expected=expected, fix=fix))
    if other := [k for k in places if re.search("wave ?length", table.header[k], re.IGNORECASE)]:
        fault = "the columns of a matrix have emission wavelengths of their own"
        where, expected = f"{table.where}, column {other[0] + 1}", "those of the first column"
        fix = "export scans over the same wavelengths, or a long table: excitation, emission, value"
        got = repr(table.header[other[0]])
        raise table.error(message(fault, where=where, got=got, expected=expected, fix=fix))
    wavelengths = []
    for place in places:
        if (wavelength := _wavelength(table.header[place])) is None or not np.isfinite(wavelength):
            fault, fix = (
                "the header of a matrix holds what is not a wavelength",
                "name each excitation wavelength",
            )
            where = f"{table.where}, line {table.lines[0]}, header, cell {place + 1}"
            raise table.error(
                message(fault, where=where, got=repr(table.header[place]), expected="nm", fix=fix)
            )
        wavelengths.append(wavelength)
    return np.array(wavelengths), places


def _wavelength(heading: str) -> float | None:
    """The wavelength that a heading is ("350", "350 nm") or says ("Paint_EX_350.00")."""
    number = parse_number(_UNIT.sub("", heading))
    return float(found[1]) if number is None and (found := _EXCITED.search(heading)) else number


def _check_cells(table: Table, values: Array, places: Sequence[int], columns: Array) -> None:
    named = dict(zip(places, columns, strict=True))
    for line, row, words in zip(table.lines[1:], values, table.rows, strict=True):
        for at, (value, word) in enumerate(zip(row, words, strict=True)):
            if np.isfinite(value) or (not word and at in named):
                continue
            where = f"{table.where}, line {line}, cell {at + 1}"
            where += f" (emission {row[0]:g} nm, excitation {named[at]:g} nm)" if at in named else ""
            fault, fix = "a matrix holds a value that is not a finite number", "measure or interpolate it"
            raise table.error(message(fault, where=where, got=repr(word), fix=fix))


def _check_order(table: Table, what: str, wavelengths: Array, places: Sequence[str]) -> None:
    steps = np.diff(wavelengths)
    falling = np.count_nonzero(steps < 0) > np.count_nonzero(steps > 0)
    wrong = np.flatnonzero(steps >= 0 if falling else steps <= 0)
    if not len(wrong):
        return
    at = int(wrong[0])
    name = "emission" if what == "rows" else "excitation"
    fault = f"the {name} wavelengths of a matrix, in its {what}, do not {'descend' if falling else 'ascend'}"
    got = f"{wavelengths[at]:g} nm, then {wavelengths[at + 1]:g} nm"
    fix = "sort them and remove duplicates"
    raise table.error(message(fault, where=f"{table.where}, {places[at + 1]}", got=got, fix=fix))


def _has_excitation_rows(table: Table, rows: Array, columns: Array, cells: Array) -> bool:
    corner = "" if _EXCITED.search(table.header[0]) else table.header[0]
    for text in (table.keys.get("rows", ""), corner):
        if says(text, "emission") != says(text, "excitation"):  # "Ex/Em" says nothing
            return says(text, "excitation")
    shift = np.where(np.isfinite(cells), cells, 0.0) * np.sign(rows[:, None] - columns)
    if columns[-1] <= rows[-1] or shift.sum() >= 0:
        return False
    text = (
        f"{table.where}: rows are taken for excitation wavelengths, else most light would be shifted to shorter ones; "
        "say so by a line '# rows: excitation', or '# rows: emission'"
    )
    warnings.warn(text, ApproximationWarning, stacklevel=4)
    return True


def _complete(table: Table, emission: Array, excitation: Array, cells: Array) -> tuple[Array, Array, Array]:
    """Set empty cells above the diagonal to 0, refuse others."""
    if min(cells.shape) < 2:
        fault, got = (
            "a matrix has too few wavelengths",
            f"{len(emission)} of emission, {len(excitation)} of excitation",
        )
        raise table.error(message(fault, where=table.where, got=got, expected="two or more of either"))
    if (shortest := min(emission[0], excitation[0])) <= 0 or emission[-1] < LONGEST_IN_MICROMETRES:
        fix = "write micrometres as nm: times 1000" if shortest > 0 else ""
        got, expected = f"{shortest:g} nm", "wavelengths of light in nm"
        raise table.error(
            message("a wavelength is impossible", where=table.where, got=got, expected=expected, fix=fix)
        )
    empty = np.isnan(cells)
    if np.any(missing := empty & (emission[:, None] >= excitation)):
        i, j = np.argwhere(missing)[0]
        fault, fix = "a cell of a matrix is empty", "measure or interpolate it"
        got = f"nothing at emission {emission[i]:g} nm, excitation {excitation[j]:g} nm"
        expected = "a number in every cell on and below the diagonal"
        raise table.error(message(fault, where=table.where, got=got, expected=expected, fix=fix))
    return emission, excitation, np.where(empty, 0.0, cells)
