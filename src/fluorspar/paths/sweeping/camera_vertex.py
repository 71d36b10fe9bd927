"""Compiled code for the camera vertex: sums over the samples of a pixel, and the components they make.

The sums are kept for each material row that the pixel has seen, so that reflection and luminescence towards the camera
are done once for a row and not for each sample.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from fluorspar.paths.sweeping.luminesce import luminesce

__all__ = ["add_source", "close_batch", "close_pixel", "collect", "flush", "new_pixel"]


class Pixel(NamedTuple):
    """Sums at the camera vertex, by place: the rows that the pixel has seen, in the order in which it met them.

    Attributes
    ----------
    place : (rows,)
        Place of a material row, -1 if the pixel has not seen it.
    row : (places,)
        Material row at a place.
    sums : (places, 4, B)
        E_D, R_1 - E_D, F_1, G_1 of the samples since the last flush.
    exact : (places, 4, B)
        Of those before it, in double precision, because single precision loses small terms in long sums.
    before : (places, 4, B)
        `sums` at the end of the last batch.
    batch : (places, B)
        All light of the batch; with one light its direct part is a number, `direct`, until the batch ends.
    in_batch : (places,)
        Whether the batch has met the row.
    source, batch_source : (B,)
        Light seen directly, of the pixel and of the batch.
    light, glow : (B,)
        Scratch.
    """

    place: Any
    row: Any
    sums: Any
    exact: Any
    before: Any
    batch: Any
    direct: Any
    in_batch: Any
    source: Any
    batch_source: Any
    light: Any
    glow: Any


@numba.njit(inline="always")
def new_pixel(rows: int, places: int, width: int) -> Any:
    """Room for so many of the material rows."""
    return Pixel(
        np.full(rows, -1, dtype=np.int32),
        np.zeros(places, dtype=np.int64),
        np.zeros((places, 4, width), dtype=np.float32),
        np.zeros((places, 4, width), dtype=np.float64),
        np.zeros((places, 4, width), dtype=np.float32),
        np.zeros((places, width), dtype=np.float32),
        np.zeros(places, dtype=np.float32),
        np.zeros(places, dtype=np.bool_),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
    )


@numba.njit(inline="always")
def add_source(pixel: Any, weight: Any, light: int, L: Any, width: int) -> None:
    """Add light seen directly: there is no vertex before it."""
    for j in range(width):
        pixel.batch_source[j] += weight * L[light, j]


@numba.njit(inline="always")
def collect(
    pixel: Any, at: int, path: Any, n: int, luminesced: bool, L: Any, one_light: bool, width: int
) -> None:
    """Add the light arriving at the camera vertex of a path of n vertices to the sums of place `at`."""
    sums, batch, vertex, weight = pixel.sums, pixel.batch, path.vertex, path.weight
    R, F, G = path.R, path.F, path.G
    pixel.in_batch[at] = True
    if one_light:
        pixel.direct[at] += weight[0, 0] + weight[0, 1]
    else:
        a, b = vertex[0, 1], vertex[0, 2]
        for j in range(width):
            e = weight[0, 0] * L[a, j] + weight[0, 1] * L[b, j]
            sums[at, 0, j] += e
            batch[at, j] += e
    if n > 1:
        if luminesced:
            for j in range(width):
                sums[at, 1, j] += R[j]
                sums[at, 2, j] += F[j]
                sums[at, 3, j] += G[j]
                batch[at, j] += R[j] + F[j] + G[j]
        else:
            for j in range(width):
                sums[at, 1, j] += R[j]
                batch[at, j] += R[j]


@numba.njit(inline="always")
def close_batch(
    pixel: Any,
    seen: int,
    y: Any,
    total: Any,
    tables: Any,
    one_light: bool,
    component_errors: bool,
    width: int,
) -> None:
    """Put the sum over the batch's samples into `total`, and into `y` for each component if that is asked for."""
    S, L = tables.reflectance, tables.lights
    sums, before, batch, light = pixel.sums, pixel.before, pixel.batch, pixel.light
    for j in range(width):
        total[j] = pixel.batch_source[j]
        pixel.source[j] += pixel.batch_source[j]
        pixel.batch_source[j] = 0
    if component_errors:
        _clear(y)
        for j in range(width):
            y[0, j] = total[j]
    for at in range(seen):
        if not pixel.in_batch[at]:
            continue
        pixel.in_batch[at] = False
        r = pixel.row[at]
        e = pixel.direct[at]
        pixel.direct[at] = 0
        if one_light:
            for j in range(width):
                sums[at, 0, j] += e * L[0, j]
                light[j] = batch[at, j] + e * L[0, j]
        else:
            for j in range(width):
                light[j] = batch[at, j]
        for j in range(width):
            total[j] += S[r, j] * light[j]
            batch[at, j] = 0
        luminesce(total, light, np.float32(1), r, width, tables)
        if component_errors:
            for q in range(4):
                for j in range(width):
                    before[at, q, j] = sums[at, q, j] - before[at, q, j]
            _components(y, before, at, r, tables, light, pixel.glow, width)
            for q in range(4):
                for j in range(width):
                    before[at, q, j] = sums[at, q, j]


@numba.njit(inline="always")
def flush(pixel: Any, seen: int, width: int) -> None:
    """Move the sums to double precision."""
    for at in range(seen):
        for q in range(4):
            for j in range(width):
                pixel.exact[at, q, j] += pixel.sums[at, q, j]
                pixel.sums[at, q, j] = 0
                pixel.before[at, q, j] = 0


@numba.njit(inline="always")
def close_pixel(pixel: Any, seen: int, y: Any, tables: Any, flushed: bool, width: int) -> None:
    """Put the components, summed over the pixel's samples, into `y`, clear the sums and forget the rows."""
    _clear(y)
    for j in range(width):
        y[0, j] = pixel.source[j]
        pixel.source[j] = 0
    for at in range(seen):
        if flushed:
            for q in range(4):
                for j in range(width):
                    pixel.sums[at, q, j] = pixel.exact[at, q, j] + pixel.sums[at, q, j]
                    pixel.exact[at, q, j] = 0
        r = pixel.row[at]
        pixel.place[r] = -1
        _components(y, pixel.sums, at, r, tables, pixel.light, pixel.glow, width)
        for q in range(4):
            for j in range(width):
                pixel.sums[at, q, j] = 0
                pixel.before[at, q, j] = 0


@numba.njit(inline="always")
def _components(y: Any, sums: Any, at: int, r: int, tables: Any, light: Any, glow: Any, width: int) -> None:
    """Add components 1-6 of material row `r` to `y`, from the sums E_D, R_1 - E_D, F_1, G_1 (Eqs. 3-13)."""
    S = tables.reflectance
    for j in range(width):
        y[1, j] += S[r, j] * sums[at, 0, j]
        y[3, j] += S[r, j] * sums[at, 1, j]
        y[5, j] += S[r, j] * sums[at, 2, j]
        y[6, j] += S[r, j] * sums[at, 3, j]
    if tables.glows[r] >= 0:
        for c in range(3):
            for j in range(width):
                light[j] = sums[at, c, j] if c < 2 else sums[at, 2, j] + sums[at, 3, j]
                glow[j] = 0
            luminesce(glow, light, np.float32(1), r, width, tables)
            for j in range(width):
                y[2 * c + 2, j] += glow[j]


@numba.njit(inline="always")
def _clear(y: Any) -> None:
    for c in range(y.shape[0]):
        for j in range(y.shape[1]):
            y[c, j] = 0
