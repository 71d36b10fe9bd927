"""Compiled code kept on disk. Where it cannot be kept or read, compiling takes its time again, and no render fails."""

from __future__ import annotations

import inspect
import logging
import pickle
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.serialize import dumps

from fluorspar.errors import FluorsparWarning

__all__ = ["FAST", "fingerprint", "fingerprint_of_folder", "keep_code", "keep_gpu_code"]

# Sums may be reordered for SIMD; NaN and infinity keep their meaning.
FAST = {"reassoc", "contract", "nsz", "arcp"}

_LOG = logging.getLogger(__name__)
_FIX = "set NUMBA_CACHE_DIR to a folder that can be written to"


class _Checked(CompileResultCacheImpl):  # type: ignore[misc]
    """Adds a checksum: machine code with a hole would crash the process, or compute something else."""

    def reduce(self, cres: Any) -> Any:
        data = dumps(super().reduce(cres))
        return zlib.crc32(data), data

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        checksum, data = payload
        if zlib.crc32(data) != checksum:
            raise ValueError("wrong checksum")
        return super().rebuild(target_context, pickle.loads(data))


class _Announced:
    """A cache of Numba's whose faults are warnings. Numba itself ends a call with what reading or writing raised."""

    what: str
    cache_path: str
    flush: Callable[[], None]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            code = super().load_overload(sig, target_context)  # type: ignore[misc]
        except (
            Exception
        ) as err:  # what `pickle` raises for a file that is empty, cut off or of other bytes: anything
            code = None
            self._warn("is damaged", err, "; it is made anew")
            self._attempt(self.flush)
        if code is None:
            _LOG.warning("compiling %s: some seconds, once", self.what)
        return code

    def save_overload(self, sig: Any, data: Any) -> None:
        self._attempt(super().save_overload, sig, data)  # type: ignore[misc]

    def _attempt(self, write: Any, *arguments: Any) -> None:
        try:
            write(*arguments)
        except Exception as err:
            self._warn("cannot be written", err, f": {_FIX}")

    def _warn(self, fault: str, err: Exception, rest: str) -> None:
        text = f"compiled code in {self.cache_path} {fault} ({type(err).__name__}: {err}){rest}"
        warnings.warn(text, FluorsparWarning, stacklevel=2)


class _Cache(_Announced, FunctionCache):  # type: ignore[misc]
    _impl_class = _Checked


def fingerprint(*modules: ModuleType) -> int:
    """A number of the source of modules whose code is compiled into a function that is kept.

    Numba looks at the date of the function's own file only; a captured value is part of the key of its code.
    """
    return zlib.crc32("".join(inspect.getsource(module) for module in modules).encode())


def keep_code(kernel: Any, what: str) -> None:
    """Let a function compiled by Numba look for its code on disk, and keep it there.

    Parameters
    ----------
    kernel : numba dispatcher
        Made without `cache=True`, by which Numba refuses to compile at all where no folder can be written to.
    what : str
        What it is called when it must be compiled.

    Warns
    -----
    FluorsparWarning
        If there is no folder to keep it in; later, if its file is damaged or cannot be written.
    """
    _keep(kernel, _Cache, what)


def keep_gpu_code(kernel: Any, what: str) -> None:
    """Let a kernel for a GPU look for its code on disk, and keep it there; see `keep_code`."""
    from numba import config

    if config.ENABLE_CUDASIM:
        return  # nothing is compiled
    from numba.cuda.dispatcher import CUDACache

    _keep(kernel, type("GpuCache", (_Announced, CUDACache), {}), what)


def _keep(kernel: Any, kind: type[Any], what: str) -> None:
    try:
        cache = kind(kernel.py_func)
    except RuntimeError:
        _LOG.warning("compiling %s: some seconds", what)
        text = f"there is no folder to keep compiled code in, so each start compiles for some seconds; {_FIX}"
        warnings.warn(text, FluorsparWarning, stacklevel=2)
        return
    cache.what = what
    kernel._cache = cache  # as `cache=True` does


def fingerprint_of_folder() -> int:
    """A number of all source that the sweep on a GPU may be compiled from."""
    folder, package = Path(__file__).parent, Path(__file__).parents[2]
    others = ("paths/log.py", "image/components.py", "scene/lobes/lobe.py")
    files = [*sorted(folder.glob("*.py")), *(package / name for name in others)]
    return zlib.crc32(b"".join(file.read_bytes() for file in files))
