"""The sweep on a GPU, as the CPU sees it: logs and tables go there, spectra come back through pinned memory."""

from __future__ import annotations

import warnings
from concurrent.futures import Executor
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.pixels import Pixels
from fluorspar.paths.log import Log
from fluorspar.paths.sweeping.batches import COMPONENT_COUNT
from fluorspar.paths.sweeping.cuda_kernel import Output, compiled_for_warps, room_for_warps
from fluorspar.paths.sweeping.cuda_lobe_kernel import (
    compiled_for_warps_and_lobes,
    lobe_tables_for_warps,
    room_for_warps_and_lobes,
)
from fluorspar.paths.sweeping.cuda_memory import (
    copy_back,
    copy_layers_back,
    empty,
    processors,
    to_gpu,
)
from fluorspar.paths.sweeping.gpu import gpu_memory
from fluorspar.paths.sweeping.lobe_kernel import LobeTables
from fluorspar.paths.sweeping.spectral_tables import SpectralTables
from fluorspar.paths.sweeping.warp import WARP, tables_for_warps

__all__ = ["SweepOnGpu"]

_WARPS = 4  # of a block
_BLOCKS = 8  # of a processor, more than it runs at a time
_ROOM = 8  # material rows of a pixel that there is room for at first
_MOST = 1 << 29  # bytes that all warps together may work in, and that results may take


class SweepOnGpu:
    """Sweeps chunks with one set of tables; not in several threads at a time.

    Parameters
    ----------
    tables : SpectralTables or LobeTables
    component_errors : bool
        Whether standard errors of the components are estimated, too.
    """

    @gpu_memory()
    def __init__(self, tables: SpectralTables | LobeTables, component_errors: bool) -> None:
        self._lobes, self._component_errors = isinstance(tables, LobeTables), component_errors
        self._tables: Any = to_gpu(
            lobe_tables_for_warps(tables) if isinstance(tables, LobeTables) else tables_for_warps(tables)
        )
        spectra = self._tables.spectra if self._lobes else self._tables
        self._rows, self._each, _ = spectra.reflectance.shape
        self._room, self._scratch, self._warps = _ROOM, None, 0
        self._shape: tuple[int, int] | None = None

    @gpu_memory()
    def sweep(
        self,
        counts: tuple[int, int, int],
        log: Log,
        pool: Executor,
        out: Pixels,
        halves: NDArray[np.float32],
    ) -> None:
        """Compute the spectra of a chunk; see `sweep`.

        Parameters
        ----------
        counts : (int, int, int)
            Samples of a pixel, its lanes and its batches.
        log : Log
            Its entries flat, in arrays of NumPy or in the memory of the GPU.
        pool : Executor
            Threads that copy.
        out : Pixels
            Those of the chunk.
        halves : ndarray of shape (8, P, N), or (1, P, N) without errors of the components
            Where standard errors by two halves go, see `store`.
        """
        _, pixels, bands = out.radiance.shape
        places = [out.radiance, out.standard_error[np.newaxis], out.component_standard_error, halves]
        layers = sum(len(place) for place in places if place is not None)
        each = max(1, min(pixels, _MOST // (out.radiance.itemsize * bands * layers)))
        if self._shape != (each, bands):
            self._allocate_output(each, bands)
        there = to_gpu(log)
        if self._lobes:
            kernel: Any = compiled_for_warps_and_lobes(self._each, self._component_errors)
        else:
            kernel = compiled_for_warps(self._each, len(log.direct_light) == 0, self._component_errors)
        for first in range(0, pixels, each):
            stop = min(first + each, pixels)
            self._launch(kernel, first, stop, counts, there)
            for values, place in zip(self._output, places, strict=True):
                if place is not None:
                    copy_layers_back(values.reshape(-1, each, bands), place[:, first:stop], pool)

    def _launch(self, kernel: Any, first: int, stop: int, counts: tuple[int, int, int], log: Any) -> None:
        """Sweep a range of pixels, again with twice the room if a pixel sees more rows, or a path is longer."""
        short = np.ones(1, dtype=np.int32)
        while short[0]:
            if self._scratch is None:
                self._allocate_scratch(len(log.row) // len(log.sampled))
            there_short = to_gpu(np.zeros(1, dtype=np.int32))
            blocks = min(self._warps // _WARPS, -(-(stop - first) // _WARPS))
            with warnings.catch_warnings():
                # Few pixels leave some of it idle. By text: the class is another one than Numba's own.
                warnings.filterwarnings("ignore", "Grid size .* low occupancy")
                kernel[blocks, (WARP, _WARPS)](
                    first, stop, *counts, log, self._tables, self._scratch, self._output, there_short
                )
            copy_back(there_short, short)
            if short[0]:
                self._room, self._scratch = 2 * self._room, None

    def _allocate_output(self, pixels: int, bands: int) -> None:
        errors = pixels if self._component_errors else 0
        of_halves = COMPONENT_COUNT + 1 if self._component_errors else 1
        shapes = [
            (COMPONENT_COUNT, pixels, bands),
            (pixels, bands),
            (COMPONENT_COUNT, errors, bands),
            (of_halves, pixels, bands),
        ]
        self._output = Output(*(empty(shape, np.float32) for shape in shapes))
        self._shape = pixels, bands

    def _allocate_scratch(self, terms: int) -> None:
        """Give room to as many warps as run at a time, or as there is memory for."""
        room: Any = (
            room_for_warps_and_lobes(terms, self._each, self._room)
            if self._lobes
            else room_for_warps(self._rows, self._each, self._room)
        )
        size = sum(prod(shape) * np.dtype(kind).itemsize for shape, kind in room)
        most = min(processors() * _BLOCKS, _MOST // (size * _WARPS))
        self._warps = max(most, 1) * _WARPS
        self._scratch = type(room)(*(empty((self._warps, *shape), kind) for shape, kind in room))
