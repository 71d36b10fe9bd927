"""How much of the difference of two renders is noise.

The bands of a pixel are almost fully correlated, so the independent observations are pixels. The square of a
difference is expected to be the variance of the noise, whatever the correlation of the bands, so sums over
bands and over blocks of pixels of both are compared. Each block counts the same: a few pixels at the edge of a
lamp, whose noise is a thousand times that of others, would otherwise decide alone.

Standard errors of few samples scatter themselves, and ratios to them have long tails. A ratio is replaced by the one
that is as rare where standard errors are known: Student's t becomes a normal variable, Snedecor's F a chi-squared one.

Three things tell a real difference: the mean difference of a block or of everything; squared differences that are
too large for the noise, such as those of a pattern that is zero on average; and a pixel without noise that differs.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.measuring.freedom import combined_freedom

__all__ = [
    "NoiseVerdict",
    "chi_squared_score",
    "explained_by_noise",
    "noise_sentence",
    "normal_score",
    "share_text",
    "verdict_text",
]

Array = NDArray[np.float64]

_LEAST_CHANCE = 1e-300

_OTHER = {"A": "B", "B": "A"}  # the side whose standard errors are not known
_CHANCE = 1e-3
_BLOCKS = 16  # along the longer side
_LEAST = 8  # pixels along a block
_FEWEST = 4.0  # degrees of freedom of standard errors at a point that a verdict needs
_ROUNDING = 1e-5  # of the radiance: sums and band conversions in float32


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
        Standard error of the share, from the scatter of the blocks (or points); of one alone, from theory.
    mean_z : float
        Mean difference of all blocks, each in its own standard errors, over the standard error of that mean. Here
        and below, those of few samples count as what is as rare where they are known.
    block_z : float
        Greatest mean difference of a block of pixels (or a point), in standard errors, without its sign.
    block_bound : float
        What noise alone exceeds in one comparison of a thousand, corrected for their number.
    blocks : int
        Number of blocks.
    observations : int
        Number of pixels or points.
    share_z : float
        By how many standard deviations the squared differences exceed what noise alone gives (Wilson and
        Hilferty's transform of chi-squared); negative: they fall short of it.
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

    def as_dict(self) -> dict[str, Any]:
        """All fields as plain numbers and strings."""
        return asdict(self)


def explained_by_noise(
    squares: ArrayLike,
    variances: ArrayLike,
    means: ArrayLike,
    mean_errors: ArrayLike,
    known_of: str = "A and B",
    *,
    scale_error: float = 0.0,
    levels: ArrayLike | None = None,
    level_squares: ArrayLike | None = None,
    same_seed: int | None = None,
    square_variances: ArrayLike | None = None,
    freedom: ArrayLike = np.inf,
) -> NoiseVerdict | None:
    """Compare differences with their standard errors.

    Parameters
    ----------
    squares : array_like of shape (Y, X) or (P,)
        Sum over bands of the squared difference, of each pixel or point.
    variances : array_like of the same shape
        Sum over bands of its variance, both sides added.
    means : array_like of the same shape
        Mean over bands of the difference.
    mean_errors : array_like of the same shape
        Standard error of that mean; the mean of the standard errors is that of fully correlated bands and else
        a little too large.
    known_of : str
        Whose standard errors these are. There is no verdict if they are those of one side only.
    scale_error : float
        Relative standard error of the factor that matched the scales, which all pixels share.
    levels, level_squares : array_like of the same shape, optional
        Mean over bands of B after matching, and the sum of its squares: needed with a scale error, and to tell
        a difference from rounding where there is no noise.
    same_seed : int, optional
        The seed of both sides if it is the same: their noise is then correlated.
    square_variances : array_like of the same shape, optional
        Variance of `squares` if there is nothing but noise. Default: that of fully correlated bands, twice the
        square of `variances`; with independent bands it is less, twice the sum over bands of squares.
    freedom : array_like of the same shape, or float
        Degrees of freedom of the standard errors; infinite: they are known.

    Returns
    -------
    NoiseVerdict or None
        None if there is no noise at all, or no pixel is known. Blocks without noise have no ratio; what
        differs in them is counted pixel by pixel.

    Notes
    -----
    For noise alone and bands that are fully correlated, the mean over blocks of the sum of squares over the sum
    of variances is a mean of squares, whose degrees of freedom are those of the pixels, or fewer if the ratios
    scatter more than that. Where the variance of the squares is given, it is the measure.

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> d = random.standard_normal((64, 64))
    >>> verdict = explained_by_noise(d**2, np.ones((64, 64)), d, np.ones((64, 64)))
    >>> verdict.differs, abs(verdict.share - 1) < 3 * verdict.share_uncertainty
    (False, True)
    """
    q, v, m, e = (np.asarray(values, dtype=np.float64) for values in (squares, variances, means, mean_errors))
    zero = np.zeros_like(q)
    b = zero if levels is None else np.asarray(levels, dtype=np.float64)
    b2 = zero if level_squares is None else np.asarray(level_squares, dtype=np.float64)
    of_q = 2 * v**2 if square_variances is None else np.asarray(square_variances, dtype=np.float64)
    f = np.broadcast_to(np.asarray(freedom, dtype=np.float64), q.shape)
    known = np.isfinite(q) & np.isfinite(v)
    quiet = known & (v + scale_error**2 * b2 == 0)
    unexplained = 0 if known_of in _OTHER else int(np.sum(quiet & (q > _ROUNDING**2 * b2)))
    equal = not q[known].any()
    observations, points = int(known.sum()), q.ndim < 2
    fewest = float(f[known].min()) if known.any() else np.inf
    sums = [_blocks(np.where(known, x, 0.0)) for x in (q, v, of_q, v**2 / f, m, e**2, e**4 / f, b, b2)]
    noisy = sums[1] > 0
    if not noisy.any():
        return None
    q, v, of_q, v2_f, m, e2, e4_f, b, b2 = (values[noisy] for values in sums)
    of_scale, of_mean = scale_error**2 * b2, (scale_error * b) ** 2
    ratios = q / (v + of_scale)
    below = combined_freedom(v + of_scale, v2_f + of_scale**2 / fewest)
    # the mean of a ratio to an estimate of n degrees of freedom is n / (n - 2)
    mean = float(np.mean(ratios * np.maximum(1 - 2 / below, 1 / 3)))
    as_known = chi_squared_score(ratios, 2 * v**2 / of_q, below)
    # the square of one shared error has a standard deviation of sqrt(2) times its mean
    shared = float(np.sqrt(2) * np.mean(of_scale / (v + of_scale)))
    expected = float(np.hypot(np.sqrt(np.sum(of_q / v**2)) / len(ratios), shared))
    spread = float(np.hypot(_scatter(ratios), shared)) if len(ratios) > 1 else expected * mean
    level = float(as_known.mean())
    widened = square_variances is None and len(ratios) > 1 and level > 0
    share_z = _square_z(level, max(expected, _scatter(as_known) / level if widened else 0.0))
    z = normal_score(m / np.sqrt(e2 + of_mean), combined_freedom(e2 + of_mean, e4_f + of_mean**2 / fewest))
    bound, worst = _bound(len(z) + 2), float(np.abs(z).max())
    own, freedom_of_own = np.sqrt(e2), combined_freedom(e2, e4_f)
    scores = normal_score(m / own, freedom_of_own)
    mean_z = float(np.sum(scores) / np.hypot(np.sqrt(len(m)), scale_error * np.sum(b / own)))
    few = float(freedom_of_own.min()) if points else np.inf
    doubt = "" if equal else _doubt(known_of, same_seed, few, share_z < -bound)
    return NoiseVerdict(
        known_of,
        1 / mean if mean > 0 else np.inf,
        spread / mean**2 if mean > 0 else np.inf,
        mean_z,
        worst,
        bound,
        len(z),
        observations,
        share_z,
        unexplained,
        doubt,
        _differs(max(worst, abs(mean_z), share_z) > bound, unexplained, doubt),
    )


def _scatter(ratios: Array) -> float:
    """Standard error of the mean of two or more ratios."""
    return float(ratios.std(ddof=1) / np.sqrt(len(ratios)))


def _square_z(mean: float, spread: float) -> float:
    """A mean of squares whose expectation is 1, in standard deviations, if it is a chi-squared variable.

    Parameters
    ----------
    mean : float
    spread : float
        Its relative standard deviation, sqrt(2 / degrees of freedom).

    References
    ----------
    E. B. Wilson, M. M. Hilferty, "The distribution of chi-square", PNAS 17(12), 1931.

    Examples
    --------
    >>> round(_square_z(38.885 / 30, (2 / 30) ** 0.5), 2)  # of 30 degrees of freedom: 38.885 is at 87.2 %
    1.14
    """
    variance = spread**2 / 9
    return float((np.cbrt(mean) - (1 - variance)) / np.sqrt(variance))


def _differs(beyond: bool, unexplained: int, doubt: str) -> bool | None:
    if unexplained:
        return True  # whatever the noise of the other pixels
    return None if doubt else bool(beyond)


def _doubt(known_of: str, same_seed: int | None, freedom: float, too_small: bool) -> str:
    if known_of in _OTHER:
        return f"the noise of {_OTHER[known_of]} is not known: no verdict"
    if same_seed is not None:
        other = f"render one with --seed {same_seed + 1}"
        return f"the noise of both is correlated (same seed {same_seed}): no verdict; {other}"
    if freedom < _FEWEST:
        return f"the standard errors come from {freedom + 1:.0f} repeats, too few for points: no verdict"
    if too_small:
        return (
            "the difference is far smaller than its standard errors, so the noise of both is correlated or the "
            "errors are too large: no verdict"
        )
    return ""


def share_text(noise: NoiseVerdict) -> str:
    """The share of the squared difference that noise explains, in words; never more than all of it."""
    if not np.isfinite(noise.share):
        return "no difference"
    if noise.doubt and noise.known_of not in _OTHER:
        return "not known"
    if noise.share > 1 + noise.share_uncertainty:
        return "all"
    return f"{100 * noise.share:.1f} ± {100 * noise.share_uncertainty:.1f} %"


def verdict_text(noise: NoiseVerdict) -> str:
    """Whether the difference is more than noise, in words."""
    if noise.differs is None:
        return "no verdict"
    return "more than noise" if noise.differs else "no more than noise"


def noise_sentence(noise: NoiseVerdict, subject: str = "") -> str:
    """What the standard errors say, in words; `subject` is put before what noise explains."""
    of_blocks = noise.blocks < noise.observations
    quiet = ""
    if noise.unexplained:
        quiet = f"; {noise.unexplained} {'pixels' if of_blocks else 'points'} differ where there is no noise"
    if noise.doubt and noise.known_of in _OTHER:
        part = f"{subject}of {noise.known_of} alone explains {share_text(noise)} of the squared difference"
        return f"{noise.doubt}; {part}"
    if noise.doubt:
        return noise.doubt + quiet
    if np.isfinite(noise.share):
        share = share_text(noise)
        deviation = (
            "" if share == "all" else f" ({abs(noise.share_z):.1f} standard deviations from all of it)"
        )
        explained = f"{subject}of {noise.known_of} explains {share} of the squared difference{deviation}"
    else:
        explained = "there is no difference"
    what = f"of {noise.blocks} blocks" if of_blocks else "of the points"
    return (
        f"{explained}; mean difference: {abs(noise.mean_z):.1f} standard errors, greatest {what}: {noise.block_z:.1f} "
        f"(noise alone: below {noise.block_bound:.1f}){quiet}, so the difference is {verdict_text(noise)}"
    )


def _blocks(values: Array) -> Array:
    """Sums over square blocks of pixels; points are blocks of their own."""
    if values.ndim < 2:
        return values
    size = max(_LEAST, -(-max(values.shape) // _BLOCKS))
    rows, columns = (np.arange(0, length, size) for length in values.shape)
    return np.asarray(np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1).ravel())


def _bound(count: int) -> float:
    from scipy.special import ndtri

    return float(-ndtri(_CHANCE / (2 * count)))


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
