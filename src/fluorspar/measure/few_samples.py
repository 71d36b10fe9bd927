"""Standard errors that are estimates themselves: from few samples they scatter, and ratios to them have long tails.

A ratio is replaced by the one that is as rare where standard errors are known, so that everything after it need not
know of how many samples they are: Student's t becomes a normal variable, Snedecor's F a chi-squared one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["chi_squared_score", "combined_freedom", "normal_score"]

Array = NDArray[np.float64]

_LEAST_CHANCE = 1e-300


def normal_score(t: ArrayLike, freedom: ArrayLike) -> Array:
    """Return the number of known standard errors that is as rare as t of estimated ones.

    Parameters
    ----------
    t : array_like
        A difference in estimated standard errors.
    freedom : array_like
        Degrees of freedom of those; infinite: known.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> normal_score([2.0, 12.924], [np.inf, 3]).round(2)  # Student's t of 3: beyond 12.924 by chance 0.0005
    array([2.  , 3.29])
    """
    from scipy.special import ndtri, stdtr

    t, freedom = np.broadcast_arrays(np.asarray(t, np.float64), np.asarray(freedom, np.float64))
    score = np.array(t)
    few = np.isfinite(freedom)
    rare = np.maximum(stdtr(freedom[few], -np.abs(t[few])), _LEAST_CHANCE)
    score[few] = -np.sign(t[few]) * ndtri(rare)
    return score


def chi_squared_score(ratio: ArrayLike, above: ArrayLike, below: ArrayLike) -> Array:
    """Return the ratio of a sum of squares to its known variance that is as rare as one to an estimate of it.

    Parameters
    ----------
    ratio : array_like
        Mean square over its estimated expectation.
    above, below : array_like
        Degrees of freedom of the square and of the estimate; infinite below: known.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> chi_squared_score([2.0, 167.029], [1, 1], [np.inf, 3]).round(1)  # the squares of 12.924 and 3.29
    array([ 2. , 10.8])
    """
    from scipy.special import chdtri, fdtrc

    ratio, above, below = np.broadcast_arrays(
        *(np.asarray(values, np.float64) for values in (ratio, above, below))
    )
    score = np.array(ratio)
    few = np.isfinite(below)
    rare = np.maximum(fdtrc(above[few], below[few], ratio[few]), _LEAST_CHANCE)
    score[few] = chdtri(above[few], rare) / above[few]
    return score


def combined_freedom(variances: ArrayLike, squares: ArrayLike) -> Array:
    """Return the degrees of freedom of a sum of estimated variances.

    Parameters
    ----------
    variances : array_like
        The sum of variances.
    squares : array_like
        The sum of their squares, each over its own degrees of freedom.

    Returns
    -------
    ndarray
        Infinite where the variances are known.

    References
    ----------
    F. E. Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics
    Bulletin 2(6), 1946.

    Examples
    --------
    >>> combined_freedom(1.0 + 1.0, 1 / 3 + 1 / 3)
    array(6.)
    """
    above, below = np.asarray(variances, np.float64) ** 2, np.asarray(squares, np.float64)
    return np.asarray(np.divide(above, below, out=np.full(np.shape(above), np.inf), where=below > 0))
