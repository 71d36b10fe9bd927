"""The camera, and the settings of a render."""

from __future__ import annotations

from typing import Any

from .values import Said, plain, rows

__all__ = ["camera_of", "settings_of"]


def camera_of(scene: Any, depsgraph: Any) -> Said | None:
    if scene.camera is None:
        return None
    thing = scene.camera.evaluated_get(depsgraph)
    data, dof = thing.data, thing.data.dof
    names = (
        "type",
        "lens",
        "sensor_fit",
        "sensor_width",
        "sensor_height",
        "shift_x",
        "shift_y",
        "ortho_scale",
        "clip_start",
        "clip_end",
    )
    distance = dof.focus_distance
    if dof.focus_object is not None:
        there = dof.focus_object.evaluated_get(depsgraph).matrix_world.translation
        distance = -(thing.matrix_world.inverted() @ there).z
    round_one = dof.aperture_blades < 3 and dof.aperture_ratio == 1
    focus = {"distance": distance, "fstop": dof.aperture_fstop, "round": round_one} if dof.use_dof else None
    said = {name: plain(getattr(data, name)) for name in names}
    return {**said, "name": thing.name, "matrix": rows(thing.matrix_world), "focus": focus}


def settings_of(scene: Any) -> Said:
    render, cycles = scene.render, getattr(scene, "cycles", None)
    part = render.resolution_percentage / 100
    return {
        "width": max(1, int(render.resolution_x * part)),
        "height": max(1, int(render.resolution_y * part)),
        "aspect": render.pixel_aspect_y / render.pixel_aspect_x,
        "region": render.use_border,
        "transparent": render.film_transparent,
        "motion_blur": render.use_motion_blur,
        "exposure": getattr(cycles, "film_exposure", 1.0),
        "samples": getattr(cycles, "samples", 128),
        "bounces": getattr(cycles, "max_bounces", 12),
    }
