"""Donaldson matrices: what a matte surface does to light, fluorescence included, on one wavelength grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.bispectral.checks import check_photon_yield, check_stokes_side
from fluorspar.bispectral.conversions import (
    Stokes,
    density_from_band,
    stokes_weights,
)
from fluorspar.errors import MaterialError, message
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["DonaldsonMatrix", "Stokes", "weighted_matrices"]

Array = NDArray[np.float64]

_ROUNDING = 1e-6


def _no_factors() -> Array:
    return np.zeros((0, 0))


@dataclass(frozen=True, eq=False)
class DonaldsonMatrix:
    """The bispectral radiance factor D of a matte surface on a wavelength grid.

    Light E that falls on the surface leaves it as `y(em) = S(em) E(em) + integral D_L(em, ex) E(ex) d_ex`;
    on a grid of step h the integral is h times a sum. D_L is a density in excitation wavelength, so its
    values do not depend on the grid.

    Parameters
    ----------
    wavelengths : Wavelengths
        The grid, N wavelengths.
    reflectance : ndarray of shape (N,)
        S, the reflected radiance factor.
    emission : ndarray of shape (K, N), optional
        alpha of each of K fluorophores, dimensionless.
    excitation : ndarray of shape (K, N), optional
        beta of each, 1/nm.
    luminescent : ndarray of shape (N, N), optional
        D_L in full instead of factors, 1/nm, rows are emission wavelengths; used as given.
    stokes : {"half", "strict"}
        For factors: whether excitation at the emission wavelength itself counts half (the trapezoid rule,
        second order in h) or not at all (Eq. 1 of the paper to the letter, first order in h).

    Raises
    ------
    MaterialError
        If the shapes do not fit, a number is not finite, or both factors and a full matrix are given.

    See Also
    --------
    DonaldsonMatrix.check : is it physically possible?

    Notes
    -----
    "The paper" is Tominaga, Guarnera, Ohtera, "Spectral Image Rendering of Fluorescent Objects Using a
    Conventional Renderer", IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.

    Examples
    --------
    >>> grid = Wavelengths(400, 420, 10)
    >>> D = DonaldsonMatrix(grid, np.full(3, 0.5), emission=[[0, 0, 0.6]], excitation=[[0.1, 0, 0]])
    >>> D.band()
    array([[0.5, 0. , 0. ],
           [0. , 0.5, 0. ],
           [0.6, 0. , 0.5]])
    >>> D.apply([1.0, 1.0, 1.0])
    array([0.5, 0.5, 1.1])
    """

    wavelengths: Wavelengths
    reflectance: Array
    emission: Array = field(default_factory=_no_factors)
    excitation: Array = field(default_factory=_no_factors)
    luminescent: Array | None = None
    stokes: Stokes = "half"

    def __post_init__(self) -> None:
        n = len(self.wavelengths)
        for name in ("reflectance", "emission", "excitation", "luminescent"):
            if (given := getattr(self, name)) is None:
                continue
            array = np.array(given, dtype=np.float64)  # a copy, so that nobody can change it
            if name in ("emission", "excitation"):
                array = np.atleast_2d(array) if array.size else np.zeros((0, n))
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        full = self.luminescent
        shapes_fit = (
            self.reflectance.shape == (n,)
            and self.emission.ndim == 2
            and self.emission.shape == self.excitation.shape
            and self.emission.shape[1] == n
            and (full is None or (full.shape == (n, n) and len(self.emission) == 0))
        )
        if not shapes_fit:
            got = [
                None if a is None else a.shape
                for a in (self.reflectance, self.emission, self.excitation, full)
            ]
            expected = f"({n},), and either (K, {n}) and (K, {n}) or ({n}, {n})"
            fault = "the parts of a Donaldson matrix do not fit its grid"
            raise MaterialError(message(fault, got=got, expected=expected))
        for part in (self.reflectance, self.emission, self.excitation, full):
            if part is not None and not np.all(np.isfinite(part)):
                raise MaterialError(message("a Donaldson matrix holds a value that is not a finite number"))
        if self.stokes not in ("half", "strict"):
            fault, expected = "there is no such Stokes rule", "'half' or 'strict'"
            raise MaterialError(message(fault, got=repr(self.stokes), expected=expected))

    @classmethod
    def from_band(cls, matrix: ArrayLike, wavelengths: Wavelengths) -> DonaldsonMatrix:
        """Take a band-weighted matrix as instruments store it: diagonal S, elsewhere D_L times h.

        Parameters
        ----------
        matrix : array_like of shape (N, N)
            Rows are emission, columns excitation wavelengths.
        wavelengths : Wavelengths
            Its grid.

        Examples
        --------
        >>> DonaldsonMatrix.from_band([[0.5, 0], [0.2, 0.4]], Wavelengths(400, 410, 10)).luminescent
        array([[0.  , 0.  ],
               [0.02, 0.  ]])
        """
        reflectance, density = density_from_band(np.asarray(matrix, dtype=np.float64), wavelengths.step)
        return cls(wavelengths, reflectance, luminescent=density)

    @property
    def is_fluorescent(self) -> bool:
        """Whether D_L has any value other than 0 on this grid."""
        return bool(self.luminescent_bands[0].any())

    @property
    def luminescent_bands(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which wavelengths D_L emits, and which excite it; two ndarrays of shape (N,).

        Examples
        --------
        >>> DonaldsonMatrix.from_band([[0.5, 0], [0.2, 0.4]], Wavelengths(400, 410, 10)).luminescent_bands
        (array([False,  True]), array([ True, False]))
        """
        if self.luminescent is not None:
            cells = self.luminescent != 0
            return cells.any(axis=1), cells.any(axis=0)
        emits, excites = self.emission != 0, self.excitation != 0
        return (
            np.any(emits & (self._up_to(excites.astype(float)) > 0), axis=0),
            np.any(excites & (self._from(emits.astype(float)) > 0), axis=0),
        )

    @property
    def rank(self) -> int:
        """Number of fluorophores; of a matrix given in full, the rank of D_L."""
        return (
            len(self.emission) if self.luminescent is None else int(np.linalg.matrix_rank(self.luminescent))
        )

    def density(self) -> Array:
        """Return D_L with its Stokes weights, 1/nm, ndarray of shape (N, N).

        Examples
        --------
        >>> DonaldsonMatrix(Wavelengths(400, 410, 10), [0.5, 0.5], [[0.2, 0.4]], [[0.1, 0.1]]).density()
        array([[0.01, 0.  ],
               [0.04, 0.02]])
        """
        if self.luminescent is not None:
            return self.luminescent.copy()
        return np.asarray(
            (self.emission.T @ self.excitation) * stokes_weights(len(self.wavelengths), self.stokes)
        )

    def band(self) -> Array:
        """Return the operator of the surface on this grid: y = band() @ E, ndarray of shape (N, N).

        That is diag(S) + h D_L. With half weight the diagonal is S plus half a cell of luminescence.
        """
        return np.diag(self.reflectance) + self.wavelengths.step * self.density()

    def reflect(self, illumination: ArrayLike) -> Array:
        """Return S E, the reflected part of the radiance; `illumination` and result of shape (..., N).

        Examples
        --------
        >>> DonaldsonMatrix(Wavelengths(400, 410, 10), [0.5, 0.4]).reflect([1.0, 2.0])
        array([0.5, 0.8])
        """
        return np.asarray(self.reflectance * self._fitting(illumination))

    def apply_luminescent(self, illumination: ArrayLike) -> Array:
        """Return the integral of D_L E over excitation, the luminescent part of the radiance.

        Parameters
        ----------
        illumination : array_like of shape (..., N)
            E, W m-2 sr-1 nm-1.

        Returns
        -------
        ndarray of shape (..., N)

        Examples
        --------
        >>> grid = Wavelengths(400, 420, 10)
        >>> D = DonaldsonMatrix(grid, np.zeros(3), emission=[[1, 1, 1]], excitation=[[0.05, 0.05, 0.05]])
        >>> D.apply_luminescent([1.0, 1.0, 1.0])
        array([0.25, 0.75, 1.25])
        """
        E = self._fitting(illumination)
        h = self.wavelengths.step
        if self.luminescent is not None:
            return np.asarray(h * (E @ self.luminescent.T))
        y = np.zeros_like(E)
        for alpha, beta in zip(self.emission, self.excitation, strict=True):
            y += alpha * self._up_to(h * beta * E)
        return y

    def _up_to(self, values: Array) -> Array:
        """Sum over the wavelengths up to each one, which itself counts as the Stokes rule says; shape (..., N)."""
        own = 0.5 if self.stokes == "half" else 1.0
        return np.asarray(np.cumsum(values, axis=-1) - own * values)

    def _from(self, values: Array) -> Array:
        """Sum over the wavelengths from each one on, likewise."""
        return self._up_to(values[..., ::-1])[..., ::-1]

    def _given_out(self, weights: Array) -> Array:
        """Sum of h D_L over emission with weights, for each excitation wavelength; all of shape (N,)."""
        if self.luminescent is not None:
            return np.asarray(self.wavelengths.step * (weights @ self.luminescent))
        return np.asarray(
            self.wavelengths.step * np.sum(self.excitation * self._from(weights * self.emission), axis=0)
        )

    def apply(self, illumination: ArrayLike) -> Array:
        """Return the radiance D E that leaves the surface; `illumination` and result of shape (..., N).

        Examples
        --------
        >>> D = DonaldsonMatrix.from_band([[0.5, 0], [0.2, 0.4]], Wavelengths(400, 410, 10))
        >>> D.apply([1.0, 2.0])
        array([0.5, 1. ])
        """
        return self.reflect(illumination) + self.apply_luminescent(illumination)

    def _fitting(self, illumination: ArrayLike) -> Array:
        E = np.asarray(illumination, dtype=np.float64)
        if E.shape[-1:] != (len(self.wavelengths),):
            expected = f"(..., {len(self.wavelengths)})"
            raise MaterialError(
                message("the light is not on the grid of the matrix", got=E.shape, expected=expected)
            )
        return E

    def photon_yield(self) -> Array:
        """Return photons out per photon in, for each excitation wavelength, ndarray of shape (N,).

        S(ex) plus the sum over em of B(em, ex) em / ex, with B = h D_L. What is emitted outside the grid is
        not counted.

        Examples
        --------
        >>> grid = Wavelengths(400, 500, 100)
        >>> DonaldsonMatrix.from_band([[0.1, 0], [0.4, 0.7]], grid).photon_yield()  # 0.1 + 0.4 x 500 / 400
        array([0.6, 0.7])
        """
        return self.reflectance + self.luminescent_photon_yield()

    def luminescent_photon_yield(self) -> Array:
        """Return the luminescent part of `photon_yield`, ndarray of shape (N,)."""
        w = self.wavelengths.values
        return self._given_out(w) / w  # a photon has energy hc / lambda

    def energy_yield(self) -> Array:
        """Return energy out per energy in, for each excitation wavelength, ndarray of shape (N,).

        Examples
        --------
        >>> DonaldsonMatrix.from_band([[0.1, 0], [0.4, 0.7]], Wavelengths(400, 500, 100)).energy_yield()
        array([0.5, 0.7])
        """
        return self.reflectance + self._given_out(np.ones(len(self.wavelengths)))

    def check(self, name: str = "", *, orientation: bool = True) -> DonaldsonMatrix:
        """Return the matrix as it is if a real surface could have it.

        Parameters
        ----------
        name : str
            For messages.
        orientation : bool
            Whether to look for a transposed matrix: False where it was looked for on the measured cells, of which
            this may be a small part.

        Raises
        ------
        MaterialError
            If a reflectance lies outside 0 to 1, more light is shifted to shorter than to longer wavelengths
            (transposed), or an excitation wavelength gives out more than 1.15 times its photons.

        Warns
        -----
        PhotonYieldWarning
            If it gives out up to that.

        Examples
        --------
        >>> DonaldsonMatrix(Wavelengths(), np.full(69, 0.5)).check().rank
        0
        """
        grid = self.wavelengths.values
        where = repr(name) if name else "a Donaldson matrix"
        worst = int(np.argmax(np.abs(self.reflectance - 0.5)))
        if not -_ROUNDING <= self.reflectance[worst] <= 1 + _ROUNDING:
            fault = (
                "a reflectance is negative"
                if self.reflectance[worst] < 0
                else "a reflectance is greater than 1"
            )
            got = f"{self.reflectance[worst]:g}"
            raise MaterialError(
                message(fault, where=f"{where}, {grid[worst]:g} nm", got=got, expected="0 to 1")
            )
        if orientation and self.luminescent is not None:  # factors have nothing above the diagonal
            check_stokes_side(self.wavelengths.step * self.luminescent, grid, grid, where)
        check_photon_yield(self.photon_yield(), grid, where)
        return self


def weighted_matrices(terms: Sequence[tuple[float, DonaldsonMatrix]]) -> DonaldsonMatrix:
    """Add matrices on one grid with weights; factors stay factors where all have them.

    Examples
    --------
    >>> grey = DonaldsonMatrix(Wavelengths(400, 410, 10), [0.5, 0.4])
    >>> weighted_matrices([(0.5, grey), (0.25, grey)]).reflectance
    array([0.375, 0.3  ])
    """
    grid, stokes = terms[0][1].wavelengths, terms[0][1].stokes
    reflectance = np.sum([weight * D.reflectance for weight, D in terms], axis=0)
    if all(D.luminescent is None for _, D in terms):
        emission = np.concatenate([weight * D.emission for weight, D in terms])
        excitation = np.concatenate([D.excitation for _, D in terms])
        return DonaldsonMatrix(grid, reflectance, emission, excitation, stokes=stokes)
    density = np.sum([weight * D.density() for weight, D in terms], axis=0)
    return DonaldsonMatrix(grid, reflectance, luminescent=density, stokes=stokes)
