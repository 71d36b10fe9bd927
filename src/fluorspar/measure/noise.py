"""How much of the difference of two renders is noise.

The bands of a pixel are almost fully correlated, so the independent observations are pixels. A square of a
difference is expected to be the variance of the noise, whatever the correlation of the bands, so sums over
bands of both are compared, pixel by pixel.
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
        Share of the squared difference that noise explains: sum of variances over sum of squares. 1 if the
        difference is noise and nothing else.
    share_uncertainty : float
        Standard error of the share, with pixels (or points) as observations.
    mean_z : float
        Mean difference over everything, in standard errors.
    block_z : float
        Greatest mean difference of a block of pixels (or a point), in standard errors, without its sign.
    block_bound : float
        What noise alone exceeds in one comparison of a thousand, corrected for the number of blocks.
    blocks : int
        Number of blocks.
    observations : int
        Number of pixels or points.
    differs : bool
        Whether the difference is more than noise: `block_z` is beyond its bound.
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
        Standard error of that mean; for fully correlated bands the mean of the standard errors.
    known_of : str
        Whose standard errors these are.

    Returns
    -------
    NoiseVerdict or None
        None if there is no noise at all, or no pixel is known.

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> d = random.standard_normal((64, 64))
    >>> verdict = explained_by_noise(d**2, np.ones((64, 64)), d, np.ones((64, 64)))
    >>> verdict.differs, abs(verdict.share - 1) < 3 * verdict.share_uncertainty
    (False, True)
    """
    q, v, m, e = (np.asarray(values, dtype=np.float64) for values in (squares, variances, means, mean_errors))
    known = np.isfinite(q) & np.isfinite(v)
    count = int(known.sum())
    noise, difference = float(v[known].sum()), float(q[known].sum())
    if count == 0 or noise == 0:
        return None
    ratio = difference / noise
    spread = np.sqrt(np.sum((q[known] - ratio * v[known]) ** 2)) / noise
    share = noise / difference if difference > 0 else np.inf
    z = _block_z(np.where(known, m, 0.0), np.where(known, e**2, 0.0))
    bound = _bound(len(z))
    mean_z = float(m[known].sum() / np.sqrt(np.sum(e[known] ** 2)))
    worst = float(np.abs(z).max())
    return NoiseVerdict(
        known_of,
        float(share),
        float(spread / ratio**2) if difference > 0 else np.inf,
        mean_z,
        worst,
        bound,
        len(z),
        count,
        bool(worst > bound),
    )


def _block_z(means: Array, variances: Array) -> Array:
    """Mean differences of blocks over their standard errors; each point for itself if there are no rows."""
    if means.ndim == 2:
        size = max(_LEAST, -(-max(means.shape) // _BLOCKS))
        rows, columns = (np.arange(0, length, size) for length in means.shape)
        means = np.add.reduceat(np.add.reduceat(means, rows, axis=0), columns, axis=1).ravel()
        variances = np.add.reduceat(np.add.reduceat(variances, rows, axis=0), columns, axis=1).ravel()
    return np.asarray(means / np.sqrt(np.where(variances > 0, variances, np.inf)))


def _bound(count: int) -> float:
    from scipy.special import ndtri

    return float(-ndtri(_CHANCE / (2 * count)))
