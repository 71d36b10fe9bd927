"""From a measured Donaldson matrix to a material: reflectance and non-negative emission and excitation spectra."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import MaterialError, message
from fluorspar.spectral.factorise import Factors, Problem
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.material import Fluorophore, Material
from fluorspar.spectral.matrix_noise import MatrixNoise, estimate_noise, stokes_shift
from fluorspar.spectral.measured import MeasuredMatrix
from fluorspar.spectral.measured_check import check_measured
from fluorspar.spectral.rank_choice import choose_rank
from fluorspar.spectral.spectrum import Spectrum, trapezoid
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["MaterialFit", "fit_material"]

Array = NDArray[np.float64]

_ROW_TOLERANCE = 0.002  # radiance factor: about 0.1 of CIEDE2000
_NEGLIGIBLE = 1e-4  # of the highest value of a spectrum; written as 0


@dataclass(frozen=True, eq=False)
class MaterialFit:
    """What `fit_material` found.

    Attributes
    ----------
    material : Material
    measured : MeasuredMatrix
        What it was fitted to.
    noise : MatrixNoise
    gains : tuple of float
        By how much the first, second, ... term lowered the misfit.
    noise_gain : float
        By how much a term lowers it above the diagonal, where there is only noise.
    unexplained : float
        Root-mean-square residual of the luminescent part over its root mean square, baselines taken out of
        both.
    scaled : float
        Factor that was put on the luminescence to keep the photon yield at 1; nearly always 1.
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
    fit, its size is taken from the cells above the diagonal, and the baseline every column has in common
    above and below the diagonal is not taken for luminescence. S is the diagonal less the half cell of
    luminescence in it. Rows are held to add up in daylight to what was measured, since many small errors of
    one sign would show as a colour.

    Parameters
    ----------
    measured
        The matrix.
    rank
        Number of fluorophores, 0 included; chosen by the data if None (see `choose_rank`).
    name, description, credit
        Of the material.
    smooth
        Make the spectra as smooth as the noise allows.
    support
        The first and last wavelength of the tables in nm. Where the data end earlier S keeps its end value
        and alpha and beta are 0, which `material.assumed` says.

    Returns
    -------
    MaterialFit

    Raises
    ------
    MaterialError
        If the matrix gives out more than 1.15 photons per photon, or S lies outside 0 to 1 by more than noise
        (by less, it is set to 0 or 1).

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
    shift = stokes_shift(measured.emission, measured.excitation, measured.step)
    noise = estimate_noise(measured.cells, shift)
    choice = choose_rank(measured, noise, rank)
    daylight = illuminant("D65")
    light = np.interp(measured.excitation, daylight.wavelengths, daylight.values / 100)
    problem = Problem(measured.cells, shift, noise, row_tolerance=_ROW_TOLERANCE, light=light)
    factors = problem.nothing()
    if choice.factors.rank:
        factors = problem.fit(replace(choice.factors, curvature=0.0))
        factors = problem.smooth(factors) if smooth else factors
    title = name or measured.title
    table = _tables(measured, factors, support, 3 * noise.near)
    scaled = _photon_limit(table)
    material = Material(
        title,
        Spectrum(table.wavelengths, table.reflectance, f"reflectance of {title!r}", table.assumed),
        tuple(
            Fluorophore(
                Spectrum(table.wavelengths, scaled * a, f"emission of {title!r}", table.assumed),
                Spectrum(table.wavelengths, b, f"excitation of {title!r}", table.assumed),
                f"{title}_{k}",
            )
            for k, (a, b) in enumerate(zip(table.emission, table.excitation, strict=True), start=1)
        ),
        description=description,
        credit=credit,
        assumed=table.assumed,
    )
    unexplained = _unexplained(measured, factors, shift)
    return MaterialFit(material, measured, noise, choice.gains, choice.noise_gain, unexplained, scaled)


@dataclass(frozen=True, eq=False)
class _Tables:
    """Spectra on common wavelengths (n,); emission and excitation (K, n)."""

    wavelengths: Array
    reflectance: Array
    emission: Array
    excitation: Array
    assumed: str


def _tables(
    measured: MeasuredMatrix, factors: Factors, support: tuple[float, float], tolerance: float
) -> _Tables:
    """Turn band-weighted factors into S, alpha, beta (integral 1) on the measured wavelengths within `support`."""
    em, ex, h = measured.emission, measured.excitation, measured.step
    first = em[0] + h * np.ceil((support[0] - em[0]) / h - 1e-6)
    last = em[0] + h * np.floor((support[1] - em[0]) / h + 1e-6)
    grid = Wavelengths(float(first), float(last), h).values
    own = np.interp(measured.reflectance.wavelengths, em, np.arange(len(em))).round().astype(int)
    excited = np.interp(measured.reflectance.wavelengths, ex, np.arange(len(ex))).round().astype(int)
    reflectance = measured.reflectance.values - 0.5 * factors.product[own, excited]
    worst = int(np.argmax(np.abs(reflectance - 0.5)))
    if not -tolerance <= reflectance[worst] <= 1 + tolerance:
        raise MaterialError(
            message(
                "the reflectance in a Donaldson matrix lies outside 0 to 1 by more than noise",
                where=f"{measured.title}, {measured.reflectance.wavelengths[worst]:g} nm",
                got=f"{reflectance[worst]:.3g} once half a cell of luminescence is taken off",
                expected=f"0 to 1 within {tolerance:.2g}",
                fix="check the calibration of the measurement, or that the diagonal is S",
            )
        )
    emission = np.array([np.interp(grid, em, a, left=0.0, right=0.0) for a in factors.emission])
    excitation = np.array([np.interp(grid, ex, b, left=0.0, right=0.0) for b in factors.excitation])
    for k in range(factors.rank):
        area = trapezoid(excitation[k], grid)
        excitation[k] /= area
        emission[k] *= area / h
        for values in (emission[k], excitation[k]):
            values[values < _NEGLIGIBLE * values.max()] = 0.0
    return _Tables(
        grid,
        np.clip(np.interp(grid, measured.reflectance.wavelengths, reflectance), 0.0, 1.0),
        emission.reshape(factors.rank, len(grid)),
        excitation.reshape(factors.rank, len(grid)),
        _assumptions(measured, grid, bool(factors.rank)),
    )


def _assumptions(measured: MeasuredMatrix, grid: Array, fluorescent: bool) -> str:
    """Say what the tables assume outside the data."""
    found = []
    first, last = measured.reflectance.support
    what = [("reflectance", first, last, "held at its value there")]
    if fluorescent:
        what += [
            ("emission", float(measured.emission[0]), float(measured.emission[-1]), "taken as 0"),
            ("excitation", float(measured.excitation[0]), float(measured.excitation[-1]), "taken as 0"),
        ]
    for quantity, a, b, how in what:
        if grid[0] < a - 1e-6:
            found.append(f"{quantity} below {a:g} nm not measured, {how}")
        if grid[-1] > b + 1e-6:
            found.append(f"{quantity} above {b:g} nm not measured, {how}")
    return "; ".join(found)


def _photon_limit(table: _Tables) -> float:
    """Return the factor (at most 1) that keeps every photon yield at 1 or below."""
    w, h = table.wavelengths, table.wavelengths[1] - table.wavelengths[0]
    weights = np.tri(len(w), k=-1) + 0.5 * np.eye(len(w))
    lit = h * (w @ (weights * (table.emission.T @ table.excitation))) / w
    room = np.where(lit > 0, (1 - table.reflectance) / np.maximum(lit, 1e-12), np.inf)
    return float(min(1.0, room.min()))


def _unexplained(measured: MeasuredMatrix, factors: Factors, shift: Array) -> float:
    lit = shift > 0.5
    data = (measured.cells - factors.baseline)[lit]
    total = np.sqrt(np.mean(data**2)) if data.size else 0.0
    return float(np.sqrt(np.mean((data - factors.product[lit]) ** 2)) / total) if total else 0.0
