"""Render with the one-pass method: chunk after chunk of pixels, traced and swept."""

from __future__ import annotations

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fluorspar.bispectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.paths.sweeping.spectral_tables import spectral_tables
from fluorspar.paths.sweeping.sweep import Swept, room, sweep
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import TRACE_VARIANTS, usable_cores, use_variant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["CHUNK", "estimate"]

CHUNK = 1 << 19  # paths traced at a time; a constant, because the random numbers of a pixel depend on it


def estimate(
    scene: Scene,
    grid: Wavelengths,
    *,
    seed: int,
    stokes: Stokes = "half",
    component_errors: bool = False,
    backend: str = "llvm",
    threads: int | None = None,
) -> Generator[tuple[int, Swept]]:
    """Yield the components of one run of pixels after another.

    Parameters
    ----------
    scene
        What to render, with its size, samples and depths.
    grid
        Wavelengths.
    seed
        Same seed, same result, bit for bit, whatever the number of threads.
    stokes
        Weight of excitation at the emission wavelength itself, see `DonaldsonMatrix`.
    component_errors
        Estimate a standard error for each component.
    backend
        `"llvm"` or `"cuda"`.
    threads
        Threads to use; default: all cores this process may run on.

    Yields
    ------
    first_pixel : int
        Number of the first pixel of the run, row by row from the top left.
    swept : Swept
        Valid until the next run is asked for.
    """
    import drjit as dr

    from fluorspar.paths.tracing.trace_scene import build_trace_scene
    from fluorspar.paths.tracing.tracer import Tracer

    matrices = scene.matrices(grid, stokes)
    tables = spectral_tables(matrices, [light.spectrum.on(grid) for light in scene.lights])
    settings = scene.settings
    pixels = settings.width * settings.height
    per_chunk = max(1, CHUNK // settings.spp)
    chunks = [(first, min(per_chunk, pixels - first)) for first in range(0, pixels, per_chunk)]
    workers = threads or usable_cores()
    threads_before = dr.thread_count()
    with use_variant(TRACE_VARIANTS[backend]), ThreadPoolExecutor(workers) as pool:
        dr.set_thread_count(workers)
        try:
            survival = np.array([_survival(matrix) for matrix in matrices])
            tracer = Tracer(build_trace_scene(scene), settings, survival, seed)
            out = room(chunks[0][1], len(grid), component_errors)
            started = tracer.start(0, *chunks[0])
            for number, (first_pixel, _) in enumerate(chunks):
                paths = tracer.finish(started)
                swept = sweep(paths, tables, len(grid), pool, component_errors=component_errors, out=out)
                # Tracing goes on while the caller stores what is finished; sweep and trace both use all cores.
                if number + 1 < len(chunks):
                    started = tracer.start(number + 1, *chunks[number + 1])
                yield first_pixel, swept
        finally:
            dr.set_thread_count(threads_before)


def _survival(matrix: DonaldsonMatrix) -> float:
    """Largest share of light of any band that leaves the surface again, luminescence included, for Russian roulette."""
    return float(min(1.0, matrix.energy_yield().max()))
