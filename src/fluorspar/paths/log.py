"""The log of traced light paths: what the tracer records and the sweep reads. It holds geometry and no spectrum."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["BLOCK", "END", "ENTRIES", "OF_TERMS", "SURVIVAL", "Chunk", "Log", "flat", "lanes_per_pixel"]

BLOCK = 16  # lanes whose entries lie side by side in memory, so that all lanes of a register write one line
END = 0xFFFFFFFF  # `row` of an entry whose ray has met no surface that light leaves again
# Russian roulette survives with the throughput of the brightest band, within these bounds. The lower one keeps
# paths unbiased if the spectra are changed after tracing.
SURVIVAL = (0.05, 0.95)
_LONGEST_LANE = 64  # samples that one lane traces one after another


class Log(NamedTuple):
    """What each lane has met, one entry after another.

    A lane traces samples of one pixel. In each turn its ray meets something, and one entry says what; where the
    path ends, the lane's next entry is the first one of its next path. Entry t of lane l lies at
    `[strips[l // BLOCK, 0] + t, l % BLOCK]`. A lane that comes to the end of its strip goes on at entry 0 of slot
    `goes_on[l]`, and so on; slots count like lanes.

    In scenes of general surfaces a vertex has several terms, lobes of its BSDF with a spectrum each; `row`, `direct`
    and `weight` are then of shape (terms, entries, BLOCK), with the coefficients of the lobe in `direct` and `weight`,
    and the path ends where all weights are 0.

    Attributes
    ----------
    sampled : ndarray of shape (entries, BLOCK), float32
        Weight of the light that the ray has hit, combined with next-event estimation at the vertex before by multiple
        importance sampling; h of the method. In the first entry of a path it is light seen directly.
    row : ndarray of shape (entries, BLOCK), uint32
        Row of the material table of the surface that was hit, or `END`.
    direct : ndarray of shape (entries, BLOCK), float32
        Weight of the light found by next-event estimation, E_D = direct x L, in sr for radiance, m-2 for
        intensity, 1 for irradiance, divided by pi; w of the method.
    weight : ndarray of shape (entries, BLOCK), float32
        Weight of the path's continuation, 1 / survival probability of Russian roulette; f of the method. 0 ends
        the path.
    sampled_light, direct_light : ndarray of shape (entries, BLOCK), uint32
        Rows of the light table that `sampled` and `direct` belong to; without entries where the scene has one light.
    strips : ndarray of shape (slots / BLOCK, 2), int64
        Where the entries of each block of lanes begin and end.
    goes_on : ndarray of shape (slots,), int32
        Slot in which the lane goes on behind the end of its strip, -1 if it does not.
    used : ndarray of shape (slots,), int32
        Entries of each lane in its strip; what follows them has no meaning.
    """

    sampled: NDArray[np.float32]
    row: NDArray[np.uint32]
    direct: NDArray[np.float32]
    weight: NDArray[np.float32]
    sampled_light: NDArray[np.uint32]
    direct_light: NDArray[np.uint32]
    strips: NDArray[np.int64]
    goes_on: NDArray[np.int32]
    used: NDArray[np.int32]

    @property
    def nbytes(self) -> int:
        """Size in memory, room for entries that were not needed included."""
        return sum(values.nbytes for values in self)

    def compact(self, heights: NDArray[np.int64] | None = None) -> Log:
        """Copy without the room between strips; of each strip only the first `heights` entries, or all of them."""
        if heights is None:
            heights = self.strips[:, 1] - self.strips[:, 0]
        ends = np.cumsum(heights)
        strips = np.stack([ends - heights, ends], axis=1)
        kept = np.repeat(self.strips[:, 0] - strips[:, 0], heights) + np.arange(ends[-1])
        entries = {
            name: values[..., kept, :]
            for name, values in self._asdict().items()
            if name in ENTRIES and len(values)
        }
        used = np.minimum(self.used, np.repeat(heights, BLOCK)).astype(self.used.dtype)
        return self._replace(strips=strips, used=used, **entries)


ENTRIES: dict[str, type[np.float32 | np.uint32]] = {
    "sampled": np.float32,
    "row": np.uint32,
    "direct": np.float32,
    "weight": np.float32,
    "sampled_light": np.uint32,
    "direct_light": np.uint32,
}
"""The fields of `Log` that have a value for each entry, and their types."""


OF_TERMS = ("row", "direct", "weight")
"""Those of them that have one for each term of a vertex."""


@dataclass(frozen=True)
class Chunk:
    """The light paths of a run of pixels.

    Attributes
    ----------
    first_pixel, pixels : int
        Range of pixels, numbered row by row from the top left.
    spp : int
        Samples per pixel, divided evenly among `lanes_per_pixel(spp)` lanes.
    log : Log
        Lane l of the p-th pixel of the chunk is slot p x lanes_per_pixel(spp) + l.
    """

    first_pixel: int
    pixels: int
    spp: int
    log: Log

    def compact(self, heights: NDArray[np.int64] | None = None) -> Chunk:
        """Copy without unused room, see `Log.compact`."""
        return replace(self, log=self.log.compact(heights))


def lanes_per_pixel(spp: int) -> int:
    """Number of lanes that share the samples of a pixel.

    Lane l of n traces samples l x spp // n to (l + 1) x spp // n.

    Examples
    --------
    >>> lanes_per_pixel(16), lanes_per_pixel(1000)
    (1, 16)
    """
    return -(-spp // _LONGEST_LANE)


def flat(log: Log) -> Log:
    """See the entries of a log as one line; in the memory of a GPU they are already."""
    lines = {name: getattr(log, name) for name in ENTRIES}
    return log._replace(**{name: v if v.ndim == 1 else v.reshape(-1) for name, v in lines.items()})
