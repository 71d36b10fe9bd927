"""Fluorspar: spectral images of scenes with fluorescent objects, on a renderer that knows nothing of fluorescence.

The public names, listed in `__init__.pyi`, are imported when they are first used. Importing Fluorspar sets no
Mitsuba variant, reads no data file and prints nothing. It does point Dr.Jit to a working LLVM, through the
environment variable `DRJIT_LIBLLVM_PATH` unless that is set: Dr.Jit loads LLVM when it is imported, so import
Fluorspar before Mitsuba.
"""

from __future__ import annotations

from typing import Any

import lazy_loader

from fluorspar.scene.variants import configure_llvm as _configure_llvm
from fluorspar.version import __version__ as __version__

_configure_llvm()

_public, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'fluorspar' has no attribute '{name}'")
    return _public(name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
