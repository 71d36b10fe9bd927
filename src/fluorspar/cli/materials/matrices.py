"""Reading what the commands on materials are given."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fluorspar.errors import MaterialError, message

if TYPE_CHECKING:
    from fluorspar.bispectral.measured import MeasuredMatrix

__all__ = ["find_matrix", "read_matrix"]


def find_matrix(path: Path) -> MeasuredMatrix | None:
    """Read a measured matrix; None if the file is of another kind (a material of factors).

    Raises
    ------
    MaterialError
        If the file is missing or malformed, or the matrix physically impossible.
    """
    from fluorspar.bispectral.files.bfc import read_bfc
    from fluorspar.bispectral.files.donaldson_csv import read_donaldson_csv
    from fluorspar.bispectral.measured_check import check_measured
    from fluorspar.files.tables import read_table

    if path.suffix.lower() == ".bfc":
        return read_bfc(path)
    table = read_table(path, error=MaterialError)
    if "fluorspar-material" in table.keys:
        return None
    return check_measured(read_donaldson_csv(path))


def read_matrix(path: Path) -> MeasuredMatrix:
    """Read a measured matrix, and nothing else.

    Raises
    ------
    MaterialError
        If the file is missing, malformed, or a material of factors.
    """
    found = find_matrix(path)
    if found is None:
        fault, fix = "there is nothing to fit in a material file", "give the measured matrix it was made from"
        raise MaterialError(message(fault, where=path, expected="a Donaldson matrix, .bfc or .csv", fix=fix))
    return found
