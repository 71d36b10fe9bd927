"""Bringing spectra of different wavelength grids and band shapes together, explicitly.

A *sample* is the value at one wavelength. A *band* of an instrument is the mean under a triangle whose full
width at half maximum (FWHM) is the instrument's bandwidth. Standard errors of bands are fully correlated in a render,
independent in a table of measurements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import OptionError, SpectrumError, message
from fluorspar.spectral.uneven import UnevenWavelengths
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = [
    "Bands",
    "assumed_bands",
    "band_weights",
    "beyond_the_data",
    "common_bands",
    "conversion",
    "error_of_sum",
    "errors_on_bands",
]

Array = NDArray[np.float64]

_SAME = 1e-6  # nm


@dataclass(frozen=True)
class Bands:
    """A wavelength grid and the shape of its bands.

    Parameters
    ----------
    grid : Wavelengths
        The centres.
    fwhm : float or None
        Full width at half maximum of the triangular bands in nm; 0: samples; None: not known.

    Raises
    ------
    OptionError
        If the width is negative or not finite.

    Examples
    --------
    >>> print(Bands(Wavelengths(400, 700, 10), 10))
    400-700 nm by 10, triangular bands of 10 nm FWHM
    """

    grid: Wavelengths
    fwhm: float | None = 0.0

    def __post_init__(self) -> None:
        if self.fwhm is not None and not (np.isfinite(self.fwhm) and self.fwhm >= 0):
            raise OptionError(
                message("a bandwidth is impossible", got=self.fwhm, expected="0 nm (samples) or more")
            )

    def __str__(self) -> str:
        if self.fwhm is None:
            return f"{self.grid}, band shape not known"
        return f"{self.grid}, " + (f"triangular bands of {self.fwhm:g} nm FWHM" if self.fwhm else "samples")


def band_weights(source: ArrayLike, target: ArrayLike, fwhm: float = 0.0) -> Array:
    """Return the matrix that takes samples to other samples or to triangular bands.

    The samples stand for the piecewise linear spectrum through them, whose mean under each triangle is taken
    exactly. Where a triangle reaches beyond the first or last sample, the spectrum is continued by point
    reflection through that sample, so that a linear spectrum stays itself up to the ends.

    Parameters
    ----------
    source : array_like of shape (N,)
        Wavelengths of the samples in nm, ascending.
    target : array_like of shape (T,)
        Centres wanted, within the range of the samples.
    fwhm : float
        Width of the triangles in nm; 0: linear interpolation.

    Returns
    -------
    ndarray of shape (T, N)
        Each row sums to 1.

    Raises
    ------
    SpectrumError
        If a centre is outside the samples, or the triangles are wider than their range.

    Examples
    --------
    >>> band_weights([400, 405, 410, 415, 420], [410], fwhm=5).round(4)
    array([[0.    , 0.1667, 0.6667, 0.1667, 0.    ]])
    """
    at, centres = np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64)
    if centres.min() < at[0] - _SAME or centres.max() > at[-1] + _SAME:
        raise SpectrumError(
            message(
                "a band lies outside the data",
                got=f"bands at {centres.min():g}-{centres.max():g} nm",
                expected=f"within {at[0]:g}-{at[-1]:g} nm",
            )
        )
    centres = np.clip(centres, at[0], at[-1])
    if fwhm == 0:
        return _interpolation(at, centres)
    if fwhm > at[-1] - at[0]:
        raise SpectrumError(
            message(
                "the bands are wider than the data",
                got=f"{fwhm:g} nm",
                expected=f"data for {at[-1] - at[0]:g} nm",
            )
        )
    nodes, mirrored = _reflected(at, fwhm)
    rows = [_under_triangle(nodes, centre, fwhm) for centre in centres]
    return np.asarray(np.stack(rows) @ mirrored)


def _interpolation(at: Array, points: Array) -> Array:
    """Weights of linear interpolation, ndarray of shape (points, samples)."""
    left = np.clip(np.searchsorted(at, points, side="right") - 1, 0, len(at) - 2)
    share = (points - at[left]) / (at[left + 1] - at[left])
    weights = np.zeros((len(points), len(at)))
    rows = np.arange(len(points))
    weights[rows, left] = 1 - share
    weights[rows, left + 1] = share
    return weights


def _reflected(at: Array, reach: float) -> tuple[Array, Array]:
    """Continue samples by point reflection at both ends: the nodes, and their values as weights of the samples."""
    count = len(at)
    below = [k for k in range(1, count) if at[k - 1] - at[0] < reach][::-1]
    above = [k for k in range(count - 2, -1, -1) if at[-1] - at[k + 1] < reach]
    nodes = np.concatenate([2 * at[0] - at[below], at, 2 * at[-1] - at[above]])
    weights = np.zeros((len(nodes), count))
    for row, k in enumerate(below):
        weights[row, [0, k]] = 2.0, -1.0
    weights[len(below) : len(below) + count] = np.eye(count)
    for row, k in enumerate(above, start=len(below) + count):
        weights[row, [-1, k]] = 2.0, -1.0
    return nodes, weights


def _under_triangle(nodes: Array, centre: float, fwhm: float) -> Array:
    """Weights of the nodes in the mean under one triangle; Simpson's rule is exact on each linear piece."""
    inside = nodes[(nodes > centre - fwhm) & (nodes < centre + fwhm)]
    ends = np.unique(np.concatenate([inside, [centre - fwhm, centre, centre + fwhm]]))
    lengths = np.diff(ends)
    points = np.concatenate([ends[:-1], (ends[:-1] + ends[1:]) / 2, ends[1:]])
    simpson = np.concatenate([lengths / 6, 4 * lengths / 6, lengths / 6])
    heights = np.maximum(0.0, 1 - np.abs(points - centre) / fwhm) / fwhm
    weights = (simpson * heights) @ _interpolation(nodes, points)
    return np.asarray(weights / weights.sum())


def assumed_bands(bands: Bands, other: Bands) -> Bands:
    """Assume a band shape where it is not known: triangular with the step as FWHM on the coarser grid, else samples.

    Parameters
    ----------
    bands : Bands
    other : Bands
        What they are compared with.

    Examples
    --------
    >>> print(assumed_bands(Bands(Wavelengths(400, 700, 10), None), Bands(Wavelengths(360, 700, 5))))
    400-700 nm by 10, triangular bands of 10 nm FWHM
    """
    if bands.fwhm is not None:
        return bands
    coarser = _spacing(bands.grid) > _spacing(other.grid) * (1 + 1e-6)
    return Bands(bands.grid, _spacing(bands.grid) if coarser else 0.0)


def _spacing(grid: Wavelengths) -> float:
    """The step of a grid, the mean one if it is uneven."""
    return (grid.stop - grid.start) / (len(grid) - 1)


def common_bands(a: Bands, b: Bands, wanted: Wavelengths | None = None) -> Bands:
    """Choose the bands on which two spectra are compared.

    The grid is the coarser of the two as far as both have data, made even if it is not; the band shape is the wider
    of the two. A band shape that is not known is that of `assumed_bands`.

    Parameters
    ----------
    a, b : Bands
    wanted : Wavelengths, optional
        The grid to be used instead, within the range of both.

    Returns
    -------
    Bands

    Raises
    ------
    SpectrumError
        If there are fewer than two wavelengths that both have, or the grid wanted reaches beyond them.

    Examples
    --------
    >>> print(common_bands(Bands(Wavelengths(360, 700, 5)), Bands(Wavelengths(400, 780, 10), None)))
    400-700 nm by 10, triangular bands of 10 nm FWHM
    """
    coarse = b if _spacing(b.grid) > _spacing(a.grid) * (1 + 1e-6) else a
    fwhm = max(assumed_bands(a, b).fwhm or 0.0, assumed_bands(b, a).fwhm or 0.0)
    first = max(a.grid.start, b.grid.start) - _SAME
    last = min(a.grid.stop, b.grid.stop) + _SAME
    if wanted and first < last and (wanted.start < first or wanted.stop > last):
        raise SpectrumError(
            message(
                "the wavelengths to compare on reach beyond the data",
                got=str(wanted),
                expected=f"within {first + _SAME:g}-{last - _SAME:g} nm, which both have",
            )
        )
    grid = (wanted or coarse.grid).values
    if not wanted and isinstance(coarse.grid, UnevenWavelengths):
        start, stop, step = first + _SAME, last - _SAME, _spacing(coarse.grid)
        grid = start + step * np.arange(max((stop - start) // step + 1, 0))
    both = grid[(grid >= first) & (grid <= last)]
    if len(both) < 2:
        raise SpectrumError(
            message(
                "the two spectra have no wavelengths in common",
                got=f"{a.grid} and {b.grid}",
                expected="at least two wavelengths" + (f" of {wanted}" if wanted else "") + " that both have",
            )
        )
    return Bands(Wavelengths.from_values(both), fwhm)


def beyond_the_data(source: Wavelengths, target: Wavelengths, fwhm: float) -> str:
    """Say where triangular bands reach beyond the data, and what is assumed there; empty if nowhere.

    Parameters
    ----------
    source, target : Wavelengths
        Of the samples, and the centres of the bands.
    fwhm : float
        In nm.

    Examples
    --------
    >>> beyond_the_data(Wavelengths(400, 700, 5), Wavelengths(400, 680, 10), 10)
    'below 400 nm the data are continued by point reflection through the end value'
    """
    reach = [f"below {source.start:g}"] * (target.start - fwhm < source.start - _SAME)
    reach += [f"above {source.stop:g}"] * (target.stop + fwhm > source.stop + _SAME)
    if not reach:
        return ""
    return f"{' and '.join(reach)} nm the data are continued by point reflection through the end value"


def conversion(source: Bands, target: Bands, name: str = "it") -> tuple[Array | None, str]:
    """Work out how spectra are brought to other bands, and say it.

    Parameters
    ----------
    source, target : Bands
    name : str
        What the spectra are called in the sentence.

    Returns
    -------
    weights : ndarray of shape (T, N) or None
        None if nothing has to be done.
    sentence : str
        What is done, for the report.

    Examples
    --------
    >>> weights, sentence = conversion(Bands(Wavelengths(360, 700, 5)), Bands(Wavelengths(400, 700, 10), 10), "A")
    >>> weights.shape, sentence.split(",")[0]
    ((31, 69), 'A: 360-700 nm by 5')
    """
    own = source.fwhm or 0.0
    wanted = target.fwhm or 0.0
    # variances of band shapes add: what is missing for the wider one
    missing = float(np.sqrt(max(wanted**2 - own**2, 0.0)))
    missing = 0.0 if missing < 1e-6 else missing
    here, there = source.grid, target.grid
    if missing == 0 and here == there:
        return None, f"{name}: {source}, used as it is."
    inside = np.isclose(here.values[:, np.newaxis], there.values, rtol=0, atol=_SAME).any(axis=0).all()
    if missing:
        how = f"mean under triangles of {missing:g} nm FWHM"
        if beyond := beyond_the_data(here, there, missing):
            how += f"; {beyond}"
    else:
        how = "every sample that is needed, unchanged" if inside else "linear interpolation"
    return band_weights(
        here.values, there.values, missing
    ), f"{name}: {source}, brought to {target} by: {how}."


def error_of_sum(errors: Array, shares: Array, correlated: bool) -> Array:
    """Return the standard error of weighted sums over bands.

    Parameters
    ----------
    errors : ndarray of shape (P, N)
    shares : ndarray of shape (N,)
        Weights of the bands.
    correlated : bool
        Whether the errors of the bands are fully correlated; else they are independent.

    Returns
    -------
    ndarray of shape (P,)

    Examples
    --------
    >>> errors, mean = np.ones((1, 4)), np.full(4, 0.25)
    >>> error_of_sum(errors, mean, correlated=True), error_of_sum(errors, mean, correlated=False)
    (array([1.]), array([0.5]))
    """
    if correlated:
        return np.asarray(errors @ np.abs(shares))
    return np.asarray(np.sqrt(errors**2 @ shares**2))


def errors_on_bands(errors: Array | None, weights: Array | None, correlated: bool) -> Array | None:
    """Bring standard errors to other bands.

    Parameters
    ----------
    errors : ndarray of shape (P, N) or None
    weights : ndarray of shape (T, N) or None
        As from `conversion`; None: nothing is to be done.
    correlated : bool
        As in `error_of_sum`.

    Returns
    -------
    ndarray of shape (P, T) or None

    Examples
    --------
    >>> errors_on_bands(np.ones((1, 2)), np.array([[0.5, 0.5]]), correlated=True)
    array([[1.]])
    """
    if errors is None or weights is None:
        return errors
    return np.stack([error_of_sum(errors, row, correlated) for row in weights], axis=-1)
