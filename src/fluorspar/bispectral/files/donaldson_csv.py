"""Read Donaldson matrices from tables: band-weighted cells or a density, rows emission, columns excitation."""

from __future__ import annotations

import numpy as np

from fluorspar.bispectral.files.even_matrix import on_common_step
from fluorspar.bispectral.files.matrix_table import matrix_of_table
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import Table
from fluorspar.spectral.even import even_grid

__all__ = ["donaldson_matrix"]

_SAME = 1e-4  # nm
_FIX = "write lines such as '# quantity: band' and '# step: 10' above the table"


def donaldson_matrix(table: Table) -> MeasuredMatrix:
    """Return the matrix that the table of a Donaldson file is.

    The file has comment lines `# quantity: band` (or `density`) and, for `band`, `# step: 10`, a header row with the
    excitation wavelengths, and one row per emission wavelength, which stands first in it; other layouts are described
    in `matrix_of_table`. In both quantities the cells of equal wavelength are S; the others are D_L times the step, or
    D_L in 1/nm. Wavelengths may be uneven and have different steps: they are brought to a common one.

    Raises
    ------
    MaterialError
        If quantity or step are not stated, the table is malformed, or not a possible matrix.

    Warns
    -----
    ApproximationWarning
        If the matrix is interpolated to a common step, or rows are taken for excitation wavelengths.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from fluorspar.files.tables import read_table
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "sheet.csv")
    ...     _ = file.write_text("# quantity: density\\n# step: 10\\nnm,400,410\\n400,0.5,0\\n410,0.02,0.4")
    ...     donaldson_matrix(read_table(file, error=MaterialError)).cells
    array([[0.5, 0. ],
           [0.2, 0.4]])
    """
    quantity = table.keys.get("quantity", "").lower()
    if quantity not in ("band", "density"):
        fault, expected = "a Donaldson file does not say what its cells are", "'band' or 'density'"
        raise MaterialError(
            message(fault, where=table.where, got=repr(quantity), expected=expected, fix=_FIX)
        )
    emission, excitation, cells = matrix_of_table(table)
    stated = _stated_step(table) if quantity == "band" or "step" in table.keys else None
    grid = even_grid(excitation)
    if stated and grid is not None and abs(grid.step - stated) > _SAME:
        fault = "the step of a Donaldson file is not that of its excitation wavelengths"
        got, expected, fix = f"{stated:g} nm", f"{grid.step:g} nm", "correct the line '# step', or the header"
        raise MaterialError(message(fault, where=table.where, got=got, expected=expected, fix=fix))
    diagonal = np.abs(emission[:, None] - excitation) < _SAME
    density = cells if quantity == "density" else np.where(diagonal, cells, cells / (stated or 1.0))
    w_em, w_ex, even = on_common_step(emission, excitation, density, table.where)
    if even is density and quantity == "band":
        return MeasuredMatrix(emission, excitation, cells, table.where.name)
    step = float(np.diff(w_ex).mean())
    band = np.where(np.abs(w_em[:, None] - w_ex) < _SAME, even, step * even)
    return MeasuredMatrix(w_em, w_ex, band, table.where.name)


def _stated_step(table: Table) -> float:
    text = table.keys.get("step", "")
    try:
        step = float(text.removesuffix("nm"))
    except ValueError:
        step = np.nan
    if not (np.isfinite(step) and step > 0):
        fault, expected = "a Donaldson file does not state its step", "a number of nm, such as '# step: 10'"
        raise MaterialError(message(fault, where=table.where, got=repr(text), expected=expected, fix=_FIX))
    return step
