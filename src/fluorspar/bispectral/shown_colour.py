"""What a flat sample shows in some light: radiance factors, XYZ, CIELAB, sRGB and whiteness."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.adaptation import adapt_to_d65
from fluorspar.colour.observers import CIE_1931, CIE_1964
from fluorspar.colour.whiteness import Whiteness, cie_whiteness
from fluorspar.colour.xyz import SRGB_FROM_XYZ, lab_from_xyz, observer_weights, srgb_encode, srgb_from_xyz
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["LampColour"]

Array = NDArray[np.float64]

_SAME_WHITE = 0.01  # in x, y: a lamp that simulates D65 may be that far off


@dataclass(frozen=True, eq=False)
class LampColour:
    """What a material shows under a lamp; N wavelengths of `grid`.

    Attributes
    ----------
    grid : Wavelengths
    lamp : str
        The light in words.
    light : ndarray of shape (N,)
        What a perfect white would show, relative: the light that falls on the sample.
    reflected, luminescent : ndarray of shape (N,)
        The two parts of what the sample shows, on the scale of `light`.
    viewed_in : ndarray of shape (N,) or None
        The light of the tristimulus sums: D50 under a measurement condition; None for `light` itself.
    observer : str
        One of `fluorspar.colour.observers.OBSERVERS`.
    """

    grid: Wavelengths
    lamp: str
    light: Array
    reflected: Array
    luminescent: Array
    viewed_in: Array | None
    observer: str

    @property
    def radiance_factor(self) -> Array:
        """The total radiance factor, ndarray of shape (N,); nan where the lamp gives no light."""
        return self.reflected_factor + self.luminescent_factor

    @property
    def reflected_factor(self) -> Array:
        """The reflected part of it, S; nan where the lamp gives no light."""
        return self._factor(self.reflected)

    @property
    def luminescent_factor(self) -> Array:
        """The luminescent part of it, which depends on the lamp; nan where the lamp gives no light."""
        return self._factor(self.luminescent)

    @property
    def xyz(self) -> Array:
        """XYZ, ndarray of shape (3,); Y = 100 for the perfect white."""
        return self._xyz(self.reflected + self.luminescent)

    @property
    def xyz_reflected(self) -> Array:
        """XYZ of the reflected part."""
        return self._xyz(self.reflected)

    @property
    def xyz_luminescent(self) -> Array:
        """XYZ of the luminescent part."""
        return self._xyz(self.luminescent)

    @property
    def white(self) -> Array:
        """XYZ of the perfect white, ndarray of shape (3,), Y = 100."""
        return self._xyz(self.light)

    @property
    def lab(self) -> Array:
        """CIELAB with the perfect white in this light as reference, ndarray of shape (3,)."""
        return lab_from_xyz(self.xyz, self.white)

    @property
    def lab_reflected(self) -> Array:
        """CIELAB of the reflected part alone: the sample if it did not luminesce."""
        return lab_from_xyz(self.xyz_reflected, self.white)

    @property
    def luminescent_share(self) -> float:
        """Luminescent part of the luminance, 0 to 1; 0 where the noise of a measured matrix makes it negative."""
        return max(0.0, float(self.xyz_luminescent[1] / self.xyz[1])) if self.xyz[1] > 0 else 0.0

    @property
    def srgb(self) -> Array:
        """Gamma-encoded sRGB, ndarray of shape (3,), 0 to 1, as seen by an eye adapted to the lamp (Bradford).

        What is too bright for sRGB is dimmed until it fits, so that a neon paint keeps its hue.
        """
        return srgb_from_xyz(self._seen(), min(1.0, 1.0 / self._brightest()))[0]

    @property
    def plain_srgb(self) -> Array:
        """Gamma-encoded sRGB of XYZ as it is, ndarray of shape (3,): no adaptation to the lamp, nothing fitted.

        Below 0 or above 1 where sRGB has no such colour; negative values are encoded as their positive ones.
        """
        linear = SRGB_FROM_XYZ @ (self.xyz / 100)
        return np.sign(linear) * srgb_encode(np.abs(linear))

    @property
    def in_gamut(self) -> bool:
        """Whether sRGB can show the colour; if not, `srgb` is dimmer or less saturated."""
        return srgb_from_xyz(self._seen())[1] == 0.0

    def _seen(self) -> Array:
        return adapt_to_d65(self.xyz, self.white) / 100

    def _brightest(self) -> float:
        """The highest of linear red, green and blue."""
        return max(float((SRGB_FROM_XYZ @ self._seen()).max()), 1e-9)

    @property
    def whiteness(self) -> Whiteness:
        """CIE whiteness and tint; see `cie_whiteness`. They are meant for D65, and not valid in another white."""
        if self.observer not in (CIE_1931, CIE_1964):
            return Whiteness(math.nan, math.nan, ("it is defined for CIE 1931 and CIE 1964 only",))
        whiteness = cie_whiteness(self.xyz, self.white, self.observer)
        weights = observer_weights(self.grid, self.observer)
        daylight = illuminant("D65").on(self.grid, outside="zero") @ weights
        x, y = self.white[:2] / self.white.sum() - daylight[:2] / daylight.sum()
        if math.hypot(x, y) < _SAME_WHITE:
            return whiteness
        return replace(
            whiteness, outside=(*whiteness.outside, "it is meant for D65, which this light is not")
        )

    def _factor(self, radiance: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.light > 0, radiance / self.light, np.nan)

    def _xyz(self, radiance: Array) -> Array:
        weights = observer_weights(self.grid, self.observer)
        if self.viewed_in is None:  # luminescence may shine where the lamp is dark
            viewed, white = radiance, self.light
        else:
            lit = self.light > 0
            gain = np.where(lit, self.viewed_in / np.where(lit, self.light, 1.0), 0.0)
            viewed, white = radiance * gain, self.light * gain
        with np.errstate(divide="ignore", invalid="ignore"):  # NaN where no wavelength is visible
            return np.asarray(100 * viewed @ weights / (white @ weights[:, 1]))
