"""The same points on both sides of a comparison, on common bands."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.spectral.bands import Bands, error_of_sum, errors_on_bands

__all__ = ["Pair", "paired"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pair:
    """Spectra of the same points on the common bands; None if there are no points.

    Parameters
    ----------
    a, b : PointSpectra or None
    given : (PointSpectra or None, PointSpectra or None)
        What they were before they were brought to the common bands; None: what they are.
    weights : (ndarray of shape (T, N) or None, ndarray or None)
        What brought them there; None: nothing.
    """

    a: PointSpectra | None
    b: PointSpectra | None
    given: tuple[PointSpectra | None, PointSpectra | None] = (None, None)
    weights: tuple[Array | None, Array | None] = (None, None)

    def error_of_sum(self, side: int, shares: Array) -> Array | None:
        """The standard error of a weighted sum over the common bands, at each point of a side.

        Parameters
        ----------
        side : int
            0: A, 1: B.
        shares : ndarray of shape (T,)
            Weights of the common bands.

        Returns
        -------
        ndarray of shape (P,) or None
            None if no standard errors are known. Bands that overlap share the errors of the samples they are
            made of, which counts.

        Examples
        --------
        >>> from fluorspar.spectral.wavelengths import Wavelengths
        >>> table = PointSpectra(("1",), Bands(Wavelengths(400, 700, 100)), np.ones((1, 4)), np.ones((1, 4)))
        >>> Pair(table, table).error_of_sum(0, np.full(4, 0.25))
        array([0.5])
        """
        table, weights = self.given[side] or (self.a, self.b)[side], self.weights[side]
        if table is None or table.standard_error is None:
            return None
        on_own = shares if weights is None else shares @ (np.abs(weights) if table.correlated else weights)
        return error_of_sum(table.standard_error, on_own, table.correlated)

    def covariance(self, side: int, point: int) -> Array | None:
        """Covariance of the common bands at one point of a side.

        Parameters
        ----------
        side : int
            0: A, 1: B.
        point : int
            Its number.

        Returns
        -------
        ndarray of shape (T, T) or None
            None if no standard errors are known.

        Examples
        --------
        >>> from fluorspar.spectral.wavelengths import Wavelengths
        >>> table = PointSpectra(("1",), Bands(Wavelengths(400, 500, 100)), np.ones((1, 2)), np.ones((1, 2)))
        >>> Pair(table, table).covariance(0, 0)
        array([[1., 0.],
               [0., 1.]])
        """
        table, weights = self.given[side] or (self.a, self.b)[side], self.weights[side]
        if table is None or table.standard_error is None:
            return None
        error = table.standard_error[point]
        if table.correlated:
            error = error if weights is None else np.abs(weights) @ error
            return np.outer(error, error)
        return np.diag(error**2) if weights is None else np.asarray((weights * error**2) @ weights.T)


def paired(
    tables: tuple[PointSpectra, PointSpectra] | None,
    weights: tuple[Array | None, Array | None],
    common: Bands,
) -> Pair:
    """Bring two tables to the common bands.

    Parameters
    ----------
    tables : (PointSpectra, PointSpectra) or None
    weights : (ndarray of shape (T, N) or None, ndarray or None)
        As from `conversion`.
    common : Bands

    Examples
    --------
    >>> paired(None, (None, None), None)
    Pair(a=None, b=None, given=(None, None), weights=(None, None))
    """
    if tables is None:
        return Pair(None, None)
    a, b = (_through(table, each, common) for table, each in zip(tables, weights, strict=True))
    return Pair(a, b, tables, weights)


def _through(table: PointSpectra, weights: Array | None, common: Bands) -> PointSpectra:
    if weights is None:
        return table
    error = errors_on_bands(table.standard_error, weights, table.correlated)
    return replace(table, bands=common, radiance=table.radiance @ weights.T, standard_error=error)
