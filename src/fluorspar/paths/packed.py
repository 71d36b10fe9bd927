"""Light paths packed for keeping: a third of the bytes of a log, unpacked block by block while they are swept.

Most of what a log holds is 0, 1, or room: light is found by half of the entries, hit by few, and the weight of a
continuation is 1 until roulette begins. So an entry is the row of its surface, a byte that says what else there is,
and those numbers that are neither 0 nor 1, one after another.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.log import BLOCK, END, ENTRIES, OF_TERMS, Chunk, Log, lanes_per_pixel
from fluorspar.paths.packing import kernels

__all__ = ["ARRAYS", "PackedChunk", "pack", "unpack"]

_TASKS = 16  # parts that the blocks of a chunk are divided into

ARRAYS = ("rows", "says", "numbers", "lights", "strips", "goes_on", "used", "starts")
"""The arrays of a `PackedChunk`."""


@dataclass(frozen=True, eq=False)
class PackedChunk:
    """The light paths of a run of pixels, packed.

    Attributes
    ----------
    first_pixel, pixels, spp : int
        As in `Chunk`.
    rows : ndarray of shape (terms, entries, BLOCK), uint8, uint16 or uint32
        Row of the surface; the largest number of the type for `END`.
    says : ndarray of shape (terms, entries, BLOCK), uint8
        What is there of a term, see `packing.py`.
    numbers : ndarray of shape (n,), float32
        Those numbers, in the order of blocks, entries, lanes: `sampled`, then `direct` and `weight` of each term.
    lights : ndarray of shape (m,), uint32
        Rows of the lights of each `sampled` and `direct` there is, in the same order, one for all terms; none where the
        scene has one light.
    strips, goes_on, used : ndarray
        As in `Log`.
    starts : ndarray of shape (blocks, 2), int64
        Where `numbers` and `lights` of each block begin.
    """

    first_pixel: int
    pixels: int
    spp: int
    rows: NDArray[Any]
    says: NDArray[np.uint8]
    numbers: NDArray[np.float32]
    lights: NDArray[np.uint32]
    strips: NDArray[np.int64]
    goes_on: NDArray[np.int32]
    used: NDArray[np.int32]
    starts: NDArray[np.int64]

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return sum(getattr(self, name).nbytes for name in ARRAYS)

    def fault(self, rows: int, lights: int) -> str:
        """What is wrong with paths that come from a file, for tables of so many rows and lights; "" if nothing.

        Unpacking and sweeping follow the numbers blindly.
        """
        terms, entries, lanes = self.rows.shape if self.rows.ndim == 3 else (0, 0, 0)
        blocks = len(self.strips)
        if not terms or lanes != BLOCK or self.says.shape != self.rows.shape:
            return "rows of another shape"
        if self.strips.shape != (blocks, 2) or self.starts.shape != (blocks, 2):
            return "blocks of another number"
        if not len(self.used) == len(self.goes_on) == blocks * BLOCK:
            return "lanes of another number"
        heights = self.strips[:, 1] - self.strips[:, 0]
        begin = np.cumsum(heights) - heights
        if (heights < 0).any() or entries != heights.sum() or (self.strips[:, 0] != begin).any():
            return "strips that do not fit the entries"
        used = self.used.reshape(blocks, BLOCK)
        if (
            (used < 0).any()
            or (used > heights[:, np.newaxis]).any()
            or (self.goes_on >= blocks * BLOCK).any()
        ):
            return "lanes that leave their strips"
        counts = np.empty((blocks, 3), np.int64)
        check = kernels()["check"]
        with ThreadPoolExecutor() as pool:
            _in_parts(pool, blocks, lambda *part: check(*part, self.rows, self.says, self.strips, counts))
        if counts[:, 2].max(initial=0) >= rows:
            return "rows that are not in the table"
        if int(self.lights.max(initial=0)) >= lights:
            return "lights that are not in the table"
        for number, given in enumerate((self.numbers, self.lights)):
            if number == 1 and not len(given):
                continue  # a scene of one light
            after = np.cumsum(counts[:, number])
            if after[-1] != len(given) or (self.starts[:, number] != after - counts[:, number]).any():
                return "numbers too few or too many"
        return ""


def pack(chunk: Chunk, rows: int, pool: Executor) -> PackedChunk:
    """Pack a chunk whose rows are below `rows`. Unpacked it is what it was, bit for bit, to who sweeps it.

    The same paths make the same arrays, however long the strips were in which they were traced.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from fluorspar.job import RenderJob
    >>> from fluorspar.paths.chunks import trace_chunks
    >>> chunk = next(trace_chunks(RenderJob.of("cornell-box", size=(8, 8), spp=4)))
    >>> with ThreadPoolExecutor() as pool:
    ...     packed = pack(chunk, 16, pool)
    >>> packed.nbytes < chunk.log.compact().nbytes / 2
    True
    """
    log = _joined(chunk)
    heights = log.strips[:, 1] - log.strips[:, 0]
    ends = np.cumsum(heights)
    strips = np.stack([ends - heights, ends], axis=1)
    kind = next(kind for kind in (np.uint8, np.uint16, np.uint32) if rows <= np.iinfo(kind).max)
    shape = log.row.size // log.sampled.size, int(ends[-1]), BLOCK
    small, says = np.empty(shape, kind), np.empty(shape, np.uint8)
    counts = np.empty((len(strips), 2), np.int64)
    flat, run = _flat(log), kernels()
    _in_parts(pool, len(strips), lambda *part: run["count"](*part, flat, strips, small, says, counts, END))
    starts = np.cumsum(counts, axis=0) - counts
    several = bool(len(log.direct_light))
    numbers = np.empty(counts[:, 0].sum(), np.float32)
    lights = np.empty(counts[:, 1].sum() if several else 0, np.uint32)
    arrays = says, starts, numbers, lights, several
    _in_parts(pool, len(strips), lambda *part: run["fill"](*part, flat, strips, *arrays))
    pixels = chunk.first_pixel, chunk.pixels, chunk.spp
    return PackedChunk(*pixels, small, says, numbers, lights, strips, log.goes_on, log.used, starts)


def unpack(packed: PackedChunk, row_of: NDArray[np.uint32], beyond: int, pool: Executor) -> Chunk:
    """Unpack a chunk, with other rows in place of those that were traced.

    Parameters
    ----------
    packed : PackedChunk
    row_of : ndarray of shape (n,), uint32
        What becomes of the rows below n.
    beyond : int
        What is added to all other rows.
    pool : Executor
        Threads to unpack with.
    """
    terms, entries, _ = packed.rows.shape
    several = bool(len(packed.lights))
    arrays: dict[str, Any] = {}
    for name, kind in ENTRIES.items():
        shape = (terms, entries, BLOCK) if terms > 1 and name in OF_TERMS else (entries, BLOCK)
        arrays[name] = np.empty((0, BLOCK) if name.endswith("light") and not several else shape, kind)
    log = Log(**arrays, strips=packed.strips, goes_on=packed.goes_on, used=packed.used)
    flat, run = _flat(log), kernels()
    given = packed.rows, packed.says, packed.strips, packed.starts, packed.numbers, packed.lights, several
    _in_parts(pool, len(packed.strips), lambda *part: run["unpack"](*part, *given, row_of, beyond, flat, END))
    return Chunk(packed.first_pixel, packed.pixels, packed.spp, log)


def _joined(chunk: Chunk) -> Log:
    """Copy the entries of lanes that go on elsewhere behind one another, into one strip."""
    log = chunk.log
    slots = -(-chunk.pixels * lanes_per_pixel(chunk.spp) // BLOCK) * BLOCK
    if len(log.used) == slots:
        return log
    block, column = np.divmod(np.arange(slots), BLOCK)
    pieces, total = [], np.zeros(slots, np.int64)  # where lanes have them, and how many entries so far
    going: NDArray[Any] = np.arange(slots)
    at: NDArray[Any] = np.arange(slots)
    while len(going):
        pieces.append((going, at, total[going]))
        total[going] += log.used[at]
        at = log.goes_on[at]
        going, at = going[at >= 0], at[at >= 0]
    heights = total.reshape(-1, BLOCK).max(axis=1)
    ends = np.cumsum(heights)
    strips = np.stack([ends - heights, ends], axis=1)
    source = np.zeros((int(ends[-1]), BLOCK), np.int64)
    for going, at, before in pieces:
        count = log.used[at]
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        to = np.repeat(strips[block[going], 0] + before, count) + within
        entry = np.repeat(log.strips[at // BLOCK, 0], count) + within
        source[to, np.repeat(column[going], count)] = entry * BLOCK + np.repeat(at % BLOCK, count)
    entries = {
        name: values.reshape(*values.shape[:-2], -1)[..., source]
        for name, values in log._asdict().items()
        if name in ENTRIES and len(values)
    }
    goes_on = np.full(slots, -1, np.int32)
    return log._replace(**entries, strips=strips, goes_on=goes_on, used=total.astype(np.int32))


def _flat(log: Log) -> Log:
    return log._replace(**{name: getattr(log, name).reshape(-1) for name in ENTRIES})


def _in_parts(pool: Executor, blocks: int, work: Callable[..., object]) -> None:
    """Do something with all blocks, in parts, at once."""
    edges = np.linspace(0, blocks, _TASKS + 1).astype(int).tolist()
    for _ in pool.map(work, edges[:-1], edges[1:]):
        pass
