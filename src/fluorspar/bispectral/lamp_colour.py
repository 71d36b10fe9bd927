"""The colour of a material under a lamp, without any scene: a flat sample and a perfect white beside it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.conditions import measurement_condition
from fluorspar.bispectral.lamp import WIDE, grid_for, lamp_on
from fluorspar.colour.adaptation import adapt_to_d65
from fluorspar.colour.whiteness import Whiteness, cie_whiteness
from fluorspar.colour.xyz import CIE_1931, SRGB_FROM_XYZ, lab_from_xyz, observer_weights, srgb_from_xyz
from fluorspar.errors import SpectrumError, message
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    from fluorspar.bispectral.material import Material

__all__ = ["LampColour", "colour_under_condition", "colour_under_lamp"]

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
        Name of the colour matching functions.
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
        """Luminescent part of the luminance, 0 to 1."""
        return float(self.xyz_luminescent[1] / self.xyz[1]) if self.xyz[1] > 0 else 0.0

    @property
    def srgb(self) -> Array:
        """Gamma-encoded sRGB, ndarray of shape (3,), 0 to 1, as seen by an eye adapted to the lamp (Bradford).

        What is too bright for sRGB is dimmed until it fits, so that a neon paint keeps its hue.
        """
        return srgb_from_xyz(self._seen(), min(1.0, 1.0 / self._brightest()))[0]

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
        found = cie_whiteness(self.xyz, self.white, self.observer)
        daylight = illuminant("D65").on(self.grid, outside="zero") @ observer_weights(
            self.grid, self.observer
        )
        x, y = self.white[:2] / self.white.sum() - daylight[:2] / daylight.sum()
        if math.hypot(x, y) < _SAME_WHITE:
            return found
        return replace(found, outside=(*found.outside, "it is meant for D65, which this light is not"))

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
        return np.asarray(100 * viewed @ weights / (white @ weights[:, 1]))


def colour_under_lamp(
    material: Material,
    lamp: str | Spectrum = "D65",
    *,
    uv_cut: float | None = None,
    observer: str = CIE_1931,
    wavelengths: Wavelengths | None = None,
) -> LampColour:
    """Return the colour of a material under a lamp.

    The sample is flat and fills the view; light falls on it once. What it shows is D L, and a perfect white
    shows L.

    Parameters
    ----------
    material
        The material.
    lamp
        Name of an illuminant, or a spectrum, in any unit.
    uv_cut
        Take away what the lamp gives below this wavelength in nm, sharply, as with an ideal filter.
    observer
        Name of the colour matching functions.
    wavelengths
        The grid; the light of all its wavelengths excites. 300-780 nm by 5 by default, or as fine as the lamp is
        tabulated, down to 1 nm.

    Returns
    -------
    LampColour

    Raises
    ------
    SpectrumError
        If there is no such illuminant, or nothing of its light is seen.
    OptionError
        If there is no such observer, or the cut leaves no light.
    MaterialError
        If the material is physically impossible.

    Warns
    -----
    ExtrapolationWarning
        If the data of the lamp or of the material end within the grid.
    ApproximationWarning
        If the lamp has lines between the wavelengths of the grid.

    Examples
    --------
    >>> from fluorspar.bispectral.library import material
    >>> paint = colour_under_lamp(material("poster-yellow"), "D65")
    >>> bool(paint.xyz[1] > paint.xyz_reflected[1])
    True
    >>> paper = material("paper-whitened")
    >>> with_uv, without = colour_under_lamp(paper), colour_under_lamp(paper, uv_cut=400)
    >>> bool(with_uv.lab[2] < without.lab[2])  # a brightener takes away yellow
    True
    """
    grid = wavelengths or grid_for(lamp)
    light, words = lamp_on(lamp, grid, uv_cut)
    return _shown(material, light, None, words, grid, observer)


def colour_under_condition(
    material: Material,
    condition: str = "M1",
    *,
    observer: str = CIE_1931,
    wavelengths: Wavelengths = WIDE,
) -> LampColour:
    """Return the colour of a material as ISO 13655 wants it measured and calculated.

    The radiance factor is that under the source of the condition; it is then multiplied with D50, so
    luminescence excited by a tungsten lamp (M0) is not what D50 would excite.

    Parameters
    ----------
    material
        The material.
    condition
        "M0", "M1" or "M2" (see `MeasurementCondition`).
    observer
        Name of the colour matching functions; ISO 13655 wants CIE 1931.
    wavelengths
        The grid.

    Returns
    -------
    LampColour

    Raises
    ------
    OptionError
        If there is no such condition or observer.
    MaterialError
        If the material is physically impossible.

    Examples
    --------
    >>> from fluorspar.bispectral.library import material
    >>> paper = material("paper-whitened")
    >>> b = [float(colour_under_condition(paper, m).lab[2]) for m in ("M0", "M1", "M2")]
    >>> b[1] < b[0] < b[2]  # the more ultraviolet, the bluer
    True
    """
    found = measurement_condition(condition)
    light, _ = lamp_on(found.source, wavelengths, found.uv_cut)
    viewed_in, _ = lamp_on(found.viewed_in, wavelengths)
    words = f"{found.name}: {found.meaning}, seen in {found.viewed_in}"
    return _shown(material, light, viewed_in, words, wavelengths, observer)


def _shown(
    material: Material, light: Array, viewed_in: Array | None, lamp: str, grid: Wavelengths, observer: str
) -> LampColour:
    D = material.on(grid)
    if not np.all(light @ observer_weights(grid, observer) > 0):
        fault = "nobody sees this light, so no colour can be named relative to its white"
        raise SpectrumError(
            message(
                fault,
                where=lamp,
                expected="light of short, medium and long wavelengths between 380 and 780 nm",
            )
        )
    return LampColour(grid, lamp, light, D.reflect(light), D.apply_luminescent(light), viewed_in, observer)
