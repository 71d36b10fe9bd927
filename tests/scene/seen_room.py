"""A room seen by a camera, and points in it."""

from __future__ import annotations

import numpy as np

from fluorspar.scene.loading import load_scene
from fluorspar.scene.variants import use_variant

# Corners of a room and of a block in it, mm.
POINTS = np.array(
    [
        [0, 0, 0],
        [550, 0, 0],
        [0, 540, 0],
        [0, 0, 560],
        [550, 540, 560],
        [130, 165, 65],
        [290, 165, 114],
        [314, 330, 456],
    ],
    dtype=float,
)


def scene(**sensor):
    import mitsuba as mi

    with use_variant("scalar_rgb"):
        view = mi.ScalarTransform4f().look_at([278, 290, -800], [250, 273, 40], [0.1, 1, 0])
        film = {"type": "hdrfilm", "width": 96, "height": 64, "rfilter": {"type": "box"}} | sensor.pop(
            "film", {}
        )
        camera = {"type": "perspective", "fov": 45.0, "to_world": view, "film": film} | sensor
        return load_scene(
            {
                "type": "scene",
                "camera": camera,
                "light": {"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}},
                "ball": {"type": "sphere"},
            }
        )
