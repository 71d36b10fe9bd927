"""The colour of a material under a lamp, without any scene: a flat sample and a perfect white beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.conditions import measurement_condition
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.bispectral.excitation import excitation_grid
from fluorspar.bispectral.lamp import WIDE, grid_for, lamp_on
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.shown_colour import LampColour
from fluorspar.colour.observers import CIE_1931, observer_named
from fluorspar.colour.xyz import observer_weights
from fluorspar.errors import SpectrumError, message
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["LampColour", "colour_under_condition", "colour_under_lamp"]

Array = NDArray[np.float64]


def colour_under_lamp(
    material: Material,
    lamp: str | Spectrum = "D65",
    *,
    uv_cut: float | None = None,
    observer: str | int = CIE_1931,
    wavelengths: Wavelengths | None = None,
    excitation: str = "full",
) -> LampColour:
    """Return the colour of a material under a lamp.

    The sample is flat and fills the view; light falls on it once. What it shows is D L, and a perfect white
    shows L.

    Parameters
    ----------
    material : Material
    lamp : str or Spectrum
        Name of an illuminant, or a spectrum, in any unit.
    uv_cut : float, optional
        Take away what the lamp gives below this wavelength in nm, sharply, as with an ideal filter.
    observer : str or int
        2 or 10 (degrees), or a name, see `observer_named`.
    wavelengths : Wavelengths, optional
        The grid of what is shown. 300-780 nm by 5 by default, or as fine as the lamp is tabulated, down to 1 nm.
    excitation : str
        "full": light excites that the grid does not hold, too, as far down as the lamp and the excitation of the
        material overlap; "grid": only light of its wavelengths does.

    Returns
    -------
    LampColour

    Raises
    ------
    SpectrumError
        If there is no such illuminant, or nothing of its light is seen.
    OptionError
        If there is no such observer or excitation, or the cut leaves no light.
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
    spectrum = illuminant(lamp) if isinstance(lamp, str) else lamp
    grid = wavelengths or grid_for(spectrum)
    computed = excitation_grid(grid, [material], [spectrum], excitation)
    light, words = lamp_on(spectrum, computed, uv_cut)
    return _shown(material.on(computed), light, None, words, grid, observer)


def colour_under_condition(
    material: Material,
    condition: str = "M1",
    *,
    observer: str | int = CIE_1931,
    wavelengths: Wavelengths = WIDE,
    excitation: str = "full",
) -> LampColour:
    """Return the colour of a material as ISO 13655 wants it measured and calculated.

    The radiance factor is that under the source of the condition; it is then multiplied with D50, so
    luminescence excited by a tungsten lamp (M0) is not what D50 would excite.

    Parameters
    ----------
    material : Material
    condition : str
        "M0", "M1" or "M2" (see `MeasurementCondition`).
    observer : str or int
        2 or 10 (degrees), or a name, see `observer_named`; ISO 13655 wants CIE 1931.
    wavelengths : Wavelengths
    excitation : str
        "full" or "grid", see `colour_under_lamp`.

    Returns
    -------
    LampColour

    Raises
    ------
    OptionError
        If there is no such condition, observer or excitation.
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
    how = measurement_condition(condition)
    computed = excitation_grid(wavelengths, [material], [illuminant(how.source)], excitation)
    light, _ = lamp_on(how.source, computed, how.uv_cut)
    viewed_in, _ = lamp_on(how.viewed_in, wavelengths)
    words = f"{how.name}: {how.meaning}, seen in {how.viewed_in}"
    return _shown(material.on(computed), light, viewed_in, words, wavelengths, observer)


def _shown(
    D: DonaldsonMatrix,
    light: Array,
    viewed_in: Array | None,
    lamp: str,
    grid: Wavelengths,
    observer: str | int,
) -> LampColour:
    """Colour on a grid, of light on that of the matrix, which may begin earlier."""
    seen_by = observer_named(observer)
    held = slice(len(light) - len(grid), None)
    reflected, luminescent = D.reflect(light)[held], D.apply_luminescent(light)[held]
    light = light[held]
    if not np.all(light @ observer_weights(grid, seen_by) > 0):
        fault = "this light is not visible, so it cannot be the white to which colours are relative"
        raise SpectrumError(
            message(
                fault,
                where=lamp,
                expected="light of short, medium and long wavelengths between 380 and 780 nm",
            )
        )
    return LampColour(grid, lamp, light, reflected, luminescent, viewed_in, seen_by)
