"""Spectra: tabulated values over wavelength, linear in between, never silently extrapolated."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import ExtrapolationWarning, SpectrumError, message
from fluorspar.files import tables
from fluorspar.files.curves import LONGEST_IN_MICROMETRES, Role, read_curve
from fluorspar.files.names import file_and_column
from fluorspar.notebook import curve, facts_table
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = [
    "SUFFIXES",
    "Outside",
    "Spectrum",
    "SpectrumLike",
    "as_spectrum",
    "check_reflectance",
    "read_spectrum",
    "trapezoid",
    "weighted_sum",
]

Outside = Literal["warn", "error", "zero", "hold"]

SUFFIXES = (*tables.SUFFIXES, ".spd", ".spdx")
"""Of files that `read_spectrum` reads."""

_SAME = 1e-6  # nm; wavelengths closer than this are one


@dataclass(frozen=True, eq=False)
class Spectrum:
    """A spectrum as it was tabulated, on wavelengths of its own.

    Parameters
    ----------
    wavelengths : ndarray of shape (n,)
        In nm, ascending, n >= 2. A constant has the support (0, inf).
    values : ndarray of shape (n,)
        In whatever unit the quantity has; linear between samples.
    name : str
        For messages: "reflectance of 'red-wall'".
    assumed : str
        What part of the table was assumed rather than measured, in words.

    Raises
    ------
    SpectrumError
        If the lengths differ, a number is not finite, or the wavelengths do not ascend.

    Examples
    --------
    >>> s = Spectrum([400, 500, 600], [0.2, 0.6, 0.4], name="a paint")
    >>> s.on(Wavelengths(400, 600, 50))
    array([0.2, 0.4, 0.6, 0.5, 0.4])
    """

    wavelengths: NDArray[np.float64]
    values: NDArray[np.float64]
    name: str = ""
    assumed: str = ""

    def __post_init__(self) -> None:
        for field in ("wavelengths", "values"):
            array = np.array(getattr(self, field), dtype=np.float64)  # a copy, so that nobody can change it
            array.flags.writeable = False
            object.__setattr__(self, field, array)
        w, v = self.wavelengths, self.values
        if w.ndim != 1 or w.shape != v.shape or len(w) < 2:
            fault = "wavelengths and values of a spectrum must be lists of one length, at least two"
            raise SpectrumError(message(fault, where=self.title, got=f"shapes {w.shape} and {v.shape}"))
        if not np.all(np.isfinite(v)) or np.any(np.isnan(w)):
            where = f"{self.title}, {w[~np.isfinite(v) | np.isnan(w)][0]:g} nm"
            raise SpectrumError(message("a spectrum holds a value that is not a finite number", where=where))
        if not np.all(np.diff(w) > 0):
            k = int(np.argmin(np.diff(w) > 0))
            fix = "sort the rows by wavelength and remove duplicates"
            got = f"{w[k]:g} nm, then {w[k + 1]:g} nm"
            raise SpectrumError(message("the wavelengths do not ascend", where=self.title, got=got, fix=fix))
        if w[0] < 0 or (np.isinf(w[-1]) and not self.is_constant):
            got = f"{w[0]:g} to {w[-1]:g} nm"
            raise SpectrumError(message("a wavelength is impossible", where=self.title, got=got))

    def __str__(self) -> str:
        """Its range and extremes in words."""
        w, v = self.wavelengths, self.values
        if self.is_constant:
            return f"{v[0]:.3g} at all wavelengths"
        least, most = int(v.argmin()), int(v.argmax())
        extremes = f"from {v[least]:.3g} at {w[least]:g} nm to {v[most]:.3g} at {w[most]:g} nm"
        return f"{w[0]:g}-{w[-1]:g} nm, " + (f"{v[0]:.3g} everywhere" if v[least] == v[most] else extremes)

    def _repr_html_(self) -> str:
        at = (0.0, 1.0) if self.is_constant else self.wavelengths
        return facts_table(self.title, [("", str(self)), ("assumed", self.assumed)], curve(at, self.values))

    @classmethod
    def constant(cls, value: float, name: str = "", assumed: str = "") -> Spectrum:
        """Make the spectrum that has one value at every wavelength, from 0 to inf.

        Examples
        --------
        >>> Spectrum.constant(0.5).on(Wavelengths(300, 500, 100))
        array([0.5, 0.5, 0.5])
        """
        return cls(np.array([0.0, np.inf]), np.array([value, value], dtype=np.float64), name, assumed)

    @property
    def title(self) -> str:
        """The name, or "a spectrum" if it has none."""
        return self.name or "a spectrum"

    @property
    def is_constant(self) -> bool:
        """Whether it is one value from 0 to inf."""
        w, v = self.wavelengths, self.values
        return bool(len(w) == 2 and np.isinf(w[1]) and v[0] == v[1])

    @property
    def support(self) -> tuple[float, float]:
        """First and last wavelength in nm."""
        return float(self.wavelengths[0]), float(self.wavelengths[-1])

    @property
    def peak(self) -> float:
        """Wavelength in nm of the highest sample."""
        return float(self.wavelengths[self.values.argmax()])

    def on(self, grid: Wavelengths, *, outside: Outside = "warn") -> NDArray[np.float64]:
        """Sample on a grid, linear between samples.

        Parameters
        ----------
        grid : Wavelengths
            The wavelengths wanted.
        outside : {"warn", "error", "zero", "hold"}
            What happens where the grid reaches beyond the data: "warn" holds the end value and says so,
            "hold" does it without a word, "zero" gives 0, "error" refuses.

        Returns
        -------
        ndarray of shape (N,)

        Raises
        ------
        SpectrumError
            If grid and data have no wavelength in common, or `outside` is "error" and the data end too early.

        Examples
        --------
        >>> Spectrum([400, 500], [1.0, 2.0]).on(Wavelengths(300, 500, 50), outside="zero")
        array([0. , 0. , 1. , 1.5, 2. ])
        """
        first, last = self.support
        below, above = grid.start < first - _SAME, grid.stop > last + _SAME
        if grid.stop < first - _SAME or grid.start > last + _SAME:
            expected = f"a grid that meets {first:g}-{last:g} nm"
            fault = "a spectrum and the wavelength grid do not overlap"
            fix = (
                "its wavelengths look like micrometres: give them in nm"
                if last < LONGEST_IN_MICROMETRES
                else ""
            )
            raise SpectrumError(message(fault, where=self.title, got=str(grid), expected=expected, fix=fix))
        if (below or above) and outside in ("warn", "error"):
            ends = [f"below {first:g} nm ({self.values[0]:g})"] * below
            ends += [f"above {last:g} nm ({self.values[-1]:g})"] * above
            if outside == "error":
                got, expected = f"data for {first:g}-{last:g} nm", f"data for {grid}"
                fault = "a spectrum ends too early"
                raise SpectrumError(message(fault, where=self.title, got=got, expected=expected))
            warnings.warn(
                f"{self.title}: data for {first:g}-{last:g} nm, used on {grid}; "
                f"assumed: the end value held {' and '.join(ends)}",
                ExtrapolationWarning,
                stacklevel=2,
            )
        values = np.interp(grid.values, self.wavelengths, self.values)
        if outside == "zero":
            values[(grid.values < first - _SAME) | (grid.values > last + _SAME)] = 0.0
        return values

    def at(self, wavelength: float) -> float:
        """Return the value at one wavelength in nm, held beyond the ends."""
        return float(np.interp(wavelength, self.wavelengths, self.values))

    def scaled(self, factor: float) -> Spectrum:
        """Return it with all values times `factor`."""
        return replace(self, values=self.values * factor)

    def integral(self) -> float:
        """Integrate over the whole support by the trapezoid rule; unit of the values times nm.

        Examples
        --------
        >>> Spectrum([400, 500, 600], [0.0, 1.0, 0.0]).integral()
        100.0
        """
        if self.is_constant:
            fix = "give it as a table with two ends"
            raise SpectrumError(message("a constant has no finite integral", where=self.title, fix=fix))
        return trapezoid(self.values, self.wavelengths)


SpectrumLike: TypeAlias = "float | str | Path | Spectrum | tuple[ArrayLike, ArrayLike]"


def check_reflectance(spectrum: Spectrum) -> Spectrum:
    """Return a reflectance as it came if 0 <= S <= 1 everywhere.

    Raises
    ------
    SpectrumError
        Naming the wavelength of the worst value.

    Examples
    --------
    >>> check_reflectance(Spectrum.constant(0.85)).at(550)
    0.85
    """
    worst = int(np.argmax(np.abs(spectrum.values - 0.5)))
    value = spectrum.values[worst]
    if 0 <= value <= 1:
        return spectrum
    fault = "a reflectance is negative" if value < 0 else "a reflectance is greater than 1"
    where = spectrum.title + ("" if spectrum.is_constant else f", {spectrum.wavelengths[worst]:g} nm")
    fix = "reflectances are fractions, not percent" if value > 1 else ""
    fix += ": divide by 100" if value > 2 else ""
    raise SpectrumError(message(fault, where=where, got=f"{value:g}", expected="0 to 1", fix=fix))


def trapezoid(values: NDArray[np.float64], wavelengths: NDArray[np.float64]) -> float:
    """Integrate samples over their wavelengths, both ndarray of shape (n,), by the trapezoid rule.

    Examples
    --------
    >>> trapezoid(np.array([1.0, 2.0]), np.array([400.0, 410.0]))
    15.0
    """
    return float(np.sum((values[1:] + values[:-1]) * np.diff(wavelengths)) / 2)


def read_spectrum(path: str | Path, name: str = "", role: Role = "") -> Spectrum:
    """Read a spectrum from a table (`.csv`, `.txt`, `.spd`, ...) or an IES TM-27 file (`.spdx`).

    Columns are separated by tabs, semicolons, commas or blanks: the wavelength in nm, ascending or descending, and
    values. Text above and below the numbers, as instruments write it, and lines that begin with `#` are passed over; a
    comment `# assumed: ...` becomes `Spectrum.assumed`. Empty cells were not measured. Values under a heading with "%"
    are percent, wavelengths under one with "um" micrometres.

    Parameters
    ----------
    path : str or Path
        Of several columns one must be meant: `FILE:COLUMN` names it, or `role`.
    name : str
        For messages; by default that of the file, and of the column where there are several.
    role : {"", "excitation", "emission"}
        Which one of the spectra of a dye; see `fluorspar.files.curves.read_curve`.

    Raises
    ------
    SpectrumError
        If the file is missing, is not a spectrum, or holds several.

    Warns
    -----
    ApproximationWarning
        If there are empty cells between others, or the wavelengths can only be micrometres, which no heading says.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "lamp.spd")
    ...     _ = file.write_text("400 1.0\\n700 2.0")
    ...     read_spectrum(file).at(550)
    1.5
    """
    curve = read_curve(path, role)
    title = name or ", ".join(filter(None, (file_and_column(path)[0].name, curve.name)))
    return Spectrum(curve.wavelengths, curve.values, title, curve.keys.get("assumed", ""))


def as_spectrum(value: SpectrumLike, name: str = "") -> Spectrum:
    """Make a spectrum of whatever describes one.

    Parameters
    ----------
    value : float, str, Path, Spectrum or (wavelengths, values)
        A number or the text of one (constant), a pair (wavelengths, values), a file, or a `Spectrum`.
    name : str
        For messages; a `Spectrum` that has a name keeps it.

    Raises
    ------
    SpectrumError
        If it is none of these.

    Examples
    --------
    >>> as_spectrum("0.5").at(400), as_spectrum(([400, 500], [0, 1])).at(450)
    (0.5, 0.5)
    """
    if isinstance(value, Spectrum):
        return value if value.name or not name else replace(value, name=name)
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            value = Path(str(value))
    if isinstance(value, Path):
        return read_spectrum(value, name)
    if isinstance(value, (int, float, np.number)):
        if not math.isfinite(value):
            raise SpectrumError(message("a constant is not a finite number", where=name or None, got=value))
        return Spectrum.constant(float(value), name)
    try:
        wavelengths, values = value
        return Spectrum(np.asarray(wavelengths, float), np.asarray(values, float), name)
    except (TypeError, ValueError) as err:
        expected = "a number, a file, a pair (wavelengths, values) or a Spectrum"
        raise SpectrumError(
            message("this is not a spectrum", where=name or None, got=repr(value), expected=expected)
        ) from err


def weighted_sum(spectra: Sequence[Spectrum], weights: Sequence[float], name: str = "") -> Spectrum:
    """Add spectra with weights, exactly: on the union of their wavelengths, as far as all of them have data.

    Raises
    ------
    SpectrumError
        If there is no wavelength at which all of them have data.

    Examples
    --------
    >>> mixed = weighted_sum([Spectrum([400, 600], [0, 1]), Spectrum.constant(1.0)], [0.5, 0.5])
    >>> mixed.at(500)
    0.75
    """
    if all(spectrum.is_constant for spectrum in spectra):
        value = sum(weight * spectrum.values[0] for spectrum, weight in zip(spectra, weights, strict=True))
        return Spectrum.constant(float(value), name)
    first = max(spectrum.support[0] for spectrum in spectra)
    last = min(spectrum.support[1] for spectrum in spectra)
    if not first < last:
        fault, got = "spectra that are to be added have no range in common", [s.support for s in spectra]
        raise SpectrumError(message(fault, where=name or None, got=got))
    union = np.unique(np.concatenate([spectrum.wavelengths for spectrum in spectra] + [[first, last]]))
    union = union[(union >= first) & (union <= last)]
    values = np.zeros(len(union))
    for spectrum, weight in zip(spectra, weights, strict=True):
        values += weight * np.interp(union, spectrum.wavelengths, spectrum.values)
    assumed = "; ".join(f"{s.title}: {s.assumed}" for s in spectra if s.assumed)
    return Spectrum(union, values, name, assumed)
