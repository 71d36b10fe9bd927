"""Projection of points: against Mitsuba's own rays, and estimated from correspondences."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.errors import OptionError, SceneError
from fluorspar.scene.camera import camera_of, estimate_projection
from fluorspar.scene.renderer import use_variant
from fluorspar.scene.scene import load_scene

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

    made = scene(**sensor)
    camera = camera_of(made)
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
    made = scene()
    large = camera_of(made.with_settings(width=192, height=128))
    assert large.project(POINTS) == pytest.approx(2 * camera_of(made).project(POINTS))


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


def test_a_perspective_is_found_again_from_its_own_projections():
    """Expected: exact, up to rounding, and new points land where the camera puts them."""
    camera = camera_of(scene())
    found = estimate_projection(POINTS, camera.project(POINTS))
    assert found.model == "perspective"
    assert found.rms < 1e-6
    assert found.project([[200.0, 100.0, 300.0]]) == pytest.approx(
        camera.project([[200.0, 100.0, 300.0]]), abs=1e-6
    )
    assert found.matrix == pytest.approx(camera.matrix, rel=1e-6, abs=1e-3)


def test_noise_of_a_pixel_moves_projections_by_about_a_pixel():
    """Rationale: correspondences are clicked by hand. With noise of standard deviation s in n points and 11
    unknowns, the residuals have a variance of s^2 (2 n - 11) per 2 n. Expected: that, within the spread of
    200 trials."""
    rng = np.random.default_rng(3)
    points = rng.random((20, 3)) * [550, 540, 560]
    camera = camera_of(scene())
    exact = camera.project(points)
    squares = [
        np.mean(estimate_projection(points, exact + 0.5 * rng.standard_normal(exact.shape)).residuals ** 2)
        for _ in range(200)
    ]
    # the algebraic error is not quite the geometric one: 10 % more than the optimum is allowed
    assert np.mean(squares) == pytest.approx(0.25 * (40 - 11) / 40, rel=0.1)


@pytest.mark.parametrize(("model", "columns"), [("linear", 3), ("affine", 4)])
def test_linear_and_affine_projections_are_found_again(model, columns):
    """Eq. 16. Expected: exact from noise-free points, least squares from more."""
    rng = np.random.default_rng(5)
    matrix = rng.standard_normal((2, columns))
    pixels = POINTS @ matrix[:, :3].T + (matrix[:, 3] if columns == 4 else 0)
    found = estimate_projection(POINTS, pixels, model)
    assert found.matrix == pytest.approx(matrix)
    assert found.residuals.shape == (8, 2)
    least = estimate_projection(
        POINTS[3:6] if columns == 3 else POINTS[:4], pixels[3:6] if columns == 3 else pixels[:4]
    )
    assert least.model == model
    assert least.matrix == pytest.approx(matrix)


@pytest.mark.parametrize(
    ("points", "model", "match"),
    [
        (POINTS[:2], None, "too few"),
        (POINTS[:5], "perspective", "too few"),
        (POINTS * [1, 1, 0], "perspective", "one plane"),
        (POINTS * [1, 1, 0], "affine", "one plane"),
        (POINTS[:, :1] * [1.0, 2.0, 3.0], "linear", "one plane"),
        (np.ones((8, 3)), "affine", "one plane"),
        (POINTS, "cubic", "linear, affine, perspective"),
        (POINTS * np.nan, None, "finite"),
    ],
)
def test_correspondences_that_do_not_determine_a_projection_are_refused(points, model, match):
    with pytest.raises(OptionError, match=match):
        estimate_projection(points, np.arange(2.0 * len(points)).reshape(-1, 2), model)


def test_points_and_pixels_must_correspond():
    with pytest.raises(OptionError, match="correspond"):
        estimate_projection(POINTS, np.zeros((3, 2)))
