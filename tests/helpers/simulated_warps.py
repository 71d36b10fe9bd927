"""Warps in Numba's CUDA simulator, which knows single threads only: what they exchange, and that they wait.

Only for a process with `NUMBA_ENABLE_CUDASIM=1`, whose kernels run in blocks of (32, n) threads.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from typing import Any

import numpy as np
from numba import cuda
from numba.cuda.simulator.kernel import BlockManager, BlockThread
from numba.cuda.simulator.kernelapi import FakeCUDAModule

WARP = 32


class _Thread(BlockThread):  # type: ignore[misc]
    """One that runs up to an exchange in its turn. The order is another after each, so that a missing one shows."""

    def __init__(self, run: Any, manager: Any, *rest: Any) -> None:
        super().__init__(run, manager, *rest)
        self.turn = threading.Semaphore(0)
        self.exchanges = 0

    def run(self) -> None:
        self.turn.acquire()
        super().run()
        _go_on(self._manager)

    def let_others_run(self) -> None:
        self._manager.have_run.append(self)
        _go_on(self._manager)
        self.turn.acquire()


def _go_on(manager: Any) -> None:
    """Let the next thread run, the last again first when all have."""
    if not manager.to_run:
        manager.to_run, manager.have_run = manager.have_run, []
    if manager.to_run:
        manager.to_run.pop().turn.release()


def _run(manager: Any, grid_point: Any, *args: Any) -> None:
    """Run a block."""
    threads = [
        _Thread(lambda: manager._f(*args), manager, grid_point, place, manager._debug)
        for place in np.ndindex(*manager._block_dim)
    ]
    manager.given = defaultdict(lambda: [(0, None)] * WARP)
    manager.to_run, manager.have_run = list(threads), []
    for thread in threads:
        thread.start()
    _go_on(manager)
    for thread in threads:
        thread.join()
    for thread in threads:
        if thread.exception:
            raise thread.exception[0].with_traceback(thread.exception[1])


def _exchanged(value: Any) -> tuple[tuple[Any, ...], int]:
    """What all threads of the warp have given, and the number of this one."""
    thread: Any = threading.current_thread()
    lane = thread.threadIdx.x
    thread.exchanges += 1
    # the first of a warp go on, and give again, before the last have read
    given = thread._manager.given[thread.threadIdx.y, thread.exchanges % 2]
    given[lane] = thread.exchanges, value
    thread.let_others_run()
    counts, values = zip(*given, strict=True)
    assert set(counts) == {thread.exchanges}, "some threads of the warp are elsewhere"
    return values, lane


def shfl_sync(mask: int, value: Any, lane: int) -> Any:
    return _exchanged(value)[0][lane]


def shfl_up_sync(mask: int, value: Any, by: int) -> Any:
    values, lane = _exchanged(value)
    return values[max(lane - by, 0)]


def shfl_down_sync(mask: int, value: Any, by: int) -> Any:
    values, lane = _exchanged(value)
    return values[min(lane + by, WARP - 1)]


def ballot_sync(mask: int, value: Any) -> int:
    values, _ = _exchanged(value)
    return sum(1 << lane for lane, each in enumerate(values) if each)


class _ThreadIdx:
    @property
    def x(self) -> int:
        thread: Any = threading.current_thread()
        return int(thread.threadIdx.x)


def syncwarp(mask: int = 0) -> None:
    _exchanged(None)


def install() -> None:
    """Give the simulator what it lacks."""
    BlockManager.run = _run
    # Numba's own simulator gives a module its `cuda` back while others of the same module still run.
    cuda.threadIdx, cuda.ffs = _ThreadIdx(), FakeCUDAModule((1, 1, 1), (1, 1, 1), 0).ffs
    for function in (shfl_sync, shfl_up_sync, shfl_down_sync, ballot_sync, syncwarp):
        setattr(cuda, function.__name__, function)
        setattr(FakeCUDAModule, function.__name__, staticmethod(function))
