"""The camera of a scene, moved: where points appear then, and images that need no copy of the scene."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fluorspar
from fluorspar.errors import OptionError
from fluorspar.fingerprint import differences, fingerprint
from fluorspar.job import RenderJob
from fluorspar.measuring.measure import measure
from fluorspar.measuring.points import Point
from fluorspar.scene.camera import camera_of, seen_from
from fluorspar.scene.loading import load_scene
from fluorspar.scene.viewpoint import Viewpoint
from fluorspar.spectral.spectrum import Spectrum

ORIGIN, TARGET, UP, FOV = (1.5, 1.0, 4.0), (0.2, -0.1, 0.3), (0.0, 1.0, 0.0), 35.0
GRID = "400:700:100"


def room(to_world: list[list[float]], lamp: float = 1.0, **sensor: Any) -> dict[str, Any]:
    """A fluorescent ball under a lamp, as a scene dict."""
    film = {"type": "hdrfilm", "width": 12, "height": 8, "rfilter": {"type": "box"}}
    return {
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 60.0, "to_world": matrix(to_world), "film": film} | sensor,
        "lamp": {
            "type": "point",
            "position": [2.0, 3.0, 4.0],
            "intensity": {"type": "spectrum", "value": lamp},
        },
        "ball": {"type": "sphere", "bsdf": {"type": "fluorescent", "material": "poster-red"}},
    }


def matrix(rows: list[list[float]]) -> Any:
    import mitsuba as mi

    with fluorspar.scene.variants.use_variant("scalar_spectral"):
        return mi.ScalarTransform4f(rows)


def looking(origin: Any, target: Any, up: Any) -> list[list[float]]:
    """The matrix of a camera, by the definition of `lookat`."""
    forward = np.subtract(target, origin) / np.linalg.norm(np.subtract(target, origin))
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    rows = np.eye(4)
    rows[:3] = np.stack([left, np.cross(forward, left), forward, origin], axis=1)
    return [[float(value) for value in row] for row in rows]


AHEAD = looking((0, 0, 5), (0, 0, 0), (0, 1, 0))
MOVED = {"origin": ORIGIN, "target": TARGET, "up": UP, "fov": FOV}


@pytest.mark.parametrize("plugin", ["perspective", "thinlens"])
def test_points_appear_where_the_viewpoint_says(plugin: str) -> None:
    """Expected: the target in the middle; what is half the field of view to the right of it at the right edge; what is
    above it above."""
    lens = {"type": plugin} | (
        {"aperture_radius": 0.1, "focus_distance": 3.0} if plugin == "thinlens" else {}
    )
    camera = camera_of(seen_from(load_scene(room(AHEAD, **lens)), MOVED))
    forward = np.subtract(TARGET, ORIGIN) / np.linalg.norm(np.subtract(TARGET, ORIGIN))
    right = np.cross(forward, UP) / np.linalg.norm(np.cross(forward, UP))
    edge = ORIGIN + forward + np.tan(np.radians(FOV / 2)) * right
    assert camera.project(TARGET) == pytest.approx([6, 4], abs=1e-4)
    assert camera.project(edge) == pytest.approx([12, 4], abs=1e-4)
    above = camera.project(np.add(TARGET, (0, 0.1, 0)))
    assert above[0] == pytest.approx(6, abs=1e-4)
    assert above[1] < 3.9


def test_what_is_left_out_stays() -> None:
    tilted = looking((0, 3, 5), (0, 0, 0), (0, 1, 0))
    scene = load_scene(room(tilted))
    before = camera_of(scene)
    aside = seen_from(scene, {"origin": (1, 3, 5)})
    assert camera_of(aside).project([1, 0, 0]) == pytest.approx(before.project([0, 0, 0]), abs=1e-4)
    assert np.allclose(camera_of(aside).matrix[:, :3], before.matrix[:, :3], atol=1e-5)
    # twice as near by the tangent of half the field of view
    near = camera_of(seen_from(scene, {"fov": float(np.degrees(2 * np.arctan(np.tan(np.radians(30)) / 2)))}))
    offset = before.project([0.3, 0.1, 0]) - [6, 4]
    assert near.project([0.3, 0.1, 0]) - [6, 4] == pytest.approx(2 * offset, abs=1e-3)
    both = seen_from(aside, {"fov": 20}).settings.viewpoint
    assert both is not None
    assert (both.origin, both.fov) == ((1, 3, 5), 20)


def test_upwards_is_the_nearest_axis_where_the_camera_turns() -> None:
    """Expected: a camera that looked downwards by 31 degrees stands level after it is turned, not tilted by them."""
    scene = load_scene(room(looking((0, 3, 5), (0, 0, 0), (0, 1, 0))))
    turned = seen_from(scene, "origin=5,0,0 target=0,0,0")
    assert turned.settings.viewpoint == Viewpoint((5, 0, 0), (0, 0, 0), (0, 1, 0))
    assert camera_of(turned).project([0, 0.5, 0])[0] == pytest.approx(6, abs=1e-4)


def test_a_mirrored_camera_stays_mirrored() -> None:
    flipped = (np.array(AHEAD) @ np.diag([-1.0, 1, 1, 1])).tolist()
    plain, mirrored = (camera_of(seen_from(load_scene(room(rows)), MOVED)) for rows in (AHEAD, flipped))
    there = plain.project([0.5, 0.4, 0])
    assert mirrored.project([0.5, 0.4, 0]) == pytest.approx([12 - there[0], there[1]], abs=1e-4)


def test_an_orthographic_camera_keeps_its_scale() -> None:
    scaled = (np.array(AHEAD) @ np.diag([2.0, 2, 1, 1])).tolist()
    film = {"type": "hdrfilm", "width": 12, "height": 8, "rfilter": {"type": "box"}}
    sensor = {"type": "orthographic", "to_world": matrix(scaled), "film": film}
    flat = room(AHEAD) | {"sensor": sensor}
    moved = {"origin": (0.0, 4.0, 0.0), "target": (0.0, 0.0, 0.0), "up": (0.0, 0.0, 1.0)}
    copied = flat | {
        "sensor": sensor
        | {"to_world": matrix((np.array(looking(*moved.values())) @ np.diag([2.0, 2, 1, 1])).tolist())}
    }
    images = [
        fluorspar.render(scene, spp=4, wavelengths=GRID, camera=camera)
        for scene, camera in ((flat, moved), (copied, None))
    ]
    np.testing.assert_array_equal(*(image.dataset.radiance for image in images))
    assert images[0].dataset.radiance.values.any()
    with pytest.raises(OptionError, match="an orthographic camera has no fov"):
        fluorspar.render(flat, camera="fov=30")


@pytest.mark.parametrize("method", ["paths", "staged"])
def test_a_moved_camera_and_another_lamp_need_no_copy_of_the_scene(method: str) -> None:
    """Expected: bit for bit the image of a copy of the scene with that camera and that lamp, by either method; and of
    the light paths of the scene as well as of a job that went to another process."""
    options: dict[str, Any] = {"spp": 4, "wavelengths": GRID, "variant": "llvm"}
    copy = room(looking(ORIGIN, TARGET, UP), 2.5, fov=FOV)
    changes: dict[str, Any] = {"camera": MOVED, "lights": {"lamp": Spectrum.constant(2.5)}}
    expected = fluorspar.render(copy, method=method, **options)
    made = fluorspar.render(room(AHEAD), method=method, **options, **changes)
    np.testing.assert_array_equal(made.dataset.radiance, expected.dataset.radiance)
    assert expected.total().values.any()
    assert made.attrs["camera"] == "origin=1.5,1,4 target=0.2,-0.1,0.3 up=0,1,0 fov=35"
    assert list(made.attrs["lights"]) == ["lamp"]
    assert "camera" not in expected.attrs
    if method == "paths":
        job = RenderJob.of(room(AHEAD), **options, **changes)
        sent = pickle.loads(pickle.dumps(job.scene.carried()))
        again = fluorspar.render(sent, **options)
        np.testing.assert_array_equal(again.dataset.radiance, expected.dataset.radiance)


def test_light_paths_from_a_file_keep_camera_and_lamps(tmp_path: Path) -> None:
    options: dict[str, Any] = {"spp": 4, "wavelengths": GRID, "camera": MOVED, "lights": {"lamp": 2}}
    image = fluorspar.render(room(AHEAD), **options)
    fluorspar.trace(room(AHEAD), **options, output=tmp_path / "kept.paths")
    kept = fluorspar.load_paths(tmp_path / "kept.paths").image()
    np.testing.assert_array_equal(kept.dataset.radiance, image.dataset.radiance)
    for name in ("camera", "lights"):
        assert kept.attrs[name] == image.attrs[name]


def test_another_camera_is_another_image() -> None:
    """Expected: what goes on with an image of another camera or lamp is told so."""
    prints = [
        fingerprint(RenderJob.of("furnace", variant="llvm", **changes))
        for changes in ({}, {"camera": "fov=30"}, {"lights": {"cavity": 0.5}})
    ]
    assert differences(prints[1] or {}, prints[0] or {}) == ["camera: fov=30, before the scene's"]
    assert [each.rpartition(": ")[2] for each in differences(prints[2] or {}, prints[0] or {})] == ["changed"]


def test_points_are_measured_where_the_moved_camera_saw_them() -> None:
    """Expected: the point in the middle of the view is measured in the middle of the image, whether the scene is
    known by the image or given."""
    image = fluorspar.render(
        "cornell-box", size=(9, 9), spp=4, wavelengths=GRID, camera="target=100,273,559 fov=5"
    )
    point, pixel = Point("1", (100.0, 273.0, 559.2)), Point("1", (4, 4))
    expected = measure(image, [pixel], aperture="1px").radiance
    for scene in (None, "cornell-box"):
        np.testing.assert_allclose(measure(image, [point], aperture="1px", scene=scene).radiance, expected)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("origin=1,2", "origin is not readable"),
        ("origin=1,2,x", "origin is not readable"),
        ("origin=1,2,,3", "origin is not readable"),
        ("target=1,2,3,", "target is not readable"),
        ("fov=190", "fov is out of range"),
        ("fov=1,2", "fov is not readable"),
        ("from=1,2,3", "a camera has no 'from'"),
        ("1,2,3", "the camera is not readable"),
        ("fov=3 fov=4", "the camera is not readable"),
        ("", "no change of the camera is given"),
        ({}, "no change of the camera is given"),
        (3, "the camera is not readable"),
        ("origin=1,2,3 target=1,2,3", "the camera stands at its target"),
        ("up=0,0,0", "up is a vector of length 0"),
        ("up=1e-200,0,0", "the camera looks upwards"),
        ("origin=0,5,0 target=0,0,0", "the camera looks upwards or downwards"),
    ],
)
def test_what_is_no_viewpoint_is_refused(given: Any, said: str) -> None:
    with pytest.raises(OptionError, match=said):
        seen_from(load_scene(room(AHEAD)), given)


@pytest.mark.parametrize("text", ["origin=0.1,-2,3e-7 target=4,5,6 up=0,0,1 fov=39.3077", "fov=20"])
def test_a_viewpoint_is_read_as_it_is_written(text: str) -> None:
    read = Viewpoint.of(text)
    assert Viewpoint.of(str(read)) == read
    assert Viewpoint.of(text.replace(",", ", ").replace("=", " = ")) == read
