"""Compiled code that reads one path from the log and carries its light from the last vertex to the first."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from fluorspar.paths.log import BLOCK, END
from fluorspar.paths.sweeping.luminesce import luminesce

__all__ = ["Path", "new_path", "propagate", "read_path"]


class Path(NamedTuple):
    """One path: what is recorded of it, and the light arriving at the vertex it has been swept to.

    `vertex` columns: material row, light rows of w and h. `weight` columns: w, f h, f. R, F, G have luminesced never,
    once, more often; FG is their sum.
    """

    vertex: Any
    weight: Any
    R: Any
    F: Any
    G: Any
    FG: Any


def new_path(room: int, width: int) -> Any:
    """Room for a path of so many vertices."""
    return Path(
        np.zeros((room, 3), dtype=np.int64),
        np.zeros((room, 3), dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
        np.zeros(width, dtype=np.float32),
    )


@numba.njit(inline="always")
def read_path(log: Any, slot: Any, entry: Any, path: Any, one_light: bool) -> Any:
    """Read the path that begins at an entry of a slot.

    Returns the number of vertices, -1 if there is no room for them; the weight of light seen directly and its light
    row; and the slot and the entry at which the lane's next path begins.
    """
    n = 0
    source = np.float32(0)
    source_light = np.int64(0)
    block = slot // BLOCK
    while True:
        if entry == log.strips[block, 1]:
            slot = np.int64(log.goes_on[slot])
            block = slot // BLOCK
            entry = log.strips[block, 0]
        i = entry * BLOCK + slot % BLOCK
        entry += 1
        sampled = log.sampled[i]
        if n == 0:
            source = sampled
            if not one_light:
                source_light = np.int64(log.sampled_light[i])
        else:
            path.weight[n - 1, 1] = path.weight[n - 1, 2] * sampled
            if not one_light:
                path.vertex[n - 1, 2] = log.sampled_light[i]
        row = log.row[i]
        if row == END:
            break
        f = log.weight[i]
        if n == len(path.vertex):
            n = -1
            break
        path.vertex[n, 0] = row
        path.weight[n, 0] = log.direct[i]
        path.weight[n, 1] = 0
        path.weight[n, 2] = f
        if not one_light:
            path.vertex[n, 1] = log.direct_light[i]
            path.vertex[n, 2] = 0
        n += 1
        if f == 0:
            break
    return n, source, source_light, slot, entry


@numba.njit(inline="always")
def propagate(path: Any, n: int, tables: Any, one_light: bool, width: int) -> bool:
    """Sweep from vertex n - 1 to vertex 0; R is then R_1 - E_D there. Return whether the path has luminesced."""
    S, L = tables.reflectance, tables.lights
    vertex, weight = path.vertex, path.weight
    R, F, G, FG = path.R, path.F, path.G, path.FG
    luminesced = False
    twice = False  # until then G is 0
    k = n - 1
    if k > 0:
        w, h = weight[k, 0], weight[k, 1]
        a, b = vertex[k, 1], vertex[k, 2]
        if one_light:
            e = w + h
            for j in range(width):
                R[j] = e * L[0, j]
        else:
            for j in range(width):
                R[j] = w * L[a, j] + h * L[b, j]
        glow = tables.glows[vertex[k, 0]]
        if glow >= 0:
            # Only lamps light the last vertex, and what a material makes of their light is in a table.
            luminesced = True
            f = weight[k - 1, 2]
            if one_light:
                e = f * (w + h)
                for j in range(width):
                    F[j] = e * tables.glow[glow, 0, j]
                    G[j] = 0
            else:
                for j in range(width):
                    F[j] = f * (w * tables.glow[glow, a, j] + h * tables.glow[glow, b, j])
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
            if luminesced:
                twice = True
                for j in range(width):
                    FG[j] = F[j] + G[j]
                    F[j] *= f * S[r, j]
                    G[j] *= f * S[r, j]
                luminesce(G, FG, f, r, width, tables)
            else:
                luminesced = True
                for j in range(width):
                    F[j] = 0
                    G[j] = 0
            luminesce(F, R, f, r, width, tables)
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
            a, b = vertex[k, 1], vertex[k, 2]
            for j in range(width):
                R[j] = f * S[r, j] * R[j] + w * L[a, j] + h * L[b, j]
    return luminesced
