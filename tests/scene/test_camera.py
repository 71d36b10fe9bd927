"""Projection of points: against Mitsuba's own rays."""

from __future__ import annotations

import numpy as np
import pytest
from seen_room import POINTS, scene

from fluorspar.errors import OptionError, SceneError
from fluorspar.scene.camera import camera_of
from fluorspar.scene.loading import load_scene
from fluorspar.scene.variants import use_variant


@pytest.mark.parametrize(
    "sensor",
    [
        {},
        {"fov_axis": "y"},
        {"principal_point_offset_x": 0.1, "principal_point_offset_y": -0.05},
        {"film": {"crop_width": 40, "crop_height": 30, "crop_offset_x": 20, "crop_offset_y": 10}},
        {"type": "thinlens", "aperture_radius": 0.5, "focus_distance": 700.0},
    ],
    ids=["plain", "fov_axis y", "principal point", "crop window", "thin lens"],
)
def test_a_point_on_a_ray_projects_to_the_pixel_of_the_ray(sensor):
    """Rationale: Mitsuba's camera defines which pixel sees what. Expected: its rays project back to where
    they started, within single precision, also with a crop window and an offset principal point (Eq. 15)."""
    import mitsuba as mi

    loaded = scene(**sensor)
    camera = camera_of(loaded)
    pixels = np.random.default_rng(1).random((50, 2)) * [camera.width, camera.height]
    film = dict(sensor.get("film", {}))
    with use_variant("scalar_rgb"):
        built = mi.load_dict(
            {
                "type": "perspective",
                "fov": 45.0,
                "to_world": mi.ScalarTransform4f().look_at([278, 290, -800], [250, 273, 40], [0.1, 1, 0]),
                "film": {"type": "hdrfilm", "width": 96, "height": 64, "rfilter": {"type": "box"}} | film,
            }
            | {key: value for key, value in sensor.items() if key != "film"}
        )
        for pixel in pixels:
            # position within the crop window, 0 to 1; the aperture sample (0.5, 0.5) is the lens centre
            place = mi.Point2f(*(pixel / [camera.width, camera.height]))
            ray, _ = built.sample_ray(0, 0, place, mi.Point2f(0.5, 0.5))
            assert camera.project(np.array(ray.o) + 500 * np.array(ray.d)) == pytest.approx(pixel, abs=2e-3)


def test_points_behind_the_camera_have_no_pixel():
    assert np.isnan(camera_of(scene()).project([278.0, 290.0, -900.0])).all()


def test_the_size_in_the_settings_counts():
    """Expected: twice the pixels, twice the coordinates."""
    loaded = scene()
    large = camera_of(loaded.with_settings(width=192, height=128))
    assert large.project(POINTS) == pytest.approx(2 * camera_of(loaded).project(POINTS))


def test_the_size_cannot_be_changed_with_a_crop_window():
    """Expected: the error that a render gives, not a camera of another size than the image."""
    crop = {"crop_width": 40, "crop_height": 30, "crop_offset_x": 20, "crop_offset_y": 10}
    with pytest.raises(OptionError, match="the film has a crop window"):
        camera_of(scene(film=crop).with_settings(width=80, height=60))


def test_an_orthographic_camera_is_refused():
    with pytest.raises(SceneError, match="orthographic"):
        camera_of(_orthographic())


def _orthographic():
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    return load_scene(
        {
            "type": "scene",
            "camera": {"type": "orthographic", "film": film},
            "light": {"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}},
            "ball": {"type": "sphere"},
        }
    )
