"""What NVIDIA's compiler makes of the sweep: it needs no GPU, and refuses what Numba's simulator runs as plain Python.

Expected
    It compiles for the oldest GPU that has independent threads, and computes nothing in double precision, which takes
    up to 64 times as long on a GPU.
"""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numba import cuda, typeof, types
from test_sweep import Paths, lamps, make_materials

from fluorspar import load_scene
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import trace_chunks
from fluorspar.paths.log import Chunk, flat
from fluorspar.paths.render import tables_of
from fluorspar.paths.sweeping.spectral_tables import spectral_tables

CAPABILITY = (7, 5)


@pytest.fixture(autouse=True)
def _compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        assert cuda.implementation == "NVIDIA"  # what Numba itself still has is an older one
        cuda.compile_ptx(lambda values: None, (types.float32[::1],), cc=CAPABILITY)
    except Exception as err:  # without numba-cuda, NVIDIA's libraries or in the simulator: of many classes
        pytest.skip(f"no compiler for GPUs, pip install 'fluorspar[cuda]' ({type(err).__name__})")
    # Numba asks the GPU there is for which one the functions that a kernel calls are.
    gpu = SimpleNamespace(compute_capability=CAPABILITY)
    monkeypatch.setattr("numba.cuda.dispatcher.get_current_device", lambda: gpu)


def code(kernel: Any, chunk: Chunk, tables: Any, room: Any) -> str:
    from fluorspar.paths.sweeping.cuda_kernel import Output

    arrays = type(room)(*(np.empty((1, *shape), kind) for shape, kind in room))
    floats = np.empty((1, 1, 1), np.float32)
    out = Output(floats, floats[0], floats, floats)
    given = (flat(chunk.log), tables, arrays, out, np.zeros(1, np.int32))
    signature = (*[types.int64] * 5, *map(typeof, given))
    ptx, _ = cuda.compile_ptx(kernel.py_func, signature, cc=CAPABILITY)
    return str(ptx)


@pytest.mark.parametrize("lights", [1, 3])
def test_matte(lights: int) -> None:
    from fluorspar.paths.sweeping.cuda_kernel import compiled_for_warps, room_for_warps
    from fluorspar.paths.sweeping.warp import tables_for_warps

    materials = make_materials()
    chunk = Paths(1, 1, lights=lights, rows=len(materials)).chunk()
    tables = tables_for_warps(spectral_tables(materials, lamps(lights)))
    rows, each, _ = tables.reflectance.shape
    ptx = code(compiled_for_warps(each, lights == 1, True), chunk, tables, room_for_warps(rows, each, 8))
    assert not re.findall(r"\w+\.f64", ptx)


def test_general_surfaces() -> None:
    from fluorspar.paths.sweeping.cuda_lobe_kernel import (
        compiled_for_warps_and_lobes,
        lobe_tables_for_warps,
        room_for_warps_and_lobes,
    )

    scene = load_scene("still-life").with_settings(width=1, height=1, spp=1)
    job = RenderJob(scene, seed=1, variant="llvm")
    (chunk,) = trace_chunks(job)
    tables = lobe_tables_for_warps(tables_of(job))
    each = tables.spectra.reflectance.shape[1]
    terms = len(chunk.log.row)
    ptx = code(
        compiled_for_warps_and_lobes(each, True), chunk, tables, room_for_warps_and_lobes(terms, each, 8)
    )
    assert not re.findall(r"\w+\.f64", ptx)
