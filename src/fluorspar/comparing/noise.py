"""How much of the difference of two renders is noise.

The bands of a pixel are almost fully correlated, so the independent observations are pixels. The square of a
difference is expected to be the variance of the noise, whatever the correlation of the bands, so sums over
bands and over blocks of pixels of both are compared. Each block counts the same: a few pixels at the edge of a
lamp, whose noise is a thousand times that of others, would otherwise decide alone.

One rule holds for every deviation: in standard errors that are estimates of n degrees of freedom it is a Student's t,
and counts as the deviation of a normal variable that is as rare. So all of them have one bound.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.measuring.freedom import combined_freedom

__all__ = ["Differences", "NoiseVerdict", "explained_by_noise", "normal_score"]

Array = NDArray[np.float64]

_OTHER = {"A": "B", "B": "A"}  # the side whose standard errors are not known
_CHANCE = 1e-3  # of a false alarm in one comparison
_BLOCKS = 16  # along the longer side
_LEAST = 8  # pixels along a block
_ROUNDING = 1e-5  # of the radiance: sums and band conversions in float32
_LEAST_CHANCE, _LEAST_SCATTER = 1e-300, 1e-100  # so that no logarithm and no quotient is infinite


@dataclass(frozen=True, eq=False)
class Differences:
    """B - A of pixels or points, and their standard errors; all arrays have the shape (Y, X) or (P,).

    Parameters
    ----------
    squares : ndarray
        Sum over bands of the squared difference; NaN where it is not known.
    variances : ndarray
        Sum over bands of its variance, both sides added.
    means : ndarray
        Mean over bands of the difference.
    mean_errors : ndarray
        Standard error of that mean.
    levels, level_squares : ndarray
        Mean over bands of B after matching, and the sum over bands of its squares.
    freedom : ndarray or float
        Degrees of freedom of the standard errors; infinite: they are known.
    """

    squares: Array
    variances: Array
    means: Array
    mean_errors: Array
    levels: Array
    level_squares: Array
    freedom: Array | float = np.inf


@dataclass(frozen=True)
class NoiseVerdict:
    """What the standard errors say about a difference.

    Attributes
    ----------
    known_of : str
        Whose standard errors are known: "A and B", "A", "B".
    share : float
        Share of the squared difference that noise explains: 1 over the mean, over the blocks, of sum of
        squares over sum of variances. 1 if the difference is noise and nothing else.
    share_uncertainty : float
        Standard error of the share, from the scatter of the blocks (or points); infinite if there is only one.
    mean_z : float
        Sum of the mean differences of all blocks, each in its own standard errors, over the standard error of
        that sum.
    block_z : float
        Greatest mean difference of a block of pixels, in standard errors, without its sign; of points also the
        greatest root mean square over the bands.
    block_bound : float
        What noise alone exceeds in one comparison of a thousand, corrected for the number of deviations.
    blocks : int
        Number of blocks.
    observations : int
        Number of pixels or points.
    share_z : float
        By how many standard errors the squared differences exceed what noise alone gives; negative: they fall
        short of it.
    unexplained : int
        Number of pixels or points that differ although neither side has noise there.
    doubt : str
        Why there is no verdict; empty if there is one.
    differs : bool or None
        Whether the difference is more than noise: `block_z`, `mean_z` or `share_z` is beyond the bound, or a
        pixel without noise differs. None: no verdict.
    """

    known_of: str
    share: float
    share_uncertainty: float
    mean_z: float
    block_z: float
    block_bound: float
    blocks: int
    observations: int
    share_z: float
    unexplained: int
    doubt: str
    differs: bool | None

    @property
    def greatest_z(self) -> float:
        """The greatest of all deviations, in standard errors; infinite if a pixel without noise differs."""
        return np.inf if self.unexplained else max(self.block_z, abs(self.mean_z), self.share_z)

    @property
    def one_sided(self) -> bool:
        """Whether the standard errors of one side are not known."""
        return self.known_of in _OTHER

    def as_dict(self) -> dict[str, Any]:
        """All fields as plain numbers and strings."""
        return asdict(self)


def explained_by_noise(
    differences: Differences,
    known_of: str = "A and B",
    *,
    scale_error: float = 0.0,
    same_seed: int | None = None,
) -> NoiseVerdict | None:
    """Compare differences with their standard errors.

    Parameters
    ----------
    differences : Differences
        Pixels are gathered in square blocks; each point is a block of its own.
    known_of : str
        Whose standard errors are known. There is no verdict if they are those of one side only.
    scale_error : float
        Relative standard error of the factor that matched the scales, which all pixels share.
    same_seed : int, optional
        The seed of both sides if it is the same: their noise is then correlated, so there is no verdict.

    Returns
    -------
    NoiseVerdict or None
        None if there is no noise at all, or no pixel is known. Blocks without noise have no ratio; what
        differs in them is counted pixel by pixel.

    Examples
    --------
    >>> d, ones = np.random.default_rng(1).standard_normal((64, 64)), np.ones((64, 64))
    >>> verdict = explained_by_noise(Differences(d**2, ones, d, ones, ones, ones))
    >>> verdict.differs, abs(verdict.share - 1) < 3 * verdict.share_uncertainty
    (False, True)
    """
    d = differences
    known = np.isfinite(d.squares) & np.isfinite(d.variances)
    if not known.any():
        return None
    of_points = d.squares.ndim == 1
    fewest = float(np.min(np.broadcast_to(d.freedom, known.shape)[known]))
    quiet = known & (d.variances + scale_error**2 * d.level_squares == 0)
    unexplained = int(np.sum(quiet & (d.squares > _ROUNDING**2 * d.level_squares) & (known_of not in _OTHER)))
    each = np.stack(
        [
            d.squares,
            d.variances,
            d.means,
            d.mean_errors**2,
            d.mean_errors**4 / d.freedom,
            d.levels,
            d.level_squares,
        ]
    )
    sums = np.where(known, each, 0.0) if of_points else _block_sums(np.where(known, each, 0.0))
    squares, variances, means, of_mean, of_mean_squared, levels, level_squares = sums[:, sums[1] > 0]
    if not len(squares):
        return None
    # all blocks share the error of the scale
    shared, shared_of_mean = scale_error**2 * level_squares, (scale_error * levels) ** 2
    variances, of_mean = variances + shared, of_mean + shared_of_mean
    freedom = combined_freedom(of_mean, of_mean_squared + shared_of_mean**2 / fewest)
    ratios = squares / variances

    z = normal_score(means / np.sqrt(of_mean), freedom)
    tied = np.sqrt(shared_of_mean / of_mean)
    mean_z = float(np.sum(z) / np.sqrt(np.sum(1 - tied**2) + np.sum(tied) ** 2))
    # bands that are fully correlated have one deviation, the root mean square; others scatter less
    deviations = np.append(z, normal_score(np.sqrt(ratios), freedom)) if of_points else z
    bound = _bound(len(deviations) + 2)

    # the mean of a ratio to an estimate of n degrees of freedom is n / (n - 2)
    ratios = ratios * np.maximum(1 - 2 / freedom, 1 / 3)
    mean, scatter, shared_part = float(ratios.mean()), _scatter(ratios), float(np.mean(shared / variances))
    # the square of the one error that all share is beyond bound^2 no more often than the error beyond the bound
    share_t = (mean - 1) / max(scatter + shared_part * bound, _LEAST_SCATTER)
    share_z = float(normal_score(share_t, max(len(ratios) - 1, 1)))

    equal = not d.squares[known].any()
    doubt = "" if equal else _doubt(known_of, same_seed)
    block_z = float(np.abs(deviations).max())
    beyond = max(block_z, abs(mean_z), share_z) > bound
    return NoiseVerdict(
        known_of,
        share=1 / mean if mean > 0 else np.inf,
        share_uncertainty=float(np.hypot(scatter, np.sqrt(2) * shared_part)) / mean**2
        if mean > 0
        else np.inf,
        mean_z=mean_z,
        block_z=block_z,
        block_bound=bound,
        blocks=len(ratios),
        observations=int(known.sum()),
        share_z=share_z,
        unexplained=unexplained,
        doubt=doubt,
        # a pixel without noise tells, whatever the noise of the others
        differs=True if unexplained else None if doubt else beyond,
    )


def _doubt(known_of: str, same_seed: int | None) -> str:
    if known_of in _OTHER:
        return f"the noise of {_OTHER[known_of]} is not known: no verdict"
    if same_seed is not None:
        other = f"render one with --seed {same_seed + 1}"
        return f"the noise of both is correlated (same seed {same_seed}): no verdict; {other}"
    return ""


def _block_sums(values: Array) -> Array:
    """Sums over square blocks of pixels, ndarray of shape (K, Y, X) to (K, blocks)."""
    height, width = values.shape[1:]
    size = max(_LEAST, -(-max(height, width) // _BLOCKS))
    of_rows = np.add.reduceat(values, np.arange(0, height, size), axis=1)
    return np.asarray(np.add.reduceat(of_rows, np.arange(0, width, size), axis=2).reshape(len(values), -1))


def _scatter(ratios: Array) -> float:
    """Standard error of the mean of ratios; infinite for one, which does not scatter."""
    return float(ratios.std(ddof=1) / np.sqrt(len(ratios))) if len(ratios) > 1 else np.inf


def _bound(count: int) -> float:
    from scipy.special import ndtri

    return float(-ndtri(_CHANCE / (2 * count)))


def normal_score(t: ArrayLike, freedom: ArrayLike) -> Array:
    """Return the number of known standard errors that is as rare as t of estimated ones.

    Parameters
    ----------
    t : array_like of shape (...,)
        A difference in estimated standard errors: Student's t.
    freedom : array_like of the same shape
        Degrees of freedom of those; infinite: known.

    Returns
    -------
    ndarray of shape (...,)

    Examples
    --------
    >>> normal_score([2.0, 12.924], [np.inf, 3]).round(2)  # Student's t of 3: beyond 12.924 by chance 0.0005
    array([2.  , 3.29])
    """
    from scipy.special import ndtri, stdtr

    t, freedom = np.broadcast_arrays(np.asarray(t, np.float64), np.asarray(freedom, np.float64))
    score = np.array(t)
    estimated = np.isfinite(freedom)
    chance = np.maximum(stdtr(freedom[estimated], -np.abs(t[estimated])), _LEAST_CHANCE)
    score[estimated] = -np.sign(t[estimated]) * ndtri(chance)
    return score
