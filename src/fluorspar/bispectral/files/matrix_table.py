"""What all tables of a Donaldson matrix are: excitation wavelengths in the header, a row per emission wavelength."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import message
from fluorspar.files.tables import Table

__all__ = ["matrix_of_table"]

Array = NDArray[np.float64]


def matrix_of_table(table: Table) -> tuple[Array, Array, Array]:
    """Return the wavelengths and cells of a matrix; faults are named by line and cell.

    Parameters
    ----------
    table : Table
        Its first column holds emission, its header excitation wavelengths in nm.

    Returns
    -------
    emission : ndarray of shape (M,)
    excitation : ndarray of shape (P,)
    cells : ndarray of shape (M, P)

    Raises
    ------
    FluorsparError
        Of the class of the table, if a wavelength or cell is not a finite number, wavelengths do not ascend, or the
        header does not name every column.

    Examples
    --------
    >>> from fluorspar.files.tables import parse_table
    >>> matrix_of_table(parse_table("nm,400,410\\n400,0.5,0\\n410,0.1,0.4", where="sheet.csv"))[1]
    array([400., 410.])
    """
    values = table.numbers()
    emission, cells = values[:, 0], values[:, 1:]
    excitation = _excitation(table)
    if len(excitation) != cells.shape[1] or len(excitation) < 2:
        fault, fix = (
            "the header of a Donaldson matrix does not name every column",
            "name each excitation wavelength",
        )
        got, expected = f"{len(excitation)} wavelengths", f"{cells.shape[1]}, two or more"
        raise table.error(message(fault, where=table.where, got=got, expected=expected, fix=fix))
    for line, row, words in zip(table.lines[1:], values, table.rows, strict=True):
        if not np.all(np.isfinite(row)):
            at = int(np.argmin(np.isfinite(row)))
            where = f"{table.where}, line {line}, cell {at + 1}"
            where += f" (emission {row[0]:g} nm, excitation {excitation[at - 1]:g} nm)" if at else ""
            fault, fix = (
                "a Donaldson matrix holds a value that is not a finite number",
                "measure or interpolate it",
            )
            raise table.error(message(fault, where=where, got=repr(words[at]), fix=fix))
    for line, (before, after) in zip(table.lines[2:], pairwise(emission), strict=True):
        _check_ascent(table, "emission", f"line {line}", before, after)
    return emission, excitation, cells


def _excitation(table: Table) -> Array:
    wavelengths: list[float] = []
    for place, cell in enumerate(table.header[1:], start=2):
        where = f"line {table.lines[0]}, header, cell {place}"
        try:
            wavelengths.append(float(cell))
        except ValueError:
            wavelengths.append(np.nan)
        if not np.isfinite(wavelengths[-1]):
            fault, fix = (
                "the header of a Donaldson matrix holds what is not a wavelength",
                "name each excitation wavelength",
            )
            where = f"{table.where}, {where}"
            raise table.error(message(fault, where=where, got=repr(cell), expected="nm", fix=fix))
        if len(wavelengths) > 1:
            _check_ascent(table, "excitation", where, *wavelengths[-2:])
    return np.array(wavelengths)


def _check_ascent(table: Table, what: str, where: str, before: float, after: float) -> None:
    if after <= before:
        fault = f"the {what} wavelengths of a Donaldson matrix do not ascend"
        got, fix = f"{before:g} nm, then {after:g} nm", "sort them and remove duplicates"
        raise table.error(message(fault, where=f"{table.where}, {where}", got=got, fix=fix))
