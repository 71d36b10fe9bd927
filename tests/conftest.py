"""What all tests share."""

from __future__ import annotations

from fluorspar.scene.variants import configure_llvm

# Before any test module imports Mitsuba: Dr.Jit loads its LLVM library when it is imported.
configure_llvm()
