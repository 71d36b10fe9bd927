"""Write material files: small text tables that `read_material` reads."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.material import Material
from fluorspar.errors import MaterialError, message
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["refuse_without_factors", "write_material"]

_RANGE = (300.0, 780.0)  # of a table of constants
_EDGE = 0.001  # nm, beside the end of a spectrum that does not end at 0


def write_material(path: str | Path, material: Material) -> Path:
    """Write a material to a `.csv` file, to 6 digits.

    The table has the wavelengths of all its spectra; in between all of them are linear, so nothing is
    resampled. Where the reflectance ends before the others its end value is held, and the file says so.

    Parameters
    ----------
    path
        The file; an existing one is replaced when the new one is complete.
    material
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
    refuse_without_factors(material)
    lines = ["# fluorspar-material: 1", f"# name: {' '.join(material.name.split())}"]
    single = len(material.fluorophores) == 1
    columns = {"reflectance": material.reflectance}
    for k, dye in enumerate(material.fluorophores, start=1):
        columns |= {f"emission_{k}": dye.emission, f"excitation_{k}": dye.excitation}
    wavelengths = _union(list(columns.values()))
    for key in ("description", "credit", "quality", "assumed"):
        lines += [f"# {key}: {part}" for part in getattr(material, key).splitlines()]
    lines += [f"# assumed: {text}" for text in _held(material.reflectance, wavelengths)]
    header = ["wavelength", *(name.removesuffix("_1") if single else name for name in columns)]
    table = [wavelengths]
    for name, spectrum in columns.items():
        outside = {} if name == "reflectance" else {"left": 0.0, "right": 0.0}
        table.append(np.interp(wavelengths, spectrum.wavelengths, spectrum.values, **outside))
    lines.append(",".join(header))
    lines += [
        ",".join([f"{row[0]:.7g}", *(f"{value:.6g}" for value in row[1:])]) for row in np.array(table).T
    ]
    temporary = path.with_name(path.name + ".part")
    try:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
        os.replace(temporary, path)
    except OSError as err:
        temporary.unlink(missing_ok=True)
        raise MaterialError(message("a material file cannot be written", where=path, got=err)) from err
    return path


def refuse_without_factors(material: Material) -> None:
    """Refuse a material that has no reflectance, emission and excitation of its own.

    Raises
    ------
    MaterialError
        If it holds a measured matrix, or is a mixture that keeps its ingredients.

    Examples
    --------
    >>> refuse_without_factors(Material("grey", Spectrum.constant(0.45)))
    """
    if material.matrix is not None:
        fault, fix = "a material that holds a measured matrix has no spectra of factors", "fit it first"
        raise MaterialError(message(fault, where=material.name, fix=fix))
    if material.parts:
        fault = "a mixture of measured matrices, or of materials with data for different ranges, has no single table"
        fix = "bring the ingredients to one range first (fluorspar.bispectral.resampling.resampled)"
        raise MaterialError(message(fault, where=material.name, fix=fix))


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
