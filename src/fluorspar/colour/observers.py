"""Standard observers: their names and colour matching functions."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.files.tables import read_table
from fluorspar.spectral.colour_science import colour_science

__all__ = ["CIE_1931", "CIE_1964", "OBSERVERS", "matching_functions", "observer_named"]

Array = NDArray[np.float64]

CIE_1931 = "CIE 1931 2 Degree Standard Observer"
CIE_1964 = "CIE 1964 10 Degree Standard Observer"

OBSERVERS = (
    CIE_1931,
    CIE_1964,
    "CIE 2015 2 Degree Standard Observer",
    "CIE 2015 10 Degree Standard Observer",
)
"""Those whose functions are CIE XYZ: CIELAB and sRGB mean nothing in cone fundamentals or RGB functions."""

_SHORT = {
    "2": CIE_1931,
    "10": CIE_1964,
    "2-2015": "CIE 2015 2 Degree Standard Observer",
    "10-2015": "CIE 2015 10 Degree Standard Observer",
}


def observer_named(observer: str | int, where: str | None = None) -> str:
    """Return the full name of an observer.

    Parameters
    ----------
    observer : str or int
        2 or 10, degrees, of the CIE observers of 1931 and 1964; "2-2015" or "10-2015", those of CIE 170-2:2015, made
        of the cone fundamentals of 2006; or one of `OBSERVERS`, in any case.
    where : str, optional
        The option, for messages.

    Raises
    ------
    OptionError
        If there is no such observer; the message lists those there are.

    Examples
    --------
    >>> observer_named("10"), observer_named("2-2015")
    ('CIE 1964 10 Degree Standard Observer', 'CIE 2015 2 Degree Standard Observer')
    """
    text = str(observer).strip()
    names = _SHORT | {name.casefold(): name for name in OBSERVERS}
    if text.casefold() in names:
        return names[text.casefold()]
    expected = f"2 or 10 (degrees), 2-2015 or 10-2015; or a name: {', '.join(OBSERVERS)}"
    raise OptionError(message("there is no such observer", where=where, got=repr(text), expected=expected))


def matching_functions(observer: str | int) -> tuple[Array, Array]:
    """Return the colour matching functions of an observer, CIE XYZ.

    The CIE 1931 table comes with the package, those of others from colour-science.

    Parameters
    ----------
    observer : str or int
        As for `observer_named`.

    Returns
    -------
    wavelengths : ndarray of shape (n,)
        In nm.
    values : ndarray of shape (n, 3)

    Raises
    ------
    OptionError
        If there is no such observer.

    Examples
    --------
    >>> wavelengths, values = matching_functions(CIE_1931)
    >>> wavelengths[[0, -1]], values.shape
    (array([360., 830.]), (471, 3))
    """
    name = observer_named(observer)
    if name == CIE_1931:
        rows = read_table(files("fluorspar") / "data" / "observers" / "CIE-1931-2-degree.csv").numbers()
        return rows[:, 0], rows[:, 1:]
    table = colour_science().MSDS_CMFS[name]
    return np.asarray(table.wavelengths, np.float64), np.asarray(table.values, np.float64)
