"""Compiled code for the camera vertex: sums over samples, and the components they make.

The sums are kept for each material row that the pixel has seen, so that reflection and luminescence towards the camera
are done once for a row and a batch of samples, and not for each sample. A loop writes one array, because the
compiler has to prove that arrays do not overlap before it uses vector instructions, and gives up where there are many.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from fluorspar.paths.sweeping.luminesce import luminesce

__all__ = ["Pixel", "add_source", "close_batch", "close_pixel", "collect", "new_pixel"]


class Pixel(NamedTuple):
    """Sums at the camera vertex, by place: the rows that the pixel has seen, in the order in which it met them.

    Attributes
    ----------
    place : ndarray of shape (rows,)
        Place of a material row, -1 if the pixel has not seen it.
    row : ndarray of shape (places,)
        Material row at a place.
    batch : ndarray of shape (places, 4, B)
        E_D, R_1 - E_D, F_1, G_1, summed over the samples of the batch.
    direct : ndarray of shape (places,)
        With one light its part of E_D, as a number, until the batch ends.
    in_batch : ndarray of shape (places,)
        Whether the batch has met the row.
    sums : ndarray of shape (places, 4, B)
        `batch` of all batches that are closed.
    source, batch_source : ndarray of shape (B,)
        Light seen directly, of all closed batches and of this one.
    light, glow : ndarray of shape (B,)
        Scratch.
    """

    place: Any
    row: Any
    batch: Any
    direct: Any
    in_batch: Any
    sums: Any
    source: Any
    batch_source: Any
    light: Any
    glow: Any


def new_pixel(rows: int, places: int, width: int) -> Any:
    """Room for so many of the material rows."""
    return Pixel(
        np.full(rows, -1, dtype=np.int32),
        np.zeros(places, dtype=np.int64),
        np.zeros((places, 4, width), dtype=np.float32),
        np.zeros(places, dtype=np.float32),
        np.zeros(places, dtype=np.bool_),
        np.zeros((places, 4, width), dtype=np.float32),
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
    """Add the light arriving at the camera vertex of a path of n vertices to the batch of place `at`."""
    batch, vertex, weight = pixel.batch, path.vertex, path.weight
    R, F, G = path.R, path.F, path.G
    pixel.in_batch[at] = True
    if one_light:
        pixel.direct[at] += weight[0, 0] + weight[0, 1]
    else:
        w, h, a, b = weight[0, 0], weight[0, 1], vertex[0, 1], vertex[0, 2]
        for j in range(width):
            batch[at, 0, j] += w * L[a, j] + h * L[b, j]
    if n > 1:
        for j in range(width):
            batch[at, 1, j] += R[j]
        if luminesced:
            for j in range(width):
                batch[at, 2, j] += F[j]
            for j in range(width):
                batch[at, 3, j] += G[j]


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
    batch, light = pixel.batch, pixel.light
    for j in range(width):
        total[j] = pixel.batch_source[j]
    for j in range(width):
        pixel.source[j] += total[j]
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
        if one_light:
            e = pixel.direct[at]
            pixel.direct[at] = 0
            for j in range(width):
                batch[at, 0, j] = e * L[0, j]
        for j in range(width):
            light[j] = batch[at, 0, j] + batch[at, 1, j] + batch[at, 2, j] + batch[at, 3, j]
        for j in range(width):
            total[j] += S[r, j] * light[j]
        luminesce(total, light, np.float32(1), r, width, tables)
        if component_errors:
            _components(y, batch, at, r, tables, pixel, width)
        for q in range(4):
            for j in range(width):
                pixel.sums[at, q, j] += batch[at, q, j]
            for j in range(width):
                batch[at, q, j] = 0


@numba.njit(inline="always")
def close_pixel(pixel: Any, seen: int, y: Any, tables: Any, width: int) -> None:
    """Put the components, summed over the pixel's samples, into `y`, clear the sums and forget the rows."""
    _clear(y)
    for j in range(width):
        y[0, j] = pixel.source[j]
    for j in range(width):
        pixel.source[j] = 0
    for at in range(seen):
        r = pixel.row[at]
        pixel.place[r] = -1
        _components(y, pixel.sums, at, r, tables, pixel, width)
        for q in range(4):
            for j in range(width):
                pixel.sums[at, q, j] = 0


@numba.njit(inline="always")
def _components(y: Any, sums: Any, at: int, r: int, tables: Any, pixel: Any, width: int) -> None:
    """Add components 1-6 of material row `r` to `y`, from the sums E_D, R_1 - E_D, F_1, G_1 (Eqs. 3-13)."""
    S, light, glow = tables.reflectance, pixel.light, pixel.glow
    for q in range(4):
        c = 2 * q + 1 if q < 3 else 6
        for j in range(width):
            y[c, j] += S[r, j] * sums[at, q, j]
    if tables.glows[r] >= 0:
        for q in range(3):
            for j in range(width):
                light[j] = sums[at, q, j]
            if q == 2:
                for j in range(width):
                    light[j] += sums[at, 3, j]
            for j in range(width):
                glow[j] = 0
            luminesce(glow, light, np.float32(1), r, width, tables)
            for j in range(width):
                y[2 * q + 2, j] += glow[j]


@numba.njit(inline="always")
def _clear(y: Any) -> None:
    for c in range(y.shape[0]):
        for j in range(y.shape[1]):
            y[c, j] = 0
