"""The wavelengths that excite: a grid that reaches as far into the ultraviolet as lamps and materials overlap."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import OptionError, message
from fluorspar.spectral.light import sampled_or_averaged
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["excitation_grid"]

_SHORTEST = 200.0  # nm; air absorbs what is below
_NEGLIGIBLE = 1e-4  # of what a lamp excites in a dye


def excitation_grid(
    held: Wavelengths, materials: Sequence[Material], lights: Sequence[Spectrum], excitation: str = "full"
) -> Wavelengths:
    """Return the grid that an image of some wavelengths is to be computed on.

    Light that excites counts whether an image holds its wavelength or not. Fluorescence gives out wavelengths that
    are longer than those it takes up, so more of them are needed at the short end only: down to where a light or
    the excitation of a material begins, whichever begins later, less what excites below 0.0001 of all of it.

    Parameters
    ----------
    held : Wavelengths
        The wavelengths that are asked for.
    materials : sequence of Material
    lights : sequence of Spectrum
    excitation : {"full", "grid"}
        "grid": only the wavelengths held excite, as in the paper.

    Returns
    -------
    Wavelengths
        `held`, begun some steps earlier.

    Raises
    ------
    OptionError
        If `excitation` is something else.

    Examples
    --------
    >>> from fluorspar.bispectral.library import material
    >>> black_light = Spectrum([340, 370, 400], [0.0, 1.0, 0.0])
    >>> excitation_grid(Wavelengths(400, 700, 10), [material("dye-stilbene")], [black_light])
    Wavelengths(start=350.0, stop=700.0, step=10.0)
    """
    if excitation not in ("full", "grid"):
        raise OptionError(
            message("there is no such excitation", got=repr(excitation), expected="'full' or 'grid'")
        )
    pairs = [(light, dye) for material in materials for dye in _excitations(material) for light in lights]
    if excitation == "grid" or not pairs:
        return held
    first = max(_SHORTEST, min(max(_begin(light), _begin(dye)) for light, dye in pairs))
    if first >= held.start:
        return held
    below = math.ceil((held.start - first) / held.step - 1e-6)
    below = min(below, math.ceil(held.start / held.step) - 1)  # a wavelength is greater than 0
    wide = _begun_earlier(held, below)
    needed = min(_first_needed(light, dye, wide) for light, dye in pairs)
    return _begun_earlier(held, max(below - needed, 0))


def _excitations(material: Material) -> Iterator[Spectrum]:
    """What each fluorophore takes up, relative; of a measured matrix, what it gives out for each excitation."""
    for _, term in material.terms:
        if isinstance(term, MeasuredMatrix):
            yield Spectrum(term.excitation, np.abs(term.density).sum(axis=0))
        else:
            yield from (dye.excitation for dye in term.fluorophores if dye.emission.values.any())


def _begin(spectrum: Spectrum) -> float:
    """Wavelength in nm from which on a spectrum has values other than 0."""
    there = np.flatnonzero(spectrum.values)
    return float(spectrum.wavelengths[max(there[0] - 1, 0)]) if len(there) else math.inf


def _begun_earlier(held: Wavelengths, bands: int) -> Wavelengths:
    return Wavelengths(held.start - bands * held.step, held.stop, held.step) if bands else held


def _first_needed(light: Spectrum, dye: Spectrum, grid: Wavelengths) -> int:
    """Number of the first band without which a light would excite less than nearly all."""
    if light.support[0] > grid.stop or light.support[1] < grid.start:
        return len(grid)
    taken_up = sampled_or_averaged(light, grid)[0] * np.interp(
        grid.values, dye.wavelengths, dye.values, 0.0, 0.0
    )
    excited = np.cumsum(taken_up)
    return (
        int(np.searchsorted(excited, _NEGLIGIBLE * excited[-1], side="right"))
        if excited[-1] > 0
        else len(grid)
    )
