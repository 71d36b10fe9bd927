"""Spectra as the page draws them."""

from __future__ import annotations

from typing import Any

from fluorspar.spectral.spectrum import Spectrum

__all__ = ["curve_of"]

_WHOLE = (300.0, 830.0)  # nm, where a constant spectrum is drawn


def curve_of(spectrum: Spectrum) -> dict[str, Any]:
    """The nodes of a spectrum.

    Examples
    --------
    >>> curve_of(Spectrum.constant(0.5))
    {'wavelengths': (300.0, 830.0), 'values': (0.5, 0.5)}
    """
    if spectrum.is_constant:
        return {"wavelengths": _WHOLE, "values": (float(spectrum.values[0]),) * 2}
    return {"wavelengths": spectrum.wavelengths, "values": spectrum.values}
