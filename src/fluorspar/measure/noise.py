"""How much of the difference of two renders is noise.

The bands of a pixel are almost fully correlated, so the independent observations are pixels. The square of a
difference is expected to be the variance of the noise, whatever the correlation of the bands, so sums over
bands and over blocks of pixels of both are compared. Each block counts the same: a few pixels at the edge of a
lamp, whose noise is a thousand times that of others, would otherwise decide alone.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["NoiseVerdict", "explained_by_noise"]

Array = NDArray[np.float64]

_CHANCE = 1e-3
_BLOCKS = 16  # along the longer side
_LEAST = 8  # pixels along a block


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
        Standard error of the share, from the scatter of the blocks (or points).
    mean_z : float
        Mean difference of all blocks, each in its own standard errors, over the standard error of that mean.
    block_z : float
        Greatest mean difference of a block of pixels (or a point), in standard errors, without its sign.
    block_bound : float
        What noise alone exceeds in one comparison of a thousand, corrected for their number.
    blocks : int
        Number of blocks.
    observations : int
        Number of pixels or points.
    differs : bool
        Whether the difference is more than noise: `block_z` or `mean_z` is beyond the bound.
    """

    known_of: str
    share: float
    share_uncertainty: float
    mean_z: float
    block_z: float
    block_bound: float
    blocks: int
    observations: int
    differs: bool

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
        Whose standard errors these are.
    scale_error : float
        Relative standard error of the factor that matched the scales, which all pixels share.
    levels, level_squares : array_like of the same shape, optional
        Mean over bands of B after matching, and the sum of its squares: needed with a scale error.

    Returns
    -------
    NoiseVerdict or None
        None if there is no noise at all, or no pixel is known. Blocks without noise are left out.

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
    known = np.isfinite(q) & np.isfinite(v)
    q, v, m, e2, b, b2 = (_blocks(np.where(known, values, 0.0)) for values in (q, v, m, e**2, b, b2))
    noisy = v > 0
    if not noisy.any():
        return None
    q, v, m, e2, b, b2 = (values[noisy] for values in (q, v, m, e2, b, b2))
    of_scale = scale_error**2 * b2
    ratios = q / (v + of_scale)
    mean = float(ratios.mean())
    spread = float(ratios.std(ddof=1) / np.sqrt(len(ratios))) if len(ratios) > 1 else np.inf
    # the square of one shared error has a standard deviation of sqrt(2) times its mean
    spread = float(np.hypot(spread, np.sqrt(2) * np.mean(of_scale / (v + of_scale))))
    z = m / np.sqrt(e2 + (scale_error * b) ** 2)
    bound, worst = _bound(len(z) + 1), float(np.abs(z).max())
    own = np.sqrt(e2)
    mean_z = float(np.sum(m / own) / np.hypot(np.sqrt(len(m)), scale_error * np.sum(b / own)))
    return NoiseVerdict(
        known_of,
        1 / mean if mean > 0 else np.inf,
        spread / mean**2 if mean > 0 else np.inf,
        mean_z,
        worst,
        bound,
        len(z),
        int(known.sum()),
        bool(max(worst, abs(mean_z)) > bound),
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
