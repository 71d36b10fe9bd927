"""The numbers of a table of measured spectra: one row for each point and wavelength, even wavelengths, bandwidth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SpectrumError, message
from fluorspar.files.tables import Table
from fluorspar.spectral.even import regular_spectra
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["TIDY", "bandwidth_of", "correlated_in", "on_even_grid", "tidy_spectra"]

Array = NDArray[np.float64]

TIDY = ("point", "wavelength", "radiance", "standard_error", "freedom")
"""The columns of a tidy table; the last two may be missing."""
# of the longest step: shorter ones are gaps in a list, not an instrument's dispersion or rounding
_UNEVEN = 0.7
_SHORTEST = 100.0  # nm


def tidy_spectra(table: Table) -> tuple[tuple[str, ...], Array, Array, Array | None, Array | None]:
    """Sort a tidy table.

    Parameters
    ----------
    table : Table
        With the columns of `TIDY`, in any order.

    Returns
    -------
    names : tuple of str
        The P points, in the order of the table.
    wavelengths : ndarray of shape (N,)
        Ascending.
    radiance : ndarray of shape (P, N)
    standard_error : ndarray of shape (P, N) or None
    freedom : ndarray of shape (P,) or None
        Degrees of freedom of the standard errors of each point, the least of its rows.

    Raises
    ------
    SpectrumError
        If a column is unknown or occurs twice, a cell is not a number, a point has no name, has a wavelength twice
        or lacks one that others have, a standard error is negative or not finite, or a number of degrees of freedom
        is not positive.

    Examples
    --------
    >>> rows = [["1", "410", "2"], ["1", "400", "3"]]
    >>> tidy_spectra(Table({}, ("point", "wavelength", "radiance"), rows, Path("a.csv"), SpectrumError))[:2]
    (('1',), array([400., 410.]))
    """
    header = [name.lower() for name in table.header]
    unknown = [name for name in header if name not in TIDY]
    missing = [name for name in TIDY[: 4 if "freedom" in header else 3] if name not in header]
    twice = sorted({name for name in header if header.count(name) > 1})
    if unknown or missing or twice:
        faults = (("unknown", unknown), ("missing", missing), ("twice", twice))
        got = "; ".join(f"{what}: {', '.join(names)}" for what, names in faults if names)
        fault, expected = "the columns of a table of spectra are not right", ", ".join(TIDY)
        fix = "this is a points file: give it as such (--points)" if {"x", "y"} <= set(header) else ""
        raise SpectrumError(message(fault, where=table.where, got=got, expected=expected, fix=fix))
    column = {name: header.index(name) for name in header}
    fields = [name for name in TIDY[1:] if name in column]
    at: dict[str, dict[float, list[float]]] = {}
    for row in table.rows:
        name = row[column["point"]]
        if not name:
            raise SpectrumError(message("a point has no name", where=table.where, got=", ".join(row)))
        try:
            wavelength, *numbers = (float(row[column[field]]) for field in fields)
        except ValueError as err:
            raise SpectrumError(message("a cell is not a number", where=table.where, got=err)) from err
        of_point = at.setdefault(name, {})
        if wavelength in of_point:
            fault, fix = f"{wavelength:g} nm occurs twice", "keep one of the rows, or their mean"
            raise SpectrumError(message(fault, where=f"{table.where}, point {name}", fix=fix))
        of_point[wavelength] = numbers
    wavelengths = _common_wavelengths(at, table.where)
    values = np.array([[of_point[wavelength] for wavelength in wavelengths] for of_point in at.values()])
    error = values[..., 1] if "standard_error" in fields else None
    if error is not None:
        _check_errors(error, tuple(at), wavelengths, table.where)
    freedom = values[..., 2].min(axis=1) if "freedom" in fields else None
    if freedom is not None and not (freedom > 0).all():
        point = int(np.argmin(freedom > 0))
        where, got, expected = (
            f"{table.where}, point {tuple(at)[point]}",
            freedom[point],
            "a positive number, or inf",
        )
        raise SpectrumError(
            message("degrees of freedom are impossible", where=where, got=got, expected=expected)
        )
    return tuple(at), np.array(wavelengths), values[..., 0], error, freedom


def _common_wavelengths(at: dict[str, dict[float, list[float]]], where: Path) -> list[float]:
    first, *others = at
    for name in others:
        if unlike := sorted(at[name].keys() ^ at[first].keys()):
            got = ", ".join(f"{wavelength:g}" for wavelength in unlike[:6]) + (
                ", ..." if len(unlike) > 6 else ""
            )
            raise SpectrumError(
                message(
                    "a point does not have the wavelengths of the first one",
                    where=f"{where}, point {name}",
                    got=f"{got} nm at one of the two only",
                    expected=f"those of point {first}",
                )
            )
    return sorted(at[first])


def _check_errors(error: Array, names: tuple[str, ...], wavelengths: list[float], where: Path) -> None:
    bad = ~(np.isfinite(error) & (error >= 0))
    if bad.any():
        point, band = np.argwhere(bad)[0]
        raise SpectrumError(
            message(
                "a standard error is impossible",
                where=f"{where}, point {names[point]}, {wavelengths[band]:g} nm",
                got=error[point, band],
                expected="a number of 0 or more",
                fix="leave the column out if errors are not known",
            )
        )


def on_even_grid(
    radiance: Array, error: Array | None, wavelengths: Array, where: Path
) -> tuple[Array, Array | None, Wavelengths]:
    """Bring spectra to evenly spaced wavelengths, unchanged if theirs are so but for rounding.

    Parameters
    ----------
    radiance : ndarray of shape (P, N)
    error : ndarray of shape (P, N) or None
    wavelengths : ndarray of shape (N,)
    where : Path
        The file, for messages.

    Raises
    ------
    SpectrumError
        If the wavelengths do not ascend, are none of light, or steps differ by more than 30 %.

    Warns
    -----
    ApproximationWarning
        If the spectra are interpolated.

    Examples
    --------
    >>> at = np.array([400.0, 403.33, 406.67, 410.0])
    >>> print(on_even_grid(np.ones((1, 4)), None, at, Path("a.csv"))[2])
    400-410 nm by 3.33333
    """
    if wavelengths.max() < _SHORTEST:
        span = f"{wavelengths.min():g} to {wavelengths.max():g} nm"
        fault, fix = "the wavelengths are too short for light", "write them in nm: micrometres times 1000"
        raise SpectrumError(message(fault, where=where, got=span, fix=fix))
    steps = np.diff(wavelengths)
    if len(steps) and steps.min() > 0 and steps.min() < _UNEVEN * steps.max():
        short, long = int(steps.argmin()), int(steps.argmax())
        raise SpectrumError(
            message(
                "the wavelengths are not evenly spaced",
                where=where,
                got=f"{steps[short]:g} nm after {wavelengths[short]:g}, {steps[long]:g} nm after {wavelengths[long]:g}",
                expected="nearly the same step everywhere",
                fix="interpolate the spectra to even steps, or add what is missing",
            )
        )
    layers = radiance[np.newaxis] if error is None else np.stack([radiance, error])
    layers, grid = regular_spectra(layers, wavelengths, where, SpectrumError)
    return layers[0], None if error is None else layers[1], grid


def bandwidth_of(table: Table) -> float | None:
    """The bandwidth that a table states in a line `# bandwidth: 8`, FWHM in nm; None if there is no such line.

    Raises
    ------
    SpectrumError
        If it is not a number of 0 or more.

    Examples
    --------
    >>> bandwidth_of(Table({"bandwidth": "8 nm"}, (), [], Path("a.csv"), SpectrumError))
    8.0
    """
    if "bandwidth" not in table.keys:
        return None
    text = table.keys["bandwidth"]
    try:
        fwhm = float(text.split()[0])
    except (IndexError, ValueError):
        fwhm = np.nan
    if not (np.isfinite(fwhm) and fwhm >= 0):
        raise SpectrumError(
            message(
                "the bandwidth is impossible",
                where=table.where,
                got=repr(text),
                expected="FWHM in nm, 0 for samples",
                fix="write '# bandwidth: 8', or delete the line if it is not known",
            )
        )
    return fwhm


def correlated_in(table: Table) -> bool:
    """Whether a table says `# errors: correlated`: that the errors of the bands of a point are fully correlated.

    Raises
    ------
    SpectrumError
        If the line says neither that nor "independent".

    Examples
    --------
    >>> correlated_in(Table({"errors": "Correlated"}, (), [], Path("a.csv"), SpectrumError))
    True
    """
    word = (table.keys.get("errors", "independent").split() or [""])[0].lower().strip(",;.")
    if word not in ("correlated", "independent"):
        raise SpectrumError(
            message(
                "what the table says of its errors is not known",
                where=table.where,
                got=repr(table.keys["errors"]),
                expected="'# errors: correlated' or '# errors: independent', from band to band",
            )
        )
    return word == "correlated"
