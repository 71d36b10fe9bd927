"""Materials: matte, possibly fluorescent surfaces, as weighted sums of spectra and of measured matrices."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from fluorspar.bispectral.conversions import Stokes
from fluorspar.bispectral.donaldson import DonaldsonMatrix, weighted_matrices
from fluorspar.bispectral.factored import FactoredMatrix, Fluorophore
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.bispectral.shown_colour import LampColour
from fluorspar.bispectral.summary import (
    colour_in_words,
    daylight_colour,
    in_lines,
    photon_yield_in_words,
    summary_grid,
)
from fluorspar.errors import ExtrapolationWarning, MaterialError, message
from fluorspar.notebook import curve, facts_table, patch
from fluorspar.spectral.spectrum import Spectrum, check_reflectance, weighted_sum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Fluorophore", "Material", "Term", "mix"]

Term: TypeAlias = FactoredMatrix | MeasuredMatrix


@dataclass(frozen=True, eq=False, init=False)
class Material:
    """A matte surface: a weighted sum of Donaldson matrices on no particular grid, nearly always of one.

    Parameters
    ----------
    name : str
        For messages and data sets.
    reflectance : Spectrum, optional
        S, 0 to 1.
    fluorophores : sequence of Fluorophore, optional
        Added up.
    terms : sequence of (float, FactoredMatrix or MeasuredMatrix)
        Weights and what they belong to, instead of spectra (see `Material.from_matrix` and `mix`). Spectra that
        are given as well, as by `dataclasses.replace(material, fluorophores=...)`, take the place of those of the
        terms.
    description, credit, quality, assumed : str
        What it is, whose data, how good, and what is assumed where nothing was measured.

    Raises
    ------
    SpectrumError
        If the reflectance leaves 0 to 1, or those of the terms have no range in common.
    MaterialError
        If there is no reflectance, or one that is to replace that of a measured matrix.

    Examples
    --------
    >>> grey = Material("grey", Spectrum.constant(0.45))
    >>> grey.fluorescent, grey.on(Wavelengths()).apply(np.ones(69))[:3]
    (False, array([0.45, 0.45, 0.45]))
    """

    name: str
    terms: tuple[tuple[float, Term], ...]
    description: str
    credit: str
    quality: str
    assumed: str

    def __init__(
        self,
        name: str,
        reflectance: Spectrum | None = None,
        fluorophores: Sequence[Fluorophore] | None = None,
        *,
        terms: Sequence[tuple[float, Term]] = (),
        description: str = "",
        credit: str = "",
        quality: str = "",
        assumed: str = "",
    ) -> None:
        if reflectance is not None or fluorophores is not None or not terms:
            terms = ((1.0, _of_spectra(name, reflectance, fluorophores, terms)),)
        texts = {"description": description, "credit": credit, "quality": quality, "assumed": assumed}
        for field, value in {"name": name, "terms": tuple(terms), **texts}.items():
            object.__setattr__(self, field, value)
        check_reflectance(self.reflectance)

    def __repr__(self) -> str:
        """Describe it in a few lines. Nothing is checked: who mends an impossible material needs its description."""
        return in_lines(self._title, self._described()[0])

    def _repr_html_(self) -> str:
        facts, colour = self._described()
        S = self.reflectance
        drawn = curve((0.0, 1.0) if S.is_constant else S.wavelengths, S.values)
        return facts_table(self._title, facts.items(), patch(colour.srgb), drawn)

    @property
    def _title(self) -> str:
        return f"Material '{self.name}'"

    def _described(self) -> tuple[dict[str, str], LampColour]:
        """What it is, in words, and its colour under D65."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ExtrapolationWarning)  # its span is told
            D = self.unchecked_on(summary_grid(self.reflectance))
        facts = {key: getattr(self, key) for key in ("description", "credit", "quality", "assumed")}
        facts["reflectance"] = str(self.reflectance)
        if self.fluorescent and len(self.terms) > 1:
            facts["fluorescent"] = "yes, " + " and ".join(
                f"{weight:.3g} of {term.name}" for weight, term in self.terms
            )
        elif self.fluorescent:
            facts["fluorescent"] = f"yes, {self.matrix}" if self.matrix else "yes"
        else:
            facts["fluorescent"] = "no"
        facts |= {f"fluorophore {k}": str(dye) for k, dye in enumerate(self.fluorophores, start=1)}
        if self.fluorescent:
            facts["photon yield"] = photon_yield_in_words(self.matrix or D)
        colour = daylight_colour(D)
        return facts | {"under D65": colour_in_words(colour)}, colour

    @classmethod
    def from_matrix(
        cls, name: str, matrix: MeasuredMatrix, *, description: str = "", credit: str = ""
    ) -> Material:
        """Make the material that a measured matrix describes.

        Examples
        --------
        >>> w = np.array([400.0, 410.0])
        >>> Material.from_matrix("sheet", MeasuredMatrix(w, w, [[0.5, 0], [0.1, 0.4]])).reflectance.values
        array([0.5, 0.4])
        """
        matrix = replace(matrix, name=matrix.name or name).within_noise()
        return cls(name, terms=((1.0, matrix),), description=description, credit=credit)

    @cached_property
    def reflectance(self) -> Spectrum:
        """S, as far as all terms have data."""
        if len(self.terms) == 1 and self.terms[0][0] == 1:
            return self.terms[0][1].reflectance
        weights, spectra = zip(*((weight, term.reflectance) for weight, term in self.terms), strict=True)
        return weighted_sum(spectra, weights, f"reflectance of {self.name!r}")

    @cached_property
    def fluorophores(self) -> tuple[Fluorophore, ...]:
        """Those of all terms, with their weights; none if a term is a measured matrix."""
        if self.is_measured:
            return ()
        factored = ((weight, term) for weight, term in self.terms if isinstance(term, FactoredMatrix))
        return tuple(dye.scaled(weight) for weight, term in factored for dye in term.fluorophores)

    @property
    def is_measured(self) -> bool:
        """Whether one of its terms is a measured matrix."""
        return any(isinstance(term, MeasuredMatrix) for _, term in self.terms)

    @property
    def matrix(self) -> MeasuredMatrix | None:
        """The measured matrix that it is; None of spectra and of mixtures."""
        term = self.terms[0][1]
        return term if len(self.terms) == 1 and isinstance(term, MeasuredMatrix) else None

    @property
    def fluorescent(self) -> bool:
        """Whether it has a luminescent part, visible on a given grid or not."""
        return any(term.fluorescent for _, term in self.terms)

    def as_spectra(self) -> FactoredMatrix:
        """Return it as one reflectance and its fluorophores.

        Raises
        ------
        MaterialError
            If it holds a measured matrix, or mixes materials with data for different ranges.

        Examples
        --------
        >>> Material("grey", Spectrum.constant(0.45)).as_spectra().fluorophores
        ()
        """
        if self.is_measured:
            fault, fix = "a material that holds a measured matrix has no spectra of factors", "fit it first"
            raise MaterialError(message(fault, where=self.name, fix=fix))
        spectra = [term.reflectance for _, term in self.terms]
        if len({spectrum.support for spectrum in spectra if not spectrum.is_constant}) > 1:
            fault = "a mixture of materials with data for different ranges has no single table"
            fix = "bring the ingredients to one range first (fluorspar.bispectral.resampling.resampled)"
            raise MaterialError(message(fault, where=self.name, fix=fix))
        return FactoredMatrix(self.reflectance, self.fluorophores, self.name)

    def on(self, grid: Wavelengths, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return its Donaldson matrix on a render grid, checked.

        Parameters
        ----------
        grid : Wavelengths
            N wavelengths.
        stokes : {"half", "strict"}
            How fluorophores treat excitation at the emission wavelength itself; "strict" also leaves out the cells
            of measured matrices above the diagonal.

        Returns
        -------
        DonaldsonMatrix
            Of shape (N, N).

        Raises
        ------
        SpectrumError
            If a spectrum and the grid do not overlap.
        MaterialError
            If the matrix is physically impossible (see `DonaldsonMatrix.check`).

        Warns
        -----
        ExtrapolationWarning
            If the grid reaches beyond the reflectance, or beyond a measured matrix.
        PhotonYieldWarning
            If the photon yield lies between 1 and 1.15. That of a measured matrix is judged on its own wavelengths.

        Examples
        --------
        >>> dye = Fluorophore(Spectrum([500, 550, 600], [0, 0.6, 0]), Spectrum([400, 450, 500], [0, 1, 0]))
        >>> Material("dyed", Spectrum.constant(0.1), (dye,)).on(Wavelengths(400, 600, 50)).band()[3].round(3)
        array([0. , 0.6, 0. , 0.1, 0. ])
        """
        D = self.unchecked_on(grid, stokes)
        # tables and measured cells were checked for their orientation
        self._judged(D).check(self.name, orientation=False)
        return D

    def _judged(self, D: DonaldsonMatrix) -> DonaldsonMatrix:
        """Return the matrix whose photons count: on the wavelengths of a measurement, not on others in between."""
        measured = next((term for _, term in self.terms if isinstance(term, MeasuredMatrix)), None)
        if measured is None:
            return D
        with warnings.catch_warnings():  # what is assumed on the render grid was told
            warnings.simplefilter("ignore", ExtrapolationWarning)
            return self.unchecked_on(measured.grid(), D.stokes)

    def unchecked_on(self, grid: Wavelengths, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return its Donaldson matrix on a grid, possible or not; see `on`."""
        return weighted_matrices([(weight, term.on(grid, stokes)) for weight, term in self.terms])

    def stokes_side(self) -> Material:
        """Return it without what measured matrices have above the diagonal: noise.

        Examples
        --------
        >>> w = np.array([400.0, 410.0])
        >>> sheet = Material.from_matrix("sheet", MeasuredMatrix(w, w, [[0.5, 0.01], [0.1, 0.4]]))
        >>> sheet.stokes_side().on(Wavelengths(400, 410, 10)).band()[0]
        array([0.5, 0. ])
        """
        terms = tuple(
            (weight, term.stokes_side() if isinstance(term, MeasuredMatrix) else term)
            for weight, term in self.terms
        )
        return replace(self, terms=terms)

    def with_concentration(self, factor: float) -> Material:
        """Return it with `factor` times the luminescence: alpha, or the luminescent cells of a matrix.

        The reflectance stays as it is.

        Parameters
        ----------
        factor : float

        Raises
        ------
        MaterialError
            If `factor` is negative or not finite.

        Examples
        --------
        >>> dye = Fluorophore(Spectrum([500, 600], [0.4, 0]), Spectrum([400, 500], [1, 0]))
        >>> weak = Material("dyed", Spectrum.constant(0.1), (dye,)).with_concentration(0.5)
        >>> weak.fluorophores[0].emission.at(500)
        0.2
        """
        if not (np.isfinite(factor) and factor >= 0):
            raise MaterialError(
                message("a concentration is impossible", where=self.name, got=factor, expected=">= 0")
            )
        if factor == 1:
            return self
        terms = tuple((weight, term.scaled_luminescence(factor)) for weight, term in self.terms)
        return replace(self, terms=terms)


def _of_spectra(
    name: str,
    reflectance: Spectrum | None,
    fluorophores: Sequence[Fluorophore] | None,
    terms: Sequence[tuple[float, Term]],
) -> FactoredMatrix:
    """Make a term of spectra; those that are not given are those of other terms."""
    if terms:
        whole = Material(name, terms=terms)
        if fluorophores is None and whole.is_measured:
            fault, fix = (
                "a measured matrix holds a reflectance of its own",
                "fit it first, or give fluorophores too",
            )
            raise MaterialError(message(fault, where=name, fix=fix))
        reflectance = whole.reflectance if reflectance is None else reflectance
        fluorophores = whole.fluorophores if fluorophores is None else fluorophores
    if reflectance is None:
        raise MaterialError(message("a material has no reflectance", where=name, fix="give it as a Spectrum"))
    named = reflectance if reflectance.name else replace(reflectance, name=f"reflectance of {name!r}")
    return FactoredMatrix(named, tuple(fluorophores or ()), name)


def mix(ingredients: Sequence[tuple[Material, float]], name: str = "") -> Material:
    """Mix materials linearly: D is the weighted sum of theirs.

    Parameters
    ----------
    ingredients : sequence of (Material, float)
        The weights are positive and add up to 1 (within 0.001; they are then divided by their sum).
    name : str
        "A:0.3,B:0.7" by default.

    Returns
    -------
    Material
        With the terms of all ingredients.

    Raises
    ------
    MaterialError
        If a weight is not positive or they do not add up to 1.

    Examples
    --------
    >>> a, b = Material("a", Spectrum.constant(0.2)), Material("b", Spectrum.constant(0.6))
    >>> half = mix([(a, 0.5), (b, 0.5)])
    >>> half.name, half.reflectance.at(550)
    ('a:0.5,b:0.5', 0.4)
    """
    name = name or ",".join(f"{material.name}:{weight:g}" for material, weight in ingredients)
    weights = np.array([weight for _, weight in ingredients], dtype=np.float64)
    if not len(weights) or not np.all(weights > 0) or not abs(weights.sum() - 1) <= 1e-3:
        got = f"weights {', '.join(f'{w:g}' for w in weights)}"
        fault = "the weights of a mixture must be positive and add up to 1"
        raise MaterialError(message(fault, where=name or None, got=got, expected="such as A:0.3,B:0.7"))
    terms: list[tuple[float, Term]] = []
    for (material, _), share in zip(ingredients, (weights / weights.sum()).tolist(), strict=True):
        terms += [(share * weight, term) for weight, term in material.terms]
    credit, quality, assumed = (
        "\n".join(f"{m.name}: {text}" for m, _ in ingredients if (text := getattr(m, field)))
        for field in ("credit", "quality", "assumed")
    )
    return Material(name, terms=terms, credit=credit, quality=quality, assumed=assumed)
