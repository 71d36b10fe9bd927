"""The compiled sweep of paths among general surfaces on a GPU; see `cuda_kernel.py` and `lobe_kernel.py`."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
from numba import cuda

from fluorspar.paths.sweeping.batches import COMPONENT_COUNT, Tally
from fluorspar.paths.sweeping.kept_code import fingerprint_of_folder, keep_gpu_code
from fluorspar.paths.sweeping.lobe_kernel import LobePath, LobeScratch, LobeTables, sweep_lobe_pixel
from fluorspar.paths.sweeping.warp import (
    INLINED,
    LIMITS,
    WARP,
    for_gpu,
    lane_tables,
    lay_out,
    store_of_lane,
    tables_for_warps,
    together,
    warp_luminesce,
)

__all__ = ["compiled_for_warps_and_lobes", "lobe_tables_for_warps", "room_for_warps_and_lobes"]

_VERTICES = 32
_TALLIED, _CARRIED = COMPONENT_COUNT + 1, COMPONENT_COUNT + 2
_FLOAT = numba.float32


@cuda.jit(**INLINED)
def _vertex(path: Any, tables: Any, k: int, j: int) -> Any:
    """A, h L_b and B L_a of band j at vertex k."""
    A = numba.float32(0)
    B = numba.float32(0)
    first = path.first[k]
    for term in range(first, path.first[k + 1]):
        row = path.row[term]
        S = tables.spectra.reflectance[row, j] if row < tables.rows else path.own[term - first, j]
        A += path.sent[term] * S
        B += path.found[term] * S
    L = tables.spectra.lights
    a, b = path.lights[k, 0], path.lights[k, 1]
    found = L[a, j] if a < len(L) else path.shining[0, j]
    hit = L[b, j] if b < len(L) else path.shining[1, j]
    return A, path.hit[k] * hit, B * found


@cuda.jit(**INLINED)
def _reflect(path: Any, tables: Any, k: int, width: int) -> None:
    """See `reflect` of `registers.py`."""
    for j in range(width):
        A, hit, found = _vertex(path, tables, k, j)
        path.A[j] = A
        path.R[j] = A * (hit + path.R[j]) + found


@cuda.jit(**INLINED)
def _collect(path: Any, tables: Any, k: int, width: int, y: Any) -> None:
    """See `collect` of `registers.py`."""
    for j in range(width):
        A, hit, found = _vertex(path, tables, k, j)
        path.A[j] = A
        y[1, j] += A * hit + found
        y[3, j] += A * path.R[j]


@cuda.jit(**INLINED)
def _colour(out: Any, tables: Any, to: int, width: int, c0: Any, c1: Any, c2: Any) -> None:
    """See `colour` of `registers.py`."""
    one, half = numba.float32(1), numba.float32(0.5)
    for j in range(width):
        w = tables.wavelengths[j]
        x = (c0 * w + c1) * w + c2
        out[to, j] = half * x / math.sqrt(one + x * x) + half


_sweep_pixel = for_gpu(
    sweep_lobe_pixel,
    luminesce=warp_luminesce,
    together=together,
    reflect=_reflect,
    collect=_collect,
    colour=_colour,
)


class LobeRoom(NamedTuple):
    """What warps work in beside registers, one row of each array for each warp; see `LobePath`."""

    row: Any
    found: Any
    sent: Any
    first: Any
    hit: Any
    lights: Any
    own: Any


def room_for_warps_and_lobes(terms: int, each: int, room: int) -> LobeRoom:
    """Shapes and types for one warp: paths of up to 32 times `room` vertices."""
    vertices = _VERTICES * room
    return LobeRoom(
        ((vertices * terms,), "u4"),
        ((vertices * terms,), "f4"),
        ((vertices * terms,), "f4"),
        ((vertices + 1,), "i4"),
        ((vertices,), "f4"),
        ((vertices, 2), "u4"),
        ((terms, each, WARP), "f4"),
    )


def lobe_tables_for_warps(tables: LobeTables) -> LobeTables:
    """Lay the spectra out for warps."""
    spectra = tables_for_warps(tables.spectra)
    return tables._replace(spectra=spectra, wavelengths=lay_out(tables.wavelengths, tables.spectra.bands))


@cache
def compiled_for_warps_and_lobes(each: int, component_errors: bool) -> Callable[..., None]:
    """Compile the sweep for a number of bands of each thread; see `compiled_for_warps`."""
    version = fingerprint_of_folder()

    @cuda.jit(**LIMITS)
    def kernel(first, stop, spp, parts, batches, log, tables, room, out, short):  # type: ignore[no-untyped-def]
        _ = version
        lane = cuda.threadIdx.x
        warp = cuda.blockIdx.x * cuda.blockDim.y + cuda.threadIdx.y
        mine = LobeTables(
            lane_tables(tables.spectra, lane),
            tables.rows,
            tables.coated,
            tables.components,
            tables.colours,
            tables.light_colours,
            tables.wavelengths[:, lane],
        )
        path = LobePath(
            room.row[warp],
            room.found[warp],
            room.sent[warp],
            room.first[warp],
            room.hit[warp],
            room.lights[warp],
            room.own[warp, :, :, lane],
            cuda.local.array((2, each), _FLOAT),
            cuda.local.array(each, _FLOAT),
            cuda.local.array(each, _FLOAT),
            cuda.local.array((4, each), _FLOAT),
        )
        tally = Tally(
            cuda.local.array((_TALLIED, each), _FLOAT),
            cuda.local.array((_TALLIED, each), _FLOAT),
            cuda.local.array((_TALLIED, each), _FLOAT),
            cuda.local.array((_TALLIED, each), _FLOAT),
        )
        y = cuda.local.array((_CARRIED, each), _FLOAT)
        sums = cuda.local.array((COMPONENT_COUNT, each), _FLOAT)
        scratch = LobeScratch(path, tally, y, sums, cuda.local.array(each, _FLOAT))
        # What is constant is not written to again: components that do not occur, lights of a scene that has one.
        for c in range(COMPONENT_COUNT):
            for i in range(each):
                sums[c, i] = 0
                for values in tally:
                    values[c, i] = 0
        if lane == 0:
            path.first[0] = 0
            for k in range(len(path.lights)):
                path.lights[k, 0] = 0
                path.lights[k, 1] = 0
        together()
        for p in range(first + warp, stop, cuda.gridDim.x * cuda.blockDim.y):
            lamps = _sweep_pixel(p, spp, parts, batches, log, mine, scratch, component_errors, each)
            if lamps < 0:
                short[0] = 1
                break
            store_of_lane(
                p - first, sums, tally, spp, batches, mine.spectra, component_errors, out, each, lamps
            )

    keep_gpu_code(kernel, f"the sweep on a GPU of {each} x {WARP} bands and lobes")
    return kernel  # type: ignore[no-any-return]
