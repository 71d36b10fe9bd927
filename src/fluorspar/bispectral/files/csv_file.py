"""A `.csv` file is a material of factors or a Donaldson matrix, as its comment lines say."""

from __future__ import annotations

from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from fluorspar.bispectral.files.donaldson_csv import donaldson_matrix
from fluorspar.bispectral.files.material_csv import is_material, material_of_table, texts_of
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import read_table

__all__ = ["SAYS", "read_csv"]

SAYS = (
    "'# fluorspar-material: 1' (with columns wavelength,reflectance), "
    "or '# quantity: band' and '# step: 10' (of a Donaldson matrix)"
)
"""What a file must say above its table, in words."""


def read_csv(path: Path | Traversable) -> tuple[Material | MeasuredMatrix, dict[str, Any]]:
    """Read a material or a Donaldson matrix, see `read_material` and `donaldson_matrix` for the tables.

    Returns
    -------
    content : Material or MeasuredMatrix
        The matrix is not checked.
    texts : dict
        What the file says of a material, by the names of its attributes.

    Raises
    ------
    MaterialError
        If the file is missing or malformed.
    """
    table = read_table(path, error=MaterialError)
    texts = texts_of(table)
    if is_material(table):
        return material_of_table(table, path.name.rpartition(".")[0]), texts
    if "quantity" in table.keys:
        return donaldson_matrix(table), texts
    fix = "write such a line above the table; `fluorspar materials from-eem` and `dye` take relative spectra"
    expected = f"a line {SAYS}"
    raise MaterialError(
        message("the file does not say what it holds", where=path, expected=expected, fix=fix)
    )
