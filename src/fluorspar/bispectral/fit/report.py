"""How well a fitted material shows the colours of the matrix it was fitted to."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.bispectral.fit.fit import MaterialFit
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import lab_from_xyz, observer_weights
from fluorspar.errors import ExtrapolationWarning
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["POOR", "FitReport", "fit_quality", "report_fit", "report_lights"]

Array = NDArray[np.float64]

POOR = 1.0
"""CIEDE2000 above which a fit does not show the measured colour: most people see that much side by side."""


@dataclass(frozen=True, eq=False)
class FitReport:
    """What `report_fit` found; N wavelengths of `grid`.

    Attributes
    ----------
    grid : Wavelengths
    unexplained : float
        Root-mean-square residual of the cells below the diagonal over their root mean square, noise included.
    delta_e : dict of str to float
        CIEDE2000 between the total radiance factors of fit and measurement under each light of
        `report_lights`. The measurement is its diagonal and what is below; what is above can only be noise.
    delta_e_all_cells : dict of str to float
        The same with the cells above the diagonal counted too, as in a measured matrix that is used as it is.
        Compare with `delta_e`: the measured colour itself is uncertain by about the difference.
    photon_yield, energy_yield : ndarray of shape (N,)
        Of the fit, per excitation wavelength, reflection included.
    measured_photon_yield, measured_energy_yield : ndarray of shape (N,)
        Of the measurement, what is above its diagonal left out; NaN where its reflectance was not measured.
    """

    grid: Wavelengths
    unexplained: float
    delta_e: dict[str, float]
    delta_e_all_cells: dict[str, float]
    photon_yield: Array
    energy_yield: Array
    measured_photon_yield: Array
    measured_energy_yield: Array

    @property
    def shortcoming(self) -> str:
        """Where the colour difference is above `POOR`, in words; empty if nowhere."""
        worst = max(self.delta_e, key=lambda light: self.delta_e[light])
        if self.delta_e[worst] <= POOR:
            return ""
        return f"the measured colour is missed by {self.delta_e[worst]:.2f} of CIEDE2000 under {worst}"


def report_fit(measured: MeasuredMatrix, material: Material, step: float | None = None) -> FitReport:
    """Compare a material with the matrix it was fitted to.

    Colours are sums over the emission wavelengths that were measured, for the CIE 1931 observer; the white
    is the same sum over the light. Where S was not measured, both hold its end value.

    Parameters
    ----------
    measured : MeasuredMatrix
    material : Material
        Its fit.
    step : float, optional
        Of the grid in nm; that of the measurement by default.

    Returns
    -------
    FitReport

    Raises
    ------
    MaterialError
        If the material is physically impossible.

    Examples
    --------
    >>> from fluorspar.bispectral.fit.fit import fit_material
    >>> w = np.arange(380.0, 781.0, 10.0)
    >>> band = np.outer(np.exp(-(((w - 560) / 30) ** 2)), np.exp(-(((w - 490) / 40) ** 2)))
    >>> sheet = MeasuredMatrix(w, w, 0.3 * np.eye(41) + 0.05 * np.tril(band, -1), "sheet")
    >>> report = report_fit(sheet, fit_material(sheet, support=(380, 780)).material, step=5)
    >>> report.delta_e["D65"] < 0.2, bool(report.photon_yield.max() < 1)
    (True, True)
    """
    grid = measured.grid(step)
    with warnings.catch_warnings():  # both sides assume the same outside the data
        warnings.simplefilter("ignore", ExtrapolationWarning)
        full = measured.on(grid)
        fitted = material.on(grid)
    stokes = replace(full, luminescent=np.tril(full.density()))
    seen = (grid.values >= measured.emission[0]) & (grid.values <= measured.emission[-1])
    weights = np.where(seen[:, None], observer_weights(grid), 0.0)
    delta_e, delta_e_all_cells = (
        {name: _difference(fitted, other, light, weights) for name, light in report_lights(grid).items()}
        for other in (stokes, full)
    )
    S_range = measured.reflectance.support
    known = (grid.values > S_range[0] - 1e-6) & (grid.values < S_range[1] + 1e-6)
    below = np.tri(len(grid), k=-1) * seen[:, None] > 0
    cells = full.density()[below]
    residual = np.sqrt(np.mean((fitted.density()[below] - cells) ** 2))
    return FitReport(
        grid,
        float(residual / np.sqrt(np.mean(cells**2))) if np.any(cells) else 0.0,
        delta_e,
        delta_e_all_cells,
        fitted.photon_yield(),
        fitted.energy_yield(),
        np.where(known, stokes.photon_yield(), np.nan),
        np.where(known, stokes.energy_yield(), np.nan),
    )


def report_lights(grid: Wavelengths) -> dict[str, Array]:
    """Return the lights a fit is judged in, relative, ndarrays of shape (N,).

    D65, A and FL11 are CIE illuminants (0 where their tables end); "D65+UV" has a band of 365 nm added, as
    of an ultraviolet lamp: half width 10 nm, three times as strong as D65 at 560 nm; "D65-UV" is D65
    without what is below 400 nm (measurement condition M2).

    Examples
    --------
    >>> lights = report_lights(Wavelengths(300, 780, 5))
    >>> sorted(lights), float(lights["D65-UV"][:20].max())
    (['A', 'D65', 'D65+UV', 'D65-UV', 'FL11'], 0.0)
    """
    lights = {name: illuminant(name).on(grid, outside="zero") for name in ("D65", "A", "FL11")}
    w = grid.values
    lights["D65+UV"] = lights["D65"] + 300.0 * np.exp(-np.log(2) * ((w - 365) / 10) ** 2)
    lights["D65-UV"] = np.where(w < 400, 0.0, lights["D65"])
    return lights


def fit_quality(fit: MaterialFit, coarse: FitReport, fine: FitReport) -> str:
    """Describe a fit: rank, colour differences to the measurement, noise, what is unexplained, photon yield.

    The measurement is its diagonal and the cells below it; what stands above can only be error, and the difference
    with it is that to the colour of the matrix used as it is.

    Parameters
    ----------
    fit : MaterialFit
        From `fit_material`.
    coarse, fine : FitReport
        From `report_fit`, at the step of the measurement and at half of it.

    Returns
    -------
    str

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.bispectral.fit.report import report_fit
    >>> from fluorspar.bispectral.fit.fit import fit_material
    >>> from fluorspar.bispectral.measured import MeasuredMatrix
    >>> w = np.arange(400.0, 701.0, 10.0)
    >>> cells = 0.3 * np.eye(31) + np.random.default_rng(1).normal(0, 0.003, (31, 31))
    >>> fit = fit_material(MeasuredMatrix(w, w, cells, "grey"))
    >>> coarse, fine = (report_fit(fit.measured, fit.material, step) for step in (10.0, 5.0))
    >>> print(fit_quality(fit, coarse, fine).partition(";")[0])
    not fluorescent: no luminescence beyond the noise of 0.0030 per cell
    """
    colours = ", ".join(f"{light} {value:.2f}" for light, value in coarse.delta_e.items())
    all_cells = ", ".join(f"{light} {coarse.delta_e_all_cells[light]:.2f}" for light in ("D65", "A", "FL11"))
    found = f"rank {fit.rank}"
    if fit.rank == 0:
        found = f"not fluorescent: no luminescence beyond the noise of {fit.noise.white:.4f} per cell"
    words = (
        f"{found}; CIEDE2000 to the measurement: {colours}, counting its diagonal and what is below; "
        f"under D65 at {fine.grid.step:g} nm {fine.delta_e['D65']:.2f}; "
        f"to all cells, with those above the diagonal {all_cells}"
    )
    if coarse.shortcoming:
        words += f"; {coarse.shortcoming}"
    if fit.rank == 0:
        return words
    words += (
        f"; noise {fit.noise.white:.4f} per cell, luminescent part unexplained {100 * fit.unexplained:.0f} %; "
        f"highest photon yield {coarse.photon_yield.max():.2f}"
    )
    if fit.scaled < 1:
        words += f"; excitation lowered, down to {fit.scaled:.3f} of its value, to conserve photons"
    return words


def _difference(a: DonaldsonMatrix, b: DonaldsonMatrix, light: Array, weights: Array) -> float:
    white = light @ weights
    labs = [lab_from_xyz(D.apply(light) @ weights, white) for D in (a, b)]
    return float(ciede2000(*labs))
