"""Warps in Numba's CUDA simulator, which knows single threads only: what they exchange, and that they wait.

Only for a process with `NUMBA_ENABLE_CUDASIM=1`, whose kernels run in blocks of (32, n) threads.
"""

from __future__ import annotations

import sys
import threading
from typing import Any

from numba import cuda
from numba.cuda.simulator.kernelapi import FakeCUDAModule

WARP = 32


class _Warp:
    def __init__(self) -> None:
        self.values: list[Any] = [None] * WARP
        self.barrier = threading.Barrier(WARP)


def _exchanged(value: Any) -> tuple[list[Any], int]:
    """What all threads of the warp have given, and the number of this one."""
    thread: Any = threading.current_thread()
    warp = thread._manager.__dict__.setdefault(f"warp {thread.threadIdx.y}", _Warp())
    lane = thread.threadIdx.x
    warp.barrier.wait()  # until all have read what was exchanged before
    warp.values[lane] = value
    warp.barrier.wait()
    return warp.values, lane


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
    sys.setswitchinterval(1e-4)  # its threads wait for one another all the time
    # Numba's own simulator gives a module its `cuda` back while others of the same module still run.
    cuda.threadIdx, cuda.ffs = _ThreadIdx(), FakeCUDAModule((1, 1, 1), (1, 1, 1), 0).ffs
    for function in (shfl_sync, shfl_up_sync, shfl_down_sync, ballot_sync, syncwarp):
        setattr(cuda, function.__name__, function)
        setattr(FakeCUDAModule, function.__name__, staticmethod(function))
