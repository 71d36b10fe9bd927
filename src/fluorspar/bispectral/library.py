"""Find a material: in the shipped library, in folders of the user's, or in a file; and measured matrices in files."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np

from fluorspar.bispectral.files.bfc import read_bfc
from fluorspar.bispectral.files.donaldson_csv import read_donaldson_csv
from fluorspar.bispectral.material import Fluorophore, Material, mix
from fluorspar.bispectral.measured import MeasuredMatrix, check_measured
from fluorspar.errors import MaterialError, SpectrumError, message
from fluorspar.files.tables import Table, read_table
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["ENVIRONMENT", "find_matrix", "material", "materials", "read_material", "read_matrix"]

ENVIRONMENT = "FLUORSPAR_MATERIALS"
"""Environment variable with more folders of material files, separated as in PATH."""

_SUFFIXES = (".csv", ".bfc")
_MIXTURE = re.compile(r"^(?P<name>[^,]+?)\s*:\s*(?P<weight>[0-9.eE+-]+)$")


def material(
    name: str | Path, directories: Sequence[str | Path] = (), *, base: Path | None = None
) -> Material:
    """Return a material by name, from a file, or mixed.

    Parameters
    ----------
    name
        The name of a library material; or a file: a material `.csv`, a Donaldson `.csv` or a Labsphere
        `.bfc`; or a mixture "A:0.3,B:0.7" of such, in which D is mixed linearly.
    directories
        Folders to look in first, before those in the environment variable `FLUORSPAR_MATERIALS` and before
        the shipped library.
    base
        Folder beside which files are looked for before anything else, also those of a mixture: that of a scene.

    Raises
    ------
    MaterialError
        If there is no such material (the message names similar ones) or its file is malformed.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "grey.csv")
    ...     _ = file.write_text("# fluorspar-material: 1\\nwavelength,reflectance\\n300,0.5\\n780,0.5")
    ...     material("grey", [folder]).reflectance.at(550), material(file).name
    (0.5, 'grey')
    """
    if isinstance(name, Path):
        return read_material(name)
    if base is not None and (base / name).is_file():
        return read_material(base / name)
    known = _files(directories)
    if name in known:
        return read_material(known[name])
    parts = [_MIXTURE.match(part.strip()) for part in name.split(",")]
    if all(parts) and not Path(name).is_file():
        ingredients = [(part["name"], part["weight"]) for part in parts if part]
        return mix(
            [(material(part, directories, base=base), _weight(weight, name)) for part, weight in ingredients],
            name,
        )
    if Path(name).suffix.lower() in _SUFFIXES or os.sep in name or "/" in name:
        return read_material(Path(name))
    folded = {key.casefold(): key for key in known}
    if name.strip().casefold() in folded:
        return read_material(known[folded[name.strip().casefold()]])
    close = [folded[key] for key in get_close_matches(name.casefold(), folded, n=3)]
    fix = f"did you mean {' or '.join(close)}?" if close else "`fluorspar materials list` shows all"
    expected = f"a file (.csv, .bfc), a mixture A:0.3,B:0.7, or one of: {', '.join(sorted(known))}"
    raise MaterialError(message("there is no such material", got=repr(name), expected=expected, fix=fix))


def materials(directories: Sequence[str | Path] = ()) -> list[str]:
    """List the names that `material` knows.

    Parameters
    ----------
    directories
        As for `material`.

    Raises
    ------
    MaterialError
        If one of the directories does not exist.

    Examples
    --------
    >>> isinstance(materials(), list)
    True
    """
    return sorted(_files(directories), key=str.casefold)


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
    stem, _, suffix = path.name.rpartition(".")
    if suffix.lower() not in ("csv", "bfc"):
        raise MaterialError(
            message("a material file has an unknown suffix", where=path, expected=".csv or .bfc")
        )
    if not path.is_file():
        fix = "check the name and the folder"
        raise MaterialError(message("the material file does not exist", where=path, fix=fix))
    if suffix.lower() == "bfc":
        return Material.from_matrix(stem, read_bfc(Path(str(path))))
    table = read_table(path, error=MaterialError)
    if "fluorspar-material" in table.keys:
        return _from_table(table, stem)
    if "quantity" in table.keys:
        found = Material.from_matrix(stem, read_donaldson_csv(Path(str(path))))
        return replace(found, **_words(table))  # type: ignore[arg-type]
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


def _from_table(table: Table, stem: str) -> Material:
    where = table.where
    if table.keys["fluorspar-material"] != "1":
        got = table.keys["fluorspar-material"]
        raise MaterialError(
            message("a material file has an unknown version", where=where, got=got, expected="1")
        )
    header = [cell.lower() for cell in table.header]
    dyes = [cell.removeprefix("emission") for cell in header if cell.startswith("emission")]
    expected = ["wavelength", "reflectance"] + [
        f"{what}{dye}" for dye in dyes for what in ("emission", "excitation")
    ]
    if sorted(header) != sorted(expected):
        got, wanted = ",".join(table.header), "wavelength,reflectance[,emission,excitation]"
        raise MaterialError(
            message("a material file has unknown columns", where=where, got=got, expected=wanted)
        )
    name = table.keys.get("name", stem)
    columns = dict(zip(header, table.rows.T, strict=True))

    def spectrum(column: str) -> Spectrum:
        title = f"{column.replace('_', ' ')} of {name!r}"
        return Spectrum(columns["wavelength"], columns[column], title, table.keys.get("assumed", ""))

    try:
        fluorophores = tuple(
            Fluorophore(spectrum(f"emission{dye}"), spectrum(f"excitation{dye}"), f"{name}{dye}")
            for dye in dyes
            if np.any(columns[f"emission{dye}"]) or np.any(columns[f"excitation{dye}"])
        )
        return Material(name, spectrum("reflectance"), fluorophores, **_words(table))  # type: ignore[arg-type]
    except SpectrumError as err:
        raise MaterialError(
            message("a material file holds an impossible spectrum", where=where, got=err)
        ) from err


def _words(table: Table) -> dict[str, str]:
    return {key: table.keys.get(key, "") for key in ("description", "credit", "quality", "assumed")}


def _weight(text: str, mixture: str) -> float:
    try:
        return float(text)
    except ValueError as err:
        raise MaterialError(message("a weight is not a number", where=mixture, got=repr(text))) from err


def _files(directories: Sequence[str | Path]) -> dict[str, Path | Traversable]:
    """Material files by name; what is found first wins."""
    from_environment = [Path(part) for part in os.environ.get(ENVIRONMENT, "").split(os.pathsep) if part]
    found: dict[str, Path | Traversable] = {}
    folders: list[Path | Traversable] = [*map(Path, directories), *from_environment]
    for folder in [*folders, files("fluorspar") / "data" / "materials"]:
        if not folder.is_dir():
            fix = f"correct the argument or the environment variable {ENVIRONMENT}"
            raise MaterialError(message("a folder of materials does not exist", where=folder, fix=fix))
        for file in sorted(folder.iterdir(), key=lambda entry: entry.name):
            stem, _, suffix = file.name.rpartition(".")
            if f".{suffix.lower()}" in _SUFFIXES:
                found.setdefault(stem, file)
    return found
