"""What all tests share."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

from fluorspar.scene.variants import configure_llvm

# Before any test module imports Mitsuba: Dr.Jit loads its LLVM library when it is imported.
configure_llvm()

# How long an example takes says how busy the machine is.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")
