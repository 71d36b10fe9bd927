"""Rows of the table of spectra that are not simply the reflectance of a material."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fluorspar.bispectral.coated import under_a_coat
from fluorspar.bispectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.bispectral.material import Material
from fluorspar.scene.lobes.lobe import operate
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Coated", "Luminescence", "Metal", "Operated", "Reflection", "conductor_reflectance"]

_NO_INDEX = 1e-12


@dataclass(frozen=True)
class Operated:
    """What a lobe makes of the reflectance of a material.

    Attributes
    ----------
    base : Material
        Its S.
    operation : float
        See `operate`.
    """

    base: Material
    operation: float

    def on(self, grid: Wavelengths, *, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return it on a grid."""
        below = self.base.on(grid, stokes=stokes)
        return replace(below, reflectance=operate(below.reflectance, self.operation))


@dataclass(frozen=True)
class Coated:
    """A base, possibly fluorescent, under the coat of a plastic; without the light's way through the coat.

    Attributes
    ----------
    base : Material
    r : float
        Share of the light that the coat reflects back to the base.
    """

    base: Material
    r: float

    def on(self, grid: Wavelengths, *, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return on a grid what has luminesced once at the most."""
        return under_a_coat(self.base.on(grid, stokes=stokes), self.r)[0]

    def more_on(self, grid: Wavelengths, *, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return on a grid what has luminesced more often."""
        return under_a_coat(self.base.on(grid, stokes=stokes), self.r)[1]


@dataclass(frozen=True)
class Reflection:
    """What a fluorescent material reflects, without its luminescence."""

    base: Material

    def on(self, grid: Wavelengths, *, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return it on a grid."""
        return DonaldsonMatrix(grid, self.base.on(grid, stokes=stokes).reflectance, stokes=stokes)


@dataclass(frozen=True)
class Luminescence:
    """The luminescence of a material, without what it reflects."""

    base: Material

    def on(self, grid: Wavelengths, *, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return it on a grid."""
        D = self.base.on(grid, stokes=stokes)
        return replace(D, reflectance=np.zeros_like(D.reflectance))


@dataclass(frozen=True)
class Metal:
    """What a conductor reflects at one angle: Fresnel's equations times its specular reflectance.

    Attributes
    ----------
    eta, k : Spectrum
        Index of refraction and extinction coefficient, against the medium outside.
    specular : Spectrum
        Further factor.
    cosine : float
        Of the angle between the light and the (micro)surface normal.
    """

    eta: Spectrum
    k: Spectrum
    specular: Spectrum
    cosine: float

    @property
    def name(self) -> str:
        """What it is made of, as Mitsuba calls it."""
        return "mirror" if self.eta.name == "eta" else self.eta.name.removeprefix("eta of ")

    def on(self, grid: Wavelengths, *, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Return it on a grid."""
        F = conductor_reflectance(self.cosine, self.eta.on(grid), self.k.on(grid))
        return DonaldsonMatrix(grid, F * self.specular.on(grid), stokes=stokes)


def conductor_reflectance(
    cosine: float, eta: np.typing.NDArray[np.float64], k: np.typing.NDArray[np.float64]
) -> np.typing.NDArray[np.float64]:
    """Unpolarised Fresnel reflectance of a conductor.

    Parameters
    ----------
    cosine : float
        Of the angle of incidence.
    eta, k : ndarray of shape (N,)
        Index of refraction and extinction coefficient, against the medium outside.

    Returns
    -------
    ndarray of shape (N,)

    Notes
    -----
    Born, Wolf, Principles of Optics, section 14.2.

    Examples
    --------
    >>> conductor_reflectance(1.0, np.array([1.5]), np.array([0.0]))  # glass: ((n - 1) / (n + 1))^2
    array([0.04])
    """
    index = np.asarray(eta) + 1j * np.asarray(k)
    index = np.where(index == 0, _NO_INDEX, index)  # the limit, where the equations say 0 / 0
    root = np.sqrt(index**2 - (1 - cosine**2))
    s = np.abs((cosine - root) / (cosine + root)) ** 2
    p = np.abs((index**2 * cosine - root) / (index**2 * cosine + root)) ** 2
    return np.asarray((s + p) / 2)
