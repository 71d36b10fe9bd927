"""A dye on a substrate, from its excitation and emission spectrum, quantum yield and strength.

The spectra count photons or energy: files say it, or the user says it for them.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.errors import ExtrapolationWarning, MaterialError, SpectrumError, message
from fluorspar.files.curves import Role, read_curve
from fluorspar.files.names import file_and_column
from fluorspar.spectral.spectrum import Spectrum, SpectrumLike, as_spectrum, read_spectrum, trapezoid

__all__ = ["Units", "check_order", "counted_units", "dye", "read_dye"]

Array = NDArray[np.float64]
Units = Literal["energy", "photon"]

_RANGE = (300.0, 780.0)  # nm, of a substrate that is the same everywhere
_EDGE = 0.001  # nm, beside the end of a table that does not end at 0
_HIGH_END = 0.05  # of the peak


def dye(
    excitation: Spectrum,
    emission: Spectrum,
    quantum_yield: float,
    strength: float,
    *,
    units: Units,
    substrate: SpectrumLike | Material = 0.85,
    name: str = "dye",
    description: str = "",
    credit: str = "",
    assumed: str = "",
) -> Material:
    """Make the material that a dye on a matte substrate is.

    The dye absorbs the share `a(ex) = strength * excitation(ex) / max(excitation)` of the light, reflects
    what the substrate reflects of the rest, S = (1 - a) S_substrate, and of each `a` photons absorbed gives
    out `quantum_yield * a` towards the outside, spread over wavelength as `emission` says, whatever was
    absorbed. In energy, and with D_L = alpha beta:

        alpha(em) beta(ex) = quantum_yield a(ex) ex q(em) / em,     q = photons per nm, integral 1

    Emission at wavelengths shorter than the excitation is left out (Stokes), so the photon yield of
    excitation inside the emission band is less than `quantum_yield * a`.

    Outside their tables the dye neither absorbs nor emits: S is that of the substrate, and the quantum yield counts
    the photons of the table alone. `assumed` of the material says so if a table ends above 0.

    Parameters
    ----------
    excitation : Spectrum
        Relative; how much light of one wavelength is absorbed. In units of "photon" an excitation spectrum
        is what a quantum counter corrects for: emission per incident photon; it is then proportional to
        `a`. In "energy" it is emission per incident energy, proportional to `a` times wavelength.
    emission : Spectrum
        Relative, per nm: photons (as quantum-counting instruments give it) or energy.
    quantum_yield : float
        Photons given out per photon absorbed, 0 to 1.
    strength : float
        The share of the light that is absorbed at the peak of the absorption, 0 to 1.
    units : {"energy", "photon"}
        Of both spectra. Must be given: no file says it by itself, and the difference is some nanometres of
        the peak.
    substrate : float, Spectrum, ... or Material, optional
        Reflectance of what is dyed; if it fluoresces, its dyes get the light that this one leaves, as S does:
        their beta times 1 - a.
    name, description, credit, assumed : str
        Of the material.

    Returns
    -------
    Material

    Raises
    ------
    MaterialError
        If units are not given as one of the two, quantum yield or strength lies outside 0 to 1, a spectrum is
        negative or 0 everywhere, or most of the emission lies at shorter wavelengths than the excitation.

    Warns
    -----
    ExtrapolationWarning
        If a table ends, within the data of the substrate, at more than 5 % of its peak.

    Examples
    --------
    >>> peak = Spectrum([400, 450, 500], [0, 1, 0]), Spectrum([480, 530, 580], [0, 1, 0])
    >>> paint = dye(*peak, quantum_yield=0.9, strength=0.5, units="photon", substrate=0.8)
    >>> paint.reflectance.at(450), paint.reflectance.at(600)
    (0.4, 0.8)
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> yields = paint.on(Wavelengths(400, 600, 1)).photon_yield()
    >>> round(float(yields[50]), 3)  # 0.4 reflected, 0.9 x 0.5 luminescent
    0.85
    """
    if units not in ("energy", "photon"):
        fix = 'say units="photon" for counts of a fluorometer, "energy" for power per nm'
        fault = "a dye needs the units of its spectra"
        raise MaterialError(
            message(fault, where=name, got=repr(units), expected="'energy' or 'photon'", fix=fix)
        )
    for what, value in (("quantum yield", quantum_yield), ("strength", strength)):
        if not isinstance(value, (int, float, np.number)) or not 0 <= value <= 1:
            fault = f"the {what} of a dye is impossible"
            raise MaterialError(message(fault, where=name, got=repr(value), expected="a number, 0 to 1"))
    for spectrum in (excitation, emission):
        if spectrum.values.min() < 0 or not spectrum.values.any() or spectrum.is_constant:
            fault = "a spectrum of a dye is negative, 0 everywhere or constant"
            raise MaterialError(message(fault, where=f"{name}, {spectrum.title}"))
    try:
        material = substrate if isinstance(substrate, Material) else Material(name, as_spectrum(substrate))
        base = material.as_spectra()
        within = _RANGE if base.reflectance.is_constant else base.reflectance.support
    except SpectrumError as err:
        raise MaterialError(message("a dyed substrate is impossible", where=name, got=err)) from err
    tables = (("absorption", excitation), ("emission", emission))
    ends = [_end_in_words(name, what, spectrum, within) for what, spectrum in tables]
    assumed = "; ".join(filter(None, [assumed, *ends]))
    excitation, emission = (_ended(spectrum, within) for spectrum in (excitation, emission))
    ex, em = excitation.wavelengths, emission.wavelengths
    absorbed = excitation.values / (ex if units == "energy" else 1.0)
    absorbed = strength * absorbed / absorbed.max()
    photons = emission.values * (em if units == "energy" else 1.0)
    photons = photons / trapezoid(photons, em)
    taken_up = absorbed * ex
    area = trapezoid(taken_up, ex)
    check_order(name, ex, taken_up, em, photons)
    fluorophore = Fluorophore(
        Spectrum(em, quantum_yield * area * photons / em, f"emission of {name!r}", assumed),
        Spectrum(ex, taken_up, f"excitation of {name!r}", assumed),
        name,
    )
    try:
        reflectance = _dyed(base.reflectance, Spectrum(ex, absorbed), f"reflectance of {name!r}", assumed)
        return Material(
            name,
            reflectance,
            (*(_shaded(other, ex, absorbed) for other in base.fluorophores), fluorophore),
            description=description,
            credit=credit,
            assumed=assumed,
        )
    except SpectrumError as err:
        raise MaterialError(message("a dyed substrate is impossible", where=name, got=err)) from err


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
    excitation, emission : str or Path
        Tables (`.csv`, `.spd`, `.txt`): wavelength in nm, value. Of several columns the one is taken whose heading says
        excitation (or absorption) and emission, so both may be one file; `FILE:COLUMN` names another. A line
        `# units: photon` or `# units: energy` says what is counted; the two files may differ. An absorption is a share
        of the light, in either unit.
    quantum_yield : float
        Photons given out per photon absorbed, 0 to 1.
    strength : float
        The share of the light that is absorbed at the peak, 0 to 1.
    units : {"energy", "photon"}, optional
        Of files that do not say it. It is never guessed.
    substrate, name, description, credit : as in `dye`
        The name is that of the emission file by default.

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
    absorbed = _in_photons(excitation, units, "excitation", -1)
    emitted = _in_photons(emission, units, "emission", 1)
    return dye(
        absorbed,
        emitted,
        quantum_yield,
        strength,
        units="photon",
        substrate=substrate,
        name=name or file_and_column(emission)[0].stem,
        description=description,
        credit=credit,
    )


def _open_ends(spectrum: Spectrum, within: tuple[float, float]) -> list[tuple[str, float, float]]:
    """Where a table ends above 0 inside a range: side, wavelength, share of the peak."""
    first, last = spectrum.support
    ends = (
        ("below", first, spectrum.values[0], first > within[0] + _EDGE),
        ("above", last, spectrum.values[-1], last < within[1] - _EDGE),
    )
    most = spectrum.values.max()
    return [(side, at, float(value / most)) for side, at, value, inside in ends if value > 0 and inside]


def _ended(spectrum: Spectrum, within: tuple[float, float]) -> Spectrum:
    """The spectrum with a 0 just beside each end that is above 0, so that nobody continues it by a line."""
    w, values = spectrum.wavelengths, spectrum.values
    for side, at, _ in _open_ends(spectrum, within):
        place, beside = (0, at - _EDGE) if side == "below" else (len(w), at + _EDGE)
        w, values = np.insert(w, place, beside), np.insert(values, place, 0.0)
    return replace(spectrum, wavelengths=w, values=values)


def _end_in_words(name: str, what: str, spectrum: Spectrum, within: tuple[float, float]) -> str:
    """Say where a table ends above 0, and warn if it is far above."""
    ends = _open_ends(spectrum, within)
    words = ", ".join(
        f"{side} {at:g} nm, where its table ends at {100 * share:.3g} % of the peak"
        for side, at, share in ends
    )
    text = f"{what} taken as 0 {words}" if ends else ""
    if any(share > _HIGH_END for _, _, share in ends):
        warnings.warn(f"{name}: {text}", ExtrapolationWarning, stacklevel=3)
    return text


def check_order(
    name: str, ex: Array, taken_up: Array, em: Array, photons: Array, *, least: float = 0.5
) -> None:
    """Refuse a dye most of whose emission the Stokes limit would leave out: all but a share below `least`."""
    longer = [trapezoid(np.where(em > at, photons, 0.0), em) for at in ex]
    share = trapezoid(taken_up * np.array(longer), ex) / trapezoid(taken_up, ex)
    if share < least:
        peaks = f"excitation peak {ex[taken_up.argmax()]:g} nm, emission peak {em[photons.argmax()]:g} nm"
        raise MaterialError(
            message(
                "most of the emission of a dye lies at shorter wavelengths than its excitation",
                where=name,
                got=f"{peaks}; {100 * share:.0f} % of the emission is at longer wavelengths",
                expected="emission at longer wavelengths than excitation (Stokes)",
                fix="were the two spectra swapped?",
            )
        )


def _shaded(other: Fluorophore, ex: Array, absorbed: Array) -> Fluorophore:
    """A dye of the substrate below one that absorbs the share `absorbed` (n,) of the light of `ex` (n,)."""
    beta = other.excitation
    inside = (ex > beta.support[0]) & (ex < beta.support[1])
    w = np.unique(np.concatenate([beta.wavelengths, ex[inside]]))
    left = np.interp(w, beta.wavelengths, beta.values) * (1 - np.interp(w, ex, absorbed, left=0.0, right=0.0))
    share = trapezoid(left, w)  # Fluorophore makes the integral 1, so alpha takes it up
    if share <= 0:
        return replace(other, emission=other.emission.scaled(0.0))
    return replace(
        other, emission=other.emission.scaled(share), excitation=replace(beta, wavelengths=w, values=left)
    )


def _dyed(substrate: Spectrum, absorbed: Spectrum, title: str, assumed: str) -> Spectrum:
    """Return S_substrate (1 - a) on the wavelengths of both; a is 0 outside its table."""
    first, last = _RANGE if substrate.is_constant else substrate.support
    w = np.unique(np.concatenate([absorbed.wavelengths, substrate.wavelengths, [first, last]]))
    w = w[(w >= first) & (w <= last)]
    share = np.interp(w, absorbed.wavelengths, absorbed.values, left=0.0, right=0.0)
    S = (
        substrate.values[0]
        if substrate.is_constant
        else np.interp(w, substrate.wavelengths, substrate.values)
    )
    return Spectrum(w, S * (1 - share), title, assumed)


def counted_units(who: str, stated: str, units: Units | None, where: object) -> Units:
    """What a file counts: as it says or, if it does not, as the user says.

    Examples
    --------
    >>> counted_units("a dye", "", "photon", "dye.csv")
    'photon'
    """
    if stated and units and stated != units:
        fault = "a file and the option disagree on its units"
        got = f"'{stated}' in the file, '{units}' as option"
        raise MaterialError(message(fault, where=where, got=got, fix="drop one of them"))
    counted = stated or units
    if counted not in ("energy", "photon"):
        fault = f"{who} needs the units of its intensities"
        fix = "write '# units: photon' (counts of a fluorometer) or '# units: energy' (power per nm) into the file, or "
        fix += "say it as units (--units)"
        got, expected = repr(counted or "nothing"), "'energy' or 'photon'"
        raise MaterialError(message(fault, where=where, got=got, expected=expected, fix=fix))
    return cast("Units", counted)


def _in_photons(path: str | Path, units: Units | None, role: Role, power: int) -> Spectrum:
    curve = read_curve(path, role)
    counted = counted_units("a dye", curve.keys.get("units", "").lower(), units, path)
    spectrum = read_spectrum(path, role=role)
    if counted == "photon" or curve.is_absorption:  # a share of the light, however light is counted
        return spectrum
    return replace(spectrum, values=spectrum.values * spectrum.wavelengths**power)
