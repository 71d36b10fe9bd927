"""What makes code of the CPU's sweep run on a GPU: the 32 threads of a warp share the bands of one pixel.

Thread l keeps neighbouring bands, l x K to (l + 1) x K, and runs the functions that a CPU runs for all of them. Only
what looks at the bands of others is another function here: luminescence, which sums over the bands below.
Bands lie as [K][32], so that the threads read what lies side by side.
"""

from __future__ import annotations

from types import FunctionType
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import config, cuda
from numba.core.dispatcher import Dispatcher
from numpy.typing import NDArray

from fluorspar.paths.sweeping.batches import store
from fluorspar.paths.sweeping.spectral_tables import SpectralTables

__all__ = [
    "ALL",
    "INLINED",
    "LIMITS",
    "WARP",
    "LaneTables",
    "for_gpu",
    "lane_tables",
    "lay_out",
    "store_of_lane",
    "tables_for_warps",
    "together",
    "warp_luminesce",
]

WARP = 32  # threads
ALL = 0xFFFFFFFF  # of them
# By NVIDIA's compiler: Numba's own way of inlining makes the same code, but takes three times as long to compile.
INLINED: Any = {"device": True} if config.ENABLE_CUDASIM else {"device": True, "forceinline": True}
# Of 32-bit registers for each thread, so that 16 warps run at a time on a processor; a simulator has none.
LIMITS = {} if config.ENABLE_CUDASIM else {"max_registers": 128}


def for_gpu(function: Any, **instead: Any) -> Any:
    """Compile a function of the CPU's sweep for a GPU, and those it calls, with others `instead` of some of them."""
    python = function.py_func
    scope = dict(python.__globals__)
    for name in python.__code__.co_names:
        if name in instead:
            scope[name] = instead[name]
        elif isinstance(scope.get(name), Dispatcher):
            scope[name] = for_gpu(scope[name], **instead)
    copy = FunctionType(python.__code__, scope, python.__name__)
    return cuda.jit(**INLINED)(copy)


def lay_out(values: NDArray[np.float32], bands: int) -> NDArray[np.float32]:
    """Lay bands out for a warp.

    Parameters
    ----------
    values : ndarray of shape (..., B)
    bands : int
        How many of the B are not padding.

    Returns
    -------
    ndarray of shape (..., K, 32)

    Examples
    --------
    >>> lay_out(np.arange(48, dtype=np.float32), 40)[:, 1].tolist()
    [2.0, 3.0]
    """
    each = -(-bands // WARP)
    out = np.zeros((*values.shape[:-1], each * WARP), dtype=np.float32)
    out[..., :bands] = values[..., :bands]
    return np.ascontiguousarray(out.reshape(*values.shape[:-1], WARP, each).swapaxes(-1, -2))


class LaneTables(NamedTuple):
    """`SpectralTables` as one thread sees them: the spectra are K bands long.

    Attributes
    ----------
    lane : int
        Number of the thread in its warp.
    matrices : ndarray of shape (full matrices, 32 K, K)
        By excitation of all bands.
    """

    lane: Any
    bands: Any
    lights: Any
    reflectance: Any
    first: Any
    last: Any
    full: Any
    alpha: Any
    beta: Any
    equal: Any
    matrices: Any
    glows: Any
    glow: Any


def tables_for_warps(tables: SpectralTables) -> SpectralTables:
    """Lay the spectra out for warps."""
    spectra: dict[str, Any] = {
        name: lay_out(getattr(tables, name), tables.bands)
        for name in ("lights", "reflectance", "alpha", "beta", "matrices", "glow")
    }
    by_excitation = spectra["matrices"][:, : tables.bands]
    missing = spectra["lights"][0].size - tables.bands
    spectra["matrices"] = np.pad(by_excitation, ((0, 0), (0, missing), (0, 0), (0, 0)))
    return tables._replace(**spectra)


@cuda.jit(**INLINED)
def lane_tables(tables: Any, lane: int) -> Any:
    """See tables of `tables_for_warps` as one thread does."""
    return LaneTables(
        lane,
        tables.bands,
        tables.lights[:, :, lane],
        tables.reflectance[:, :, lane],
        tables.first,
        tables.last,
        tables.full,
        tables.alpha[:, :, lane],
        tables.beta[:, :, lane],
        tables.equal,
        tables.matrices[:, :, :, lane],
        tables.glows,
        tables.glow[:, :, :, lane],
    )


@cuda.jit(**INLINED)
def together() -> None:
    """Wait for the other threads of the warp."""
    cuda.syncwarp()


@cuda.jit(**INLINED)
def warp_luminesce(out: Any, light: Any, scale: Any, row: int, width: int, tables: Any) -> None:
    """Add `scale` times Phi E to `out`, see `luminesce`; `width` is K. All threads of a warp must call it."""
    full = tables.full[row]
    if full >= 0:
        for lane in range(-(-tables.bands // width)):
            for i in range(width):
                e = scale * cuda.shfl_sync(ALL, light[i], lane)
                for j in range(width):
                    out[j] += tables.matrices[full, lane * width + i, j] * e
    for q in range(tables.first[row], tables.last[row]):
        own = numba.float32(0)
        for j in range(width):
            own += tables.beta[q, j] * light[j]
        below = own  # then: of all lanes up to this one
        for step in range(5):
            by = 1 << step
            more = cuda.shfl_up_sync(ALL, below, by)
            if tables.lane >= by:
                below += more
        below -= own
        for j in range(width):
            x = tables.beta[q, j] * light[j]
            out[j] += scale * tables.alpha[q, j] * (below + tables.equal * x)
            below += x


_store = for_gpu(store)


@cuda.jit(**INLINED)
def store_of_lane(
    p: int,
    y: Any,
    tally: Any,
    spp: int,
    batches: int,
    tables: Any,
    errors_too: bool,
    out: Any,
    width: int,
    lamps: int,
) -> None:
    """Write what one thread has of pixel `p`, see `store`."""
    radiance, error, errors, halves = out
    bands = radiance.shape[2]
    begin = tables.lane * width - (tables.bands - bands)  # in the image
    first = min(max(begin, 0), bands)
    stop = min(max(begin + width, 0), bands)
    _store(
        p,
        y,
        tally,
        spp,
        batches,
        stop - begin,
        errors_too,
        radiance[:, :, first:stop],
        error[:, first:stop],
        errors[:, :, first:stop],
        halves[:, :, first:stop],
        p,
        lamps,
    )
