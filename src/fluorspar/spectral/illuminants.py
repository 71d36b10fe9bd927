"""Light spectra by name: CIE illuminants, the lamps shipped with the package, and lamps in files."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable

import numpy as np

from fluorspar.errors import ApproximationWarning, SpectrumError, message
from fluorspar.files.names import file_and_column
from fluorspar.files.tables import read_table
from fluorspar.spectral.colour_science import colour_science
from fluorspar.spectral.spectrum import SUFFIXES, Spectrum, read_spectrum

__all__ = ["illuminant", "illuminants", "listed_name", "without_noise"]

_NOISE = 0.02  # of the peak of a lamp


def illuminant(name: str) -> Spectrum:
    """Return the relative spectral power distribution of a lamp or CIE illuminant.

    Parameters
    ----------
    name : str
        "D65", "D50", "A", "E", "FL2", "FL11", "LED-B1", ... or a lamp shipped with Fluorspar, in upper or
        lower case; or a file (see `fluorspar.spectral.spectrum.read_spectrum`).

    Returns
    -------
    Spectrum
        Relative: CIE tables are 100 at 560 nm. Use `Spectrum.scaled` for an absolute scale.

    Raises
    ------
    SpectrumError
        If there is none of that name; the message lists the names there are. If a file is no spectrum, or its
        light is negative by more than noise.

    Warns
    -----
    ApproximationWarning
        If a file has small negative values, which are set to 0.

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
    if file_and_column(name)[0].is_file() or os.sep in name or name.lower().endswith(SUFFIXES):
        return _of_file(name)
    names = illuminants()
    close = get_close_matches(name, names, n=3) or get_close_matches(name.upper(), names, n=3)
    fix = f"did you mean {' or '.join(close)}?" if close else ""
    fault, expected = "there is no such illuminant", f"a file, or one of: {', '.join(names)}"
    raise SpectrumError(message(fault, got=repr(name), expected=expected, fix=fix))


def illuminants() -> list[str]:
    """List the names that `illuminant` knows.

    Examples
    --------
    >>> {"D65", "D50", "A", "E", "FL2", "FL11"} <= set(illuminants())
    True
    """
    return sorted({*_shipped(), *_colour_science(), "E"}, key=str.casefold)


def listed_name(name: str) -> str | None:
    """The name of an illuminant as it is listed, whatever its case; None if there is none of that name.

    Examples
    --------
    >>> listed_name("fl11"), listed_name("lamp.csv")
    ('FL11', None)
    """
    return {each.casefold(): each for each in illuminants()}.get(name.casefold())


def without_noise(lamp: Spectrum) -> Spectrum:
    """Set negative values of a light to 0 if they are the noise of a spectrometer: down to 2 % of its peak.

    Warns
    -----
    ApproximationWarning
        If there are such values.

    Examples
    --------
    >>> without_noise(Spectrum([400, 500], [-1.0, 1.0])).values
    array([-1.,  1.])
    """
    lowest, highest = float(lamp.values.min()), float(lamp.values.max())
    if lowest >= 0 or lowest < -_NOISE * highest:
        return lamp
    light = replace(lamp, values=np.maximum(lamp.values, 0.0))
    added = 1 - lamp.integral() / light.integral()
    text = (
        f"{lamp.title}: {np.count_nonzero(lamp.values < 0)} negative values, down to {lowest:.3g} "
        f"({-100 * lowest / highest:.1g} % of the peak), are set to 0: noise; that adds {100 * added:.1g} % of light"
    )
    warnings.warn(text, ApproximationWarning, stacklevel=3)
    return light


def _of_file(name: str) -> Spectrum:
    lamp = without_noise(read_spectrum(name))
    if (lowest := lamp.values.min()) < 0:
        expected = "0 or more; noise down to 2 % of the peak is understood"
        fix = "subtract the dark signal of the spectrometer, or cut off wavelengths without light"
        where = f"{lamp.title}, {lamp.wavelengths[lamp.values.argmin()]:g} nm"
        got = f"{lowest:g} at a peak of {lamp.values.max():g}"
        raise SpectrumError(message("a light is negative", where=where, got=got, expected=expected, fix=fix))
    return lamp


def _shipped() -> dict[str, Traversable]:
    folder = files("fluorspar") / "data" / "illuminants"
    return {file.name.removesuffix(".csv"): file for file in folder.iterdir() if file.name.endswith(".csv")}


@cache
def _colour_science() -> dict[str, Spectrum]:
    return {
        name: Spectrum(np.asarray(sd.wavelengths, float), np.asarray(sd.values, float), name)
        for name, sd in colour_science().SDS_ILLUMINANTS.items()
    }
