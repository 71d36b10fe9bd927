"""How the samples of a pixel are divided: into sets whose random numbers are independent, and further into batches.

The samples of a set are spread evenly, so few sets mean little noise. Standard errors come from the scatter of batches,
which is known well but does not see how even a set is, and from the scatter of sets, which does; see
`paths/sweeping/pooled_errors.py`.
"""

from __future__ import annotations

from fluorspar.scene.settings import Settings

__all__ = ["batch_count", "sample_sets"]

_BATCHES = 32
_LARGEST = 256  # samples of a batch: in single precision longer sums lose small terms


def sample_sets(settings: Settings) -> int:
    return 2


def batch_count(spp: int) -> int:
    return min(spp, max(_BATCHES, -(-spp // _LARGEST)))
