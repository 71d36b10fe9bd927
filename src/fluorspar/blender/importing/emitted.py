"""Light that is sent out: a linear colour, which Mitsuba makes D65 times that colour, or a black body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

import numpy as np

from fluorspar.blender.importing.elements import rgb
from fluorspar.blender.importing.listing import Listing
from fluorspar.colour.observers import matching_functions

__all__ = ["Emitted"]

_FROM, _TO, _STEP = 300, 830, 10  # nm; ultraviolet excites
_COOLEST = 800.0  # K; Blender's black bodies are not darker
_SECOND_RADIATION = 1.438776877e7  # nm K


@dataclass(frozen=True)
class Emitted:
    """What a light gives out.

    Attributes
    ----------
    colour : sequence of 3 floats
        Linear; times everything.
    kelvin : float, optional
        Of a black body, whose luminance is that of white of the same strength, as in Blender.
    """

    colour: tuple[float, float, float]
    kelvin: float | None = None

    def times(self, factor: float | Sequence[float]) -> Emitted:
        """Stronger, or through a filter."""
        red, green, blue = np.asarray(self.colour) * factor
        return replace(self, colour=(float(red), float(green), float(blue)))

    @property
    def is_dark(self) -> bool:
        return max(self.colour) <= 0

    def element(self, name: str, where: str, listing: Listing) -> Element:
        """As the property of an emitter; names what is approximated."""
        colour = np.asarray(self.colour)
        if (colour < 0).any():
            listing.add(where, "takes light away (a negative strength): Fluorspar cannot, it is 0 there")
            colour = np.maximum(colour, 0)
        if self.kelvin is None:
            return rgb(name, colour.tolist())
        if np.ptp(colour) > 1e-4 * colour.max():
            listing.add(where, "has a black body times a colour: the colour counts as its luminance")
        spectrum = _black_body(max(self.kelvin, _COOLEST)) * float(colour @ [0.212671, 0.715160, 0.072169])
        pairs = zip(range(_FROM, _TO + 1, _STEP), spectrum, strict=True)
        return Element("spectrum", {"name": name, "value": ", ".join(f"{w}:{v:.6g}" for w, v in pairs)})


def _black_body(kelvin: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Planck's law, scaled to the luminance of a spectrum that is 1 everywhere."""
    wavelengths = np.arange(_FROM, _TO + 1, _STEP, dtype=np.float64)
    radiance = wavelengths**-5 / np.expm1(_SECOND_RADIATION / (wavelengths * kelvin))
    at, observer = matching_functions(2)
    luminous = np.interp(wavelengths, at, observer[:, 1], left=0, right=0)
    return np.asarray(radiance * luminous.sum() / (radiance @ luminous))
