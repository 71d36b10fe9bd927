"""How to tell that a GPU has too little memory."""

from __future__ import annotations

__all__ = ["is_out_of_memory"]


def is_out_of_memory(err: Exception) -> bool:
    """Whether Dr.Jit or Numba, whose exceptions are of no class that is known without it, lacks memory.

    Examples
    --------
    >>> is_out_of_memory(RuntimeError("[2] Call to cuMemAlloc results in CUDA_ERROR_OUT_OF_MEMORY"))
    True
    """
    return "out of memory" in str(err).lower().replace("_", " ")
