"""From an excitation-emission matrix (EEM) in relative units and a quantum yield to a material."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.dye import Units, counted_units, dye
from fluorspar.bispectral.material import Material
from fluorspar.errors import ApproximationWarning, MaterialError, OptionError, SpectrumError, message
from fluorspar.spectral.spectrum import Spectrum, SpectrumLike, as_spectrum, check_reflectance

__all__ = ["Eem", "material_from_eem"]

Array = NDArray[np.float64]

_RAMAN = 3400.0  # 1/cm, the shift of water
_TURNS, _SETTLED = 1000, 1e-7  # of the fit: how many, and the relative change that ends it
_RIDGE = (
    1e-4  # of the weight of the best-known value of a spectrum: what hardly any cell says anything about is 0
)
_POOR = 0.1  # of the root mean square, unexplained by one dye


@dataclass(frozen=True, eq=False)
class Eem:
    """An excitation-emission matrix: intensities whose unit nobody knows.

    Parameters
    ----------
    emission : ndarray of shape (M,)
    excitation : ndarray of shape (P,)
        In nm, ascending; the steps may differ and be uneven.
    cells : ndarray of shape (M, P)
        Intensity per emission wavelength interval, for equally strong excitation: corrected for lamp and detector.
    units : str
        What is counted, "photon" or "energy", in emission and in the light that excites; "" if it is not said.
    name : str
        For messages.

    Raises
    ------
    MaterialError
        If the shapes do not fit, or nothing was measured.

    Examples
    --------
    >>> Eem([500, 520], [350, 450, 470], np.ones((2, 3))).usable(scatter=15.0)[1]  # Raman scatter of 450 nm: 531 nm
    array([ True, False,  True])
    """

    emission: Array
    excitation: Array
    cells: Array
    units: str = ""
    name: str = "an EEM"

    def __post_init__(self) -> None:
        for field in ("emission", "excitation", "cells"):
            object.__setattr__(self, field, np.array(getattr(self, field), dtype=np.float64))
        shape = (len(self.emission), len(self.excitation))
        if self.cells.shape != shape or min(shape) < 2 or not self.cells.max() > 0:
            fault, expected = (
                "this is not an excitation-emission matrix",
                "two or more of either wavelength, and light",
            )
            got = f"shape {self.cells.shape}, {shape[0]} emission and {shape[1]} excitation wavelengths"
            raise MaterialError(message(fault, where=self.name, got=got, expected=expected))

    def usable(self, scatter: float) -> NDArray[np.bool_]:
        """Which cells hold luminescence alone, ndarray of shape (M, P).

        Light at shorter wavelengths than the excitation is no luminescence. Scattered light of the lamp stands at the
        excitation wavelength and, in the second order of the grating, at twice that (Rayleigh); that of water is
        shifted by 3400 1/cm (Raman).

        Parameters
        ----------
        scatter : float
            Cells as near to these in nm are not used.
        """
        em, ex = self.emission[:, None], self.excitation
        shifted = 1e7 / np.maximum(1e7 / ex - _RAMAN, 1.0)
        away = [np.abs(em - line) > scatter for line in (2 * ex, shifted)]
        return np.asarray((em > ex + scatter) & np.logical_and.reduce(away))


def material_from_eem(
    eem: Eem,
    quantum_yield: float,
    *,
    strength: float | None = None,
    reflectance: SpectrumLike | None = None,
    units: Units | None = None,
    substrate: SpectrumLike | Material = 0.85,
    scatter: float = 15.0,
    name: str = "",
    description: str = "",
    credit: str = "",
) -> Material:
    """Make a material of a relative excitation-emission matrix and a quantum yield.

    The matrix gives the shape of both spectra: the best product of an emission and an excitation spectrum, neither
    negative, over the cells without scattered light. The quantum yield gives their size: that share of the photons
    absorbed at the peak of the excitation leaves as luminescence. See `fluorspar.bispectral.dye.dye` for the rest.

    Parameters
    ----------
    eem : Eem
        Of one fluorophore.
    quantum_yield : float
        Photons given out per photon absorbed, 0 to 1.
    strength : float, optional
        Share of the light that is absorbed at the peak of the excitation, 0 to 1; the rest is that of the substrate.
    reflectance : float, Spectrum, ..., optional
        Instead: reflectance of the sample without its luminescence, 0 to 1. What it lacks at the peak is absorbed.
    units : {"energy", "photon"}, optional
        What an EEM counts that does not say it.
    substrate : float, Spectrum, ... or Material
        Reflectance of what is dyed, with `strength`.
    scatter : float
        See `Eem.usable`.
    name, description, credit : str
        Of the material. Its `quality` says what one fluorophore does not explain, `assumed` what was left out.

    Returns
    -------
    Material

    Raises
    ------
    MaterialError
        As `dye`; if the units are not said or contradict the file; if scattered light leaves no cells.
    OptionError
        If not one of strength and reflectance is given.
    SpectrumError
        If the reflectance is impossible, or has no data at the peak of the excitation.

    Warns
    -----
    ApproximationWarning
        If one fluorophore leaves more than 10 % of the intensities unexplained (root mean square).

    Examples
    --------
    >>> em, ex = np.arange(450.0, 651.0, 5), np.arange(350.0, 531.0, 10)
    >>> cells = np.outer(np.exp(-(((em - 540) / 25) ** 2)), np.exp(-(((ex - 450) / 30) ** 2)))
    >>> paint = material_from_eem(Eem(em, ex, 7e4 * cells), 0.9, strength=0.5, units="photon", substrate=0.8)
    >>> paint.fluorophores[0].excitation.peak, paint.reflectance.at(450)
    (450.0, 0.4)
    """
    title = name or eem.name
    if (strength is None) == (reflectance is None):
        fault, expected = (
            "the share of light that is absorbed has to be given once",
            "one of strength and reflectance",
        )
        fix = "give --strength (share absorbed at the peak) or --reflectance (of the sample without luminescence)"
        raise OptionError(message(fault, where=title, expected=expected, fix=fix))
    if not (np.isfinite(scatter) and scatter >= 0):
        fault = "the width of scattered light is impossible"
        raise OptionError(message(fault, where=title, got=scatter, expected="0 nm or more"))
    counted = counted_units("an EEM", eem.units, units, eem.name)
    emission, excitation, unexplained = _factors(eem, scatter)
    if unexplained > _POOR:
        text = f"{title}: one fluorophore leaves {100 * unexplained:.0f} % of the EEM unexplained; are there several?"
        warnings.warn(text, ApproximationWarning, stacklevel=2)
    lines = "Rayleigh (also second order) and Raman lines"
    left_out = f"scattered light, within {scatter:g} nm of {lines}, left out of the EEM"
    if reflectance is not None:
        S = check_reflectance(as_spectrum(reflectance, f"reflectance of {title!r}"))
        per_photon = excitation / (eem.excitation if counted == "energy" else 1.0)
        strength = 1 - _at(S, float(eem.excitation[per_photon.argmax()]))
        substrate = S
    material = dye(
        Spectrum(eem.excitation, excitation, f"excitation of {title!r}"),
        Spectrum(eem.emission, emission, f"emission of {title!r}"),
        quantum_yield,
        0.0 if strength is None else strength,
        units=counted,
        substrate=substrate,
        name=title,
        description=description,
        credit=credit,
        assumed=left_out,
    )
    quality = f"one fluorophore leaves {100 * unexplained:.2g} % of the EEM unexplained"
    if reflectance is not None:
        dyes = material.fluorophores
        material = Material(title, S, dyes, description=description, credit=credit, assumed=left_out)
    return replace(material, quality=quality)


def _factors(eem: Eem, scatter: float) -> tuple[Array, Array, float]:
    """Emission (M,), excitation (P,), and the root mean square they leave, over that of the cells."""
    usable = eem.usable(scatter)
    peak = float(eem.cells[usable].max()) if usable.any() else 0.0
    if not peak > 0:
        fault, fix = "no luminescence is left beside the scattered light", "give a smaller width (--scatter)"
        got = f"{np.count_nonzero(usable)} cells farther than {scatter:g} nm from it"
        raise MaterialError(message(fault, where=eem.name, got=got, expected="some that are not 0", fix=fix))
    cells = np.where(usable, eem.cells / peak, 0.0)
    excitation = np.maximum(cells, 0.0).sum(axis=0)
    for _ in range(
        _TURNS
    ):  # with one of the two held, each value of the other is a least-squares fit by itself
        before, emission = excitation, _fitted(cells, usable, excitation)
        excitation = _fitted(cells.T, usable.T, emission)
        if np.abs(excitation - before).max() < _SETTLED * excitation.max():
            break
    left = np.where(usable, cells - np.outer(emission, excitation), 0.0)
    return emission, excitation, float(np.sqrt(np.sum(left**2) / np.sum(cells**2)))


def _fitted(cells: Array, usable: NDArray[np.bool_], other: Array) -> Array:
    """Values (M,) that times `other` (P,) fit the cells best; 0 where they would be negative or no cell counts."""
    weight = usable @ other**2
    return np.asarray(np.maximum(cells @ other, 0.0) / (weight + _RIDGE * weight.max()))


def _at(reflectance: Spectrum, peak: float) -> float:
    """The reflectance at the peak of the excitation, which must have been measured."""
    first, last = reflectance.support
    if first <= peak <= last:
        return reflectance.at(peak)
    fault = "a reflectance was not measured at the peak of the excitation"
    got, expected = f"data for {first:g}-{last:g} nm", f"data at {peak:g} nm"
    fix = "give --strength instead: the share of the light absorbed there"
    raise SpectrumError(message(fault, where=reflectance.title, got=got, expected=expected, fix=fix))
