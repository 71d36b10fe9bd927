"""Two tables of spectra of the same points, on common bands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import xyz_from_radiance
from fluorspar.comparing.comparison import Comparison, PointComparison
from fluorspar.comparing.difference import band_bias, band_error, ratio, rmse
from fluorspar.comparing.noise import NoiseVerdict, explained_by_noise
from fluorspar.comparing.pair import Pair
from fluorspar.comparing.whites import lab_of
from fluorspar.measuring.freedom import combined_freedom

__all__ = ["compare_points"]

Array = NDArray[np.float64]


def compare_points(
    pair: Pair,
    inside: NDArray[np.bool_],
    done: Comparison,
    *,
    scale_error: float = 0.0,
    same_seed: int | None = None,
) -> PointComparison | None:
    """Compare the points of a pair.

    Parameters
    ----------
    pair : Pair
    inside : ndarray of shape (T,)
        The bands of RMSE.
    done : Comparison
        With the grid, the scale, the divisors and the white.
    scale_error : float
        Relative standard error of the scale.
    same_seed : int, optional
        As in `explained_by_noise`.

    Returns
    -------
    PointComparison or None
        None if there are no points.

    Examples
    --------
    >>> compare_points(Pair(None, None), np.ones(4, bool), None) is None
    True
    """
    if pair.a is None or pair.b is None:
        return None
    a, b = pair.a, pair.b
    matched = b.radiance * done.scale
    lab_a, lab_b = (
        lab_of(xyz_from_radiance(values, done.grid, done.observer), done.white)
        for values in (a.radiance, matched)
    )
    return PointComparison(
        a.names,
        a.radiance,
        b.radiance,
        a.standard_error,
        b.standard_error,
        rmse(a.radiance[:, inside], b.radiance[:, inside], done.mean_a, done.mean_b),
        ciede2000(lab_a, lab_b),
        lab_a,
        lab_b,
        band_error(a.radiance, matched),
        band_bias(a.radiance, matched),
        ratio(matched.mean() - a.radiance.mean(), a.radiance.mean()),
        _noise(pair, done, scale_error, same_seed),
    )


def _noise(pair: Pair, done: Comparison, scale_error: float, same_seed: int | None) -> NoiseVerdict | None:
    """In units of the mean of A, so that squares of very small or large numbers are numbers too."""
    assert pair.a is not None
    assert pair.b is not None
    tables = ((pair.a, 1 / done.mean_a), (pair.b, 1 / done.mean_b))
    count, shape = len(done.grid), pair.a.radiance.shape
    known_of, variance = [], np.zeros(shape)
    mean_variance, mean_squares = np.zeros(shape[0]), np.zeros(shape[0])
    for side, (table, factor) in enumerate(tables):
        mean_error = pair.error_of_sum(side, np.full(count, 1 / count))
        if table.standard_error is not None and mean_error is not None:
            known_of.append("AB"[side])
            variance += (table.standard_error * factor) ** 2
            of_mean = (mean_error * factor) ** 2
            mean_variance += of_mean
            mean_squares += of_mean**2 / (np.inf if table.freedom is None else table.freedom)
    if not known_of:
        return None
    first, matched = (table.radiance * factor for table, factor in tables)
    difference = matched - first
    return explained_by_noise(
        np.sum(difference**2, axis=1),
        np.sum(variance, axis=1),
        difference.mean(axis=1),
        np.sqrt(mean_variance),
        " and ".join(known_of),
        scale_error=scale_error,
        levels=matched.mean(axis=1),
        level_squares=np.sum(matched**2, axis=1),
        same_seed=same_seed,
        square_variances=_square_variances(pair, tuple(factor for _, factor in tables)),
        freedom=combined_freedom(mean_variance, mean_squares),
    )


def _square_variances(pair: Pair, factors: tuple[float, ...]) -> Array | None:
    """Variance of the sum over bands of squared noise, of each point; None if all bands are fully correlated.

    Of normal variables of covariance C it is 2 tr(C C): twice the sum over bands of squared variances, if they are
    independent.
    """
    sides = [table for table in (pair.a, pair.b) if table is not None and table.standard_error is not None]
    if all(table.correlated for table in sides):
        return None
    found = []
    for point in range(len(sides[0].names)):
        each = (pair.covariance(side, point) for side in range(2))
        scaled = [f**2 * c for f, c in zip(factors, each, strict=True) if c is not None]
        found.append(2 * np.sum(np.square(sum(scaled))))
    return np.array(found)
