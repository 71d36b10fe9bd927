"""Which of Mitsuba's variants is taken where the user names none."""

from __future__ import annotations

import drjit as dr
import pytest

from fluorspar.scene import variants


@pytest.mark.parametrize(
    ("driver", "optix", "expected"),
    [(True, True, "cuda"), (True, False, "llvm"), (False, True, "llvm"), (False, False, "llvm")],
)
def test_a_gpu_needs_its_driver_and_optix(
    driver: bool, optix: bool, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dr, "has_backend", lambda backend: driver and backend == dr.JitBackend.CUDA)
    monkeypatch.setattr(variants, "has_optix", lambda: optix)
    assert variants.fastest_variant.__wrapped__() == expected


@pytest.mark.skipif("sys.platform != 'linux'")
def test_optix_is_where_drjit_looks_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRJIT_LIBOPTIX_PATH", "libc.so.6")
    assert variants.has_optix()
    monkeypatch.setenv("DRJIT_LIBOPTIX_PATH", "/nowhere/libnvoptix.so.1")
    assert not variants.has_optix()
