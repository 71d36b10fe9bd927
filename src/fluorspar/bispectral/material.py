"""Materials: the spectra of a matte, possibly fluorescent surface, on no particular grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.conversions import Stokes
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, SpectrumError, message
from fluorspar.spectral.spectrum import Spectrum, check_reflectance, weighted_sum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Fluorophore", "Material", "mix"]

_NORMALISED = 1e-12


@dataclass(frozen=True, eq=False)
class Fluorophore:
    """One dye: D_L(em, ex) = alpha(em) beta(ex) for em > ex.

    Parameters
    ----------
    emission
        alpha, dimensionless; 0 outside its table.
    excitation
        beta in any scale; kept with integral 1 over its own table, in 1/nm. This happens once, here, and
        never on a render grid, so alpha means the same on every grid. 0 outside its table.
    name
        For messages.

    Raises
    ------
    SpectrumError
        If a value is negative, or the excitation is constant or 0 everywhere.

    Examples
    --------
    >>> dye = Fluorophore(Spectrum([500, 550, 600], [0, 0.8, 0]), Spectrum([400, 450, 500], [0, 7, 0]))
    >>> dye.excitation.at(450)
    0.02
    """

    emission: Spectrum
    excitation: Spectrum
    name: str = ""

    def __post_init__(self) -> None:
        for what, spectrum in (("emission", self.emission), ("excitation", self.excitation)):
            if spectrum.values.min() < 0:
                at = spectrum.wavelengths[spectrum.values.argmin()]
                where: str | None = f"{spectrum.name or what}, {at:g} nm"
                got = f"{spectrum.values.min():g}"
                raise SpectrumError(
                    message(f"an {what} spectrum is negative", where=where, got=got, expected=">= 0")
                )
        integral = self.excitation.integral()
        if integral <= 0:
            where = self.excitation.name or self.name or None
            raise SpectrumError(message("an excitation spectrum is 0 everywhere", where=where))
        if abs(integral - 1) > _NORMALISED:
            object.__setattr__(self, "excitation", self.excitation.scaled(1 / integral))


@dataclass(frozen=True, eq=False)
class Material:
    """A matte surface: reflectance, and fluorophores or a measured matrix if it fluoresces.

    Parameters
    ----------
    name
        For messages and data sets.
    reflectance
        S, 0 to 1.
    fluorophores
        Added up.
    matrix
        Instead of fluorophores; its diagonal then is the reflectance (see `Material.from_matrix`).
    parts : tuple of (Material, float)
        Of a mixture that holds measured matrices, or reflectances with data for different ranges: its
        ingredients and their weights (see `mix`).
    description, credit, quality, assumed
        In words: what it is, whose data, how good, and what is assumed where nothing was measured.

    Raises
    ------
    SpectrumError
        If the reflectance leaves 0 to 1.
    MaterialError
        If both fluorophores and a matrix are given.

    Examples
    --------
    >>> grey = Material("grey", Spectrum.constant(0.45))
    >>> grey.fluorescent, grey.on(Wavelengths()).apply(np.ones(69))[:3]
    (False, array([0.45, 0.45, 0.45]))
    """

    name: str
    reflectance: Spectrum
    fluorophores: tuple[Fluorophore, ...] = ()
    matrix: MeasuredMatrix | None = None
    parts: tuple[tuple[Material, float], ...] = ()
    description: str = ""
    credit: str = ""
    quality: str = ""
    assumed: str = ""

    def __post_init__(self) -> None:
        if (self.matrix is not None) + bool(self.parts) + bool(self.fluorophores) > 1:
            fault = "a material has more than one of: fluorophores, a measured matrix, ingredients"
            raise MaterialError(message(fault, where=self.name, fix="mix two materials instead"))
        if not self.reflectance.name:
            named = replace(self.reflectance, name=f"reflectance of {self.name!r}")
            object.__setattr__(self, "reflectance", named)
        check_reflectance(self.reflectance)

    def __repr__(self) -> str:
        from fluorspar.bispectral.summary import material_summary

        return material_summary(self)

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
        return cls(name, matrix.reflectance, matrix=matrix, description=description, credit=credit)

    @property
    def fluorescent(self) -> bool:
        """Whether it has a luminescent part, visible on a given grid or not."""
        if self.parts:
            return any(part.fluorescent for part, _ in self.parts)
        if self.matrix is not None:
            return bool(np.any(self.matrix.density))
        return any(np.any(dye.emission.values) for dye in self.fluorophores)

    def on(self, grid: Wavelengths, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return its Donaldson matrix on a render grid, checked.

        Parameters
        ----------
        grid
            N wavelengths.
        stokes
            How fluorophores treat excitation at the emission wavelength itself; measured matrices are used
            as given.

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
            If the photon yield lies between 1 and 1.15.

        Examples
        --------
        >>> dye = Fluorophore(Spectrum([500, 550, 600], [0, 0.6, 0]), Spectrum([400, 450, 500], [0, 1, 0]))
        >>> Material("dyed", Spectrum.constant(0.1), (dye,)).on(Wavelengths(400, 600, 50)).band()[3].round(3)
        array([0. , 0.6, 0. , 0.1, 0. ])
        """
        return self._on(grid, stokes).check(
            self.name, orientation=False
        )  # tables and measured cells were checked

    def _on(self, grid: Wavelengths, stokes: Stokes) -> DonaldsonMatrix:
        if self.parts:
            return _weighted([(part._on(grid, stokes), weight) for part, weight in self.parts])
        if self.matrix is not None:
            S, D_L = self.matrix.on(grid)
            return DonaldsonMatrix(grid, S, luminescent=D_L, stokes=stokes)
        return DonaldsonMatrix(
            grid,
            self.reflectance.on(grid),
            _sampled([dye.emission for dye in self.fluorophores], grid),
            _sampled([dye.excitation for dye in self.fluorophores], grid),
            stokes=stokes,
        )

    def with_concentration(self, factor: float) -> Material:
        """Return it with `factor` times the luminescence: alpha, or the luminescent cells of a matrix.

        The reflectance stays as it is.

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
        return replace(
            self,
            fluorophores=tuple(
                replace(dye, emission=dye.emission.scaled(factor)) for dye in self.fluorophores
            ),
            matrix=None if self.matrix is None else self.matrix.scaled_luminescence(factor),
            parts=tuple((part.with_concentration(factor), weight) for part, weight in self.parts),
        )


def _weighted(parts: Sequence[tuple[DonaldsonMatrix, float]]) -> DonaldsonMatrix:
    """Add matrices on one grid with weights; factors stay factors where all have them."""
    grid, stokes = parts[0][0].wavelengths, parts[0][0].stokes
    reflectance = np.sum([weight * D.reflectance for D, weight in parts], axis=0)
    if all(D.luminescent is None for D, _ in parts):
        emission = np.concatenate([weight * D.emission for D, weight in parts])
        excitation = np.concatenate([D.excitation for D, _ in parts])
        return DonaldsonMatrix(grid, reflectance, emission, excitation, stokes=stokes)
    density = np.sum([weight * D.density() for D, weight in parts], axis=0)
    return DonaldsonMatrix(grid, reflectance, luminescent=density, stokes=stokes)


def _sampled(spectra: Sequence[Spectrum], grid: Wavelengths) -> NDArray[np.float64]:
    rows = [spectrum.on(grid, outside="zero") for spectrum in spectra]
    return np.array(rows, dtype=np.float64).reshape(len(spectra), len(grid))


def mix(ingredients: Sequence[tuple[Material, float]], name: str = "") -> Material:
    """Mix materials linearly: D is the weighted sum of theirs.

    Parameters
    ----------
    ingredients : sequence of (Material, float)
        The weights are positive and add up to 1 (within 0.001; they are then divided by their sum).
    name
        "A:0.3,B:0.7" by default.

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
    weights /= weights.sum()
    materials = [material for material, _ in ingredients]
    title = f"reflectance of {name!r}"
    reflectance = weighted_sum([material.reflectance for material in materials], weights.tolist(), title)
    credit, quality, assumed = (
        "\n".join(f"{m.name}: {text}" for m in materials if (text := getattr(m, field)))
        for field in ("credit", "quality", "assumed")
    )
    one_range = len({m.reflectance.support for m in materials if not m.reflectance.is_constant}) <= 1
    if not one_range or any(material.matrix is not None or material.parts for material in materials):
        parts = tuple(zip(materials, weights.tolist(), strict=True))
        return Material(name, reflectance, parts=parts, credit=credit, quality=quality, assumed=assumed)
    dyes = tuple(
        replace(dye, emission=dye.emission.scaled(weight))
        for material, weight in zip(materials, weights.tolist(), strict=True)
        for dye in material.fluorophores
    )
    return Material(name, reflectance, dyes, credit=credit, quality=quality, assumed=assumed)
