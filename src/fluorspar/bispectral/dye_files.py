"""A dye from two spectrum files that say, or for which the user says, whether they count photons or energy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fluorspar.bispectral.dye import Units, dye
from fluorspar.bispectral.material import Material
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import read_table
from fluorspar.spectral.spectrum import Spectrum, SpectrumLike, read_spectrum

__all__ = ["read_dye"]


def read_dye(
    excitation: str | Path,
    emission: str | Path,
    quantum_yield: float,
    strength: float,
    *,
    units: Units | None = None,
    substrate: SpectrumLike | Material = 0.85,
    name: str = "",
    description: str = "",
    credit: str = "",
) -> Material:
    """Make a material of a dye's excitation and emission spectrum, from files; see `fluorspar.bispectral.dye.dye`.

    Parameters
    ----------
    excitation, emission
        Two-column files (`.csv`, `.spd`, `.txt`): wavelength in nm, value. A line `# units: photon` or
        `# units: energy` says what is counted; the two files may differ.
    quantum_yield
        Photons given out per photon absorbed, 0 to 1.
    strength
        The share of the light that is absorbed at the peak, 0 to 1.
    units : {"energy", "photon"}, optional
        Of files that do not say it. It is never guessed.
    substrate, name, description, credit
        See `dye`; the name is that of the emission file by default.

    Returns
    -------
    Material

    Raises
    ------
    MaterialError
        If neither a file nor `units` says what is counted, or they contradict each other; and as `dye`.
    SpectrumError
        If a file is missing or is not a spectrum.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     files = Path(folder, "absorbs.csv"), Path(folder, "emits.csv")
    ...     _ = files[0].write_text("# units: photon\\n400,0\\n450,1\\n500,0")
    ...     _ = files[1].write_text("# units: photon\\n480,0\\n530,1\\n580,0")
    ...     paint = read_dye(*files, quantum_yield=0.9, strength=0.5, substrate=0.8)
    >>> paint.name, paint.reflectance.at(450)
    ('emits', 0.4)
    """
    # energy per nm over energy per photon: emission in photons is energy times wavelength, excitation the inverse
    absorbed = _in_photons(Path(excitation), units, -1)
    emitted = _in_photons(Path(emission), units, 1)
    return dye(
        absorbed,
        emitted,
        quantum_yield,
        strength,
        units="photon",
        substrate=substrate,
        name=name or Path(emission).stem,
        description=description,
        credit=credit,
    )


def _in_photons(path: Path, units: Units | None, power: int) -> Spectrum:
    stated = read_table(path).keys.get("units", "").lower()
    if stated and units and stated != units:
        fault = "a spectrum of a dye and the option disagree on its units"
        raise MaterialError(
            message(
                fault, where=path, got=f"'{stated}' in the file, '{units}' as option", fix="drop one of them"
            )
        )
    found = stated or units
    if found not in ("energy", "photon"):
        fault = "a dye needs the units of its spectra"
        fix = "write '# units: photon' (counts of a fluorometer) or '# units: energy' (power per nm) into the file, or "
        fix += "say it as units (--units)"
        raise MaterialError(
            message(fault, where=path, got=repr(found or "nothing"), expected="'energy' or 'photon'", fix=fix)
        )
    spectrum = read_spectrum(path)
    if found == "photon":
        return spectrum
    return replace(spectrum, values=spectrum.values * spectrum.wavelengths**power)
