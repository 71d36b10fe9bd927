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

import math
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
from fluorspar.paths.sweeping import kernel as kernel_module
from fluorspar.paths.sweeping import luminesce as luminesce_module
from fluorspar.paths.sweeping import registers as registers_module
from fluorspar.paths.sweeping import spectral_tables as spectral_tables_module
from fluorspar.paths.sweeping.batches import COMPONENT_COUNT, TOTAL, Tally, count, new_tally, store
from fluorspar.paths.sweeping.kept_code import FAST, fingerprint, keep_code
from fluorspar.paths.sweeping.kernel import together
from fluorspar.paths.sweeping.luminesce import luminesce
from fluorspar.paths.sweeping.registers import collect, colour, reflect
from fluorspar.paths.sweeping.spectral_tables import SpectralTables, spectral_tables
from fluorspar.scene.lobes import lobe as lobe_module
from fluorspar.scene.lobes.lobe import ANGLES, DARK, FULL, METAL, REST, Lobes

__all__ = ["LobeTables", "compiled_for_lobes", "lobe_tables", "new_lobe_scratch"]

_VERTICES = 32


class LobeTables(NamedTuple):
    """Spectra of rows and lights, and what makes spectra of the colours of texels.

    Attributes
    ----------
    spectra : SpectralTables
        If `coated`, another row follows for each: what luminesces more than once at one surface, under its coat.
    rows : int
        Rows that paths refer to; the texels follow.
    coated : bool
    components : ndarray of int64
        Components that occur, except where nothing luminesces.
    colours, light_colours : ndarray of shape (texels, 4), float32
        See `Lobes`. Rows of metals with a texture follow, `ANGLES` for each texel.
    wavelengths : ndarray of shape (B,), float32
        In nm, within the range for which the coefficients are meant; padded with the last.
    """

    spectra: SpectralTables
    rows: int
    coated: bool
    components: NDArray[np.int64]
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
    spectra = spectral_tables([*matrices, *(more or ())], lights)
    values = np.clip(matrices[0].wavelengths.values, 360.0, 830.0)
    width = spectra.reflectance.shape[1]
    wavelengths = np.concatenate([values, np.repeat(values[-1:], width - len(values))])
    return LobeTables(
        spectra,
        len(matrices),
        more is not None,
        np.arange(COMPONENT_COUNT) if (spectra.glows >= 0).any() else np.array([0, 1, 3]),
        lobes.colours,
        lobes.light_colours,
        wavelengths.astype(np.float32),
    )


class LobePath(NamedTuple):
    """One path: what is recorded of it, and the light that arrives at the vertex it has been swept to.

    Attributes
    ----------
    row, found, sent : ndarray of shape (terms,)
        Of all its vertices, one after another, without terms that are 0: the row, d and c. A row of the table that a
        texel has is one beyond it.
    first : ndarray of shape (vertices + 1,)
        Where the terms of a vertex begin.
    hit, lights : ndarray of shape (vertices,) and (vertices, 2)
        h, and the rows of L_a and L_b.
    own, shining : ndarray of shape (terms, B) and (2, B)
        Spectra of texels: those of the terms of a vertex, L_a and L_b.
    A, R : ndarray of shape (B,)
    excites : ndarray of shape (4, B)
        What excites luminescence: direct light, light that has luminesced never and more often, and all of it.
    """

    row: Any
    found: Any
    sent: Any
    first: Any
    hit: Any
    lights: Any
    own: Any
    shining: Any
    A: Any
    R: Any
    excites: Any


class LobeScratch(NamedTuple):
    """What a sweep works in.

    `y` (9, B) is the light of a batch by component, and then F and G; `sums` (7, B) that of all batches that are
    closed.
    """

    path: LobePath
    tally: Tally
    y: NDArray[np.float32]
    sums: NDArray[np.float32]
    total: NDArray[np.float32]


_F, _G = COMPONENT_COUNT, COMPONENT_COUNT + 1


def new_lobe_scratch(terms: int, width: int, room: int) -> LobeScratch:
    """Scratch for paths of up to 32 times `room` vertices."""
    vertices = _VERTICES * room
    fields: list[Any] = [
        np.zeros(vertices * terms, dtype=np.int64),
        *np.zeros((2, vertices * terms), dtype=np.float32),
        np.zeros(vertices + 1, dtype=np.int64),
        np.zeros(vertices, dtype=np.float32),
        np.zeros((vertices, 2), dtype=np.int64),
        *(np.zeros((count, width), dtype=np.float32) for count in (terms, 2)),
        *np.zeros((2, width), dtype=np.float32),
        np.zeros((4, width), dtype=np.float32),
    ]
    path = LobePath(*fields)
    y, sums = (np.zeros((count, width), dtype=np.float32) for count in (_G + 1, COMPONENT_COUNT))
    return LobeScratch(path, new_tally(width), y, sums, np.zeros(width, dtype=np.float32))


@numba.njit(inline="always")
def _read_path(log: Any, slot: Any, entry: Any, path: Any, terms: int, one_light: bool) -> Any:
    """Read the path that begins at an entry of a slot; see `read_path` of `propagate.py`."""
    n = 0
    source = np.float32(0)
    source_light = np.int64(0)
    block = slot // BLOCK
    stride = len(log.sampled)
    term = 0
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
            at = i + t * stride
            c, d = log.weight[at], log.direct[at]
            if c != 0 or d != 0:
                path.row[term] = log.row[at]
                path.found[term] = d
                path.sent[term] = c
                goes_on = goes_on or c != 0
                term += 1
        path.hit[n] = 0
        if not one_light:
            path.lights[n, 0] = log.direct_light[i]
            path.lights[n, 1] = 0
        n += 1
        path.first[n] = term
        if not goes_on:
            break
    return n, source, source_light, slot, entry


@numba.njit(inline="always")
def _put_spectra(path: Any, k: int, tables: Any, width: int) -> bool:
    """Put the spectra of the texels at a vertex into the path; return whether one of its terms luminesces."""
    glows = False
    first = path.first[k]
    for term in range(first, path.first[k + 1]):
        if path.row[term] >= tables.rows:
            _put_colour(path, term - first, tables, path.row[term] - tables.rows, width)
        elif tables.spectra.glows[path.row[term]] >= 0:
            glows = True
    return glows


@numba.njit(inline="always")
def _put_colour(path: Any, to: int, tables: Any, number: int, width: int) -> None:
    """Put the spectrum of a texel into the path, with what a lobe makes of it; see `operate`."""
    angle = np.int64(-1)
    if number >= len(tables.colours):  # of a metal
        angle = np.int64((number - len(tables.colours)) % ANGLES)
        number = (number - len(tables.colours)) // ANGLES
    c0, c1, c2, operation = tables.colours[number]
    colour(path.own, tables, to, width, c0, c1, c2)
    if operation == 0:
        return
    one, two = np.float32(1), np.float32(2)
    out = path.own
    if angle >= 0:
        metal = np.int64(np.float32(METAL) - operation) + angle
        for j in range(width):
            out[to, j] *= tables.spectra.reflectance[metal, j]
        return
    if operation > 0:
        for j in range(width):
            out[to, j] = out[to, j] * (one - operation) / (one - operation * out[to, j])
    elif operation == REST:
        for j in range(width):
            out[to, j] = one - out[to, j]
    else:
        # k0 + k1 s + k2 S, with the root s of S.
        k0, k1, k2 = np.float32(0), two * two, -two * two
        if operation == DARK:
            k0, k1, k2 = one, -one - two, two
        elif operation == FULL:
            k1, k2 = -one, two
        for j in range(width):
            out[to, j] = k0 + k1 * math.sqrt(out[to, j]) + k2 * out[to, j]


@numba.njit(inline="always")
def _light(out: Any, to: int, row: int, tables: Any, width: int) -> None:
    """Put the spectrum of a light into a row of `out`: one of the table, or one of it times the colour of a texel."""
    L = tables.spectra.lights
    if row < len(L):
        for j in range(width):
            out[to, j] = L[row, j]
    else:
        c0, c1, c2, number = tables.light_colours[row - len(L)]
        white = np.int64(number)
        colour(out, tables, to, width, c0, c1, c2)
        for j in range(width):
            out[to, j] *= L[white, j]


@numba.njit(inline="always")
def _sweep_path(path: Any, n: int, tables: Any, y: Any, width: int) -> None:
    """Sweep from vertex n - 1 to vertex 0, and add the components that it sends to the camera to `y`."""
    R, A, excites, shining = path.R, path.A, path.excites, path.shining
    luminesced = False
    for j in range(width):
        R[j] = 0
    for k in range(n - 1, -1, -1):
        glows = _put_spectra(path, k, tables, width)
        h, a, b = path.hit[k], path.lights[k, 0], path.lights[k, 1]
        if glows or a >= len(tables.spectra.lights):
            _light(shining, 0, a, tables, width)
        if glows or b >= len(tables.spectra.lights):
            _light(shining, 1, b, tables, width)
        if glows:
            for j in range(width):
                excites[1, j] = R[j]
        if k > 0:
            reflect(path, tables, k, width)
        else:
            collect(path, tables, k, width, y)
        if luminesced:
            if glows:
                for j in range(width):
                    excites[2, j] = y[_F, j] + y[_G, j]
            if k > 0:
                for j in range(width):
                    y[_F, j] *= A[j]
                for j in range(width):
                    y[_G, j] *= A[j]
            else:
                for j in range(width):
                    y[5, j] += A[j] * y[_F, j]
                for j in range(width):
                    y[6, j] += A[j] * y[_G, j]
        if glows:
            if not luminesced:
                for q in range(_F, _G + 1):
                    for j in range(width):
                        y[q, j] = 0
                for j in range(width):
                    excites[2, j] = 0
            luminesced = _luminesce_terms(path, k, h, luminesced, tables, y, width)


@numba.njit(inline="always")
def _luminesce_terms(path: Any, k: int, h: Any, luminesced: bool, tables: Any, y: Any, width: int) -> bool:
    """Add what the terms of a vertex luminesce to F and G, or to the components that it sends to the camera."""
    X, R, FG, every = path.excites[0], path.excites[1], path.excites[2], path.excites[3]
    la, lb = path.shining[0], path.shining[1]
    for term in range(path.first[k], path.first[k + 1]):
        r = path.row[term]
        if r >= tables.rows or tables.spectra.glows[r] < 0:
            continue
        c, d = path.sent[term], path.found[term]
        for j in range(width):
            every[j] = 0
        # Of direct light, of light that has luminesced never, and more often; and more than once under the coat.
        for q in range(4):
            row = r
            if q == 0:
                for j in range(width):
                    X[j] = d * la[j] + c * h * lb[j]
                if k > 0:  # direct or not is only told apart towards the camera
                    for j in range(width):
                        X[j] += c * R[j]
            elif q == 1:
                if k > 0:
                    continue
                for j in range(width):
                    X[j] = c * R[j]
            elif q == 2:
                if not luminesced:
                    continue
                for j in range(width):
                    X[j] = c * FG[j]
            else:
                if not tables.coated:
                    continue
                row = r + tables.rows
                for j in range(width):
                    X[j] = every[j]
            to = (_F if q < 2 else _G) if k > 0 else min(2 * q + 2, 6)
            if q == 3:
                for j in range(width):
                    y[to, j] += tables.spectra.reflectance[row, j] * X[j]
            elif tables.coated:
                for j in range(width):
                    every[j] += X[j]
            luminesce(y[to], X, np.float32(1), row, width, tables.spectra)
    return True


@numba.njit(inline="always")
def sweep_lobe_pixel(
    p: int,
    spp: int,
    parts: int,
    batches: int,
    log: Any,
    tables: Any,
    scratch: Any,
    component_errors: bool,
    width: int,
) -> int:
    """Sweep all samples of a pixel into `sums` and `tally` of the scratch; see `sweep_pixel` of `kernel.py`."""
    path, tally, y, sums, total = scratch
    terms = len(log.row) // len(log.sampled)
    one_light = len(log.direct_light) == 0
    part = 0
    lamps = 0
    slot = np.int64(p * parts)
    entry = np.int64(0)
    next_part = 0
    for c in tables.components:
        for j in range(width):
            sums[c, j] = 0
    for b in range(batches):
        begin = b * spp // batches
        end = (b + 1) * spp // batches
        for c in tables.components:
            for j in range(width):
                y[c, j] = 0
        for s in range(begin, end):
            if s == next_part:
                slot = np.int64(p * parts + part)
                entry = np.int64(log.strips[slot // BLOCK, 0])
                part += 1
                next_part = part * spp // parts
            together()
            n, source, light, slot, entry = _read_path(log, slot, entry, path, terms, one_light)
            together()
            if n < 0:
                return -1
            if source > 0:
                lamps += 1
                _light(path.shining, 1, light, tables, width)
                for j in range(width):
                    y[0, j] += source * path.shining[1, j]
            if n > 0:
                _sweep_path(path, n, tables, y, width)
        for j in range(width):
            total[j] = 0
        for c in tables.components:
            for j in range(width):
                total[j] += y[c, j]
            for j in range(width):
                sums[c, j] += y[c, j]
        count(tally, TOTAL, total, end - begin, b, batches, width)
        if component_errors:
            for c in tables.components:
                count(tally, c, y[c], end - begin, b, batches, width)
    return lamps


@cache
def compiled_for_lobes(width: int) -> Callable[..., int]:
    """Compile the sweep for a padded number of bands; see `compiled` of `kernel.py`."""
    version = fingerprint(
        components_module,
        log_module,
        batches_module,
        kernel_module,
        luminesce_module,
        registers_module,
        spectral_tables_module,
        lobe_module,
    )

    @numba.njit(nogil=True, fastmath=FAST, _nrt=False)
    def kernel(first, stop, spp, parts, batches, log, tables, radiance, error, errors, halves, at, scratch):  # type: ignore[no-untyped-def]
        _ = version
        component_errors = errors.shape[1] > 0
        for p in range(first, stop):
            lamps = sweep_lobe_pixel(p, spp, parts, batches, log, tables, scratch, component_errors, width)
            if lamps < 0:
                return p
            store(
                at + p,
                scratch.sums,
                scratch.tally,
                spp,
                batches,
                tables.spectra.bands,
                component_errors,
                radiance,
                error,
                errors,
                halves,
                p,
                lamps,
            )
        return stop

    keep_code(kernel, f"the sweep of {width} bands and lobes")
    return kernel  # type: ignore[no-any-return]
