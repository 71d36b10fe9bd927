"""Reading what the commands on materials are given."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fluorspar.errors import MaterialError, message

if TYPE_CHECKING:
    from fluorspar.spectral.measured import MeasuredMatrix

__all__ = ["check_size", "find_matrix", "read_matrix"]

_LARGEST = 10_000_000  # bytes; a measured matrix has 25 kB


def check_size(name: str | Path) -> None:
    """Refuse a file that was named by mistake before it is read.

    Raises
    ------
    MaterialError
        If there is a file of that name and it is larger than 10 MB.

    Examples
    --------
    >>> check_size("poster-red")
    """
    path = Path(name)
    if path.is_file() and (size := path.stat().st_size) > _LARGEST:
        fault, fix = "the file is too large for a material", "was another file meant?"
        expected = f"at most {_LARGEST:,} bytes"
        raise MaterialError(message(fault, where=path, got=f"{size:,} bytes", expected=expected, fix=fix))


def find_matrix(path: Path) -> MeasuredMatrix | None:
    """Read a measured matrix; None if the file is of another kind (a material of factors).

    Raises
    ------
    MaterialError
        If the file is missing or malformed, or the matrix physically impossible.
    """
    from fluorspar.spectral.bfc import read_bfc
    from fluorspar.spectral.measured import read_donaldson_csv
    from fluorspar.spectral.measured_check import check_measured
    from fluorspar.spectral.tables import read_table

    check_size(path)
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
