"""Compiled code for Phi E, the integral of D_L E over excitation (Eq. 7 of the paper), up to the Stokes limit."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

__all__ = ["luminesce", "luminesce_both"]


@numba.njit(inline="always")
def luminesce(out: Any, light: Any, absorbed: Any, row: int, width: int, tables: Any) -> None:
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
def luminesce_both(
    out: Any,
    light: Any,
    absorbed: Any,
    out2: Any,
    light2: Any,
    absorbed2: Any,
    row: int,
    width: int,
    tables: Any,
) -> None:
    """Do as `luminesce` for two lights at once; the running sums wait for one another, not for themselves."""
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
