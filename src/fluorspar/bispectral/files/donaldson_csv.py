"""Read and write tables of Donaldson matrices: band-weighted cells or a density, rows emission, columns excitation."""

from __future__ import annotations

import os

import numpy as np

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.bispectral.files.even_matrix import on_common_step
from fluorspar.bispectral.files.matrix_table import matrix_of_table
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import Table
from fluorspar.files.writing import replacing
from fluorspar.spectral.even import even_grid

__all__ = ["donaldson_matrix", "write_donaldson"]

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


def write_donaldson(
    path: str | os.PathLike[str], name: str, matrix: DonaldsonMatrix, *, density: bool = False
) -> None:
    """Write a Donaldson matrix as a table that `donaldson_matrix` reads, with its quantity and units said above it.

    Parameters
    ----------
    path : path-like
    name : str
        Of the material, for the first line.
    matrix : DonaldsonMatrix
        On N wavelengths.
    density : bool
        Cells off the diagonal are D_L in 1/nm, and those on it S; else `matrix.band()`: D_L times the step, and on the
        diagonal S with what luminesces in the same band.

    Raises
    ------
    ImageError
        If the file cannot be written; what was there before then stays.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> file = Path(tempfile.mkdtemp()) / "sheet.csv"
    >>> write_donaldson(file, "sheet", DonaldsonMatrix.from_band([[0.5, 0], [0.2, 0.4]], Wavelengths(400, 410, 10)))
    >>> file.read_text().splitlines()[-1]
    '410,0.2,0.4'
    """
    grid = matrix.wavelengths
    if density:
        cells = matrix.density()
        np.fill_diagonal(cells, matrix.reflectance)
        units = "1/nm of excitation; cells of equal wavelength: reflectance"
    else:
        cells = matrix.band()
        units = "radiance given out in a band per radiance received in one; cells of equal wavelength: with reflectance"
    lines = [
        f"# material: {' '.join(name.split())}",
        f"# quantity: {'density' if density else 'band'}",
        f"# step: {grid.step:g}",
        f"# rows: emission wavelength in nm; columns: excitation wavelength in nm; cells: {units}",
        ",".join(["nm", *(f"{w:.12g}" for w in grid.values)]),
    ]
    lines += [
        ",".join([f"{w:.12g}", *(f"{cell:.9g}" for cell in row)])
        for w, row in zip(grid.values, cells, strict=True)
    ]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
