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


def syncwarp(mask: int = 0) -> None:
    _exchanged(None)


def install() -> None:
    """Give the simulator what it lacks."""
    sys.setswitchinterval(1e-4)  # its threads wait for one another all the time
    for function in (shfl_sync, shfl_up_sync, syncwarp):
        setattr(cuda, function.__name__, function)
        setattr(FakeCUDAModule, function.__name__, staticmethod(function))
