"""The sweep: from recorded light paths to the spectra of all components.

For each path, from its last vertex to its first, three spectra are carried: R, F and G, the light arriving at
the vertex that has luminesced never, once, and more often (Phi E is the integral of D_L E):

    R_k = E_D(x_k) + f_k  S_{k+1} R_{k+1}
    F_k =            f_k (S_{k+1} F_{k+1} + Phi_{k+1} R_{k+1})
    G_k =            f_k (S_{k+1} G_{k+1} + Phi_{k+1} (F_{k+1} + G_{k+1}))

At the camera vertex the sums over the samples are turned into the components, once for each pixel and material:

    y_1 = S E_D            y_3 = S (R_1 - E_D)      y_5 = S F_1
    y_2 = Phi E_D          y_4 = Phi (R_1 - E_D)    y_6 = S G_1 + Phi (F_1 + G_1)

What makes it fast was measured: one path's spectra are contiguous and padded, so that loops run along wavelength
without remainder; the code is compiled for the number of bands; F and G are zero until the path meets a
fluorescent surface; a path's records are read once into a small buffer.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.light_paths import SLOTS, TILE, LightPaths
from fluorspar.paths.tables import SpectralTables

__all__ = ["COMPONENT_COUNT", "Swept", "batch_count", "sweep"]

COMPONENT_COUNT = 7
_MOST_BATCHES = 32
_TASKS = 16  # pixel ranges a chunk is divided into; more than cores, so that none waits long

# Sums may be reordered for SIMD; NaN and infinity keep their meaning.
_FAST = {"reassoc", "contract", "nsz", "arcp"}


class Swept(NamedTuple):
    """Spectra of a run of pixels, float32, W m-2 sr-1 nm-1.

    Attributes
    ----------
    radiance
        (pixels, 7, N): the components.
    standard_error
        (pixels, N): of the total; NaN for a single sample.
    component_standard_error
        (pixels, 7, N), or (0, 7, N) if not asked for.
    """

    radiance: NDArray[np.float32]
    standard_error: NDArray[np.float32]
    component_standard_error: NDArray[np.float32]


def batch_count(spp: int) -> int:
    """Number of batches of samples from which standard errors are estimated.

    Examples
    --------
    >>> batch_count(1024), batch_count(20), batch_count(4)
    (32, 20, 4)
    """
    return min(spp, _MOST_BATCHES)


def sweep(
    paths: LightPaths, tables: SpectralTables, bands: int, pool: Executor, *, component_errors: bool = False
) -> Swept:
    """Compute the spectra of all components of the pixels of `paths`.

    Parameters
    ----------
    paths
        Recorded light paths.
    tables
        Spectra of the materials and lights whose rows the paths refer to.
    bands
        Number N of wavelengths.
    pool
        Threads to compute with; the result does not depend on their number.
    component_errors
        Estimate the standard error of each component too.

    Returns
    -------
    Swept
    """
    first, *later = paths.segments
    rest = [np.concatenate([getattr(segment, name) for segment in later]) if later else getattr(first, name)[:0] for name in _RECORDS]
    # A path goes on at an index within its segment; the later segments are joined, so count on from the first of them.
    starts = np.cumsum([TILE * len(segment.row) for segment in later]).tolist()
    counts = [TILE * len(segment.row) for segment in later]
    rest_length = np.zeros(sum(counts), dtype=np.uint8)
    rest_child = np.full(sum(counts), -1, dtype=np.int64)
    for segment, end, count in zip(later, starts, counts, strict=True):
        start, n = end - count, len(segment.length)
        rest_length[start : start + n] = segment.length
        rest_child[start : start + n] = np.where(segment.child >= 0, segment.child + end, -1)

    swept = Swept(
        np.empty((paths.pixels, COMPONENT_COUNT, bands), dtype=np.float32),
        np.empty((paths.pixels, bands), dtype=np.float32),
        np.empty((paths.pixels if component_errors else 0, COMPONENT_COUNT, bands), dtype=np.float32),
    )
    one_light = first.direct_light.size <= 1
    kernel = _kernel(tables.reflectance.shape[1], one_light, component_errors)
    records = _Records(*(getattr(first, name).ravel() for name in _RECORDS), first.length, first.child)
    tail = _Records(*(values.ravel() for values in rest), rest_length, rest_child)
    longest = SLOTS * len(paths.segments)
    edges = np.linspace(0, paths.pixels, _TASKS + 1).astype(int)
    tasks = [
        pool.submit(kernel, int(a), int(b), paths.spp, batch_count(paths.spp), paths.rr_depth, longest, records, tail, tables, *swept)
        for a, b in zip(edges[:-1], edges[1:], strict=True)
        if a < b
    ]
    for task in tasks:
        task.result()
    return swept


_RECORDS = ("row", "direct", "direct_light", "sampled", "sampled_light", "survival")


class _Records(NamedTuple):
    """Flat records of one segment, or of all later ones together."""

    row: NDArray[np.uint32]
    direct: NDArray[np.float32]
    direct_light: NDArray[np.uint32]
    sampled: NDArray[np.float32]
    sampled_light: NDArray[np.uint32]
    survival: NDArray[np.float32]
    length: NDArray[np.uint8]
    child: NDArray[Any]


@numba.njit(inline="always")
def _luminesce(out: Any, light: Any, absorbed: Any, row: int, width: int, tables: Any) -> None:
    """Add Phi E to `out`, with E = `light`; `absorbed` is scratch; all of shape (width,)."""
    full = tables.full[row]
    if full >= 0:
        for ex in range(width):
            e = light[ex]
            for j in range(width):
                out[j] += tables.matrices[full, ex, j] * e
    for q in range(tables.first[row], tables.last[row]):
        # The running sum up to the emission wavelength, in loops of its own: the others then run in SIMD.
        for j in range(width):
            absorbed[j] = tables.beta[q, j] * light[j]
        below = np.float32(0)
        for j in range(width):
            here = absorbed[j]
            absorbed[j] = below + tables.equal * here
            below += here
        for j in range(width):
            out[j] += tables.alpha[q, j] * absorbed[j]


@numba.njit(inline="always")
def _luminesce_both(
    out: Any, light: Any, absorbed: Any, out2: Any, light2: Any, absorbed2: Any, row: int, width: int, tables: Any
) -> None:
    """Do as `_luminesce` for two lights at once; the running sums wait for one another, not for themselves."""
    full = tables.full[row]
    if full >= 0:
        for ex in range(width):
            for j in range(width):
                out[j] += tables.matrices[full, ex, j] * light[ex]
                out2[j] += tables.matrices[full, ex, j] * light2[ex]
    for q in range(tables.first[row], tables.last[row]):
        for j in range(width):
            absorbed[j] = tables.beta[q, j] * light[j]
            absorbed2[j] = tables.beta[q, j] * light2[j]
        below = np.float32(0)
        below2 = np.float32(0)
        for j in range(width):
            here = absorbed[j]
            here2 = absorbed2[j]
            absorbed[j] = below + tables.equal * here
            absorbed2[j] = below2 + tables.equal * here2
            below += here
            below2 += here2
        for j in range(width):
            out[j] += tables.alpha[q, j] * absorbed[j]
            out2[j] += tables.alpha[q, j] * absorbed2[j]


@numba.njit(inline="always")
def _fetch(records: Any, i: int, at: int, rr_depth: int, one_light: bool, vertex: Any, spectrum: Any) -> tuple[int, int]:
    """Copy the records of path `i` behind those already in the buffers; return the new count and the child.

    `vertex` rows: material row, light rows a and b. `spectrum` rows: w, h of the next direction, f.
    """
    base = (i // TILE) * (TILE * SLOTS) + i % TILE
    n = np.int64(records.length[i])
    if at > 0:
        # Slot 0 of a later segment holds what the last direction of the one before has hit.
        spectrum[at - 1, 1] = records.sampled[base] * spectrum[at - 1, 2]
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
        spectrum[at + k, 0] = records.direct[slot]
        spectrum[at + k, 2] = gain
        spectrum[at + k, 1] = np.float32(0)
        if k + 1 < SLOTS and not killed:
            spectrum[at + k, 1] = gain * records.sampled[slot + TILE]
        if not one_light:
            vertex[at + k, 1] = records.direct_light[slot]
            vertex[at + k, 2] = 0
            if k + 1 < SLOTS and not killed:
                vertex[at + k, 2] = records.sampled_light[slot + TILE]
    return at + n, np.int64(records.child[i])


@lru_cache(maxsize=None)
def _kernel(width: int, one_light: bool, component_errors: bool) -> Callable[..., None]:
    """Compile the sweep for a padded number of bands; compiled code is kept on disk."""

    @numba.njit(nogil=True, fastmath=_FAST, cache=True)
    def kernel(  # type: ignore[no-untyped-def]
        start, stop, spp, batches, rr_depth, longest, records, tail, tables, radiance, standard_error, component_standard_error
    ):
        bands = radiance.shape[2]
        rows = tables.reflectance.shape[0]
        S = tables.reflectance
        L = tables.lights
        one = np.float32(1)

        vertex = np.zeros((longest + 1, 3), dtype=np.int64)
        weight = np.zeros((longest + 1, 3), dtype=np.float32)
        R = np.zeros(width, dtype=np.float32)
        F = np.zeros(width, dtype=np.float32)
        G = np.zeros(width, dtype=np.float32)
        U = np.zeros(width, dtype=np.float32)
        V = np.zeros(width, dtype=np.float32)
        W = np.zeros(width, dtype=np.float32)
        scratch = np.zeros(width, dtype=np.float32)
        scratch2 = np.zeros(width, dtype=np.float32)

        # Sums at the camera vertex for each material row: E_D, R_1 - E_D, F_1, G_1 of the pixel, and all light of
        # the batch. What belongs to one batch alone is the difference to the sums before it.
        pixel = np.zeros((rows, 4, width), dtype=np.float32)
        before = np.zeros((rows, 4, width), dtype=np.float32)
        batch = np.zeros((rows, width), dtype=np.float32)
        batch_direct = np.zeros(rows, dtype=np.float32)
        touched = np.zeros(rows, dtype=np.bool_)
        touched_pixel = np.zeros(rows, dtype=np.bool_)
        source = np.zeros(width, dtype=np.float32)
        batch_source = np.zeros(width, dtype=np.float32)
        y = np.zeros((COMPONENT_COUNT, width), dtype=np.float32)
        total = np.zeros(width, dtype=np.float32)
        # Weighted sums of batch means and their squares, counted from the mean of the first batch: in single
        # precision the difference of two large sums would be noise.
        pivot = np.zeros((COMPONENT_COUNT + 1, width), dtype=np.float32)
        sums = np.zeros((COMPONENT_COUNT + 1, width), dtype=np.float32)
        squares = np.zeros((COMPONENT_COUNT + 1, width), dtype=np.float32)

        for p in range(start, stop):
            for b in range(batches):
                begin = b * spp // batches
                end = (b + 1) * spp // batches
                for s in range(begin, end):
                    i = p * spp + s

                    # Light seen directly: no vertex before it.
                    base = (i // TILE) * (TILE * SLOTS) + i % TILE
                    if records.sampled[base] > 0:
                        a = 0
                        if not one_light:
                            a = np.int64(records.sampled_light[base])
                        for j in range(width):
                            batch_source[j] += records.sampled[base] * L[a, j]

                    n, child = _fetch(records, i, 0, rr_depth, one_light, vertex, weight)
                    while child >= 0:
                        n, child = _fetch(tail, child, n, rr_depth, one_light, vertex, weight)
                    if n == 0:
                        continue

                    luminesced = False
                    k = n - 1
                    if k > 0:
                        if one_light:
                            e = weight[k, 0] + weight[k, 1]
                            for j in range(width):
                                R[j] = e * L[0, j]
                        else:
                            w = weight[k, 0]
                            h = weight[k, 1]
                            a = vertex[k, 1]
                            c = vertex[k, 2]
                            for j in range(width):
                                R[j] = w * L[a, j] + h * L[c, j]
                    while k > 0:
                        r = vertex[k, 0]
                        k -= 1
                        f = weight[k, 2]
                        w = weight[k, 0]
                        h = weight[k, 1]
                        if k == 0:
                            # E_D of the camera vertex is summed apart.
                            w = np.float32(0)
                            h = np.float32(0)
                        e = w + h
                        fluorescent = tables.last[r] > tables.first[r] or tables.full[r] >= 0
                        if fluorescent:
                            if luminesced:
                                for j in range(width):
                                    U[j] = F[j] + G[j]
                                    V[j] = 0
                                    W[j] = 0
                                _luminesce_both(V, R, scratch, W, U, scratch2, r, width, tables)
                                for j in range(width):
                                    F[j] = f * (S[r, j] * F[j] + V[j])
                                    G[j] = f * (S[r, j] * G[j] + W[j])
                            else:
                                luminesced = True
                                for j in range(width):
                                    V[j] = 0
                                _luminesce(V, R, scratch, r, width, tables)
                                for j in range(width):
                                    F[j] = f * V[j]
                                    G[j] = 0
                        elif luminesced:
                            for j in range(width):
                                F[j] *= f * S[r, j]
                                G[j] *= f * S[r, j]
                        if one_light:
                            for j in range(width):
                                R[j] = f * S[r, j] * R[j] + e * L[0, j]
                        else:
                            a = vertex[k, 1]
                            c = vertex[k, 2]
                            for j in range(width):
                                R[j] = f * S[r, j] * R[j] + w * L[a, j] + h * L[c, j]

                    r = vertex[0, 0]
                    touched[r] = True
                    if one_light:
                        batch_direct[r] += weight[0, 0] + weight[0, 1]
                    else:
                        w = weight[0, 0]
                        h = weight[0, 1]
                        a = vertex[0, 1]
                        c = vertex[0, 2]
                        for j in range(width):
                            e = w * L[a, j] + h * L[c, j]
                            pixel[r, 0, j] += e
                            batch[r, j] += e
                    if n > 1:
                        if luminesced:
                            for j in range(width):
                                pixel[r, 1, j] += R[j]
                                pixel[r, 2, j] += F[j]
                                pixel[r, 3, j] += G[j]
                                batch[r, j] += R[j] + F[j] + G[j]
                        else:
                            for j in range(width):
                                pixel[r, 1, j] += R[j]
                                batch[r, j] += R[j]

                # The batch is full: its total (or all its components) for the standard error.
                per_sample = one / np.float32(end - begin)
                for j in range(width):
                    total[j] = batch_source[j]
                    source[j] += batch_source[j]
                if component_errors:
                    for j in range(width):
                        y[0, j] = batch_source[j]
                    for c in range(1, COMPONENT_COUNT):
                        for j in range(width):
                            y[c, j] = 0
                for j in range(width):
                    batch_source[j] = 0
                for r in range(rows):
                    if not touched[r]:
                        continue
                    touched[r] = False
                    touched_pixel[r] = True
                    if one_light:
                        e = batch_direct[r]
                        batch_direct[r] = 0
                        for j in range(width):
                            pixel[r, 0, j] += e * L[0, j]
                            batch[r, j] += e * L[0, j]
                    for j in range(width):
                        U[j] = batch[r, j]
                        total[j] += S[r, j] * batch[r, j]
                        batch[r, j] = 0
                    _luminesce(total, U, scratch, r, width, tables)
                    if component_errors:
                        for q in range(4):
                            for j in range(width):
                                before[r, q, j] = pixel[r, q, j] - before[r, q, j]
                        _components(y, before, r, width, tables, U, V, scratch)
                        for q in range(4):
                            for j in range(width):
                                before[r, q, j] = pixel[r, q, j]
                size = np.float32(end - begin)
                _tally(pivot, sums, squares, COMPONENT_COUNT, total, per_sample, size, b, width)
                if component_errors:
                    for c in range(COMPONENT_COUNT):
                        _tally(pivot, sums, squares, c, y[c], per_sample, size, b, width)

            # The pixel is full.
            scale = one / np.float32(spp)
            for c in range(COMPONENT_COUNT):
                for j in range(width):
                    y[c, j] = 0
            for r in range(rows):
                if touched_pixel[r]:
                    touched_pixel[r] = False
                    _components(y, pixel, r, width, tables, U, V, scratch)
                    for q in range(4):
                        for j in range(width):
                            pixel[r, q, j] = 0
                            before[r, q, j] = 0
            for j in range(width):
                y[0, j] = source[j]
                source[j] = 0
            for c in range(COMPONENT_COUNT):
                for j in range(bands):
                    radiance[p, c, j] = scale * y[c, j]
            freedom = np.float32(spp) * np.float32(batches - 1)
            for j in range(bands):
                standard_error[p, j] = _error(sums[COMPONENT_COUNT, j], squares[COMPONENT_COUNT, j], scale, freedom)
            if component_errors:
                for c in range(COMPONENT_COUNT):
                    for j in range(bands):
                        component_standard_error[p, c, j] = _error(sums[c, j], squares[c, j], scale, freedom)

    return kernel  # type: ignore[no-any-return]


@numba.njit(inline="always")
def _components(y: Any, sums: Any, r: int, width: int, tables: Any, U: Any, V: Any, scratch: Any) -> None:
    """Add the components 1-6 of one material row to `y`, from the sums E_D, R_1 - E_D, F_1, G_1 (Eqs. 3-13)."""
    S = tables.reflectance
    for j in range(width):
        y[1, j] += S[r, j] * sums[r, 0, j]
        y[3, j] += S[r, j] * sums[r, 1, j]
        y[5, j] += S[r, j] * sums[r, 2, j]
        y[6, j] += S[r, j] * sums[r, 3, j]
    if tables.last[r] > tables.first[r] or tables.full[r] >= 0:
        for c in range(3):
            for j in range(width):
                U[j] = sums[r, c, j] if c < 2 else sums[r, 2, j] + sums[r, 3, j]
                V[j] = 0
            _luminesce(V, U, scratch, r, width, tables)
            for j in range(width):
                y[2 * c + 2, j] += V[j]


@numba.njit(inline="always")
def _tally(
    pivot: Any, sums: Any, squares: Any, at: int, total: Any, per_sample: float, size: float, b: int, width: int
) -> None:
    """Count in the sum `total` over the `size` samples of batch `b`; batch 0 begins anew."""
    if b == 0:
        for j in range(width):
            pivot[at, j] = per_sample * total[j]
            sums[at, j] = 0
            squares[at, j] = 0
    else:
        for j in range(width):
            difference = per_sample * total[j] - pivot[at, j]
            sums[at, j] += size * difference
            squares[at, j] += size * difference * difference


@numba.njit(inline="always")
def _error(total: float, squares: float, scale: float, freedom: float) -> float:
    """Standard error of a mean from its batches: sqrt((sum n_b m_b^2 - n m^2) / (n (batches - 1)))."""
    if freedom <= 0:
        return np.float32(np.nan)
    return np.sqrt(max(squares - scale * total * total, np.float32(0)) / freedom)
