"""The first samples of each lane of a log, cut out, so that a quick look does not unpack all of them every time."""

from __future__ import annotations

import numpy as np

from fluorspar.paths.log import BLOCK, Chunk, lanes_per_pixel

__all__ = ["first_samples"]


def first_samples(chunk: Chunk, samples: int) -> Chunk:
    """Copy a chunk without the entries that nobody reads who sweeps so many samples of each pixel.

    Parameters
    ----------
    chunk : Chunk
        Unpacked: weights are 0 wherever a path ends, and in room that is not used.
    samples : int
        At least one a lane.

    Examples
    --------
    >>> import fluorspar
    >>> paths = fluorspar.trace("cornell-box", size=(8, 8), spp=16)
    >>> (whole,) = paths._unpacked(paths.job)
    >>> first_samples(whole, 2).log.nbytes < 0.3 * whole.log.nbytes
    True
    """
    log = chunk.log
    heights = log.strips[:, 1] - log.strips[:, 0]
    block = np.repeat(np.arange(len(heights)), heights)
    ended = log.weight == 0 if log.weight.ndim == 2 else (log.weight == 0).all(axis=0)
    paths = np.cumsum(ended, axis=0, dtype=np.int32)  # ended so far, in all blocks
    before = np.concatenate([np.zeros((1, BLOCK), np.int32), paths])[log.strips[:, 0]]
    wanted = -(-samples // lanes_per_pixel(chunk.spp))
    unfinished = (paths - before[block] < wanted).any(axis=1)
    # where lanes go on elsewhere, these are all entries of the strip
    kept = np.minimum(np.bincount(block, unfinished, len(heights)).astype(np.int64) + 1, heights)
    return chunk.compact(kept)
