"""The light of a lamp on a wavelength grid: samples where they say it all, else means over bands, energy kept."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, ExtrapolationWarning
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["light_on", "means_over_bands", "sampled_or_averaged"]

Array = NDArray[np.float64]

_SAME = 1e-6  # nm
_CURVED = (
    0.03  # of the light between two wavelengths of a grid: a smooth lamp is not further off a straight line
)
_LINES = 0.1  # a lamp of which more lies between has lines


def light_on(spectrum: Spectrum, grid: Wavelengths, *, above: float = 0.0) -> Array:
    """Return the light of a lamp on a grid.

    A lamp that is nearly linear between all wavelengths of the grid is sampled. Of any other, each wavelength gets the
    mean under its triangle, so that a line between two wavelengths counts in full and is shared by them.

    Parameters
    ----------
    spectrum : Spectrum
    grid : Wavelengths
        N wavelengths.
    above : float
        Take away what is below this wavelength in nm, sharply.

    Returns
    -------
    ndarray of shape (N,)
        0 where the data of the lamp end.

    Raises
    ------
    SpectrumError
        If grid and data have no wavelength in common.

    Warns
    -----
    ExtrapolationWarning
        If the data of the lamp end within the grid, and not at 0.
    ApproximationWarning
        If the lamp has lines between the wavelengths of the grid.

    Examples
    --------
    >>> light_on(Spectrum([400, 500], [1.0, 2.0]), Wavelengths(400, 500, 50), above=420)
    array([0. , 1.5, 2. ])
    >>> laser = Spectrum([487, 488, 489], [0.0, 1.0, 0.0], "a laser")
    >>> with warnings.catch_warnings(action="ignore"):
    ...     light_on(laser, Wavelengths(485, 490, 5)).round(3)  # 5 nm of these hold its 1 W
    array([0.08, 0.12])
    """
    light, missed = sampled_or_averaged(spectrum, grid, above)
    first, last = spectrum.support
    begins, ends = max(grid.start, above) < first - _SAME, grid.stop > last + _SAME
    if (begins and spectrum.values[0] > 0) or (ends and spectrum.values[-1] > 0):
        text = f"{spectrum.title}: data for {first:g}-{last:g} nm, used on {grid}; assumed: no light outside"
        warnings.warn(text, ExtrapolationWarning, stacklevel=3)
    if missed > _LINES:
        step = float(np.diff(spectrum.wavelengths).min())
        text = (
            f"{spectrum.title}: tabulated every {step:g} nm, used every {grid.step:g} nm: {min(100 * missed, 100):.0f} "
            f"% of its light lies between, averaged over bands of {grid.step:g} nm; to keep its lines use a grid such "
            f"as {grid.start:g}:{grid.stop:g}:{max(step, 1):g} (--wavelengths)"
        )
        warnings.warn(text, ApproximationWarning, stacklevel=3)
    return light


def sampled_or_averaged(spectrum: Spectrum, grid: Wavelengths, above: float = 0.0) -> tuple[Array, float]:
    """Return what `light_on` does, and the share of the light that lies between the samples; without a word.

    Examples
    --------
    >>> sampled_or_averaged(Spectrum([400, 500], [1.0, 2.0]), Wavelengths(400, 500, 50))
    (array([1. , 1.5, 2. ]), 0.0)
    """
    samples = spectrum.on(grid, outside="zero")
    light = np.where(grid.values < above - _SAME, 0.0, samples)
    first, last = max(spectrum.support[0], grid.start, above), min(spectrum.support[1], grid.stop)
    if spectrum.is_constant or first >= last:
        return light, 0.0
    fine = np.unique(np.concatenate([grid.values, spectrum.wavelengths, [first]]))
    fine = fine[(fine >= first) & (fine <= last)]
    exact = np.interp(fine, spectrum.wavelengths, spectrum.values)
    between = np.abs(exact - np.interp(fine, grid.values, samples))
    cell = np.searchsorted(
        grid.values, (fine[:-1] + fine[1:]) / 2
    )  # the two wavelengths that each piece is between
    missed, all_of_it = (
        np.bincount(cell, (v[:-1] + v[1:]) * np.diff(fine) / 2) for v in (between, np.abs(exact))
    )
    if np.any(missed > _CURVED * all_of_it):
        light = means_over_bands(spectrum, grid, above=above)
    return light, float(missed.sum() / max(all_of_it.sum(), 1e-300))


def means_over_bands(spectrum: Spectrum, grid: Wavelengths, *, above: float = 0.0) -> Array:
    """Return the mean of a spectrum under the triangle of each wavelength, half as wide at half height as its base.

    The triangles reach to the neighbours and add up to 1, so the step times the sum is the integral.

    Parameters
    ----------
    spectrum : Spectrum
        0 outside its data.
    grid : Wavelengths
        N wavelengths; their step is the half width of the base.
    above : float
        Nothing below this wavelength in nm counts.

    Returns
    -------
    ndarray of shape (N,)

    Examples
    --------
    >>> line = Spectrum([406, 407, 408], [0.0, 1.0, 0.0])
    >>> 5 * means_over_bands(line, Wavelengths(400, 415, 5))
    array([0. , 0.6, 0.4, 0. ])
    """
    edges = np.concatenate([[grid.start - grid.step], grid.values, [grid.stop + grid.step]])
    first, last = max(spectrum.support[0], edges[0], above), min(spectrum.support[1], edges[-1])
    nodes = np.unique(np.concatenate([edges, spectrum.wavelengths, [first, last]]))
    nodes = nodes[(nodes >= first) & (nodes <= last)]
    left, lengths = nodes[:-1], np.diff(nodes)
    below = np.searchsorted(edges, left, side="right") - 1  # the wavelength on the left of each piece
    sums = np.zeros(len(edges))
    for place, weight in ((0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6)):  # Simpson's rule, exact here
        at = left + place * lengths
        light = weight * lengths * np.interp(at, spectrum.wavelengths, spectrum.values)
        share = (at - edges[below]) / grid.step
        sums += np.bincount(below, (1 - share) * light, len(edges))
        sums += np.bincount(below + 1, share * light, len(edges))
    return np.asarray(sums[1:-1] / grid.step)
