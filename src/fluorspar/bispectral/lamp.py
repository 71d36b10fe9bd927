"""The light of a lamp on a wavelength grid, and a grid fine enough for it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, SpectrumError, message
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.light import light_on
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["WIDE", "grid_for", "lamp_on"]

Array = NDArray[np.float64]

WIDE = Wavelengths(300, 780, 5)
"""The grid of colours under lamps: it holds the ultraviolet that excites brighteners."""


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
        0 where the data of the lamp end; averaged over bands if it varies within them (see `light_on`).
    words : str

    Raises
    ------
    SpectrumError
        If there is no such illuminant, or its light is negative somewhere.
    OptionError
        If the cut leaves no light.

    Warns
    -----
    ExtrapolationWarning, ApproximationWarning
        As `light_on`.

    Examples
    --------
    >>> lamp_on("E", Wavelengths(390, 410, 10), uv_cut=400)
    (array([  0., 100., 100.]), 'illuminant E, without what is below 400 nm')
    """
    spectrum = illuminant(lamp) if isinstance(lamp, str) else lamp
    if uv_cut is not None and not (np.isfinite(uv_cut) and uv_cut > 0):
        expected = "a wavelength in nm, such as 400"
        raise OptionError(message("an ultraviolet cut is impossible", got=f"{uv_cut:g}", expected=expected))
    light = light_on(spectrum, grid, above=uv_cut or 0.0)
    if light.min() < 0:
        at = grid.values[light.argmin()]
        where = f"{spectrum.title}, {at:g} nm"
        raise SpectrumError(message("a light is negative", where=where, got=f"{light.min():g}"))
    words = spectrum.title
    if uv_cut is not None:
        words = f"{words}, without what is below {uv_cut:g} nm"
        if not light.any():
            fault, expected = "the ultraviolet cut leaves no light", f"a wavelength below {grid.stop:g} nm"
            raise OptionError(message(fault, got=f"{uv_cut:g} nm", expected=expected))
    return light, words


def grid_for(lamp: str | Spectrum) -> Wavelengths:
    """The default grid: 300-780 nm by 5, or as fine as the lamp is tabulated, down to 1 nm."""
    spectrum = illuminant(lamp) if isinstance(lamp, str) else lamp
    steps = np.diff(spectrum.wavelengths)
    step = WIDE.step if spectrum.is_constant else min(WIDE.step, max(1.0, float(np.median(steps))))
    count = math.ceil((WIDE.stop - WIDE.start) / step - 1e-6)
    return Wavelengths(WIDE.start, WIDE.start + count * step, step)
