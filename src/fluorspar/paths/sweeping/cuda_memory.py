"""Arrays in the memory of a GPU: NumPy's are copied there, Dr.Jit's are there and are handed over by DLPack."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

import numpy as np
from numba import config, cuda
from numpy.typing import DTypeLike, NDArray

from fluorspar.paths.sweeping.out_of_memory import is_out_of_memory
from fluorspar.scene.variants import give_back_memory

__all__ = ["copy_back", "copy_layers_back", "empty", "processors", "to_gpu"]

_SIMULATED = bool(config.ENABLE_CUDASIM)  # then arrays of NumPy are those of the GPU
_STAGED = 1 << 24  # numbers that are copied back at a time, or one layer, if that is more
_kept = threading.local()
_TYPES = {0: "i", 1: "u", 2: "f"}  # of DLPack


def to_gpu(values: Any) -> Any:
    """Return values in the memory of the GPU: tuples, arrays of NumPy or with `__dlpack__`; numbers as they are."""
    if isinstance(values, tuple):
        return type(values)(*map(to_gpu, values))
    if isinstance(values, np.ndarray):
        return values if _SIMULATED else _allocated(cuda.to_device, values)
    if isinstance(values, int | float | np.generic) or hasattr(values, "__cuda_array_interface__"):
        return values
    return cuda.as_cuda_array(Borrowed(values))


def empty(shape: tuple[int, ...], kind: DTypeLike) -> Any:
    """Allocate in the memory of the GPU."""
    return np.empty(shape, kind) if _SIMULATED else _allocated(cuda.device_array, shape, np.dtype(kind))


def _allocated(allocate: Callable[..., Any], *arguments: Any) -> Any:
    """Allocate; where memory does not suffice, again without what Dr.Jit has freed and keeps for itself."""
    try:
        return allocate(*arguments)
    except Exception as err:  # of no class that is known without a GPU
        if not is_out_of_memory(err):
            raise
    give_back_memory()
    return allocate(*arguments)


def copy_back(values: Any, to: NDArray[Any]) -> None:
    """Wait for what the GPU computes and copy it to an array of NumPy."""
    if _SIMULATED:
        to[...] = values
    else:
        values.copy_to_host(to)


def copy_layers_back(values: Any, to: NDArray[np.float32], pool: Executor) -> None:
    """Wait for what the GPU computes and copy the first p pixels of each layer to an array of NumPy.

    Parameters
    ----------
    values : array of shape (layers, P, N), float32, in the memory of the GPU
    to : ndarray of shape (layers, p, N)
    pool : Executor
        Threads that copy.
    """
    layers, *shape = values.shape
    size = int(np.prod(shape))
    staging = _staging(size)
    several = len(staging) // size
    for first in range(0, layers, several):
        some = values[first : first + several]
        staged = staging[: len(some) * size].reshape(some.shape)
        copy_back(some, staged)
        list(pool.map(np.copyto, to[first : first + several], staged[:, : to.shape[1]]))


def _staging(size: int) -> NDArray[np.float32]:
    """Memory of the processor that a GPU writes to directly.

    To get it takes longer than to fill it, so each thread keeps its own for the next image.
    """
    kept: NDArray[np.float32] | None = getattr(_kept, "staging", None)
    if kept is None or len(kept) < size:
        make = np.empty if _SIMULATED else cuda.pinned_array
        kept = _kept.staging = make(max(size, _STAGED), np.dtype(np.float32))
    return kept


def processors() -> int:
    """How many processors the GPU has, of which each runs some blocks of threads at a time."""
    return 1 if _SIMULATED else int(cuda.get_current_device().MULTIPROCESSOR_COUNT)


class _Tensor(ctypes.Structure):
    """`DLTensor` of DLPack, which a managed one begins with."""

    _fields_ = (
        ("data", ctypes.c_void_p),
        ("device", ctypes.c_int32 * 2),
        ("ndim", ctypes.c_int32),
        ("code", ctypes.c_uint8),
        ("bits", ctypes.c_uint8),
        ("lanes", ctypes.c_uint16),
        ("shape", ctypes.POINTER(ctypes.c_int64)),
        ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("byte_offset", ctypes.c_uint64),
    )


class Borrowed:
    """A contiguous array that has `__dlpack__`, with the interface that Numba knows; it lives as long as this one.

    The capsule is not consumed: it gives its memory back when it goes.
    """

    def __init__(self, values: Any) -> None:
        self._owner, self._capsule = values, values.__dlpack__()
        pointer = ctypes.pythonapi.PyCapsule_GetPointer
        pointer.restype, pointer.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
        tensor = _Tensor.from_address(pointer(self._capsule, b"dltensor"))
        self.__cuda_array_interface__ = {
            "shape": tuple(tensor.shape[: tensor.ndim]),
            "typestr": f"<{_TYPES[tensor.code]}{tensor.bits // 8}",
            "data": ((tensor.data or 0) + tensor.byte_offset, False),
            "version": 3,
        }
