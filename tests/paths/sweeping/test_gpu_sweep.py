"""The sweep on a GPU against that on the CPU; without a GPU in Numba's simulator, in a process of its own.

Rationale
    Both run the same functions, but a thread of a GPU keeps some of the bands, and the records of a path are shared by
    a warp. What may differ are luminescence, texels, the layout of tables and results, and room that runs out.
Expected
    Equal up to the rounding of sums in single precision.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import config
from test_sweep import N, Paths, lamps, make_materials

from fluorspar import load_scene
from fluorspar.errors import RendererError
from fluorspar.image.pixels import Pixels
from fluorspar.job import RenderJob, read_grid
from fluorspar.paths.chunks import trace_chunks
from fluorspar.paths.log import Chunk
from fluorspar.paths.render import render_chunks, tables_of
from fluorspar.paths.sweeping.gpu import why_not_on_gpu
from fluorspar.paths.sweeping.spectral_tables import spectral_tables
from fluorspar.paths.sweeping.sweep import sweep
from fluorspar.scene.sample_sets import sample_sets

SIMULATED = bool(config.ENABLE_CUDASIM)
if SIMULATED:
    import simulated_warps

    simulated_warps.install()

needs_gpu = pytest.mark.skipif(
    not SIMULATED and why_not_on_gpu() is not None, reason="no GPU; the simulator is tried instead"
)


@pytest.mark.skipif(SIMULATED, reason="is in the simulator")
def test_in_the_simulator() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "0"},
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "passed" in done.stdout


def both(
    chunk: Chunk, tables: Any, bands: int, *, component_errors: bool = True, samples: int | None = None
) -> tuple[Pixels, Pixels]:
    """Sweep on the CPU and on the GPU, with two pixels in front."""
    from fluorspar.paths.sweeping.cuda_sweep import SweepOnGpu

    results = []
    with ThreadPoolExecutor(2) as pool:
        for gpu in (None, SweepOnGpu(tables, component_errors)):
            out = Pixels.empty(chunk.pixels + 2, bands, component_errors)
            sweep(chunk, tables, pool, out, 2, samples, gpu)
            results.append(out[2:])
    return results[0], results[1]


def assert_equal(results: tuple[Pixels, Pixels]) -> None:
    scale = results[0].radiance.max()
    assert scale > 0
    for cpu, gpu in zip(*map(astuple, results), strict=True):
        if cpu is not None:
            np.testing.assert_allclose(gpu, cpu, rtol=2e-5, atol=1e-6 * scale)


@needs_gpu
@pytest.mark.parametrize(
    ("lights", "component_errors", "stokes"),
    [(1, False, "half"), (1, True, "strict"), (3, False, "strict"), (3, True, "half")],
)
def test_matte(lights: int, component_errors: bool, stokes: str) -> None:
    """One dye, two, a full matrix; paths that luminesce never, once and more often; lanes that go on elsewhere."""
    materials = make_materials(stokes)
    paths = Paths(2, 6, lights=lights, rows=len(materials), longest=7)
    tables = spectral_tables(materials, lamps(lights))
    results = both(paths.chunk(height=9), tables, N, component_errors=component_errors)
    assert (results[0].radiance.max(axis=(1, 2)) > 0).all()
    assert_equal(results)


@needs_gpu
def test_several_lanes_a_pixel_and_fewer_bands_than_computed() -> None:
    """More samples than one lane traces; the image holds the last bands, and those below excite."""
    materials = make_materials()
    paths = Paths(1, 70, lights=1, rows=len(materials), longest=2)
    chunk = paths.chunk(height=40)
    assert (chunk.log.goes_on >= 0).any()
    tables = spectral_tables(materials, lamps(1))
    assert_equal(both(chunk, tables, N - 4))
    assert_equal(both(chunk, tables, N, samples=6))


@needs_gpu
def test_more_rows_and_longer_paths_than_there_is_room_for() -> None:
    from test_sweep import GRID

    from fluorspar.bispectral.donaldson import DonaldsonMatrix

    rng = np.random.default_rng(4)
    materials = [DonaldsonMatrix(GRID, rng.uniform(0.1, 0.9, N)) for _ in range(12)]
    paths = Paths(1, 40, lights=1, rows=12, longest=2)
    assert len({vertices[0].row for _, _, vertices in paths.paths if vertices}) > 8
    assert_equal(both(paths.chunk(), spectral_tables(materials, lamps(1)), N))
    paths = Paths(1, 1, lights=1, rows=1)
    paths.paths = [(0.0, 0, 300 * Paths(1, 1, lights=1, rows=1, longest=9, seed=6).paths[0][2][:1])]
    for vertex in paths.paths[0][2]:
        vertex.f, vertex.row = 1.0, 0
    white = DonaldsonMatrix(GRID, np.ones(N))
    assert_equal(both(paths.chunk(), spectral_tables([white], lamps(1)), N))


@needs_gpu
def test_results_that_take_too_much_memory_come_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two pixels at a time, of which the memory that a GPU writes to directly takes two layers."""
    monkeypatch.setattr("fluorspar.paths.sweeping.cuda_sweep._MOST", 23 * 4 * N * 2)
    monkeypatch.setattr("fluorspar.paths.sweeping.cuda_memory._STAGED", 2 * 2 * N)
    monkeypatch.setattr("fluorspar.paths.sweeping.cuda_memory._kept", threading.local())
    chunk = Paths(5, 1, lights=1, rows=5, longest=3).chunk()
    assert_equal(both(chunk, spectral_tables(make_materials(), lamps(1)), N))


@needs_gpu
def test_what_drjit_keeps_unused_is_given_back_before_memory_is_too_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from fluorspar.paths.sweeping.cuda_memory import _allocated

    given_back: list[bool] = []
    monkeypatch.setattr("drjit.flush_malloc_cache", lambda: given_back.append(True))

    def allocate(size: int) -> int:
        if not given_back:
            raise RuntimeError("[2] Call to cuMemAlloc results in CUDA_ERROR_OUT_OF_MEMORY")
        return size

    assert _allocated(allocate, 3) == 3
    with pytest.raises(ValueError, match="something else"):
        _allocated(lambda: (_ for _ in ()).throw(ValueError("something else")))


@needs_gpu
def test_a_single_sample_has_no_error() -> None:
    chunk = Paths(3, 1, lights=1, rows=5, longest=3).chunk()
    _, gpu = both(chunk, spectral_tables(make_materials(), lamps(1)), N)
    assert np.isnan(gpu.standard_error).all()


@needs_gpu
def test_more_bands_than_threads() -> None:
    """A traced box, 69 bands and those below them that excite: several bands a thread, of which some are empty."""
    scene = load_scene("cornell-box").with_settings(width=2, height=1, spp=2)
    job = RenderJob(scene, seed=1, variant="llvm")
    (chunk,) = trace_chunks(job)
    assert_equal(both(chunk, tables_of(job), len(job.grid), component_errors=False))


@needs_gpu
def test_general_surfaces() -> None:
    """A traced still life: textures, metal, coated dyes, several terms a vertex, an environment."""
    scene = load_scene("still-life").with_settings(width=2, height=2, spp=3)
    job = RenderJob(scene, seed=2, variant="llvm")
    (chunk,) = trace_chunks(job)
    results = both(chunk, tables_of(job), len(job.grid))
    assert_equal(results)


@needs_gpu
@pytest.mark.parametrize("component_errors", [False, True])
def test_standard_errors_are_pooled_over_neighbours(
    component_errors: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A whole image, of enough pixels: those in batches come from the GPU, and so do those by halves, of all bands."""
    scene = load_scene("cornell-box").with_settings(width=5, height=5, spp=4, max_depth=2)
    job = RenderJob(scene, read_grid("400:700:30"), seed=3, variant="llvm", component_errors=component_errors)
    assert sample_sets(scene.settings) == 2
    images = []
    for on_gpu in (False, True):
        monkeypatch.setattr("fluorspar.paths.render.sweeps_on_gpu", lambda variant, on_gpu=on_gpu: on_gpu)
        images.append(render_chunks(trace_chunks(job), job).dataset)
    (chunk,) = trace_chunks(job)
    (in_batches, _) = both(chunk, tables_of(job), len(job.grid), component_errors=False)
    cpu, gpu = images
    assert not np.allclose(in_batches.standard_error, cpu.standard_error.values.reshape(25, -1), rtol=0.1)
    assert ("component_standard_error" in cpu) == component_errors
    for name in cpu.data_vars:
        np.testing.assert_allclose(gpu[name], cpu[name], rtol=2e-5, atol=1e-6 * float(cpu[name].max()))


@needs_gpu
def test_too_little_memory_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def empty(*_: Any) -> None:
        raise Exception("[2] Call to cuMemAlloc results in CUDA_ERROR_OUT_OF_MEMORY")

    monkeypatch.setattr("fluorspar.paths.sweeping.cuda_sweep.empty", empty)
    chunk = Paths(1, 1, lights=1, rows=5, longest=3).chunk()
    with pytest.raises(RendererError, match=r"(?s)too little free memory.*OUT_OF_MEMORY.*variant 'llvm'"):
        both(chunk, spectral_tables(make_materials(), lamps(1)), N)
