"""Light spectra by name: CIE illuminants and the lamps shipped with the package."""

from __future__ import annotations

from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable

import numpy as np

from fluorspar.errors import SpectrumError, message
from fluorspar.files.tables import read_table
from fluorspar.spectral.colour_science import colour_science
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["illuminant", "illuminants"]


def illuminant(name: str) -> Spectrum:
    """Return the relative spectral power distribution of a lamp or CIE illuminant.

    Parameters
    ----------
    name : str
        "D65", "D50", "A", "E", "FL2", "FL11", "LED-B1", ... or a lamp shipped with Fluorspar, in upper or
        lower case.

    Returns
    -------
    Spectrum
        Relative: CIE tables are 100 at 560 nm. Use `Spectrum.scaled` for an absolute scale.

    Raises
    ------
    SpectrumError
        If there is none of that name; the message lists the names there are.

    Notes
    -----
    D65 is the table of CIE 15, 300-830 nm by 5 nm, E is 100 everywhere; both come with the package. The other
    CIE illuminants are the tables of colour-science, whose ranges differ.

    Examples
    --------
    >>> d65 = illuminant("d65")
    >>> d65.at(560), d65.support
    (100.0, (300.0, 830.0))
    >>> round(illuminant("D65").scaled(0.01).at(460), 5)
    1.17812
    """
    wanted = name.strip().casefold()
    if wanted == "e":
        return Spectrum.constant(100.0, "illuminant E")
    shipped = {key.casefold(): file for key, file in _shipped().items()}
    if wanted in shipped:
        table = read_table(shipped[wanted])
        title = table.keys.get("name", name)
        wavelengths, values = table.numbers().T
        return Spectrum(wavelengths, values, title, table.keys.get("assumed", ""))
    tables = {key.casefold(): spectrum for key, spectrum in _colour_science().items()}
    if wanted in tables:
        return replace(tables[wanted], name=f"illuminant {tables[wanted].name}")
    names = illuminants()
    close = get_close_matches(name, names, n=3) or get_close_matches(name.upper(), names, n=3)
    fix = f"did you mean {' or '.join(close)}?" if close else ""
    fault = "there is no such illuminant"
    raise SpectrumError(message(fault, got=repr(name), expected=", ".join(names), fix=fix))


def illuminants() -> list[str]:
    """List the names that `illuminant` knows.

    Examples
    --------
    >>> {"D65", "D50", "A", "E", "FL2", "FL11"} <= set(illuminants())
    True
    """
    return sorted({*_shipped(), *_colour_science(), "E"}, key=str.casefold)


def _shipped() -> dict[str, Traversable]:
    folder = files("fluorspar") / "data" / "illuminants"
    return {file.name.removesuffix(".csv"): file for file in folder.iterdir() if file.name.endswith(".csv")}


@cache
def _colour_science() -> dict[str, Spectrum]:
    return {
        name: Spectrum(np.asarray(sd.wavelengths, float), np.asarray(sd.values, float), name)
        for name, sd in colour_science().SDS_ILLUMINANTS.items()
    }
