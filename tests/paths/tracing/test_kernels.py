"""Compiling the loop that traces paths takes seconds, so there is one kernel for a scene."""

import pytest

from fluorspar import load_scene
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import trace_chunks
from fluorspar.paths.log import BLOCK
from fluorspar.scene.variants import use_variant


@pytest.mark.parametrize("bsdf", ["diffuse", "roughplastic"])
def test_one_kernel_for_all_chunks_samples_and_seeds(bsdf, monkeypatch):
    inside = {"type": "sphere", "flip_normals": True, "bsdf": {"type": bsdf}, "light": {"type": "area"}}
    camera = {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}}
    scene = load_scene({"type": "scene", "camera": camera, "inside": inside})
    with use_variant("llvm_ad_rgb"):
        import drjit as dr

        from fluorspar.paths.tracing import tracer

        monkeypatch.setattr("fluorspar.paths.chunks.CHUNK", {"llvm": 64})
        monkeypatch.setattr(tracer, "_ROOM", 2.0)
        monkeypatch.setattr(tracer, "_MOST_ROOM", 3.0)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            chunks = [
                chunk
                for spp, seed in ((4, 1), (10, 2))
                for chunk in trace_chunks(RenderJob(scene.with_settings(spp=spp), seed=seed))
            ]
            loops = [kernel for kernel in dr.kernel_history() if kernel.get("operation_count", 0) > 500]
    assert len(chunks) == 4 + 11
    going_on = [len(chunk.log.goes_on) // BLOCK - 1 for chunk in chunks]
    assert sum(going_on) > len(chunks), "lanes come to the end of their strips"
    assert len(loops) == len(chunks) + sum(going_on)
    assert len({kernel["hash"] for kernel in loops}) == 1
