"""Write material files: small text tables that `read_material` reads."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import MaterialError, message
from fluorspar.spectral.material import Material
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["write_material"]

_RANGE = (300.0, 780.0)  # of a table of constants
_EDGE = 0.001  # nm, beside the end of a spectrum that does not end at 0


def write_material(path: str | Path, material: Material) -> Path:
    """Write a material to a `.csv` file, to 6 digits.

    The table has the wavelengths of all its spectra; in between all of them are linear, so nothing is
    resampled.

    Parameters
    ----------
    path
        The file; an existing one is replaced when the new one is complete.
    material
        Without a measured matrix and not a mixture of such.

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
    if material.matrix is not None or material.parts:
        fault, fix = "a material that holds a measured matrix has no table of factors", "fit it first"
        raise MaterialError(message(fault, where=material.name, fix=fix))
    lines = ["# fluorspar-material: 1", f"# name: {material.name}"]
    for key in ("description", "credit", "quality", "assumed"):
        lines += [f"# {key}: {part}" for part in getattr(material, key).splitlines()]
    single = len(material.fluorophores) == 1
    columns = {"reflectance": material.reflectance}
    for k, dye in enumerate(material.fluorophores, start=1):
        columns |= {f"emission_{k}": dye.emission, f"excitation_{k}": dye.excitation}
    wavelengths = _union(list(columns.values()))
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
