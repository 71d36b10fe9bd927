"""Material files: small text tables of reflectance, emission and excitation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.errors import ImageError, MaterialError, SpectrumError, message
from fluorspar.files.tables import Table
from fluorspar.files.writing import replacing
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["is_material", "material_of_table", "texts_of", "write_material"]

_TEXTS = ("description", "credit", "quality", "assumed")

_RANGE = (300.0, 780.0)  # of a table of constants
_EDGE = 0.001  # nm, beside the end of a spectrum that does not end at 0


def write_material(path: str | Path, material: Material) -> Path:
    """Write a material to a `.csv` file, to 6 digits.

    The table has the wavelengths of all its spectra; in between all of them are linear, so nothing is
    resampled. Where the reflectance ends before the others its end value is held, and the file says so.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced when the new one is complete.
    material : Material
        Of factors: without a measured matrix and not a mixture of materials that keep their own tables.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    MaterialError
        If the material holds a measured matrix, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = write_material(Path(folder, "grey.csv"), Material("grey", Spectrum.constant(0.45)))
    ...     print(file.read_text())
    # fluorspar-material: 1
    # name: grey
    wavelength,reflectance
    300,0.45
    780,0.45
    <BLANKLINE>
    """
    path = Path(path)
    spectra = material.as_spectra()
    lines = ["# fluorspar-material: 1", f"# name: {' '.join(material.name.split())}"]
    single = len(spectra.fluorophores) == 1
    columns = {"reflectance": spectra.reflectance}
    for k, dye in enumerate(spectra.fluorophores, start=1):
        columns |= {f"emission_{k}": dye.emission, f"excitation_{k}": dye.excitation}
    wavelengths = _union(list(columns.values()))
    for key in _TEXTS:
        lines += [f"# {key}: {part}" for part in getattr(material, key).splitlines()]
    lines += [f"# assumed: {text}" for text in _held(spectra.reflectance, wavelengths)]
    header = ["wavelength", *(name.removesuffix("_1") if single else name for name in columns)]
    table = [wavelengths]
    for name, spectrum in columns.items():
        outside = {} if name == "reflectance" else {"left": 0.0, "right": 0.0}
        table.append(np.interp(wavelengths, spectrum.wavelengths, spectrum.values, **outside))
    lines.append(",".join(header))
    lines += [
        ",".join([f"{row[0]:.7g}", *(f"{value:.6g}" for value in row[1:])]) for row in np.array(table).T
    ]
    try:
        with replacing(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except ImageError as err:
        raise MaterialError(message("a material file cannot be written", where=path, got=err)) from err
    return path


def is_material(table: Table) -> bool:
    """Whether a table says that it is a material of spectra."""
    return "fluorspar-material" in table.keys


def texts_of(table: Table) -> dict[str, Any]:
    """What the comment lines of a table say of a material, by the names of its attributes."""
    return {key: table.keys.get(key, "") for key in _TEXTS}


def material_of_table(table: Table, stem: str) -> Material:
    """Make the material of a material file.

    Parameters
    ----------
    table : Table
        See `fluorspar.bispectral.files.registry.read_material`.
    stem : str
        The name of a material that states none.

    Raises
    ------
    MaterialError
        If version or columns are unknown, a cell is not a number, or a spectrum is impossible.
    """
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
    columns = dict(zip(header, table.numbers().T, strict=True))

    def spectrum(column: str) -> Spectrum:
        title = f"{column.replace('_', ' ')} of {name!r}"
        return Spectrum(columns["wavelength"], columns[column], title, table.keys.get("assumed", ""))

    try:
        fluorophores = tuple(
            Fluorophore(spectrum(f"emission{dye}"), spectrum(f"excitation{dye}"), f"{name}{dye}")
            for dye in dyes
            if np.any(columns[f"emission{dye}"]) or np.any(columns[f"excitation{dye}"])
        )
        return Material(name, spectrum("reflectance"), fluorophores, **texts_of(table))
    except SpectrumError as err:
        raise MaterialError(
            message("a material file holds an impossible spectrum", where=where, got=err)
        ) from err


def _held(reflectance: Spectrum, wavelengths: NDArray[np.float64]) -> list[str]:
    """Say where the table goes beyond the data of the reflectance."""
    if reflectance.is_constant:
        return []
    first, last = reflectance.support
    sides = [f"below {first:g} nm"] if wavelengths[0] < first - _EDGE else []
    sides += [f"above {last:g} nm"] if wavelengths[-1] > last + _EDGE else []
    return [f"reflectance {side} not given, held at its value there" for side in sides]


def _union(spectra: list[Spectrum]) -> NDArray[np.float64]:
    """Return the wavelengths of all spectra, with one beside each inner end at which a spectrum falls to 0."""
    reflectance, *factors = spectra
    wavelengths = list(_RANGE if reflectance.is_constant else reflectance.wavelengths)
    for spectrum in factors:
        wavelengths += [*spectrum.wavelengths]
    lowest, highest = min(wavelengths), max(wavelengths)
    for spectrum in factors:
        first, last = spectrum.support
        wavelengths += [first - _EDGE] if spectrum.values[0] and first > lowest else []
        wavelengths += [last + _EDGE] if spectrum.values[-1] and last < highest else []
    return np.unique(np.round(wavelengths, 3))
