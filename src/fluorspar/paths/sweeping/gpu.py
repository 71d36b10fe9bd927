"""Whether the sweep can run on a GPU here, and what is missing if not."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

from fluorspar.errors import RendererError, message
from fluorspar.paths.log import Chunk, flat
from fluorspar.paths.sweeping.out_of_memory import is_out_of_memory

__all__ = ["chunk_on_gpu", "gpu_memory", "sweeps_on_gpu", "why_not_on_gpu"]


def sweeps_on_gpu(variant: str) -> bool:
    """Whether light paths traced in a variant are swept on a GPU: those of `"cuda"` are, where that is possible."""
    return variant == "cuda" and why_not_on_gpu() is None


@contextmanager
def gpu_memory() -> Iterator[None]:
    """Say what helps if the body needs more memory than the GPU has.

    Raises
    ------
    RendererError
        In place of what Dr.Jit and Numba raise.
    """
    try:
        yield
    except Exception as err:
        if not is_out_of_memory(err):
            raise
        fix = "use variant 'llvm', or render fewer samples or a smaller size"
        raise RendererError(message("the GPU has too little free memory", got=err, fix=fix)) from err


@gpu_memory()
def chunk_on_gpu(chunk: Chunk) -> Chunk:
    """Copy the paths of a chunk to the memory of the GPU."""
    from fluorspar.paths.sweeping.cuda_memory import to_gpu

    return replace(chunk, log=to_gpu(flat(chunk.log)))


@cache
def why_not_on_gpu() -> str | None:
    """Say why the sweep cannot run on a GPU on this machine; None if it can.

    Examples
    --------
    >>> why_not_on_gpu() is None or isinstance(why_not_on_gpu(), str)
    True
    """
    try:
        from numba import cuda

        if cuda.implementation != "NVIDIA":  # what Numba itself still has is an older one
            raise ImportError("only the one within Numba")
    except (AttributeError, ImportError) as err:
        return f"package numba-cuda is missing ({err}): pip install 'fluorspar[cuda]'"
    from numba import config

    if config.ENABLE_CUDASIM:
        return "NUMBA_ENABLE_CUDASIM is set, so Numba would only simulate a GPU: unset it"
    try:
        cuda.get_current_device()
    except Exception as err:  # what the driver and its bindings raise is of many classes
        return f"Numba finds no GPU ({_first_line(err)}): install an NVIDIA driver of version 535 or later"
    try:
        from cuda.pathfinder import load_nvidia_dynamic_lib

        for library in ("nvvm", "nvrtc"):  # numba-cuda alone, without its extra, brings no compiler
            load_nvidia_dynamic_lib(library)
    except Exception as err:
        return f"Numba lacks a compiler for the GPU ({_first_line(err)}): pip install 'fluorspar[cuda]'"
    return None


def _first_line(err: Exception) -> str:
    return (str(err).strip().splitlines() or [type(err).__name__])[0]
