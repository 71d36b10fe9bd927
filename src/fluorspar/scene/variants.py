"""Mitsuba's variants: choosing one for a while, and the LLVM library its vectorised variants need."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path

from fluorspar.errors import RendererError, message
from fluorspar.files.writing import undisturbed
from fluorspar.scene.renderer_log import renderer_log

__all__ = [
    "LOBE_VARIANTS",
    "OPTIX_MISSING",
    "SPECTRUM_VARIANT",
    "TRACE_VARIANTS",
    "configure_llvm",
    "fastest_variant",
    "find_llvm",
    "give_back_memory",
    "has_optix",
    "usable_cores",
    "use_variant",
]

# Light paths hold no wavelength, so they are traced in a monochrome variant.
TRACE_VARIANTS = {"llvm": "llvm_ad_mono", "cuda": "cuda_ad_mono"}
# With probes in the colour channels of general surfaces.
LOBE_VARIANTS = {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb"}
# Spectra of Mitsuba plugins are read in this one: it evaluates them at any wavelength.
SPECTRUM_VARIANT = "scalar_spectral"
OLDEST_LLVM = 16
OPTIX_MISSING = (
    "not found: libnvoptix.so.1 comes with NVIDIA's driver; in a container set NVIDIA_DRIVER_CAPABILITIES=all"
)
# A variant is a setting of the whole process, and so are Dr.Jit's threads and Mitsuba's file resolver.
_TURN = threading.RLock()


def find_llvm() -> Path | str | None:
    """Locate the LLVM library that Dr.Jit is to use.

    Returns
    -------
    Path, str or None
        The user's `DRJIT_LIBLLVM_PATH`, else the library of the installed `karellen-llvm-core`
        package, else the system's; None if there is none.
    """
    if given := os.environ.get("DRJIT_LIBLLVM_PATH"):
        return given
    try:
        files = metadata.files("karellen-llvm-core") or []
    except metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.name == "libLLVM.so" and (path := Path(str(file.locate())).resolve()).exists():
            return path
    # The package may list its libraries relative to the installation prefix only.
    prefixed = Path(sys.prefix, "lib", "libLLVM.so")
    return prefixed if prefixed.exists() else ctypes.util.find_library("LLVM")


def configure_llvm() -> None:
    """Point Dr.Jit to a working LLVM, unless the user has set `DRJIT_LIBLLVM_PATH`.

    Old system libraries (LLVM 14, 15) abort the process on processors with AVX-512, so the one
    that came as a package is preferred. Without effect once Dr.Jit is imported: that loads LLVM.
    """
    if (
        "DRJIT_LIBLLVM_PATH" not in os.environ
        and "drjit" not in sys.modules
        and isinstance(path := find_llvm(), Path)
    ):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(path)


def _check_llvm() -> None:
    """Refuse an LLVM that may abort the process, as happens where Mitsuba was imported before it could be chosen."""
    import drjit as dr

    loaded = dr.detail.llvm_version()[0]
    if 0 <= loaded < OLDEST_LLVM:
        raise RendererError(
            message(
                f"Dr.Jit has loaded LLVM {loaded}, which aborts Python on some processors",
                expected=f"LLVM {OLDEST_LLVM} or later",
                fix="import fluorspar before mitsuba and drjit, or start Python with "
                f"DRJIT_LIBLLVM_PATH={find_llvm()}",
            )
        )


def _set_variant(name: str) -> None:
    import mitsuba as mi

    # An exception in the middle of a start crashes Mitsuba or is lost in it.
    with undisturbed(), warnings.catch_warnings():
        # Mitsuba loads its differentiable integrators anew each time, and after 140 times Dr.Jit warns of that.
        warnings.filterwarnings("ignore", message="The AST-transforming decorator", category=RuntimeWarning)
        mi.set_variant(name)


def _variant() -> str | None:
    import mitsuba as mi

    name: str | None = mi.variant()
    return name


@cache
def fastest_variant() -> str:
    """Name what traces fastest here: `"cuda"` where there are a GPU's driver and OptiX, else `"llvm"`.

    Examples
    --------
    >>> fastest_variant() in ("llvm", "cuda")
    True
    """
    configure_llvm()
    with undisturbed():
        import drjit as dr

        return "cuda" if dr.has_backend(dr.JitBackend.CUDA) and has_optix() else "llvm"


def has_optix() -> bool:
    """Whether there is the library that Mitsuba traces rays on a GPU with; it comes with the driver."""
    if sys.platform != "linux":  # elsewhere it lies among the files of the driver
        return True
    try:
        ctypes.CDLL(os.environ.get("DRJIT_LIBOPTIX_PATH", "libnvoptix.so.1"))
    except OSError:
        return False
    return True


def give_back_memory() -> None:
    """Let Dr.Jit give back the memory of arrays that are gone, which it keeps for the next ones."""
    import drjit as dr

    dr.flush_malloc_cache()
    dr.sync_thread()  # what goes back to a pool of a GPU's driver is free only then


@contextmanager
def use_variant(name: str) -> Iterator[None]:
    """Set a Mitsuba variant for the body of a `with` statement and give the caller's back after it.

    Mitsuba cannot unset a variant: where the caller had set none, `name` stays. Threads take turns: all use of Mitsuba
    is within such a body, and other threads wait until it is left. Bodies may be nested.

    Raises
    ------
    RendererError
        If the variant does not exist or cannot start.
    """
    with _TURN:
        before = _change_variant(name)
        try:
            with renderer_log():
                yield
        finally:
            if before is not None and before != _variant():
                _set_variant(before)


def _change_variant(name: str) -> str | None:
    """Set a variant and return the one before; after an error that is still set."""
    configure_llvm()
    with undisturbed():
        import mitsuba as mi

    before = _variant()
    if name.startswith("llvm"):
        _check_llvm()
    if name == before:  # to set it again would take 0.1 s
        return before
    try:
        _set_variant(name)
    except ImportError as err:
        if before is not None:
            _set_variant(before)
        backend = name.partition("_")[0]
        fix = {
            "llvm": "install an LLVM library: 'pip install karellen-llvm-core' on 64-bit Linux, "
            "'apt install libllvm19' on Debian, 'brew install llvm' on macOS; then see 'fluorspar doctor'",
            "cuda": "use variant 'llvm', or install an NVIDIA driver of version 535 or later",
        }.get(backend, "choose one of Mitsuba's variants")
        raise RendererError(
            message(
                f"Mitsuba variant '{name}' does not start",
                got=err,
                expected=f"one of {', '.join(mi.variants())}",
                fix=fix,
            )
        ) from err
    return before


def usable_cores() -> int:
    """Number of cores this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
