"""From a measured Donaldson matrix to a material: reflectance and non-negative emission and excitation spectra."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.fit.factorise import Factors, Problem
from fluorspar.bispectral.fit.rank import choose_rank
from fluorspar.bispectral.fit.spectra import spectra_of_factors
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.matrix_noise import MatrixNoise, estimate_noise, stokes_shift
from fluorspar.bispectral.measured import MeasuredMatrix, check_measured
from fluorspar.errors import MaterialError, message
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["MaterialFit", "fit_material"]

Array = NDArray[np.float64]

_TOLERANCE = 0.4  # of what the noise of single cells does to the sum of a row
# Share of cells beside the diagonal in that sum: reflected light that the bandpass of the instrument spills into them
# is not luminescence. 1 would pull the weak luminescence of a whitened paper down by a third, 0 would miss the measured
# colours by 0.25 of CIEDE2000 on average.
_BESIDE = 0.7


@dataclass(frozen=True, eq=False)
class MaterialFit:
    """What `fit_material` found.

    Attributes
    ----------
    material : Material
    measured : MeasuredMatrix
        What it was fitted to: the measurement, less its zero error (`noise.common`; nearly always 0).
    noise : MatrixNoise
    gains : tuple of float
        By how much the first, second, ... term lowered the misfit.
    noise_gain : float
        By how much a term lowers it above the diagonal, where there is only noise; at least by one for each of its
        numbers.
    unexplained : float
        Root-mean-square residual of the luminescent part over its root mean square, baselines taken out of
        both.
    scaled : float
        Smallest factor that was put on the excitation at a wavelength to keep its photon yield at 1; nearly always 1.
    """

    material: Material
    measured: MeasuredMatrix
    noise: MatrixNoise
    gains: tuple[float, ...]
    noise_gain: float
    unexplained: float
    scaled: float

    @property
    def rank(self) -> int:
        """Number of fluorophores."""
        return len(self.material.fluorophores)


def fit_material(
    measured: MeasuredMatrix,
    rank: int | None = None,
    *,
    name: str = "",
    smooth: bool = True,
    support: tuple[float, float] = (300.0, 780.0),
    description: str = "",
    credit: str = "",
) -> MaterialFit:
    """Fit reflectance and K fluorophores to a measured matrix.

    `D = diag(S) + sum over k of alpha_k beta_k^T` for excitation below emission, with half weight where the
    two are equal, alpha and beta non-negative. Nothing is clipped: noise of both signs is averaged by the
    fit, and its size is taken from the cells above the diagonal. The baseline that a column has above and
    below the diagonal alike is not taken for luminescence, nor is the one that all columns share. S is the
    diagonal less the half cell of luminescence in it. Rows are held to add up in daylight to what was measured, to a
    part of what noise does to such a sum, since many small errors of one sign would show as a colour.

    Where more photons would leave than arrive, S is lowered as far as its noise allows, then the excitation at that
    wavelength. Where S was not measured it keeps its end value, or less where luminescence leaves no room for it.

    Parameters
    ----------
    measured : MeasuredMatrix
    rank : int, optional
        Number of fluorophores, 0 included; chosen by the data if None (see `choose_rank`). Terms that find no
        luminescence are left out.
    name, description, credit : str
        Of the material.
    smooth : bool
        Make the spectra as smooth as the noise allows.
    support : (float, float)
        The first and last wavelength of the tables in nm. Where the data end earlier S keeps its end value
        and alpha and beta are 0, which `material.assumed` says.

    Returns
    -------
    MaterialFit

    Raises
    ------
    MaterialError
        If the matrix gives out more than 1.15 photons per photon, S lies outside 0 to 1 by more than noise (by less,
        it is set to 0 or 1), the rank is not a number of terms, or `support` has nothing of the measured
        reflectance.

    Examples
    --------
    >>> w = np.arange(400.0, 701.0, 10.0)
    >>> band = np.outer(np.exp(-(((w - 560) / 30) ** 2)), np.exp(-(((w - 490) / 40) ** 2)))
    >>> cells = 0.3 * np.eye(31) + 0.05 * np.tril(band, -1)
    >>> fit = fit_material(MeasuredMatrix(w, w, cells, "sheet"), support=(400, 700))
    >>> fit.rank, fit.unexplained < 0.01
    (1, True)
    >>> round(fit.material.fluorophores[0].emission.at(560), 2)
    0.35
    """
    check_measured(measured)
    _check_request(measured, rank, support)
    shift = stokes_shift(measured.emission, measured.excitation, measured.step)
    noise = estimate_noise(measured.cells, shift)
    if noise.common:
        measured = replace(measured, cells=measured.cells - noise.common)
    choice = choose_rank(measured, noise, rank)
    sums = _daylight_sums(measured)
    tolerance = _TOLERANCE * noise.white * float(np.sqrt(np.max(np.sum(sums**2, axis=(1, 2)))))
    problem = Problem(measured.cells, shift, noise, sums=sums, tolerance=tolerance)
    factors = problem.nothing()
    if choice.factors.rank:
        factors = problem.fit(replace(choice.factors, curvature=0.0))
        factors = problem.smooth(factors) if smooth else factors
    title = name or measured.title
    spectra, scaled = spectra_of_factors(measured, factors, support, tolerance=3 * noise.near, name=title)
    material = Material(
        title,
        terms=((1.0, spectra),),
        description=description,
        credit=credit,
        assumed=spectra.reflectance.assumed,
    )
    unexplained = _unexplained(measured, factors, shift)
    return MaterialFit(material, measured, noise, choice.gains, choice.noise_gain, unexplained, scaled)


def _check_request(measured: MeasuredMatrix, rank: int | None, support: tuple[float, float]) -> None:
    if rank is not None and (isinstance(rank, bool) or rank != int(rank) or rank < 0):
        fault = "the number of fluorophores is impossible"
        raise MaterialError(message(fault, where=measured.title, got=repr(rank), expected="0, 1, 2, ..."))
    first, last = measured.reflectance.support
    if not (support[0] < last and support[1] > first and support[0] < support[1]):
        raise MaterialError(
            message(
                "the reflectance was not measured at the wavelengths asked for",
                where=measured.title,
                got=f"{support[0]:g}-{support[1]:g} nm",
                expected=f"a range that meets {first:g}-{last:g} nm",
                fix="give the range as `support`, on the command line as --wavelengths",
            )
        )


def _daylight_sums(measured: MeasuredMatrix) -> Array:
    """Weights of the cells in what every row adds up to in daylight, a radiance factor; ndarray of shape (M, M, P)."""
    grid = Wavelengths(float(measured.excitation[0]), float(measured.excitation[-1]), measured.step)
    light = illuminant("D65").on(grid, outside="zero") / 100
    shift = stokes_shift(measured.emission, measured.excitation, measured.step)
    share = np.where(shift > 1.5, 1.0, _BESIDE)
    return np.asarray(np.eye(len(measured.emission))[:, :, np.newaxis] * (share * light))


def _unexplained(measured: MeasuredMatrix, factors: Factors, shift: Array) -> float:
    lit = shift > 0.5
    data = (measured.cells - factors.baseline)[lit]
    total = np.sqrt(np.mean(data**2)) if data.size else 0.0
    return float(np.sqrt(np.mean((data - factors.product[lit]) ** 2)) / total) if total else 0.0
