"""Standard observers: their names and colour matching functions."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.files.tables import read_table
from fluorspar.spectral.colour_science import colour_science

__all__ = ["CIE_1931", "CIE_1964", "matching_functions", "observer_named"]

Array = NDArray[np.float64]

CIE_1931 = "CIE 1931 2 Degree Standard Observer"
CIE_1964 = "CIE 1964 10 Degree Standard Observer"

_OF_DEGREES = {"2": CIE_1931, "10": CIE_1964}


def observer_named(text: str, where: str | None = None) -> str:
    """Return the full name of an observer.

    Parameters
    ----------
    text : str
        "2" or "10", degrees, of the CIE observers of 1931 and 1964; or a name in colour-science.
    where : str, optional
        The option, for messages.

    Raises
    ------
    OptionError
        If there is no such observer; the message lists those there are.

    Examples
    --------
    >>> observer_named("10")
    'CIE 1964 10 Degree Standard Observer'
    """
    name = _OF_DEGREES.get(text, text)
    if name in _OF_DEGREES.values() or name in colour_science().MSDS_CMFS:  # a second to import
        return name
    expected = f"{' or '.join(_OF_DEGREES)}; or a name: {', '.join(sorted(colour_science().MSDS_CMFS))}"
    raise OptionError(message("there is no such observer", where=where, got=repr(text), expected=expected))


def matching_functions(observer: str) -> tuple[Array, Array]:
    """Return the colour matching functions of an observer.

    The CIE 1931 table comes with the package, those of others from colour-science.

    Parameters
    ----------
    observer : str
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
