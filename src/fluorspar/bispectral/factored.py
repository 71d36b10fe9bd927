"""Donaldson matrices as few spectra, on no particular grid: reflectance, and emission times excitation of each dye."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.conversions import Stokes
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.errors import SpectrumError, message
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["FactoredMatrix", "Fluorophore"]

_NORMALISED = 1e-12


@dataclass(frozen=True, eq=False)
class Fluorophore:
    """One dye: D_L(em, ex) = alpha(em) beta(ex) for em > ex.

    Parameters
    ----------
    emission : Spectrum
        alpha, dimensionless; 0 outside its table.
    excitation : Spectrum
        beta in any scale; kept with integral 1 over its own table, in 1/nm. This happens once, here, and
        never on a render grid, so alpha means the same on every grid. 0 outside its table.
    name : str
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

    def __str__(self) -> str:
        """Its peaks in words."""
        most = f"{self.emission.values.max():.3g}"
        return (
            f"excitation peak {self.excitation.peak:g} nm, emission peak {self.emission.peak:g} nm ({most})"
        )

    def scaled(self, factor: float) -> Fluorophore:
        """Return it with `factor` times the emission."""
        return self if factor == 1 else replace(self, emission=self.emission.scaled(factor))


@dataclass(frozen=True, eq=False)
class FactoredMatrix:
    """D = S on the diagonal, and the sum of alpha beta of the fluorophores below it.

    Parameters
    ----------
    reflectance : Spectrum
        S.
    fluorophores : tuple of Fluorophore
    name : str
        For messages.

    Examples
    --------
    >>> FactoredMatrix(Spectrum.constant(0.45)).on(Wavelengths(400, 410, 10)).band()
    array([[0.45, 0.  ],
           [0.  , 0.45]])
    """

    reflectance: Spectrum
    fluorophores: tuple[Fluorophore, ...] = ()
    name: str = ""

    @property
    def fluorescent(self) -> bool:
        """Whether it has a luminescent part."""
        return any(np.any(dye.emission.values) for dye in self.fluorophores)

    def on(self, grid: Wavelengths, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Sample it on a render grid; see `Material.on`."""
        return DonaldsonMatrix(
            grid,
            self.reflectance.on(grid),
            _sampled([dye.emission for dye in self.fluorophores], grid),
            _sampled([dye.excitation for dye in self.fluorophores], grid),
            stokes=stokes,
        )

    def scaled_luminescence(self, factor: float) -> FactoredMatrix:
        """Return it with `factor` times the emission and S as it is."""
        return replace(self, fluorophores=tuple(dye.scaled(factor) for dye in self.fluorophores))


def _sampled(spectra: Sequence[Spectrum], grid: Wavelengths) -> NDArray[np.float64]:
    rows = [spectrum.on(grid, outside="zero") for spectrum in spectra]
    return np.array(rows, dtype=np.float64).reshape(len(spectra), len(grid))
