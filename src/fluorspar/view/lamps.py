"""Lamps from menus: by name, temperature, centre and width, drawn by hand, or uploaded."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import SpectrumError, message
from fluorspar.spectral.illuminants import illuminants, listed_name
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.view.questions import LightSpectrum
from fluorspar.view.uploads import Uploads

__all__ = ["blackbody", "gaussian", "known_illuminant", "lamp_of"]

_PLANCK = 6.62607015e-34 * 299792458.0 / 1.380649e-23 * 1e9  # second radiation constant, nm K
_AT = np.arange(200.0, 1101.0, 5.0)  # nm
_WIDTHS = 4.0  # of a Gaussian, in standard deviations on each side
_NODES = 161


def lamp_of(asked: LightSpectrum, uploads: Uploads) -> Spectrum | str:
    """The spectrum that is asked for; the name of an illuminant stays one.

    Raises
    ------
    SpectrumError
        If there is no such illuminant, or the curve is none.
    OptionError
        If there is no such upload.
    """
    if asked.name is not None:
        return known_illuminant(asked.name)
    if asked.blackbody is not None:
        return blackbody(asked.blackbody)
    if asked.gaussian is not None:
        return gaussian(*asked.gaussian)
    if asked.upload is not None:
        return uploads.light(asked.upload)
    at, values = np.array(sorted(asked.curve or [])).T
    return Spectrum(at, values, "drawn by hand")


def known_illuminant(name: str) -> str:
    """The name of an illuminant as it is listed; a file of this computer is none of them.

    Raises
    ------
    SpectrumError
        If there is none of that name.

    Examples
    --------
    >>> known_illuminant("fl11")
    'FL11'
    """
    known = listed_name(name)
    if known is None:
        expected = ", ".join(illuminants())
        raise SpectrumError(message("there is no such illuminant", got=repr(name), expected=expected))
    return known


def blackbody(temperature: float) -> Spectrum:
    """Return the relative radiance of a black body (Planck's law), 1 at 560 nm.

    Examples
    --------
    >>> round(blackbody(2856.0).at(460), 3)  # as CIE's illuminant A has it
    0.378
    """

    def planck(at: ArrayLike) -> NDArray[np.float64]:
        nm = np.asarray(at, np.float64)
        return nm**-5 / np.expm1(_PLANCK / (nm * temperature))

    return Spectrum(_AT, planck(_AT) / planck(560.0), f"black body of {temperature:g} K")


def gaussian(centre: float, width: float) -> Spectrum:
    """Return a Gaussian of this centre and full width at half maximum in nm, 1 at the centre: a coloured LED.

    Examples
    --------
    >>> led = gaussian(450.0, 20.0)
    >>> round(led.at(440), 2), round(led.peak)
    (0.5, 450)
    """
    sigma = width / np.sqrt(8 * np.log(2))
    at = centre + _WIDTHS * sigma * np.linspace(-1, 1, _NODES)
    values = np.exp(-0.5 * ((at - centre) / sigma) ** 2) - np.exp(-0.5 * _WIDTHS**2)
    kept = at >= 1.0
    return Spectrum(at[kept], np.maximum(values[kept], 0.0), f"LED of {centre:g} nm, {width:g} nm wide")
