"""How good a fit is, in one line, as material files say it."""

from __future__ import annotations

from fluorspar.bispectral.fit.fit import MaterialFit
from fluorspar.bispectral.fit.report import FitReport

__all__ = ["fit_quality"]


def fit_quality(fit: MaterialFit, coarse: FitReport, fine: FitReport) -> str:
    """Describe a fit: rank, colour differences to the measurement, noise, what is unexplained, photon yield.

    The measurement is its diagonal and the cells below it; what stands above can only be error, and the difference
    with it is that to the colour of the matrix used as it is.

    Parameters
    ----------
    fit
        From `fit_material`.
    coarse, fine
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
    >>> fit_quality(fit, report_fit(fit.measured, fit.material), report_fit(fit.measured, fit.material, 5.0))
    'not fluorescent: no luminescence beyond the noise of 0.0030 per cell'
    """
    if fit.rank == 0:
        return f"not fluorescent: no luminescence beyond the noise of {fit.noise.white:.4f} per cell"
    colours = ", ".join(f"{light} {value:.2f}" for light, value in coarse.delta_e.items())
    all_cells = ", ".join(f"{light} {coarse.delta_e_all_cells[light]:.2f}" for light in ("D65", "A", "FL11"))
    words = (
        f"rank {fit.rank}; CIEDE2000 to the measurement: {colours}; "
        f"under D65 at {fine.grid.step:g} nm {fine.delta_e['D65']:.2f}, "
        f"with the cells above the diagonal {all_cells}; "
        f"noise {fit.noise.white:.4f} per cell, luminescent part unexplained {100 * fit.unexplained:.0f} %; "
        f"highest photon yield {coarse.photon_yield.max():.2f}"
    )
    if fit.scaled < 1:
        words += f"; excitation lowered, down to {fit.scaled:.3f} of its value, to conserve photons"
    return words
