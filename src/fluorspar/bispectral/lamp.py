"""The light of a lamp on a wavelength grid, and a grid fine enough for it."""

from __future__ import annotations

import math
import warnings

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, ExtrapolationWarning, OptionError, SpectrumError, message
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum, trapezoid
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["WIDE", "grid_for", "lamp_on"]

Array = NDArray[np.float64]

WIDE = Wavelengths(300, 780, 5)
"""The grid of colours under lamps: it holds the ultraviolet that excites brighteners."""

_MOST_MISSED = 0.02  # of the light of a lamp, between the wavelengths of the grid


def lamp_on(lamp: str | Spectrum, grid: Wavelengths, uv_cut: float | None = None) -> tuple[Array, str]:
    """Return the light of a lamp on a grid, and the lamp in words.

    Parameters
    ----------
    lamp : str or Spectrum
        Name of an illuminant, or a spectrum.
    grid : Wavelengths
        N wavelengths.
    uv_cut : float, optional
        Take away what is below this wavelength in nm.

    Returns
    -------
    light : ndarray of shape (N,)
        0 where the data of the lamp end.
    words : str

    Raises
    ------
    SpectrumError
        If there is no such illuminant, or its light is negative somewhere.
    OptionError
        If the cut leaves no light.

    Warns
    -----
    ExtrapolationWarning
        If the data of the lamp end within the grid.
    ApproximationWarning
        If the lamp has lines between the wavelengths of the grid.

    Examples
    --------
    >>> lamp_on("E", Wavelengths(390, 410, 10), uv_cut=400)
    (array([  0., 100., 100.]), 'illuminant E, without what is below 400 nm')
    """
    spectrum = illuminant(lamp) if isinstance(lamp, str) else lamp
    light = spectrum.on(grid, outside="zero")
    _warn_of_lines(spectrum, grid, light)
    if light.min() < 0:
        at = grid.values[light.argmin()]
        where = f"{spectrum.title}, {at:g} nm"
        raise SpectrumError(message("a light is negative", where=where, got=f"{light.min():g}"))
    words = spectrum.title
    if uv_cut is not None:
        if not (np.isfinite(uv_cut) and uv_cut > 0):
            expected = "a wavelength in nm, such as 400"
            raise OptionError(
                message("an ultraviolet cut is impossible", got=f"{uv_cut:g}", expected=expected)
            )
        light = np.where(grid.values < uv_cut - 1e-6, 0.0, light)
        words = f"{words}, without what is below {uv_cut:g} nm"
        if not light.any():
            fault, expected = "the ultraviolet cut leaves no light", f"a wavelength below {grid.stop:g} nm"
            raise OptionError(message(fault, got=f"{uv_cut:g} nm", expected=expected))
    first, last = spectrum.support
    lowest = max(grid.start, uv_cut or 0.0)
    if lowest < first - 1e-6 or grid.stop > last + 1e-6:
        text = f"{spectrum.title}: data for {first:g}-{last:g} nm, used on {grid}; assumed: no light outside"
        warnings.warn(text, ExtrapolationWarning, stacklevel=2)
    return light, words


def _warn_of_lines(spectrum: Spectrum, grid: Wavelengths, light: Array) -> None:
    """Say so where the wavelengths of a grid miss what a lamp gives in between: lines."""
    if spectrum.is_constant or len(grid) < 3:
        return
    fine = np.unique(np.concatenate([grid.values, spectrum.wavelengths]))
    fine = fine[(fine >= grid.start) & (fine <= grid.stop)]
    exact = np.interp(fine, spectrum.wavelengths, spectrum.values, left=0.0, right=0.0)
    missed = trapezoid(np.abs(exact - np.interp(fine, grid.values, light)), fine)
    share = missed / max(trapezoid(np.abs(exact), fine), 1e-300)
    if share > _MOST_MISSED:
        step = float(np.diff(spectrum.wavelengths).min())
        text = (
            f"{spectrum.title}: tabulated every {step:g} nm, used every {grid.step:g} nm: {100 * share:.0f} % of its "
            f"light lies between; use a grid such as {grid.start:g}:{grid.stop:g}:{max(step, 1):g} (--wavelengths)"
        )
        warnings.warn(text, ApproximationWarning, stacklevel=3)


def grid_for(lamp: str | Spectrum) -> Wavelengths:
    """The default grid: 300-780 nm by 5, or as fine as the lamp is tabulated, down to 1 nm."""
    spectrum = illuminant(lamp) if isinstance(lamp, str) else lamp
    steps = np.diff(spectrum.wavelengths)
    step = WIDE.step if spectrum.is_constant else min(WIDE.step, max(1.0, float(np.median(steps))))
    count = math.ceil((WIDE.stop - WIDE.start) / step - 1e-6)
    return Wavelengths(WIDE.start, WIDE.start + count * step, step)
