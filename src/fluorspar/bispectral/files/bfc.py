"""Read the matrix files of the Labsphere BFC-450 bispectral colorimeter."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np

from fluorspar.bispectral.measured import MeasuredMatrix, check_measured
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import refuse_huge

__all__ = ["read_bfc"]

_HEADER = "r:c:"
_END = "EOD"


def read_bfc(path: str | Path) -> MeasuredMatrix:
    """Read a `.bfc` file: a bispectral radiance factor, band-weighted, rows emission, columns excitation.

    The file starts with free text; a line that begins with `r:c:` names the excitation wavelengths, then
    there is a line per emission wavelength, and `EOD` ends it. Lines may end with CR, LF or both, and blank
    lines count for nothing. If a line above the table states ranges and steps, they must be those of the
    table.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    MeasuredMatrix
        Emission and excitation in nm, cells as they stand: S on the diagonal, elsewhere D_L times the step.

    Raises
    ------
    MaterialError
        If the file is missing, larger than 10 MB, truncated or malformed (the message names line and cell),
        is transposed, or gives out more photons than it gets.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> text = "a sheet\\r\\r400 410 10 2 400 10\\rr:c:\\t400\\t410\\r400\\t0.5\\t0\\r410\\t0.1\\t0.4\\rEOD\\r"
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "sheet.bfc")
    ...     _ = file.write_bytes(text.encode())
    ...     read_bfc(file).cells
    array([[0.5, 0. ],
           [0.1, 0.4]])
    """
    path = Path(path)
    lines = [(number, line.split()) for number, line in enumerate(_lines(path), start=1) if line.strip()]
    header = next((k for k, (_, cells) in enumerate(lines) if cells[0].lower() == _HEADER), None)
    if header is None:
        got = (
            "an empty file"
            if not lines
            else f"{len(lines)} lines, the first of them {' '.join(lines[0][1])!r}"
        )
        fix = "is it a BFC-450 matrix file, and was it exported whole?"
        expected = f"a line that begins with {_HEADER!r} and names the excitation wavelengths"
        fault = "a BFC file has no header of excitation wavelengths"
        raise MaterialError(message(fault, where=path, got=got, expected=expected, fix=fix))
    number, cells = lines[header]
    excitation = _ascending(_numbers(cells[1:], path, number), path, number, "excitation")
    emission, rows, ended = [], [], False
    for number, cells in lines[header + 1 :]:
        if cells[0].upper() == _END:
            ended = True
            break
        values = _numbers(cells, path, number)
        if len(values) != len(excitation) + 1:
            fault, expected = "a row of a BFC file has the wrong number of cells", f"{len(excitation) + 1}"
            fix = "the file was truncated or edited; export it again"
            raise MaterialError(
                message(fault, where=f"{path}, line {number}", got=len(values), expected=expected, fix=fix)
            )
        emission.append(values[0])
        _ascending(emission[-2:], path, number, "emission")
        rows.append(values[1:])
    if not ended:
        fault, fix = "a BFC file has no end", "the file was truncated; export it again"
        expected = f"a line {_END!r} below the table"
        raise MaterialError(message(fault, where=path, got=f"{len(rows)} rows", expected=expected, fix=fix))
    _check_ranges(lines[:header], emission, excitation, path)
    matrix = MeasuredMatrix(
        np.array(emission), np.array(excitation), np.array(rows).reshape(len(rows), -1), path.name
    )
    return check_measured(matrix)


def _lines(path: Path) -> list[str]:
    """Return the lines of a file; its size is looked at first, so that a file named by mistake is not read."""
    try:
        refuse_huge(path, MaterialError)
        text = path.read_bytes().decode("latin-1")
    except FileNotFoundError as err:
        raise MaterialError(
            message("the file does not exist", where=path, fix="check the name and the folder")
        ) from err
    except OSError as err:
        raise MaterialError(message("the file cannot be read", where=path, got=err)) from err
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _numbers(cells: list[str], path: Path, line: int) -> list[float]:
    values = []
    for place, cell in enumerate(cells, start=1):
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            where = f"{path}, line {line}, cell {place}"
            fault = "a cell of a BFC file is not a finite number"
            raise MaterialError(message(fault, where=where, got=repr(cell), expected="a number"))
        values.append(value)
    return values


def _ascending(wavelengths: list[float], path: Path, line: int, what: str) -> list[float]:
    for before, after in pairwise(wavelengths):
        if after <= before:
            fault = f"the {what} wavelengths of a BFC file do not ascend"
            got = f"{before:g} nm, then {after:g} nm"
            raise MaterialError(
                message(fault, where=f"{path}, line {line}", got=got, fix="export the file again")
            )
    return wavelengths


def _check_ranges(
    preamble: list[tuple[int, list[str]]], emission: list[float], excitation: list[float], path: Path
) -> None:
    """Compare the table with the line `first last step columns first step` above it, if there is one."""
    for number, cells in preamble:
        try:
            stated = [float(cell) for cell in cells]
        except ValueError:
            continue
        if len(stated) != 6 or len(emission) < 2 or len(excitation) < 2:
            continue
        found = [
            emission[0],
            emission[-1],
            emission[1] - emission[0],
            len(excitation),
            excitation[0],
            excitation[1] - excitation[0],
        ]
        if not np.allclose(stated, found):
            expected, got = (" ".join(f"{value:g}" for value in values) for values in (stated, found))
            fault = "the table of a BFC file is not the one its header states"
            fix = "the file was truncated, or its step changed; export it again"
            where = f"{path}, line {number} (emission first last step, excitation count first step)"
            raise MaterialError(message(fault, where=where, got=got, expected=expected, fix=fix))
