"""Cycles against Mitsuba, both as renderers of the staged method: every kind of light, camera and surface."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest

from floor_scene import QUICK, floor_under
from fluorspar.errors import SceneNotice
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import use_variant
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.emission import emitter_arrays, patch_illumination
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.renderers.cycles.renderer import CyclesRenderer
from fluorspar.staged.renderers.mitsuba.renderer import MitsubaRenderer

pytestmark = pytest.mark.blender

GRID = Wavelengths(400, 600, 50)
RENDERERS = (MitsubaRenderer(), CyclesRenderer(os.environ.get("BLENDER")))


def transform() -> Any:
    import mitsuba as mi

    return mi.ScalarTransform4f()


def lit(kind: str) -> dict[str, Any]:
    """A light above the floor, of unit strength or so, off its middle."""
    with use_variant("scalar_rgb"):
        T = transform()
        return {
            "constant": {"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}},
            "point": {
                "type": "point",
                "position": [0.3, 0.2, 1.5],
                "intensity": {"type": "spectrum", "value": 1.0},
            },
            "directional": {
                "type": "directional",
                "direction": [1, 0.5, -2],
                "irradiance": {"type": "spectrum", "value": 1.0},
            },
            "spot": {
                "type": "spot",
                "to_world": T.look_at([0.5, 0, 1.5], [0.2, 0.1, 0], [0, 1, 0]),
                "cutoff_angle": 35.0,
                "beam_width": 15.0,
                "intensity": {"type": "spectrum", "value": 1.0},
            },
            "area": {
                "type": "rectangle",
                "to_world": T.translate([0.4, 0.1, 1]).rotate([1, 0, 0], 160).scale(0.3),
                "emitter": {"type": "area", "radiance": {"type": "spectrum", "value": 1.0}},
            },
            "area from behind": {
                "type": "rectangle",
                "to_world": T.translate([0.4, 0.1, 1]).scale(0.3),
                "emitter": {"type": "area", "radiance": {"type": "spectrum", "value": 1.0}},
            },
        }[kind]


def measured(renderer: Any, scene: Scene, seeds: int, scale: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of lamps, direct and indirect light over blocks of the image, and their standard errors."""
    matrices = [made.on(GRID) for made in scene.materials]
    albedo = np.array([matrix.reflectance for matrix in matrices])[:, :3]
    emission = np.tile([1.0, 2.0, 3.0], (len(scene.lights), 1))
    images = []
    with renderer.session(2):
        loaded = renderer.load(scene)
        for seed in range(seeds):
            at = [loaded.render(albedo, emission, max_depth=d, seed=seed, scale=scale) for d in (1, 2, -1)]
            parts = np.stack([at[0], at[1] - at[0], at[2] - at[1]])
            _, height, width, bands = parts.shape
            blocks = parts.reshape(3, 4, height // 4, 4, width // 4, bands)
            images.append(blocks.mean(axis=(2, 4)))
    return np.mean(images, axis=0), np.std(images, axis=0, ddof=1) / np.sqrt(seeds)


def assert_alike(scene: Scene, seeds: int = 8, scale: int = 8) -> None:
    """Every block within 5 standard errors, and the mean of the squares no more than noise."""
    (one, error), (other, error2) = (measured(renderer, scene, seeds, scale) for renderer in RENDERERS)
    noise = np.hypot(error, error2) + 2e-3 * np.abs(one) + 1e-6
    z = (one - other) / noise
    assert np.abs(z).max() < 6  # of 144 blocks, with errors that are themselves uncertain by a quarter
    assert np.sqrt((z**2).mean()) < 1.5


@pytest.mark.parametrize("kind", ["constant", "point", "directional", "spot", "area", "area from behind"])
def test_every_light(kind: str) -> None:
    """Rationale: units and directions of lights differ between renderers. Expected: the same light on the
    floor and on a wall that stands on it, directly and by reflection."""
    with use_variant("scalar_rgb"):
        wall = {
            "type": "rectangle",
            "to_world": transform().translate([0, 1, 1]).rotate([1, 0, 0], 90),
            "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}},
        }
    assert_alike(floor_under(lit(kind), wall=wall))


def test_camera_with_shift_and_oblong_film() -> None:
    """Rationale: Blender measures its lens and shift in widths, or heights, of the film. Expected: the same
    image of a floor in a light that varies over it."""
    with use_variant("scalar_rgb"):
        scene = load_scene(
            {
                "type": "scene",
                "camera": {
                    "type": "perspective",
                    "fov": 40.0,
                    "principal_point_offset_x": 0.1,
                    "principal_point_offset_y": -0.2,
                    "to_world": transform().look_at([1, -3, 2], [0, 0, 0], [0, 0, 1]),
                    "film": {"type": "hdrfilm", "width": 8, "height": 12, "rfilter": {"type": "box"}},
                },
                "light": lit("point"),
                "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
            }
        )
    assert_alike(scene)


def test_spheres_become_meshes_and_that_is_said() -> None:
    """Rationale: Cycles gets triangles. Expected: a notice, and the same image of a sphere."""
    ball = {"type": "sphere", "center": [0.2, 0, 0.5], "radius": 0.4, "bsdf": {"type": "diffuse"}}
    with pytest.warns(SceneNotice, match="'ball' \\(sphere\\) become meshes"):
        assert_alike(floor_under(lit("area"), ball=ball))


def cup(left: float) -> dict[str, Any]:
    """A low box on the floor, without a bottom and black inside, whose sides are from x = left on 0.8 long."""
    with use_variant("scalar_rgb"):
        T = transform().translate([left + 0.4, 0, 0.2]).scale([0.4, 0.4, 0.2])
        turns = [([1, 0, 0], 0), ([1, 0, 0], 90), ([1, 0, 0], -90), ([0, 1, 0], 90), ([0, 1, 0], -90)]
        return {
            f"side-{k}": {
                "type": "rectangle",
                "to_world": T.rotate(*turn).translate([0, 0, 1]),
                "bsdf": {"type": "diffuse"},
            }
            for k, turn in enumerate(turns)
        }


def room() -> dict[str, Any]:
    """Around camera and lamp, and black inside."""
    with use_variant("scalar_rgb"):
        return {"room": {"type": "cube", "to_world": transform().scale(5), "bsdf": {"type": "diffuse"}}}


@pytest.mark.parametrize(
    "more", [{}, cup(-0.6), room()], ids=["empty", "under a hollow box", "in a dark room"]
)
def test_light_on_patches(more: dict[str, Any]) -> None:
    """Rationale: light on emitters is measured by baking. Expected: that of Mitsuba's probes, within noise, also where
    points inside a hollow box do not count, and in a dark room, where all do."""
    scene = floor_under(lit("area"), **more)
    found = []
    for renderer in RENDERERS:
        matrices = [made.on(GRID) for made in scene.materials]
        with renderer.session(2):
            (array,) = emitter_arrays(renderer, scene, matrices, StagedOptions(emitters=3))
            found.append(
                patch_illumination(
                    renderer.load(scene),
                    array,
                    np.array([matrix.reflectance for matrix in matrices])[:, :3],
                    np.array([[1.0, 2.0, 3.0]]),
                    [np.arange(3)],
                    samples=2000,
                    max_depth=2,
                    seed=1,
                    glows=False,
                )
            )
    assert found[1] == pytest.approx(found[0], rel=0.08)
    assert found[1].mean() == pytest.approx(found[0].mean(), rel=0.02)


def test_all_components() -> None:
    """Rationale: the whole procedure, emission per face included. Expected: each component as of Mitsuba,
    with the same number of samples, within the 3 % that are 3 standard errors of the noisiest one."""
    with use_variant("scalar_rgb"):
        T = transform()
        wall = {
            "type": "rectangle",
            "to_world": T.translate([0, 1, 1]).rotate([1, 0, 0], 90),
            "bsdf": {"type": "diffuse"},
        }
    scene = floor_under(lit("constant"), size=8, spp=1024, wall=wall)
    options = StagedOptions(emitters=2, repeats=4, patch_samples=512)
    images = [
        render(scene, wavelengths="400:600:50", method="staged", staged=options, renderer=renderer)
        for renderer in ("mitsuba", RENDERERS[1])
    ]
    for name in images[0].components:
        one, other = (image.component(name).values.astype(float).mean(axis=(0, 1)) for image in images)
        assert other == pytest.approx(one, rel=0.03, abs=1e-6), name


def test_repeats_bit_for_bit() -> None:
    scene = floor_under(lit("point"))
    one, other = (
        render(scene, wavelengths="400:600:50", method="staged", staged=QUICK, renderer=RENDERERS[1])
        for _ in range(2)
    )
    assert (one.dataset.radiance.values == other.dataset.radiance.values).all()
