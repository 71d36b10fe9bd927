"""The lines that describe a material: its photon yields and its colour in words."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.bispectral.shown_colour import LampColour
from fluorspar.colour.observers import CIE_1931
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["colour_in_words", "daylight_colour", "in_lines", "photon_yield_in_words", "summary_grid"]

_STEP = 5.0  # nm, of the grid on which photon yield and colour are found
_RANGE = (300.0, 780.0)  # nm, at most


def in_lines(title: str, facts: Mapping[str, str]) -> str:
    """Write facts below a title, one a line; of mixtures, one a line for each ingredient.

    Examples
    --------
    >>> print(in_lines("Material 'grey'", {"credit": "", "fluorescent": "no"}))
    Material 'grey'
      fluorescent:   no
    """
    lines = [title]
    for key, text in facts.items():
        parts = enumerate(text.splitlines())
        lines += [f"  {key + ':' if not k else '':<14} {part}" for k, part in parts if part]
    return "\n".join(lines)


def summary_grid(reflectance: Spectrum) -> Wavelengths:
    """The 5 nm grid over a reflectance, within 300-780 nm, on which photon yield and colour are told.

    Examples
    --------
    >>> print(summary_grid(Spectrum([400, 702], [0.1, 0.2])))
    400-700 nm by 5
    """
    first = max(reflectance.support[0], _RANGE[0])
    last = min(reflectance.support[1], _RANGE[1])
    if last - first < _STEP:  # data for a few nanometres, or none where light is looked at
        first, last = _RANGE if last <= first else (first, first + _STEP)
    return Wavelengths(first, first + _STEP * math.floor((last - first) / _STEP), _STEP)


def photon_yield_in_words(matrix: DonaldsonMatrix | MeasuredMatrix) -> str:
    """The highest photon yields, of a measured matrix those of its own cells."""
    total, luminescent = matrix.photon_yield(), matrix.luminescent_photon_yield()
    at = matrix.excitation if isinstance(matrix, MeasuredMatrix) else matrix.wavelengths.values
    return (
        f"at most {luminescent.max():.3g} (light of {at[luminescent.argmax()]:g} nm), "
        f"{total.max():.3g} with what is reflected (light of {at[total.argmax()]:g} nm)"
    )


def daylight_colour(D: DonaldsonMatrix) -> LampColour:
    """The colour under D65."""
    light = illuminant("D65").on(D.wavelengths)
    return LampColour(
        D.wavelengths, "D65", light, D.reflect(light), D.apply_luminescent(light), None, CIE_1931
    )


def colour_in_words(seen: LampColour) -> str:
    """A colour in sRGB and CIELAB."""
    if not np.isfinite(seen.lab).all():
        return "no colour, for want of visible wavelengths"
    rgb = " ".join(str(round(255 * float(c))) for c in seen.srgb)
    lab = " ".join(f"{c:.1f}" for c in seen.lab.round(1) + 0.0)  # no "-0.0"
    return f"sRGB {rgb}, L*a*b* {lab}"
