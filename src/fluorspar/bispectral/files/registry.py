"""Which suffix is which file of a material or a measured matrix, and who reads it."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources.abc import Traversable
from pathlib import Path

from fluorspar.bispectral.files.bfc import read_bfc
from fluorspar.bispectral.files.donaldson_csv import donaldson_matrix
from fluorspar.bispectral.files.material_csv import is_material, material_of_table, texts_of
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix, check_measured
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import read_table

__all__ = ["SUFFIXES", "find_matrix", "read_material", "read_matrix"]

SUFFIXES = (".csv", ".bfc")
"""Material or Donaldson table, and Labsphere BFC-450."""


def read_material(path: Path | Traversable) -> Material:
    """Read a material file, a Donaldson `.csv` or a Labsphere `.bfc`.

    A material file has a comment line `# fluorspar-material: 1`, further lines `# key: value` (name,
    description, credit, quality, assumed), then a header `wavelength,reflectance` with, for a fluorescent
    material, `emission,excitation` or `emission_1,excitation_1,emission_2,...`, then rows ascending in nm.

    Raises
    ------
    MaterialError
        If the file is missing or malformed.
    SpectrumError
        If the reflectance of a measured matrix leaves 0 to 1.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> text = '''# fluorspar-material: 1
    ... # name: dye
    ... wavelength,reflectance,emission,excitation
    ... 300,0.1,0,0.01
    ... 400,0.1,0,0.01
    ... 500,0.1,0.5,0
    ... '''
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "dye.csv")
    ...     _ = file.write_text(text)
    ...     dye = read_material(file)
    >>> dye.name, dye.fluorophores[0].excitation.integral()
    ('dye', 1.0)
    """
    stem, _, ending = path.name.rpartition(".")
    suffix = f".{ending.lower()}"
    if suffix not in SUFFIXES:
        fault, expected = "a material file has an unknown suffix", " or ".join(SUFFIXES)
        raise MaterialError(message(fault, where=path, expected=expected))
    if not path.is_file():
        fix = "check the name and the folder"
        raise MaterialError(message("the material file does not exist", where=path, fix=fix))
    if suffix == ".bfc":
        return Material.from_matrix(stem, read_bfc(Path(str(path))))
    table = read_table(path, error=MaterialError)
    if is_material(table):
        return material_of_table(table, stem)
    if "quantity" in table.keys:
        return replace(Material.from_matrix(stem, donaldson_matrix(table)), **texts_of(table))
    expected = "a line '# fluorspar-material: 1', or '# quantity: band' for a Donaldson matrix"
    raise MaterialError(message("the file does not say that it is a material", where=path, expected=expected))


def find_matrix(path: Path) -> MeasuredMatrix | None:
    """Read a measured matrix; None if the file is of another kind (a material of factors).

    Raises
    ------
    MaterialError
        If the file is missing or malformed, or the matrix physically impossible.
    """
    if path.suffix.lower() == ".bfc":
        return read_bfc(path)
    table = read_table(path, error=MaterialError)
    return None if is_material(table) else check_measured(donaldson_matrix(table))


def read_matrix(path: Path) -> MeasuredMatrix:
    """Read a measured matrix, and nothing else.

    Raises
    ------
    MaterialError
        If the file is missing, malformed, or a material of factors.
    """
    if (matrix := find_matrix(path)) is not None:
        return matrix
    fault, fix = "there is nothing to fit in a material file", "give the measured matrix it was made from"
    raise MaterialError(message(fault, where=path, expected="a Donaldson matrix, .bfc or .csv", fix=fix))
