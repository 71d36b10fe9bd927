"""The compiled sweep: one pixel after another, one path after another, from its last vertex to its first.

What makes it fast was measured: one path's spectra are contiguous and padded, so that loops run along wavelength
without remainder; the code is compiled for the number of bands; F and G are zero until the path meets a
fluorescent surface; the last vertex is lit by lamps only, so what luminesces there comes from a table; the camera
vertex is done once for each pixel and material row; results are written where they belong.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from fluorspar.image import components as components_module
from fluorspar.paths import log as log_module
from fluorspar.paths.log import BLOCK
from fluorspar.paths.sweeping import batches as batches_module
from fluorspar.paths.sweeping import camera_vertex as camera_vertex_module
from fluorspar.paths.sweeping import luminesce as luminesce_module
from fluorspar.paths.sweeping import propagate as propagate_module
from fluorspar.paths.sweeping import spectral_tables as spectral_tables_module
from fluorspar.paths.sweeping.batches import COMPONENT_COUNT, TOTAL, Tally, count, new_tally, store
from fluorspar.paths.sweeping.camera_vertex import (
    Pixel,
    add_source,
    close_batch,
    close_pixel,
    collect,
    new_pixel,
)
from fluorspar.paths.sweeping.kept_code import FAST, fingerprint, keep_code
from fluorspar.paths.sweeping.propagate import Path, new_path, propagate, read_path

__all__ = ["Scratch", "compiled", "new_scratch", "sweep_pixel", "together"]

_VERTICES = 32


class Scratch(NamedTuple):
    """What a sweep works in: it allocates nothing itself, and so has no references to count.

    `y` (7, B) and `total` (B,) are the light towards the camera of a batch, by component and in all.
    """

    path: Path
    pixel: Pixel
    tally: Tally
    y: NDArray[np.float32]
    total: NDArray[np.float32]


def new_scratch(rows: int, width: int, room: int) -> Scratch:
    """Scratch for pixels that see up to `room` of the material rows, and paths of up to 32 times as many vertices."""
    return Scratch(
        new_path(_VERTICES * room, width),
        new_pixel(rows, room, width),
        new_tally(width),
        np.zeros((COMPONENT_COUNT, width), dtype=np.float32),
        np.zeros(width, dtype=np.float32),
    )


@numba.njit(inline="always")
def together() -> None:
    """Where several threads sweep one pixel, wait for the others: they keep one record of the path and of rows."""


@numba.njit(inline="always")
def sweep_pixel(
    p: int,
    spp: int,
    parts: int,
    batches: int,
    log: Any,
    tables: Any,
    scratch: Any,
    one_light: bool,
    component_errors: bool,
    width: int,
) -> int:
    """Sweep all samples of a pixel into `y` and `tally` of the scratch; return how many show a lamp, -1: no room."""
    path, pixel, tally, y, total = scratch
    seen = 0
    part = 0
    lamps = 0
    slot = np.int64(p * parts)
    entry = np.int64(0)
    next_part = 0
    for b in range(batches):
        begin = b * spp // batches
        end = (b + 1) * spp // batches
        for s in range(begin, end):
            if s == next_part:
                slot = np.int64(p * parts + part)
                entry = np.int64(log.strips[slot // BLOCK, 0])
                part += 1
                next_part = part * spp // parts
            together()
            n, source, light, slot, entry = read_path(log, slot, entry, path, one_light)
            together()
            if n < 0:
                return -1
            if source > 0:
                lamps += 1
                add_source(pixel, source, light, tables.lights, width)
            if n > 0:
                luminesced = propagate(path, n, tables, one_light, width)
                row = path.vertex[0, 0]
                place = np.int64(pixel.place[row])
                together()
                if place < 0:
                    if seen == len(pixel.row):
                        return -1
                    place = np.int64(seen)
                    pixel.place[row] = seen
                    pixel.row[seen] = row
                    seen += 1
                collect(pixel, place, path, n, luminesced, tables.lights, one_light, width)
        close_batch(pixel, seen, y, total, tables, one_light, component_errors, width)
        count(tally, TOTAL, total, end - begin, b, batches, width)
        if component_errors:
            for c in range(COMPONENT_COUNT):
                count(tally, c, y[c], end - begin, b, batches, width)
    together()
    close_pixel(pixel, seen, y, tables, width)
    return lamps


@cache
def compiled(width: int, one_light: bool) -> Callable[..., int]:
    """Compile the sweep for a padded number of bands; compiled code is kept on disk.

    The function returned takes a range of pixels of a chunk, its samples, lanes per pixel and batches, the log (see
    `Log`, its entries flat), the `SpectralTables`, and the arrays (7, P, N), (P, N) and (7, P, N) or (7, 0, N) in which
    pixel 0 of the chunk is pixel `at`. It returns the pixel that it did not do for lack of room in
    the `Scratch`, `stop` if it did all.
    """
    version = fingerprint(
        components_module,
        log_module,
        batches_module,
        camera_vertex_module,
        luminesce_module,
        propagate_module,
        spectral_tables_module,
    )

    # Without Numba's counting of references: it counts in the innermost loops, in memory that all threads share.
    @numba.njit(nogil=True, fastmath=FAST, _nrt=False)
    def kernel(first, stop, spp, parts, batches, log, tables, radiance, error, errors, halves, at, scratch):  # type: ignore[no-untyped-def]
        _ = version  # a captured value is part of the key under which Numba keeps compiled code
        component_errors = errors.shape[1] > 0
        for p in range(first, stop):
            lamps = sweep_pixel(
                p, spp, parts, batches, log, tables, scratch, one_light, component_errors, width
            )
            if lamps < 0:
                return p
            store(
                at + p,
                scratch.y,
                scratch.tally,
                spp,
                batches,
                tables.bands,
                component_errors,
                radiance,
                error,
                errors,
                halves,
                p,
                lamps,
            )
        return stop

    keep_code(kernel, f"the sweep of {width} bands")
    return kernel  # type: ignore[no-any-return]
