"""CIE whiteness and tint, for papers and textiles that are meant to be white."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fluorspar.colour.observers import CIE_1931, CIE_1964
from fluorspar.errors import OptionError, message

__all__ = ["CIE_1964", "Whiteness", "cie_whiteness"]

_TINT = {CIE_1931: 1000.0, CIE_1964: 900.0}  # coefficient of x; that of y is 650 for both
_LEAST_WHITENESS = 40.0
_TINTS = (-4.0, 2.0)


@dataclass(frozen=True)
class Whiteness:
    """What `cie_whiteness` found.

    Attributes
    ----------
    whiteness : float
        W, 100 for a perfect white; more is whiter.
    tint : float
        T, 0 for no tint; above 0 greenish, below 0 reddish.
    outside : tuple of str
        The limits of the formula that the sample exceeds, in words; empty if the numbers mean something.
    """

    whiteness: float
    tint: float
    outside: tuple[str, ...]

    @property
    def valid(self) -> bool:
        """Whether the sample lies within the limits of the formula."""
        return not self.outside


def cie_whiteness(xyz: ArrayLike, white: ArrayLike, observer: str = CIE_1964) -> Whiteness:
    """Return CIE whiteness and tint.

    W = Y + 800 (x_n - x) + 1700 (y_n - y) and T = c (x_n - x) - 650 (y_n - y), where c is 1000 for the 2 and
    900 for the 10 degree observer, and x_n, y_n belong to the perfect diffuser. The formula is meant for D65
    and for samples that are sold as white: W > 40, W < 5 Y - 280 and -4 < T < 2.

    Parameters
    ----------
    xyz : array_like of shape (3,)
        Of the sample.
    white : array_like of shape (3,)
        Of the perfect diffuser in the same light and unit.
    observer : str
        `CIE_1931` or `CIE_1964`, the one both were found with; 10 degree is usual.

    Returns
    -------
    Whiteness

    Raises
    ------
    OptionError
        If the observer is another.

    Notes
    -----
    A black sample has neither: both are NaN.

    References
    ----------
    CIE 15:2004, section 9; ISO 11475.

    Examples
    --------
    >>> white = [94.811, 100.0, 107.304]
    >>> cie_whiteness(white, white)
    Whiteness(whiteness=100.0, tint=0.0, outside=())
    >>> grey = cie_whiteness([0.4 * 94.811, 40.0, 0.4 * 107.304], white)
    >>> round(grey.whiteness, 6), grey.valid
    (40.0, False)
    """
    if observer not in _TINT:
        fault, expected = "CIE whiteness is not defined for this observer", " or ".join(map(repr, _TINT))
        raise OptionError(message(fault, got=repr(observer), expected=expected))
    sample, reference = np.asarray(xyz, dtype=np.float64), np.asarray(white, dtype=np.float64)
    if not sample.sum() > 0:
        return Whiteness(float("nan"), float("nan"), ("a black sample has none",))
    sample = 100 * sample / reference[1]
    reference = 100 * reference / reference[1]
    dx, dy = (reference / reference.sum() - sample / sample.sum())[:2]
    W = float(sample[1] + 800 * dx + 1700 * dy)
    T = float(_TINT[observer] * dx - 650 * dy)
    most = 5 * float(sample[1]) - 280
    outside = []
    if W <= _LEAST_WHITENESS:
        outside.append(f"whiteness must be above {_LEAST_WHITENESS:g}")
    if not most > W:
        outside.append(f"whiteness must be below 5 Y - 280 = {most:.1f}")
    if not _TINTS[0] < T < _TINTS[1]:
        outside.append(f"tint must lie between {_TINTS[0]:g} and {_TINTS[1]:g}")
    return Whiteness(W, T, tuple(outside))
