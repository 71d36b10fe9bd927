"""Curves over wavelength in tables of any layout: which column is the wavelength, which is meant, in which units."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, SpectrumError, message
from fluorspar.files.names import file_and_column
from fluorspar.files.spdx import read_spdx
from fluorspar.files.tables import Table, read_table

__all__ = ["LONGEST_IN_MICROMETRES", "Curve", "Role", "is_wavelength", "read_curve", "says"]

Array = NDArray[np.float64]
Role = Literal["", "excitation", "emission"]

_WORDS = {
    "excitation": ("excitation", "ex", "exc"),
    "absorption": ("absorption", "absorbance", "absorptance", "abs", "ab", "extinction"),
    "emission": ("emission", "em", "fluorescence"),
}
_OTHERS = {"excitation": ("emission",), "emission": ("excitation", "absorption")}
_WAVELENGTH = re.compile(r"wave ?length|lambda|λ|^wl\b|^nm\.?$|[(\[](nm|[uµμ]m)[)\]]", re.IGNORECASE)
_MICROMETRES = re.compile(r"\b[uµμ]m\b|micromet|micron", re.IGNORECASE)
LONGEST_IN_MICROMETRES = 50.0
"""In nm no spectrum ends there."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One column of a table, over the wavelengths beside it.

    Attributes
    ----------
    name : str
        The heading of the column; "" if it has none.
    wavelengths, values : ndarray of shape (n,)
        In nm, ascending unless the file jumps back and forth; in whatever unit the quantity has.
    keys : dict of str to str
        The `# key: value` lines of the table.
    """

    name: str
    wavelengths: Array
    values: Array
    keys: dict[str, str]

    @property
    def is_absorption(self) -> bool:
        """Whether its name says that it is the absorption of something."""
        return says(self.name, "absorption")


def read_curve(path: str | Path, role: Role = "") -> Curve:
    """Read one curve from a file.

    Parameters
    ----------
    path : str or Path
        A table or an `.spdx` file. `FILE:COLUMN` says which of several columns: its heading, or a part of it that no
        other heading has; without headings "column 2", "column 3", ...
    role : {"", "excitation", "emission"}
        What is wanted of a dye; among several columns the one whose heading says so ("EGFP ex", "emission"). Where
        there is no excitation spectrum, the absorption is taken.

    Returns
    -------
    Curve
        Cells that are empty were not measured: at the ends the curve is shorter.

    Raises
    ------
    SpectrumError
        If the file is missing or no table, no column is meant, or more than one.

    Warns
    -----
    ApproximationWarning
        If there are empty cells between others, or the wavelengths can only be micrometres, which no heading says.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "dye.csv")
    ...     _ = file.write_text("wavelength,EGFP ex,EGFP em\\n600,,0\\n500,0.6,1\\n400,0.2,")
    ...     read_curve(file, "excitation").values, read_curve(f"{file}:em").wavelengths
    (array([0.2, 0.6]), array([500., 600.]))
    """
    file, wanted = file_and_column(path)
    table = read_spdx(file) if file.suffix.lower() == ".spdx" else read_table(file)
    headings = table.header or ("", *(f"column {k}" for k in range(2, len(table.rows[0]) + 1)))
    axes = [k for k, heading in enumerate(headings) if is_wavelength(heading)] or [0]
    columns = [
        k for k, heading in enumerate(headings) if k not in axes and heading
    ]  # not the numbers of the rows
    column = _chosen(columns, headings, wanted, role, file)
    axis = max((k for k in axes if k < column), default=axes[0])
    return _curve(table, headings, axis, column, named=bool(table.header) and len(columns) > 1)


def is_wavelength(heading: str) -> bool:
    """Whether a heading is that of a column of wavelengths.

    Examples
    --------
    >>> is_wavelength("Wavelength (nm)"), is_wavelength("Intensity (W/m2/nm)")
    (True, False)
    """
    return bool(_WAVELENGTH.search(heading))


def says(heading: str, what: str) -> bool:
    """Whether a heading says "excitation", "absorption" or "emission", in full or shortened.

    Examples
    --------
    >>> says("EGFP ex", "excitation"), says("Alexa 488", "excitation")
    (True, False)
    """
    return bool({*re.findall(r"[a-z]+", heading.lower())} & {*_WORDS[what]})


def _chosen(columns: Sequence[int], headings: Sequence[str], wanted: str, role: Role, file: Path) -> int:
    """Index of the column that is meant."""
    if wanted:
        same = [k for k in columns if headings[k].casefold() == wanted.casefold()]
        found = same or [k for k in columns if wanted.casefold() in headings[k].casefold()]
    elif not role or (
        len(columns) == 1 and not any(says(headings[columns[0]], other) for other in _OTHERS[role])
    ):
        found = list(columns)
    else:
        found = [k for k in columns if says(headings[k], role)]
        if role == "excitation" and not found:
            found = [k for k in columns if says(headings[k], "absorption")]
    if len(found) == 1:
        return found[0]
    names = ", ".join(repr(headings[k]) for k in columns)
    fault = "the file holds several spectra" if columns else "the file is not a spectrum"
    if wanted:
        fault = f"the file has {'no column' if not found else 'more than one column'} {wanted!r}"
    elif role and not found:
        fault = f"no column of the file says that it is the {role}"
    got = f"{len(headings)} columns: {names}" if columns else "1 column"
    fix = f"name one, such as '{file}:{headings[columns[0]]}'" if columns else ""
    raise SpectrumError(message(fault, where=file, got=got, expected="wavelength and value", fix=fix))


def _curve(table: Table, headings: Sequence[str], axis: int, column: int, *, named: bool) -> Curve:
    name = headings[column]
    cells = [(row[axis], row[column]) for row in table.rows]
    filled = np.array([bool(wavelength and value) for wavelength, value in cells])
    at, values = table.numbers(blanks=True).T[[axis, column]]
    measured = np.flatnonzero(filled)
    if not len(measured):
        raise table.error(message("a column is empty", where=f"{table.where}, {name!r}"))
    where = f"{table.where}, {name!r}" if named else f"{table.where}"
    inside = slice(measured[0], measured[-1] + 1)
    if gaps := [f"{wavelength:g}" for wavelength in at[inside][~filled[inside]]]:
        listed = ", ".join(gaps[:5]) + (f" and {len(gaps) - 5} others" if len(gaps) > 5 else "")
        text = f"{where}: empty cells between others, at {listed} nm, are interpolated linearly"
        warnings.warn(text, ApproximationWarning, stacklevel=4)
    at, values = at[filled], values[filled]
    if len(at) > 1 and np.all(np.diff(at) < 0):
        at, values = at[::-1], values[::-1]
    stated = bool(_MICROMETRES.search(headings[axis]))
    if stated or at.max() < LONGEST_IN_MICROMETRES:
        if not stated:
            text = f"{where}: wavelengths of {at.min():g} to {at.max():g} are taken for micrometres"
            warnings.warn(text, ApproximationWarning, stacklevel=4)
        at = at * 1000
    if "%" in name or "percent" in name.lower():
        values = values / 100
    return Curve(name if named else "", at, values, table.keys)
