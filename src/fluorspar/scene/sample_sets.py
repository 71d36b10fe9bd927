"""How the samples of a pixel are divided: into sets whose random numbers are independent, and further into batches.

The samples of a set are spread evenly, so few sets mean little noise. How much, only the scatter of sets tells; that of
batches is known better, but overestimates it. See `pooled_errors.py`.
"""

from __future__ import annotations

from fluorspar.scene.settings import Settings

__all__ = ["batch_count", "error_freedom", "sample_sets"]

_BATCHES = 32
_LARGEST = 256  # samples of a batch: in single precision longer sums lose small terms
_FEWEST_PIXELS = 25
_POOLED_FREEDOM = 25.0
_MOST_SAMPLES = (
    8192  # beyond, a run of pixels that is traced at a time is no larger than a window of `pooled_errors`
)


def batch_count(spp: int) -> int:
    """Number of batches of samples from which standard errors are estimated.

    Examples
    --------
    >>> batch_count(1), batch_count(5), batch_count(20), batch_count(1024), batch_count(65536)
    (1, 4, 20, 32, 256)
    """
    batches = min(spp, max(_BATCHES, -(-spp // _LARGEST)))
    return max(batches // 2 * 2, 1)  # the first half of them is a set


def sample_sets(settings: Settings) -> int:
    """Number of independent sets: two, or where that is too few to estimate standard errors, each batch is one.

    Examples
    --------
    >>> from fluorspar.scene.settings import Settings
    >>> sample_sets(Settings(256, 256, 64)), sample_sets(Settings(4, 4, 64))
    (2, 32)
    """
    batches = batch_count(settings.spp)
    if settings.width * settings.height < _FEWEST_PIXELS or settings.spp > _MOST_SAMPLES:
        return batches
    return min(batches, 2)


def error_freedom(settings: Settings) -> float:
    """Degrees of freedom of the standard errors of a pixel: of the batches, less one, or of the pixels that share them.

    Examples
    --------
    >>> from fluorspar.scene.settings import Settings
    >>> error_freedom(Settings(256, 256, 64)), error_freedom(Settings(4, 4, 64))
    (25.0, 31.0)
    """
    if sample_sets(settings) == 2:
        return min(_POOLED_FREEDOM, 0.8 * settings.width * settings.height)
    return float(max(batch_count(settings.spp) - 1, 1))
