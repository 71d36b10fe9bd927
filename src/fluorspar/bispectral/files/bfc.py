"""Read the matrix files of the Labsphere BFC-450 bispectral colorimeter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.files.matrix_table import matrix_of_table
from fluorspar.bispectral.measured import MeasuredMatrix, check_measured
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import read_text, table_of_lines

__all__ = ["read_bfc"]

Array = NDArray[np.float64]

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
    path : str or Path

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
    text = read_text(path, MaterialError, encoding="latin-1")
    lines = [(number, line.split()) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
    first = next((k for k, (_, cells) in enumerate(lines) if cells[0].lower() == _HEADER), None)
    if first is None:
        got = f"{len(lines)} lines, the first of them {' '.join(lines[0][1])!r}" if lines else "an empty file"
        fix = "is it a BFC-450 matrix file, and was it exported whole?"
        expected = f"a line that begins with {_HEADER!r} and names the excitation wavelengths"
        fault = "a BFC file has no header of excitation wavelengths"
        raise MaterialError(message(fault, where=path, got=got, expected=expected, fix=fix))
    end = next((k for k, (_, cells) in enumerate(lines) if k > first and cells[0].upper() == _END), None)
    table = table_of_lines({}, lines[first:end], has_header=True, where=path, error=MaterialError)
    if end is None:
        fault, fix = "a BFC file has no end", "the file was truncated; export it again"
        got, expected = f"{len(table.rows)} rows", f"a line {_END!r} below the table"
        raise MaterialError(message(fault, where=path, got=got, expected=expected, fix=fix))
    emission, excitation, cells = matrix_of_table(table)
    _check_ranges(lines[:first], emission, excitation, path)
    return check_measured(MeasuredMatrix(emission, excitation, cells, path.name))


def _check_ranges(
    preamble: list[tuple[int, list[str]]], emission: Array, excitation: Array, path: Path
) -> None:
    """Compare the table with the line `first last step columns first step` above it, if there is one."""
    for number, cells in preamble:
        try:
            stated = [float(cell) for cell in cells]
        except ValueError:
            continue
        if len(stated) != 6 or len(emission) < 2:
            continue
        step, count = emission[1] - emission[0], len(excitation)
        actual = [emission[0], emission[-1], step, count, excitation[0], excitation[1] - excitation[0]]
        if not np.allclose(stated, actual):
            expected, got = (" ".join(f"{value:g}" for value in values) for values in (stated, actual))
            fault = "the table of a BFC file does not have the wavelengths that its header states"
            fix = "the file was truncated, or its step changed; export it again"
            where = f"{path}, line {number} (emission first last step, excitation count first step)"
            raise MaterialError(message(fault, where=where, got=got, expected=expected, fix=fix))
