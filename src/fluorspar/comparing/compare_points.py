"""Two tables of spectra of the same points, on common bands."""

from __future__ import annotations

import numpy as np

from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import xyz_from_radiance
from fluorspar.comparing.comparison import PointComparison
from fluorspar.comparing.difference import band_bias, band_error, ratio, rmse_eq14, rmse_of_each
from fluorspar.comparing.noise import Differences, NoiseVerdict, explained_by_noise
from fluorspar.comparing.sides import PointSide
from fluorspar.comparing.terms import Terms
from fluorspar.comparing.whites import lab_of
from fluorspar.measuring.error_freedom import combined_freedom

__all__ = ["compare_points"]


def compare_points(a: PointSide, b: PointSide, terms: Terms, *, at_a_point: bool = False) -> PointComparison:
    """Compare two tables.

    Parameters
    ----------
    a, b : PointSide
        The same P points on the T common bands.
    terms : Terms
    at_a_point : bool
        Whether the scales were matched at a point, as Eq. 14 has it.

    Returns
    -------
    PointComparison
    """
    first, second, scale = a.spectra, b.spectra, terms.scale
    matched = second.radiance * scale.factor
    labs = [
        lab_of(xyz_from_radiance(radiance, terms.grid, terms.observer), terms.white)
        for radiance in (first.radiance, matched)
    ]
    in_range = first.radiance[:, terms.in_range], second.radiance[:, terms.in_range]
    return PointComparison(
        names=first.names,
        a=first.radiance,
        b=second.radiance,
        error_a=first.standard_error,
        error_b=second.standard_error,
        rmse=rmse_of_each(*in_range, scale.mean_a, scale.mean_b),
        rmse_eq14=rmse_eq14(*in_range, scale.mean_a, scale.mean_b) if at_a_point else None,
        de00=ciede2000(*labs),
        lab_a=labs[0],
        lab_b=labs[1],
        band_error=band_error(first.radiance, matched),
        band_bias=band_bias(first.radiance, matched),
        bias=ratio(matched.mean() - first.radiance.mean(), first.radiance.mean()),
        noise=_noise(a, b, terms),
    )


def _noise(a: PointSide, b: PointSide, terms: Terms) -> NoiseVerdict | None:
    """In units of the mean of A, so that squares of very small or large numbers are numbers too."""
    known_of = []
    variances, of_mean, of_mean_squared = (np.zeros(len(a.spectra.names)) for _ in range(3))
    shares = np.full(len(terms.grid), 1 / len(terms.grid))
    for name, side, mean in (("A", a, terms.scale.mean_a), ("B", b, terms.scale.mean_b)):
        error, error_of_mean = side.spectra.standard_error, side.error_of_sum(shares)
        if error is not None and error_of_mean is not None:
            known_of.append(name)
            freedom = np.inf if side.measured.freedom is None else side.measured.freedom
            variances += np.sum((error / mean) ** 2, axis=1)
            of_mean += (error_of_mean / mean) ** 2
            of_mean_squared += (error_of_mean / mean) ** 4 / freedom
    if not known_of:
        return None
    matched = b.spectra.radiance / terms.scale.mean_b
    difference = matched - a.spectra.radiance / terms.scale.mean_a
    differences = Differences(
        squares=np.sum(difference**2, axis=1),
        variances=variances,
        means=difference.mean(axis=1),
        mean_errors=np.sqrt(of_mean),
        levels=matched.mean(axis=1),
        level_squares=np.sum(matched**2, axis=1),
        freedom=combined_freedom(of_mean, of_mean_squared),
    )
    return explained_by_noise(
        differences,
        " and ".join(known_of),
        scale_error=terms.scale.error,
        same_seed=terms.same_seed,
        denoised=" and ".join(name for name, side in (("A", a), ("B", b)) if side.spectra.denoised),
    )
