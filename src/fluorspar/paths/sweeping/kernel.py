"""The compiled sweep: one pixel after another, one path after another, from its last vertex to its first.

What makes it fast was measured: one path's spectra are contiguous and padded, so that loops run along wavelength
without remainder; the code is compiled for the number of bands; F and G are zero until the path meets a
fluorescent surface; the last vertex is lit by lamps only, so what luminesces there comes from a table; a path's records
are read once into a small buffer; the camera vertex is done once for each pixel and material.
"""

from __future__ import annotations

import inspect
import zlib
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths import light_paths
from fluorspar.paths.light_paths import SLOTS, TILE
from fluorspar.paths.sweeping import luminesce as luminesce_module
from fluorspar.paths.sweeping.luminesce import luminesce, luminesce_both

__all__ = ["COMPONENT_COUNT", "Records", "compiled"]

COMPONENT_COUNT = 7
_FLUSH = 256  # samples that are summed in single precision
_TOTAL = COMPONENT_COUNT  # index behind the components, for the tally of the total

# Sums may be reordered for SIMD; NaN and infinity keep their meaning.
_FAST = {"reassoc", "contract", "nsz", "arcp"}


class Records(NamedTuple):
    """Flat records of one segment, or of all later ones together; see `Segment`."""

    row: NDArray[np.uint32]
    direct: NDArray[np.float32]
    direct_light: NDArray[np.uint32]
    sampled: NDArray[np.float32]
    sampled_light: NDArray[np.uint32]
    survival: NDArray[np.float32]
    length: NDArray[np.uint8]
    child: NDArray[Any]


class _Path(NamedTuple):
    """One path: its records, and the light arriving at the vertex it has been swept to.

    `vertex` rows: material row, light rows a and b. `weight` rows: w, f h, f. R, F, G have luminesced never, once,
    more often; the others are scratch.
    """

    vertex: Any
    weight: Any
    R: Any
    F: Any
    G: Any
    U: Any
    V: Any
    W: Any
    scratch: Any
    scratch2: Any


class _Pixel(NamedTuple):
    """Sums at the camera vertex.

    `sums` (rows, 4, B): E_D, R_1 - E_D, F_1, G_1 of the samples since the last flush; `exact`: of those before it, in
    double precision, because single precision loses small terms in long sums. `before`: `sums` at the end of the
    last batch.
    `batch` (rows, B): all light of the batch; with one light its direct part is a number, `direct` (rows,), until
    the batch ends. `source`: light seen directly.
    """

    sums: Any
    exact: Any
    before: Any
    batch: Any
    direct: Any
    in_batch: Any
    in_pixel: Any
    source: Any
    batch_source: Any


class _Tally(NamedTuple):
    """Batch means of the components and, last, of the total: weighted sums and squares of their distance to `pivot`.

    Counted from the mean of the first batch, because in single precision the difference of two large sums would be
    noise.
    """

    pivot: Any
    sums: Any
    squares: Any


@cache
def compiled(width: int, one_light: bool, component_errors: bool) -> Callable[..., None]:
    """Compile the sweep for a padded number of bands; compiled code is kept on disk."""
    version = _version()

    @numba.njit(nogil=True, fastmath=_FAST, cache=True)
    def kernel(start, stop, spp, batches, rr_depth, longest, records, tail, tables, radiance, error, errors):  # type: ignore[no-untyped-def]
        _ = version  # a captured value is part of the key under which Numba keeps compiled code
        rows = tables.reflectance.shape[0]
        path = _new_path(longest, width)
        pixel = _new_pixel(rows, width)
        tally = _new_tally(width)
        y = np.zeros((COMPONENT_COUNT, width), dtype=np.float32)
        total = np.zeros(width, dtype=np.float32)
        for p in range(start, stop):
            flushed = 0
            for b in range(batches):
                begin = b * spp // batches
                end = (b + 1) * spp // batches
                for s in range(begin, end):
                    i = p * spp + s
                    _add_source(pixel.batch_source, records, i, tables.lights, one_light, width)
                    n, child = _fetch(records, i, 0, rr_depth, one_light, path.vertex, path.weight)
                    while child >= 0:
                        n, child = _fetch(tail, child, n, rr_depth, one_light, path.vertex, path.weight)
                    if n > 0:
                        luminesced = _propagate(path, n, tables, one_light, width)
                        _collect(pixel, path, n, luminesced, tables.lights, one_light, width)
                _close_batch(pixel, path, y, total, tables, one_light, component_errors, width)
                _count(tally, _TOTAL, total, end - begin, b, width)
                if component_errors:
                    for c in range(COMPONENT_COUNT):
                        _count(tally, c, y[c], end - begin, b, width)
                if end - flushed >= _FLUSH:
                    _flush(pixel, width)
                    flushed = end
            _close_pixel(pixel, path, y, tables, flushed > 0, width)
            _store(p, y, tally, spp, batches, component_errors, radiance, error, errors)

    return kernel  # type: ignore[no-any-return]


def _version() -> int:
    """Fingerprint of the other files whose code is compiled in: Numba looks at the date of this one only."""
    sources = (inspect.getsource(module) for module in (luminesce_module, light_paths))
    return zlib.crc32("".join(sources).encode())


@numba.njit(inline="always")
def _new_path(longest: int, width: int) -> Any:
    return _Path(
        np.zeros((longest + 1, 3), dtype=np.int64),
        np.zeros((longest + 1, 3), dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
    )


@numba.njit(inline="always")
def _new_pixel(rows: int, width: int) -> Any:
    return _Pixel(
        np.zeros((rows, 4, width), dtype=np.float32),
        np.zeros((rows, 4, width), dtype=np.float64),
        np.zeros((rows, 4, width), dtype=np.float32),
        np.zeros((rows, width), dtype=np.float32),
        np.zeros(rows, dtype=np.float32),
        np.zeros(rows, dtype=np.bool_),
        np.zeros(rows, dtype=np.bool_),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
    )


@numba.njit(inline="always")
def _new_tally(width: int) -> Any:
    return _Tally(
        np.zeros((COMPONENT_COUNT + 1, width), dtype=np.float32),
        np.zeros((COMPONENT_COUNT + 1, width), dtype=np.float32),
        np.zeros((COMPONENT_COUNT + 1, width), dtype=np.float32),
    )


@numba.njit(inline="always")
def _add_source(source: Any, records: Any, i: int, L: Any, one_light: bool, width: int) -> None:
    """Add light seen directly by path `i`: there is no vertex before it."""
    base = (i // TILE) * (TILE * SLOTS) + i % TILE
    if records.sampled[base] > 0:
        a = np.int64(0)
        if not one_light:
            a = np.int64(records.sampled_light[base])
        for j in range(width):
            source[j] += records.sampled[base] * L[a, j]


@numba.njit(inline="always")
def _fetch(
    records: Any, i: int, at: int, rr_depth: int, one_light: bool, vertex: Any, weight: Any
) -> tuple[Any, Any]:
    """Copy the records of path `i` behind those already in the buffers; return the new count and the child."""
    base = (i // TILE) * (TILE * SLOTS) + i % TILE
    n = np.int64(records.length[i])
    if at > 0:
        # Slot 0 of a later segment holds what the last direction of the one before has hit.
        weight[at - 1, 1] = records.sampled[base] * weight[at - 1, 2]
        if not one_light:
            vertex[at - 1, 2] = records.sampled_light[base]
    for k in range(n):
        slot = base + k * TILE
        gain = np.float32(1)
        if at + k + 1 >= rr_depth:
            gain = records.survival[slot]
        killed = gain < 0
        if killed:
            gain = np.float32(0)
        vertex[at + k, 0] = records.row[slot]
        weight[at + k, 0] = records.direct[slot]
        weight[at + k, 2] = gain
        weight[at + k, 1] = np.float32(0)
        if k + 1 < SLOTS and not killed:
            weight[at + k, 1] = gain * records.sampled[slot + TILE]
        if not one_light:
            vertex[at + k, 1] = records.direct_light[slot]
            vertex[at + k, 2] = 0
            if k + 1 < SLOTS and not killed:
                vertex[at + k, 2] = records.sampled_light[slot + TILE]
    return at + n, np.int64(records.child[i])


@numba.njit(inline="always")
def _propagate(path: Any, n: int, tables: Any, one_light: bool, width: int) -> bool:
    """Sweep from vertex n - 1 to vertex 0; R is then R_1 - E_D there. Return whether the path has luminesced."""
    S, L = tables.reflectance, tables.lights
    vertex, weight = path.vertex, path.weight
    R, F, G, U, V, W = path.R, path.F, path.G, path.U, path.V, path.W
    luminesced = False
    twice = False  # until then G is 0
    k = n - 1
    if k > 0:
        w, h = weight[k, 0], weight[k, 1]
        if one_light:
            e = w + h
            for j in range(width):
                R[j] = e * L[0, j]
        else:
            a, c = vertex[k, 1], vertex[k, 2]
            for j in range(width):
                R[j] = w * L[a, j] + h * L[c, j]
        r = vertex[k, 0]
        glow = tables.glows[r]
        if glow >= 0:
            # only lamps light the last vertex, and what a material makes of their light is in a table
            luminesced = True
            f, a, c = weight[k - 1, 2], np.int64(0), np.int64(0)
            if not one_light:
                a, c = vertex[k, 1], vertex[k, 2]
            for j in range(width):
                F[j] = f * (w * tables.glow[glow, a, j] + h * tables.glow[glow, c, j])
                G[j] = 0
    last = k
    while k > 0:
        r = vertex[k, 0]
        k -= 1
        f, w, h = weight[k, 2], weight[k, 0], weight[k, 1]
        if k == 0:
            # E_D of the camera vertex is summed apart.
            w = np.float32(0)
            h = np.float32(0)
        if k + 1 == last:
            pass  # done above
        elif tables.glows[r] >= 0:
            for j in range(width):
                V[j] = 0
            if luminesced:
                for j in range(width):
                    U[j] = F[j] + G[j]
                    W[j] = 0
                twice = True
                luminesce_both(V, R, path.scratch, W, U, path.scratch2, r, width, tables)
                for j in range(width):
                    F[j] = f * (S[r, j] * F[j] + V[j])
                    G[j] = f * (S[r, j] * G[j] + W[j])
            else:
                luminesced = True
                luminesce(V, R, path.scratch, r, width, tables)
                for j in range(width):
                    F[j] = f * V[j]
                    G[j] = 0
        elif twice:
            for j in range(width):
                F[j] *= f * S[r, j]
                G[j] *= f * S[r, j]
        elif luminesced:
            for j in range(width):
                F[j] *= f * S[r, j]
        if one_light:
            e = w + h
            for j in range(width):
                R[j] = f * S[r, j] * R[j] + e * L[0, j]
        else:
            a, c = vertex[k, 1], vertex[k, 2]
            for j in range(width):
                R[j] = f * S[r, j] * R[j] + w * L[a, j] + h * L[c, j]
    return luminesced


@numba.njit(inline="always")
def _collect(pixel: Any, path: Any, n: int, luminesced: bool, L: Any, one_light: bool, width: int) -> None:
    """Add the light arriving at the camera vertex to the sums of its material row."""
    sums, batch, vertex, weight = pixel.sums, pixel.batch, path.vertex, path.weight
    R, F, G = path.R, path.F, path.G
    r = vertex[0, 0]
    pixel.in_batch[r] = True
    if one_light:
        pixel.direct[r] += weight[0, 0] + weight[0, 1]
    else:
        a, c = vertex[0, 1], vertex[0, 2]
        for j in range(width):
            e = weight[0, 0] * L[a, j] + weight[0, 1] * L[c, j]
            sums[r, 0, j] += e
            batch[r, j] += e
    if n > 1:
        if luminesced:
            for j in range(width):
                sums[r, 1, j] += R[j]
                sums[r, 2, j] += F[j]
                sums[r, 3, j] += G[j]
                batch[r, j] += R[j] + F[j] + G[j]
        else:
            for j in range(width):
                sums[r, 1, j] += R[j]
                batch[r, j] += R[j]


@numba.njit(inline="always")
def _close_batch(
    pixel: Any,
    path: Any,
    y: Any,
    total: Any,
    tables: Any,
    one_light: bool,
    component_errors: bool,
    width: int,
) -> None:
    """Put the sum over the batch's samples into `total`, and into `y` for each component if that is asked for."""
    S, L = tables.reflectance, tables.lights
    sums, before, batch = pixel.sums, pixel.before, pixel.batch
    for j in range(width):
        total[j] = pixel.batch_source[j]
        pixel.source[j] += pixel.batch_source[j]
        pixel.batch_source[j] = 0
    if component_errors:
        _clear(y)
        for j in range(width):
            y[0, j] = total[j]
    for r in range(len(pixel.in_batch)):
        if not pixel.in_batch[r]:
            continue
        pixel.in_batch[r] = False
        pixel.in_pixel[r] = True
        if one_light:
            e = pixel.direct[r]
            pixel.direct[r] = 0
            for j in range(width):
                sums[r, 0, j] += e * L[0, j]
                batch[r, j] += e * L[0, j]
        for j in range(width):
            path.U[j] = batch[r, j]
            total[j] += S[r, j] * batch[r, j]
            batch[r, j] = 0
        luminesce(total, path.U, path.scratch, r, width, tables)
        if component_errors:
            for q in range(4):
                for j in range(width):
                    before[r, q, j] = sums[r, q, j] - before[r, q, j]
            _components(y, before, r, width, tables, path)
            for q in range(4):
                for j in range(width):
                    before[r, q, j] = sums[r, q, j]


@numba.njit(inline="always")
def _flush(pixel: Any, width: int) -> None:
    """Move the sums to double precision."""
    for r in range(len(pixel.in_pixel)):
        if pixel.in_pixel[r]:
            for q in range(4):
                for j in range(width):
                    pixel.exact[r, q, j] += pixel.sums[r, q, j]
                    pixel.sums[r, q, j] = 0
                    pixel.before[r, q, j] = 0


@numba.njit(inline="always")
def _close_pixel(pixel: Any, path: Any, y: Any, tables: Any, flushed: bool, width: int) -> None:
    """Put the components, summed over the pixel's samples, into `y` and clear the sums."""
    _clear(y)
    for j in range(width):
        y[0, j] = pixel.source[j]
        pixel.source[j] = 0
    for r in range(len(pixel.in_pixel)):
        if pixel.in_pixel[r]:
            pixel.in_pixel[r] = False
            if flushed:
                for q in range(4):
                    for j in range(width):
                        pixel.sums[r, q, j] = pixel.exact[r, q, j] + pixel.sums[r, q, j]
                        pixel.exact[r, q, j] = 0
            _components(y, pixel.sums, r, width, tables, path)
            for q in range(4):
                for j in range(width):
                    pixel.sums[r, q, j] = 0
                    pixel.before[r, q, j] = 0


@numba.njit(inline="always")
def _components(y: Any, sums: Any, r: int, width: int, tables: Any, path: Any) -> None:
    """Add the components 1-6 of one material row to `y`, from the sums E_D, R_1 - E_D, F_1, G_1 (Eqs. 3-13)."""
    S, U, V, scratch = tables.reflectance, path.U, path.V, path.scratch
    for j in range(width):
        y[1, j] += S[r, j] * sums[r, 0, j]
        y[3, j] += S[r, j] * sums[r, 1, j]
        y[5, j] += S[r, j] * sums[r, 2, j]
        y[6, j] += S[r, j] * sums[r, 3, j]
    if tables.glows[r] >= 0:
        for c in range(3):
            for j in range(width):
                U[j] = sums[r, c, j] if c < 2 else sums[r, 2, j] + sums[r, 3, j]
                V[j] = 0
            luminesce(V, U, scratch, r, width, tables)
            for j in range(width):
                y[2 * c + 2, j] += V[j]


@numba.njit(inline="always")
def _clear(y: Any) -> None:
    for c in range(y.shape[0]):
        for j in range(y.shape[1]):
            y[c, j] = 0


@numba.njit(inline="always")
def _count(tally: Any, at: int, total: Any, size: int, b: int, width: int) -> None:
    """Count in the sum `total` over the `size` samples of batch `b`; batch 0 begins anew."""
    n = np.float32(size)
    per_sample = np.float32(1) / n
    if b == 0:
        for j in range(width):
            tally.pivot[at, j] = per_sample * total[j]
            tally.sums[at, j] = 0
            tally.squares[at, j] = 0
    else:
        for j in range(width):
            difference = per_sample * total[j] - tally.pivot[at, j]
            tally.sums[at, j] += n * difference
            tally.squares[at, j] += n * difference * difference


@numba.njit(inline="always")
def _store(
    p: int,
    y: Any,
    tally: Any,
    spp: int,
    batches: int,
    component_errors: bool,
    radiance: Any,
    error: Any,
    errors: Any,
) -> None:
    """Write the means and standard errors of pixel `p`."""
    bands = radiance.shape[2]
    scale = np.float32(1) / np.float32(spp)
    freedom = np.float32(spp) * np.float32(batches - 1)
    for c in range(COMPONENT_COUNT):
        for j in range(bands):
            radiance[p, c, j] = scale * y[c, j]
    for j in range(bands):
        error[p, j] = _error(tally.sums[_TOTAL, j], tally.squares[_TOTAL, j], scale, freedom)
    if component_errors:
        for c in range(COMPONENT_COUNT):
            for j in range(bands):
                errors[p, c, j] = _error(tally.sums[c, j], tally.squares[c, j], scale, freedom)


@numba.njit(inline="always")
def _error(total: Any, squares: Any, scale: Any, freedom: Any) -> Any:
    """Standard error of a mean from its batches: sqrt((sum n_b m_b^2 - n m^2) / (n (batches - 1)))."""
    if freedom <= 0:
        return np.float32(np.nan)
    return np.sqrt(max(squares - scale * total * total, np.float32(0)) / freedom)
