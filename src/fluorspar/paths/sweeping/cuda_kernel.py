"""The compiled sweep on a GPU: a warp for each pixel, K bands for each of its threads; see `warp.py`."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import cuda

from fluorspar.paths.log import BLOCK, END
from fluorspar.paths.sweeping.batches import COMPONENT_COUNT, Tally
from fluorspar.paths.sweeping.camera_vertex import Pixel
from fluorspar.paths.sweeping.kept_code import fingerprint_of_folder, keep_gpu_code
from fluorspar.paths.sweeping.kernel import Scratch, sweep_pixel
from fluorspar.paths.sweeping.propagate import Path
from fluorspar.paths.sweeping.warp import (
    ALL,
    INLINED,
    LIMITS,
    WARP,
    for_gpu,
    lane_tables,
    store_of_lane,
    together,
    warp_luminesce,
)

__all__ = ["Output", "compiled_for_warps", "room_for_warps"]

_VERTICES = 32
_TALLIED = COMPONENT_COUNT + 1
_FLOAT = numba.float32


@cuda.jit(**INLINED)
def _ahead(log: Any, slot: Any, entry: Any, by: int) -> Any:
    """Slot and entry that is `by` entries on in what a lane has recorded, slot -1 where that is beyond its end."""
    entry += by
    while slot >= 0 and entry >= log.strips[slot // BLOCK, 1]:
        entry -= log.strips[slot // BLOCK, 1]
        slot = np.int64(log.goes_on[slot])
        if slot >= 0:
            entry += log.strips[slot // BLOCK, 0]
    return slot, entry


@cuda.jit(**INLINED)
def _read_path(log: Any, slot: Any, entry: Any, path: Any, one_light: bool) -> Any:
    """Read a path as `read_path` does, 32 entries at a time, one for each thread."""
    lane = cuda.threadIdx.x
    n = 0
    source = numba.float32(0)
    source_light = np.int64(0)
    while True:
        own_slot, own_entry = _ahead(log, slot, entry, lane)
        i = np.int64(0)
        sampled = direct = f = numba.float32(0)
        row = np.uint32(END)
        ends = False
        light = np.int64(0)
        if own_slot >= 0:
            i = own_entry * BLOCK + own_slot % BLOCK
            # All at once, needed or not: to wait for one after the other takes longer.
            sampled, row, direct, f = log.sampled[i], log.row[i], log.direct[i], log.weight[i]
            ends = row == END or f == 0
            if not one_light:
                light = np.int64(log.sampled_light[i])
        vertex = row != END
        ended = cuda.ballot_sync(ALL, ends)
        entries = cuda.ffs(ended) if ended != 0 else WARP
        if n + entries > len(path.vertex):
            n = -1
            break
        if n == 0:
            source = cuda.shfl_sync(ALL, sampled, 0)
            source_light = cuda.shfl_sync(ALL, light, 0)
        elif lane == 0:
            path.weight[n - 1, 1] = path.weight[n - 1, 2] * sampled
            path.vertex[n - 1, 2] = light
        # What the next ray hits belongs to this vertex.
        hit = cuda.shfl_down_sync(ALL, sampled, 1)
        hit_light = cuda.shfl_down_sync(ALL, light, 1)
        if vertex and lane < entries:
            followed = lane + 1 < entries
            path.vertex[n + lane, 0] = row
            path.weight[n + lane, 0] = direct
            path.weight[n + lane, 1] = f * hit if followed else numba.float32(0)
            path.weight[n + lane, 2] = f
            if not one_light:
                path.vertex[n + lane, 1] = log.direct_light[i]
                path.vertex[n + lane, 2] = hit_light if followed else 0
        last = cuda.shfl_sync(ALL, np.int32(vertex), entries - 1)
        slot = cuda.shfl_sync(ALL, own_slot, entries - 1)
        entry = cuda.shfl_sync(ALL, own_entry, entries - 1) + 1
        n += entries
        if ended != 0:
            if last == 0:
                n -= 1
            break
        cuda.syncwarp()
    return n, source, source_light, slot, entry


_sweep_pixel = for_gpu(sweep_pixel, luminesce=warp_luminesce, together=together, read_path=_read_path)


class Output(NamedTuple):
    """Where results go, see `store`.

    `radiance` (7, P, N), `error` (P, N), `errors` (7, P, N) and `halves` (8, P, N), or (7, 0, N) and (1, P, N) if
    errors of the components are not asked for.
    """

    radiance: Any
    error: Any
    errors: Any
    halves: Any


class Room(NamedTuple):
    """What warps work in beside registers, one row of each array for each warp; see `Path` and `Pixel`.

    What the threads of a warp agree about is kept once; the rest of them keep apart.
    """

    vertex: Any
    weight: Any
    place: Any
    row: Any
    batch: Any
    sums: Any
    direct: Any
    in_batch: Any


def room_for_warps(rows: int, each: int, room: int) -> Room:
    """Shapes and types for one warp: up to `room` material rows a pixel, paths of up to 32 times as many vertices."""
    return Room(
        ((_VERTICES * room, 3), "u4"),
        ((_VERTICES * room, 3), "f4"),
        ((rows,), "i4"),
        ((room,), "u4"),
        ((room, 4, each, WARP), "f4"),
        ((room, 4, each, WARP), "f4"),
        ((room, WARP), "f4"),
        ((room, WARP), "?"),
    )


@cuda.jit(**INLINED)
def _clear(room: Any, warp: int, lane: int) -> None:
    """Empty what a sweep expects to be empty."""
    for row in range(lane, room.place.shape[1], WARP):
        room.place[warp, row] = -1
    for at in range(room.row.shape[1]):
        room.direct[warp, at, lane] = 0
        room.in_batch[warp, at, lane] = False
        for q in range(4):
            for i in range(room.batch.shape[3]):
                room.batch[warp, at, q, i, lane] = 0
                room.sums[warp, at, q, i, lane] = 0


@cache
def compiled_for_warps(each: int, one_light: bool, component_errors: bool) -> Callable[..., None]:
    """Compile the sweep for a number of bands of each thread; compiled code is kept on disk.

    The kernel takes a range of pixels of a chunk, its samples, lanes per pixel and batches, the log (see `Log`, its
    entries flat), tables of `tables_for_warps`, a `Room`, an `Output` for that range, and an array of one number, which
    becomes 1 if the room was not enough. A block is of 32 x n threads.
    """
    version = fingerprint_of_folder()

    @cuda.jit(**LIMITS)
    def kernel(first, stop, spp, parts, batches, log, tables, room, out, short):  # type: ignore[no-untyped-def]
        _ = version  # a captured value is part of the key under which Numba keeps compiled code
        lane = cuda.threadIdx.x
        warp = cuda.blockIdx.x * cuda.blockDim.y + cuda.threadIdx.y
        mine = lane_tables(tables, lane)
        source = cuda.local.array(each, _FLOAT)
        batch_source = cuda.local.array(each, _FLOAT)
        for i in range(each):
            source[i] = 0
            batch_source[i] = 0
        path = Path(
            room.vertex[warp],
            room.weight[warp],
            cuda.local.array(each, _FLOAT),
            cuda.local.array(each, _FLOAT),
            cuda.local.array(each, _FLOAT),
            cuda.local.array(each, _FLOAT),
        )
        pixel = Pixel(
            room.place[warp],
            room.row[warp],
            room.batch[warp, :, :, :, lane],
            room.direct[warp, :, lane],
            room.in_batch[warp, :, lane],
            room.sums[warp, :, :, :, lane],
            source,
            batch_source,
            cuda.local.array(each, _FLOAT),
            cuda.local.array(each, _FLOAT),
        )
        tally = Tally(
            cuda.local.array((_TALLIED, each), _FLOAT),
            cuda.local.array((_TALLIED, each), _FLOAT),
            cuda.local.array((_TALLIED, each), _FLOAT),
            cuda.local.array((_TALLIED, each), _FLOAT),
        )
        y = cuda.local.array((COMPONENT_COUNT, each), _FLOAT)
        scratch = Scratch(path, pixel, tally, y, cuda.local.array(each, _FLOAT))
        _clear(room, warp, lane)
        for p in range(first + warp, stop, cuda.gridDim.x * cuda.blockDim.y):
            lamps = _sweep_pixel(
                p, spp, parts, batches, log, mine, scratch, one_light, component_errors, each
            )
            if lamps < 0:
                short[0] = 1
                break
            store_of_lane(p - first, y, tally, spp, batches, mine, component_errors, out, each, lamps)

    keep_gpu_code(kernel, f"the sweep on a GPU of {each} x {WARP} bands")
    return kernel  # type: ignore[no-any-return]
