"""The sweep of light paths among general surfaces, each vertex of which has several terms.

With the coefficients d and c of its terms, for the light found by next-event estimation and for the light sent on, the
spectra S of their rows, L_a and L_b of the lights found and hit, and A = sum c S, B = sum d S, a vertex makes of the
light (R, F, G) that arrives having luminesced never, once and more often

    R' = A (h L_b + R) + B L_a
    F' = A F + Phi X               X = d L_a + c (h L_b + R), of the terms that luminesce
    G' = A G + Phi c (F + G)

and the camera vertex, where direct and indirect light are told apart, the components.
"""

from __future__ import annotations

import inspect
import zlib
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.image import components as components_module
from fluorspar.paths import log as log_module
from fluorspar.paths.log import BLOCK, END
from fluorspar.paths.sweeping import batches as batches_module
from fluorspar.paths.sweeping import luminesce as luminesce_module
from fluorspar.paths.sweeping import spectral_tables as spectral_tables_module
from fluorspar.paths.sweeping.batches import COMPONENT_COUNT, TOTAL, Tally, count, new_tally, store
from fluorspar.paths.sweeping.kept_code import keep_code
from fluorspar.paths.sweeping.luminesce import luminesce
from fluorspar.paths.sweeping.spectral_tables import SpectralTables, spectral_tables
from fluorspar.scene.lobes import lobe as lobe_module
from fluorspar.scene.lobes.lobe import DARK, HALF, REST, Lobes

__all__ = ["LobeTables", "compiled_for_lobes", "lobe_tables", "new_lobe_scratch"]

_FAST = {"reassoc", "contract", "nsz", "arcp"}
_VERTICES = 32


class LobeTables(NamedTuple):
    """Spectra of rows and lights, and what makes spectra of the colours of texels.

    Attributes
    ----------
    spectra : SpectralTables
    more : SpectralTables
        What luminesces more than once at one surface, under its coat, by the same rows; `reflectance` is the diagonal.
    coated : bool
        Whether anything does.
    colours, light_colours : ndarray of shape (texels, 4), float32
        See `Lobes`.
    wavelengths : ndarray of shape (B,), float32
        In nm, within the range for which the coefficients are meant; padded with the last.
    """

    spectra: SpectralTables
    more: SpectralTables
    coated: bool
    colours: NDArray[np.float32]
    light_colours: NDArray[np.float32]
    wavelengths: NDArray[np.float32]


def lobe_tables(
    matrices: Sequence[DonaldsonMatrix],
    lobes: Lobes,
    lights: Sequence[NDArray[np.float64]],
    more: Sequence[DonaldsonMatrix] | None = None,
) -> LobeTables:
    """Lay out the rows of `Lobes`, all on one grid, for the sweep; see `spectral_tables`."""
    spectra = spectral_tables(matrices, lights)
    values = np.clip(matrices[0].wavelengths.values, 360.0, 830.0)
    width = spectra.reflectance.shape[1]
    wavelengths = np.concatenate([values, np.repeat(values[-1:], width - len(values))])
    second = spectral_tables(more or matrices[:1], [])
    return LobeTables(
        spectra, second, more is not None, lobes.colours, lobes.light_colours, wavelengths.astype(np.float32)
    )


class LobePath(NamedTuple):
    """One path: what is recorded of it, and the light that arrives at the vertex it has been swept to.

    `row`, `found` (d) and `sent` (c) are of shape (vertices, terms); `hit` is h, `lights` are the rows of L_a and L_b.
    """

    row: Any
    found: Any
    sent: Any
    hit: Any
    lights: Any
    La: Any
    Lb: Any
    A: Any
    B: Any
    X: Any
    R: Any
    F: Any
    G: Any
    FG: Any


class LobeScratch(NamedTuple):
    """What a sweep works in. `y` (7, B) is the light of a batch by component, `sums` of all batches that are closed."""

    path: LobePath
    tally: Tally
    y: NDArray[np.float32]
    sums: NDArray[np.float32]
    total: NDArray[np.float32]


def new_lobe_scratch(terms: int, width: int, room: int) -> LobeScratch:
    """Scratch for paths of up to 32 times `room` vertices."""
    vertices = _VERTICES * room
    path = LobePath(
        np.zeros((vertices, terms), dtype=np.int64),
        np.zeros((vertices, terms), dtype=np.float32),
        np.zeros((vertices, terms), dtype=np.float32),
        np.zeros(vertices, dtype=np.float32),
        np.zeros((vertices, 2), dtype=np.int64),
        *(np.zeros(width, dtype=np.float32) for _ in range(9)),
    )
    parts = (np.zeros((COMPONENT_COUNT, width), dtype=np.float32) for _ in range(2))
    return LobeScratch(path, new_tally(width), *parts, np.zeros(width, dtype=np.float32))


@numba.njit(inline="always")
def _read_path(log: Any, slot: Any, entry: Any, path: Any, terms: int, one_light: bool) -> Any:
    """Read the path that begins at an entry of a slot; see `read_path` of `propagate.py`."""
    n = 0
    source = np.float32(0)
    source_light = np.int64(0)
    block = slot // BLOCK
    stride = len(log.sampled)
    while True:
        if entry == log.strips[block, 1]:
            slot = np.int64(log.goes_on[slot])
            block = slot // BLOCK
            entry = log.strips[block, 0]
        i = entry * BLOCK + slot % BLOCK
        entry += 1
        if n == 0:
            source = log.sampled[i]
            if not one_light:
                source_light = np.int64(log.sampled_light[i])
        else:
            path.hit[n - 1] = log.sampled[i]
            if not one_light:
                path.lights[n - 1, 1] = log.sampled_light[i]
        if log.row[i] == END:
            break
        if n == len(path.hit):
            n = -1
            break
        goes_on = False
        for t in range(terms):
            path.row[n, t] = log.row[i + t * stride]
            path.found[n, t] = log.direct[i + t * stride]
            c = log.weight[i + t * stride]
            path.sent[n, t] = c
            goes_on = goes_on or c != 0
        path.hit[n] = 0
        if not one_light:
            path.lights[n, 0] = log.direct_light[i]
            path.lights[n, 1] = 0
        n += 1
        if not goes_on:
            break
    return n, source, source_light, slot, entry


@numba.njit(inline="always")
def _colour(out: Any, colours: Any, number: int, w: Any, width: int) -> None:
    """Put the spectrum of a texel into `out`, with what a lobe makes of it; see `operate`."""
    one, half = np.float32(1), np.float32(0.5)
    c0, c1, c2, operation = colours[number]
    for j in range(width):
        x = (c0 * w[j] + c1) * w[j] + c2
        out[j] = half + half * x / np.sqrt(one + x * x)
    if operation > 0:
        for j in range(width):
            out[j] = out[j] * (one - operation) / (one - operation * out[j])
    elif operation == REST:
        for j in range(width):
            out[j] = one - out[j]
    elif operation < 0:
        two = np.float32(2)
        for j in range(width):
            out[j] = np.sqrt(out[j])
        if operation == DARK:
            for j in range(width):
                out[j] = two * (out[j] - half) * (out[j] - one)
        elif operation == HALF:
            for j in range(width):
                out[j] = two * two * out[j] * (one - out[j])
        else:
            for j in range(width):
                out[j] = two * out[j] * (out[j] - half)


@numba.njit(inline="always")
def _light(out: Any, row: int, tables: Any, width: int) -> None:
    """Put the spectrum of a light into `out`: one of the table, or one of it times the colour of a texel."""
    L = tables.spectra.lights
    if row < len(L):
        for j in range(width):
            out[j] = L[row, j]
    else:
        w, half, one = tables.wavelengths, np.float32(0.5), np.float32(1)
        c0, c1, c2, number = tables.light_colours[row - len(L)]
        white = np.int64(number)
        for j in range(width):
            x = (c0 * w[j] + c1) * w[j] + c2
            out[j] = L[white, j] * (half + half * x / np.sqrt(one + x * x))


@numba.njit(inline="always")
def _coefficients(path: Any, k: int, terms: int, tables: Any, width: int) -> bool:
    """Put A and B of a vertex into the path; return whether one of its terms luminesces."""
    A, B = path.A, path.B
    S, colours, w = tables.spectra.reflectance, tables.colours, tables.wavelengths
    rows = len(S)
    glows = False
    for j in range(width):
        A[j] = 0
    for j in range(width):
        B[j] = 0
    for t in range(terms):
        c, d = path.sent[k, t], path.found[k, t]
        if c == 0 and d == 0:
            continue
        r = path.row[k, t]
        if r < rows:
            for j in range(width):
                A[j] += c * S[r, j]
            for j in range(width):
                B[j] += d * S[r, j]
            glows = glows or tables.spectra.glows[r] >= 0
        else:
            X = path.X
            _colour(X, colours, r - rows, w, width)
            for j in range(width):
                A[j] += c * X[j]
            for j in range(width):
                B[j] += d * X[j]
    return glows


@numba.njit(inline="always")
def _propagate(path: Any, n: int, terms: int, tables: Any, width: int) -> bool:
    """Sweep from vertex n - 1 to vertex 1; R, F, G then arrive at vertex 0. Return whether the path has luminesced."""
    La, Lb = path.La, path.Lb
    A, B, X, R, F, G, FG = path.A, path.B, path.X, path.R, path.F, path.G, path.FG
    luminesced = False
    for j in range(width):
        R[j] = 0
    k = n - 1
    while k > 0:
        h, a, b = path.hit[k], path.lights[k, 0], path.lights[k, 1]
        glows = _coefficients(path, k, terms, tables, width)
        _light(La, a, tables, width)
        if h > 0:
            _light(Lb, b, tables, width)
            for j in range(width):
                R[j] += h * Lb[j]
        if luminesced:
            for j in range(width):
                FG[j] = F[j] + G[j]
            for j in range(width):
                F[j] *= A[j]
            for j in range(width):
                G[j] *= A[j]
        elif glows:
            for j in range(width):
                F[j] = 0
            for j in range(width):
                G[j] = 0
            for j in range(width):
                FG[j] = 0
        if glows:
            for t in range(terms):
                r = path.row[k, t]
                c, d = path.sent[k, t], path.found[k, t]
                if r < len(tables.spectra.glows) and tables.spectra.glows[r] >= 0 and (c != 0 or d != 0):
                    for j in range(width):
                        X[j] = d * La[j] + c * R[j]
                    luminesce(F, X, np.float32(1), r, width, tables.spectra)
                    if luminesced:
                        luminesce(G, FG, c, r, width, tables.spectra)
                    if tables.coated and tables.more.glows[r] >= 0:
                        if luminesced:
                            for j in range(width):
                                X[j] += c * FG[j]
                        for j in range(width):
                            G[j] += tables.more.reflectance[r, j] * X[j]
                        luminesce(G, X, np.float32(1), r, width, tables.more)
            luminesced = True
        for j in range(width):
            R[j] = A[j] * R[j] + B[j] * La[j]
        k -= 1
    return luminesced


@numba.njit(inline="always")
def _collect(path: Any, luminesced: bool, terms: int, tables: Any, y: Any, width: int) -> None:
    """Add the components that vertex 0 sends to the camera."""
    La, Lb = path.La, path.Lb
    A, B, X, R, F, G, FG = path.A, path.B, path.X, path.R, path.F, path.G, path.FG
    h, a, b = path.hit[0], path.lights[0, 0], path.lights[0, 1]
    glows = _coefficients(path, 0, terms, tables, width)
    _light(La, a, tables, width)
    _light(Lb, b, tables, width)
    for j in range(width):
        y[1, j] += B[j] * La[j] + A[j] * (h * Lb[j])
    for j in range(width):
        y[3, j] += A[j] * R[j]
    if luminesced:
        for j in range(width):
            y[5, j] += A[j] * F[j]
        for j in range(width):
            y[6, j] += A[j] * G[j]
        for j in range(width):
            FG[j] = F[j] + G[j]
    if glows:
        for t in range(terms):
            r = path.row[0, t]
            c, d = path.sent[0, t], path.found[0, t]
            if r < len(tables.spectra.glows) and tables.spectra.glows[r] >= 0 and (c != 0 or d != 0):
                for j in range(width):
                    X[j] = d * La[j] + c * h * Lb[j]
                luminesce(y[2], X, np.float32(1), r, width, tables.spectra)
                luminesce(y[4], R, c, r, width, tables.spectra)
                if luminesced:
                    luminesce(y[6], FG, c, r, width, tables.spectra)
                if tables.coated and tables.more.glows[r] >= 0:
                    for j in range(width):
                        X[j] += c * R[j]
                    if luminesced:
                        for j in range(width):
                            X[j] += c * FG[j]
                    for j in range(width):
                        y[6, j] += tables.more.reflectance[r, j] * X[j]
                    luminesce(y[6], X, np.float32(1), r, width, tables.more)


@cache
def compiled_for_lobes(width: int, terms: int, one_light: bool, component_errors: bool) -> Callable[..., int]:
    """Compile the sweep for a padded number of bands and a number of terms; see `compiled` of `kernel.py`."""
    version = _version()

    @numba.njit(nogil=True, fastmath=_FAST, _nrt=False)
    def kernel(first, stop, spp, parts, batches, log, tables, radiance, error, errors, at, scratch):  # type: ignore[no-untyped-def]
        _ = version
        path, tally, y, sums, total = scratch
        for p in range(first, stop):
            part = 0
            slot = np.int64(p * parts)
            entry = np.int64(0)
            next_part = 0
            for c in range(COMPONENT_COUNT):
                for j in range(width):
                    sums[c, j] = 0
            for b in range(batches):
                begin = b * spp // batches
                end = (b + 1) * spp // batches
                for c in range(COMPONENT_COUNT):
                    for j in range(width):
                        y[c, j] = 0
                for s in range(begin, end):
                    if s == next_part:
                        slot = np.int64(p * parts + part)
                        entry = np.int64(log.strips[slot // BLOCK, 0])
                        part += 1
                        next_part = part * spp // parts
                    n, source, light, slot, entry = _read_path(log, slot, entry, path, terms, one_light)
                    if n < 0:
                        return p
                    if source > 0:
                        _light(path.Lb, light, tables, width)
                        for j in range(width):
                            y[0, j] += source * path.Lb[j]
                    if n > 0:
                        luminesced = _propagate(path, n, terms, tables, width)
                        _collect(path, luminesced, terms, tables, y, width)
                for j in range(width):
                    total[j] = 0
                for c in range(COMPONENT_COUNT):
                    for j in range(width):
                        total[j] += y[c, j]
                    for j in range(width):
                        sums[c, j] += y[c, j]
                count(tally, TOTAL, total, end - begin, b, width)
                if component_errors:
                    for c in range(COMPONENT_COUNT):
                        count(tally, c, y[c], end - begin, b, width)
            store(
                at + p,
                sums,
                tally,
                spp,
                batches,
                tables.spectra.bands,
                component_errors,
                radiance,
                error,
                errors,
            )
        return stop

    keep_code(kernel, f"the sweep of {width} bands and {terms} lobes")
    return kernel  # type: ignore[no-any-return]


def _version() -> int:
    """Fingerprint of the other files whose code is compiled in: Numba looks at the date of this one only."""
    modules = (
        components_module,
        log_module,
        batches_module,
        luminesce_module,
        spectral_tables_module,
        lobe_module,
    )
    return zlib.crc32("".join(inspect.getsource(module) for module in modules).encode())
