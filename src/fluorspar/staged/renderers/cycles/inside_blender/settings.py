"""Settings of Cycles."""

from __future__ import annotations

from typing import Any

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["setup"]


def setup(scene: Any, threads: int, rr_depth: int) -> None:
    """Choose what makes Cycles a plain, unbiased path tracer, whatever its version calls it."""
    render, cycles, layer = scene.render, scene.cycles, scene.view_layers[0]
    render.engine = "CYCLES"
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", threads
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = render.use_motion_blur = False
    chosen = {
        # the sample number 0 goes through the centre of its pixel, all others through random points
        "sample_offset": 1,
        "use_sample_subset": True,
        "sample_subset_length": 1,
        "samples": 2 if bpy.app.version >= (4, 4) else 1,
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "sample_clamp_direct": 0,
        "sample_clamp_indirect": 0,
        "light_sampling_threshold": 0,
        "blur_glossy": 0,
        "pixel_filter_type": "BOX",
        "filter_width": 1,
        "min_light_bounces": min(max(rr_depth - 1, 0), 1024),
        "caustics_reflective": True,
        "film_exposure": 1,
        "sampling_pattern": "TABULATED_SOBOL" if bpy.app.version >= (4, 0) else "SOBOL",
    }
    for name, value in chosen.items():
        if hasattr(cycles, name):
            setattr(cycles, name, value)
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    for name in ("diffuse_direct", "diffuse_indirect", "emit", "environment"):
        setattr(layer, f"use_pass_{name}", True)
    row = layer.aovs.add()
    row.name, row.type = "row", "VALUE"
