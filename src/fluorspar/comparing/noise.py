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

from fluorspar.measuring.error_freedom import combined_freedom

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
    detectable : float
        Relative difference of a block or point that the bound would just tell, the median over them.
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
    detectable: float
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
    denoised: str = "",
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
    denoised : str
        Which sides are denoised: "A and B", "A", "B". Their pixels share errors, so there is no verdict.

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
    from scipy.special import ndtri

    d = differences
    known = np.isfinite(d.squares) & np.isfinite(d.variances)
    blocks = _in_blocks(d, known)
    if not len(blocks.squares):
        return None
    of_points = d.squares.ndim == 1
    # all blocks share the error of the scale
    variances = blocks.variances + scale_error**2 * blocks.level_squares
    shared = (scale_error * blocks.levels) ** 2
    of_mean = blocks.mean_errors**2 + shared
    freedom = combined_freedom(
        of_mean, blocks.mean_errors**4 / blocks.freedom + shared**2 / np.min(d.freedom)
    )
    z = normal_score(blocks.means / np.sqrt(of_mean), freedom)
    tied = shared / of_mean
    mean_z = float(z.sum() / np.sqrt(np.sum(1 - tied) + np.sum(np.sqrt(tied)) ** 2))
    if of_points:
        # fully correlated bands have one deviation, their root mean square; that of others varies less
        z = np.append(z, normal_score(np.sqrt(blocks.squares / variances), freedom))
    block_z, bound = float(np.abs(z).max()), float(-ndtri(_CHANCE / (2 * (len(z) + 2))))
    # the mean of a ratio to an estimate of n degrees of freedom is n / (n - 2)
    ratios = blocks.squares / variances * np.maximum(1 - 2 / freedom, 1 / 3)
    tied_square = float(np.mean(1 - blocks.variances / variances))
    mean = float(ratios.mean())
    scatter = float(ratios.std(ddof=1) / np.sqrt(len(ratios))) if len(ratios) > 1 else np.inf
    # the square of the one error that all share is beyond bound^2 no more often than that error beyond the bound
    share_t = (mean - 1) / max(scatter + tied_square * bound, _LEAST_SCATTER)
    share_z = float(normal_score(share_t, max(len(ratios) - 1, 1)))
    quiet = known & (d.variances + scale_error**2 * d.level_squares == 0)
    differ = quiet & (d.squares > _ROUNDING**2 * d.level_squares)
    unexplained = 0 if known_of in _OTHER else int(differ.sum())
    # at a point single bands count, since they are what gives it its colour
    noise, level = (variances, blocks.level_squares) if of_points else (of_mean, blocks.levels**2)
    relative = np.sqrt(np.divide(noise, level, out=np.full_like(level, np.inf), where=level > 0))
    doubt = _doubt(known_of, same_seed, denoised) if d.squares[known].any() else ""
    beyond = max(block_z, abs(mean_z), share_z) > bound
    return NoiseVerdict(
        known_of,
        share=1 / mean if mean > 0 else np.inf,
        share_uncertainty=float(np.hypot(scatter, np.sqrt(2) * tied_square)) / mean**2
        if mean > 0
        else np.inf,
        mean_z=mean_z,
        block_z=block_z,
        block_bound=bound,
        blocks=len(ratios),
        observations=int(known.sum()),
        share_z=share_z,
        unexplained=unexplained,
        detectable=bound * float(np.median(relative)),
        doubt=doubt,
        # a pixel without noise tells, whatever the noise of the others
        differs=True if unexplained else None if doubt else beyond,
    )


def _in_blocks(d: Differences, known: NDArray[np.bool_]) -> Differences:
    """Sums over square blocks of pixels, or over each point, without those that have no noise."""
    of_mean = d.mean_errors**2
    fields = (d.squares, d.variances, d.means, of_mean, of_mean**2 / d.freedom, d.levels, d.level_squares)
    sums = np.stack([_sums(np.where(known, values, 0.0)) for values in fields])
    squares, variances, means, of_mean, of_mean_squared, levels, level_squares = sums[:, sums[1] > 0]
    freedom = combined_freedom(of_mean, of_mean_squared)
    return Differences(squares, variances, means, np.sqrt(of_mean), levels, level_squares, freedom)


def _sums(values: Array) -> Array:
    """Sums over square blocks of pixels, or the values of points as they are, ndarray of shape (blocks,)."""
    if values.ndim == 2:
        size = max(_LEAST, -(-max(values.shape) // _BLOCKS))
        for axis in (0, 1):
            values = np.add.reduceat(values, np.arange(0, values.shape[axis], size), axis=axis)
    return values.ravel()


def _doubt(known_of: str, same_seed: int | None, denoised: str) -> str:
    if denoised:
        verb = "are" if "and" in denoised else "is"
        return f"{denoised} {verb} denoised, and neighbouring pixels share its errors"
    if known_of in _OTHER:
        return f"the noise of {_OTHER[known_of]} is not known"
    if same_seed is not None:
        return f"the noise of both is correlated, same seed {same_seed}; render one with seed {same_seed + 1}"
    return ""


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
