"""Light paths that stay on the GPU they were traced on; what needs none of it is tried on the processor."""

from __future__ import annotations

import ctypes
import sys
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from fluorspar import load_scene
from fluorspar.errors import FluorsparWarning, RendererError
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import runs_of, trace_chunks
from fluorspar.paths.log import BLOCK, ENTRIES, flat
from fluorspar.paths.render import render_chunks
from fluorspar.paths.sweeping.gpu import why_not_on_gpu
from fluorspar.scene.variants import TRACE_VARIANTS, use_variant

TRACER = "fluorspar.paths.tracing.tracer"


def job(scene: str, **options: Any) -> RenderJob:
    return RenderJob(load_scene(scene).with_settings(width=8, height=8, spp=4), variant="llvm", **options)


@pytest.mark.parametrize("room", [1.0, 30.0], ids=["lanes go on elsewhere", "room enough"])
@pytest.mark.parametrize("scene", ["cornell-box", "still-life"])
def test_entries_that_stay_are_those_that_are_copied(
    scene: str, room: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They come in Dr.Jit's arrays, one line, with all terms of all launches."""
    monkeypatch.setattr(f"{TRACER}._ROOM", room)
    monkeypatch.setattr(f"{TRACER}._MOST_ROOM", room)
    (copied,) = trace_chunks(job(scene))
    monkeypatch.setattr("fluorspar.paths.chunks.sweeps_on_gpu", lambda variant: True)
    (stayed,) = trace_chunks(job(scene))
    assert (copied.log.goes_on >= 0).any() == (room == 1.0)
    written = np.zeros((len(copied.log.sampled), BLOCK), dtype=np.bool_)  # the rest has no meaning
    for (begin, end), used in zip(copied.log.strips, copied.log.used.reshape(-1, BLOCK), strict=True):
        written[begin:end] = np.arange(end - begin)[:, np.newaxis] < used
    for name, values in flat(copied.log)._asdict().items():
        stay = getattr(flat(stayed.log), name)
        if name in ENTRIES and len(values):
            assert type(stay).__module__.startswith("drjit")
            every = np.tile(written.ravel(), len(values) // written.size)
            assert np.array_equal(np.array(stay)[every], values[every]), name
        else:
            assert np.array_equal(stay, values), name


def test_an_array_of_drjit_is_handed_over_where_it_is() -> None:
    from fluorspar.paths.sweeping.cuda_memory import Borrowed

    with use_variant(TRACE_VARIANTS["llvm"]):
        import mitsuba as mi

        for kind, of, typestr in (
            (mi.Float, ctypes.c_float, "<f4"),
            (mi.UInt32, ctypes.c_uint32, "<u4"),
        ):
            values = kind([3, 1, 4, 1, 5])
            interface = Borrowed(values).__cuda_array_interface__
            assert interface["shape"] == (5,)
            assert interface["typestr"] == typestr
            assert list((of * 5).from_address(interface["data"][0])) == [3, 1, 4, 1, 5]


def test_what_cannot_be_swept_on_the_gpu_is_swept_on_the_processor_and_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mine = job("cornell-box")
    expected = render_chunks(trace_chunks(mine), mine)
    monkeypatch.setattr("fluorspar.paths.render.sweeps_on_gpu", lambda variant: False)
    monkeypatch.setattr(
        "fluorspar.paths.render.why_not_on_gpu", lambda: "package x is missing: pip install x"
    )
    with pytest.warns(FluorsparWarning, match="spectra are computed on the CPU: package x is missing"):
        image = render_chunks(trace_chunks(mine), replace(mine, variant="cuda"))
    assert np.array_equal(image.dataset.radiance, expected.dataset.radiance)


def test_a_missing_compiler_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """numba-cuda without NVIDIA's libraries sees the GPU, and would fail in the middle of a render."""

    def load(name: str) -> None:
        raise RuntimeError(f"no lib{name}.so\nsearched everywhere")

    pathfinder = ModuleType("cuda.pathfinder")
    pathfinder.load_nvidia_dynamic_lib = load  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "cuda", ModuleType("cuda"))
    monkeypatch.setitem(sys.modules, "cuda.pathfinder", pathfinder)
    monkeypatch.setattr("numba.cuda.implementation", "NVIDIA", raising=False)
    monkeypatch.setattr("numba.cuda.get_current_device", lambda: None)
    assert why_not_on_gpu.__wrapped__() == (
        "Numba lacks a compiler for the GPU (no libnvvm.so): pip install 'fluorspar[cuda]'"
    )


def test_chunks_on_a_gpu_are_smaller_where_vertices_have_many_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("still-life").with_settings(width=1024, height=1024, spp=64)
    lengths = {}
    for terms in (1, 2, 3, 4, 5):
        monkeypatch.setattr("fluorspar.scene.lobes.lobe.Lobes.terms", terms)
        for variant in ("cuda", "llvm"):
            lengths[variant, terms] = runs_of(RenderJob(scene, variant=variant))[0][1]
    assert [lengths["cuda", terms] for terms in (1, 2, 3, 4, 5)] == [2**15, 2**15, 2**14, 2**14, 2**13]
    assert {lengths["llvm", terms] for terms in (1, 2, 3, 4, 5)} == {2**13}


@pytest.mark.parametrize(
    "fault", ["jit_malloc(): out of memory! Could not allocate 9 bytes", "something else"]
)
def test_too_little_memory_of_the_gpu_is_said(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def start(*_: Any) -> None:
        raise RuntimeError(fault)

    monkeypatch.setattr(f"{TRACER}.Tracer.start", start)
    monkeypatch.setattr("fluorspar.paths.chunks.variant_of", lambda job: TRACE_VARIANTS["llvm"])
    mine = replace(job("cornell-box"), variant="cuda")
    known = "out of memory" in fault
    with pytest.raises(RendererError if known else RuntimeError, match="variant 'llvm'" if known else fault):
        list(trace_chunks(mine))
