"""Which suffix is which file of a material or a measured matrix, and who reads it."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from fluorspar.bispectral.files.csv_file import SAYS
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix, check_measured
from fluorspar.errors import MaterialError, message
from fluorspar.files.formats import Format, suffixes_read, suffixes_written

__all__ = ["FORMATS", "SUFFIXES", "SUFFIXES_WRITTEN", "find_matrix", "read_material", "read_matrix"]

_HERE = "fluorspar.bispectral.files"

FORMATS = {
    ".csv": Format(
        "table of a material or matrix", f"{_HERE}.csv_file:read_csv", f"{_HERE}.material_csv:write_material"
    ),
    ".bfc": Format("Labsphere BFC-450", f"{_HERE}.bfc:read_bfc"),
}
"""The formats by suffix; a reader takes a path."""

SUFFIXES = suffixes_read(FORMATS)
"""Of files that hold a material or a measured matrix."""

SUFFIXES_WRITTEN = suffixes_written(FORMATS)
"""Of files that a material is written to."""


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
    content, texts = _content(path)
    if isinstance(content, Material):
        return content
    return replace(Material.from_matrix(path.name.rpartition(".")[0], content), **texts)


def find_matrix(path: Path) -> MeasuredMatrix | None:
    """Read a measured matrix; None if the file is of another kind (a material of factors).

    Raises
    ------
    MaterialError
        If the file is missing or malformed, or the matrix physically impossible.
    """
    content, _ = _content(path)
    return None if isinstance(content, Material) else check_measured(content)


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
    raise MaterialError(
        message(fault, where=path, expected=f"a Donaldson matrix, {' or '.join(SUFFIXES)}", fix=fix)
    )


def _content(path: Path | Traversable) -> tuple[Material | MeasuredMatrix, dict[str, Any]]:
    """What a file holds, and what it says of a material that is a measured matrix, by the names of attributes."""
    suffix = f".{path.name.rpartition('.')[2].lower()}"
    if suffix not in SUFFIXES:
        fault, expected = "a material file has an unknown suffix", " or ".join(SUFFIXES)
        name = path.name.rpartition(".")[0] or path.name
        fix = f"save a table as {name}.csv, with a line above it that says what it holds: {SAYS}"
        raise MaterialError(message(fault, where=path, expected=expected, fix=fix))
    if not path.is_file():
        fix = "check the name and the folder"
        raise MaterialError(message("the material file does not exist", where=path, fix=fix))
    content = FORMATS[suffix].read(path)
    return content if isinstance(content, tuple) else (content, {})
