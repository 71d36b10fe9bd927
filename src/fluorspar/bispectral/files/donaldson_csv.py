"""Read Donaldson matrices from tables: band-weighted cells or a density, rows emission, columns excitation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import Table, read_table

__all__ = ["read_donaldson_csv"]

Array = NDArray[np.float64]

_SAME = 1e-4  # nm


def read_donaldson_csv(path: str | Path) -> MeasuredMatrix:
    """Read a Donaldson matrix file.

    The file has comment lines `# quantity: band` (or `density`) and `# step: 10`, a header row with the
    excitation wavelengths, and one row per emission wavelength, which stands first in it. In both
    quantities the cells of equal wavelength are S; the others are D_L times the step, or D_L in 1/nm.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    MaterialError
        If the file is missing, malformed, or not a possible matrix.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "sheet.csv")
    ...     _ = file.write_text("# quantity: density\\n# step: 10\\nnm,400,410\\n400,0.5,0\\n410,0.02,0.4")
    ...     read_donaldson_csv(file).cells
    array([[0.5, 0. ],
           [0.2, 0.4]])
    """
    table = read_table(Path(path), error=MaterialError)
    fix = "write lines such as '# quantity: band' and '# step: 10' above the table"
    quantity = table.keys.get("quantity", "").lower()
    if quantity not in ("band", "density"):
        fault, got = "a Donaldson file does not say what its cells are", repr(quantity)
        raise MaterialError(message(fault, where=path, got=got, expected="'band' or 'density'", fix=fix))
    step = _stated_step(table, fix)
    excitation = _header_wavelengths(table)
    emission, cells = table.rows[:, 0], table.rows[:, 1:]
    if len(excitation) != cells.shape[1] or len(excitation) < 2:
        fault, fix = (
            "the header of a Donaldson file does not name every column",
            "name each excitation wavelength",
        )
        got, expected = f"{len(excitation)} wavelengths", f"{cells.shape[1]}, two or more"
        raise MaterialError(message(fault, where=path, got=got, expected=expected, fix=fix))
    _check_rows(table, excitation)
    found = float(np.diff(excitation).mean())
    if abs(found - step) > _SAME:
        fault = "the step of a Donaldson file is not that of its excitation wavelengths"
        fix = "correct the line '# step', or the header"
        raise MaterialError(message(fault, where=path, got=f"{step:g} nm", expected=f"{found:g} nm", fix=fix))
    if quantity == "density":
        diagonal = np.abs(emission[:, None] - excitation[None, :]) < _SAME
        cells = np.where(diagonal, cells, step * cells)
    return MeasuredMatrix(emission, excitation, cells, Path(path).name)


def _stated_step(table: Table, fix: str) -> float:
    text = table.keys.get("step", "")
    try:
        step = float(text.removesuffix("nm"))
    except ValueError:
        step = np.nan
    if not (np.isfinite(step) and step > 0):
        fault = "a Donaldson file does not state its step"
        got, expected = repr(text), "a number of nm, such as '# step: 10'"
        raise MaterialError(message(fault, where=table.where, got=got, expected=expected, fix=fix))
    return step


def _header_wavelengths(table: Table) -> Array:
    found: list[float] = []
    for place, cell in enumerate(table.header[1:], start=2):
        try:
            found.append(float(cell))
        except ValueError:
            found.append(np.nan)
        if not np.isfinite(found[-1]):
            fault = "the header of a Donaldson file holds something that is not a wavelength"
            where, fix = f"{table.where}, header, cell {place}", "name each excitation wavelength"
            raise MaterialError(message(fault, where=where, got=repr(cell), expected="nm", fix=fix))
        if len(found) > 1 and found[-1] <= found[-2]:
            fault = "the excitation wavelengths of a Donaldson matrix do not ascend"
            where, got = f"{table.where}, header, cell {place}", f"{found[-2]:g} nm, then {found[-1]:g} nm"
            fix = "sort the columns by wavelength and remove duplicates"
            raise MaterialError(message(fault, where=where, got=got, fix=fix))
    return np.array(found)


def _check_rows(table: Table, excitation: Array) -> None:
    """Name the line and cell of what `MeasuredMatrix` would refuse."""
    for k, (line, row) in enumerate(zip(table.lines, table.rows, strict=True)):
        if not np.all(np.isfinite(row)):
            place = int(np.argmin(np.isfinite(row)))
            where = f"{table.where}, line {line}, cell {place + 1}"
            if place:
                where += f" (emission {row[0]:g} nm, excitation {excitation[place - 1]:g} nm)"
            fault, fix = (
                "a Donaldson matrix holds a value that is not a finite number",
                "measure or interpolate it",
            )
            raise MaterialError(message(fault, where=where, got=row[place], fix=fix))
        if k and row[0] <= table.rows[k - 1, 0]:
            fault = "the emission wavelengths of a Donaldson matrix do not ascend"
            got = f"{table.rows[k - 1, 0]:g} nm, then {row[0]:g} nm"
            fix = "sort the rows by wavelength and remove duplicates"
            raise MaterialError(message(fault, where=f"{table.where}, line {line}", got=got, fix=fix))
