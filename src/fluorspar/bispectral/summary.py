"""A material in words: what it is, what it covers, where it fluoresces, which colour it has."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

from fluorspar.bispectral.checks import photon_yield
from fluorspar.bispectral.lamp_colour import LampColour
from fluorspar.colour.xyz import CIE_1931
from fluorspar.errors import ExtrapolationWarning
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    from fluorspar.bispectral.material import Fluorophore, Material

__all__ = ["material_summary"]

_STEP = 5.0  # nm, of the grid on which photon yield and colour are found
_RANGE = (300.0, 780.0)  # nm, at most


def material_summary(material: Material) -> str:
    """Describe a material in a few lines.

    Photon yield and colour are those on a 5 nm grid over the material's own reflectance, within 300-780 nm; a
    measured matrix has the photon yield of its own cells. Nothing is checked: a description of an impossible
    material is what one needs to mend it.

    Parameters
    ----------
    material
        The material.

    Returns
    -------
    str
        One fact a line.

    Examples
    --------
    >>> from fluorspar.bispectral.material import Material
    >>> print(material_summary(Material("grey", Spectrum.constant(0.45), description="half a white")))
    Material 'grey'
      description:   half a white
      reflectance:   0.45 at all wavelengths
      fluorescent:   no
      under D65:     sRGB 179 179 179, L*a*b* 72.9 0.0 0.0
    """
    facts = [(key, getattr(material, key)) for key in ("description", "credit", "quality", "assumed")]
    facts.append(("reflectance", _reflectance(material.reflectance)))
    facts.append(("fluorescent", _luminescence(material)))
    facts += [(f"fluorophore {k}", _fluorophore(dye)) for k, dye in enumerate(material.fluorophores, start=1)]
    if material.fluorescent:
        facts.append(("photon yield", _photon_yield(material)))
    facts.append(("under D65", _colour(material)))
    lines = [f"Material '{material.name}'"]
    for key, text in facts:
        # Mixtures have one line for each ingredient.
        lines += [
            f"  {key + ':' if not k else '':<14} {line}" for k, line in enumerate(text.splitlines()) if line
        ]
    return "\n".join(lines)


def _grid(reflectance: Spectrum) -> Wavelengths:
    first = max(reflectance.support[0], _RANGE[0])
    last = min(reflectance.support[1], _RANGE[1])
    if last - first < _STEP:  # data for a few nanometres, or none where light is looked at
        first, last = _RANGE if last <= first else (first, first + _STEP)
    return Wavelengths(first, first + _STEP * math.floor((last - first) / _STEP), _STEP)


def _reflectance(spectrum: Spectrum) -> str:
    if spectrum.is_constant:
        return f"{spectrum.values[0]:.3g} at all wavelengths"
    least, most = int(spectrum.values.argmin()), int(spectrum.values.argmax())
    w, v = spectrum.wavelengths, spectrum.values
    if v[least] == v[most]:
        return f"{_span(spectrum)}, {v[0]:.3g} everywhere"
    return f"{_span(spectrum)}, from {v[least]:.3g} at {w[least]:g} nm to {v[most]:.3g} at {w[most]:g} nm"


def _span(spectrum: Spectrum) -> str:
    return f"{spectrum.support[0]:g}-{spectrum.support[1]:g} nm"


def _luminescence(material: Material) -> str:
    if not material.fluorescent:
        return "no"
    if material.parts:
        return "yes, " + " and ".join(f"{weight:.3g} of {part.name}" for part, weight in material.parts)
    if (matrix := material.matrix) is None:
        return "yes"
    i, j = divmod(int(matrix.density.argmax()), matrix.density.shape[1])
    return (
        f"yes, a measured matrix: excitation {matrix.excitation[0]:g}-{matrix.excitation[-1]:g} nm, "
        f"emission {matrix.emission[0]:g}-{matrix.emission[-1]:g} nm by {matrix.step:g}, "
        f"peak {matrix.excitation[j]:g} nm to {matrix.emission[i]:g} nm"
    )


def _fluorophore(dye: Fluorophore) -> str:
    return (
        f"excitation peak {dye.excitation.wavelengths[dye.excitation.values.argmax()]:g} nm, "
        f"emission peak {dye.emission.wavelengths[dye.emission.values.argmax()]:g} nm ({dye.emission.values.max():.3g})"
    )


def _photon_yield(material: Material) -> str:
    if (matrix := material.matrix) is not None:
        total, wavelengths = matrix.photon_yield(), matrix.excitation
        luminescent = photon_yield(matrix.step * matrix.density, matrix.emission, matrix.excitation)
    else:
        grid = _grid(material.reflectance)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ExtrapolationWarning)  # of an ingredient; its span is told
            D = material._on(grid, "half")
        total, wavelengths = D.photon_yield(), grid.values
        luminescent = total - D.reflectance
    return (
        f"at most {luminescent.max():.3g} (light of {wavelengths[luminescent.argmax()]:g} nm), "
        f"{total.max():.3g} with what is reflected (light of {wavelengths[total.argmax()]:g} nm)"
    )


def _colour(material: Material) -> str:
    grid = _grid(material.reflectance)
    light = illuminant("D65").on(grid)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        D = material._on(grid, "half")  # unchecked: what is impossible can be described
    seen = LampColour(grid, "D65", light, D.reflect(light), D.apply_luminescent(light), None, CIE_1931)
    rgb = " ".join(str(round(255 * float(c))) for c in seen.srgb)
    lab = " ".join(f"{c:.1f}" for c in seen.lab.round(1) + 0.0)  # no "-0.0"
    return f"sRGB {rgb}, L*a*b* {lab}"
