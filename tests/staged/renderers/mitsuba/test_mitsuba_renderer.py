"""Mitsuba as the renderer of the staged method: what of the user's scene must not matter, and probes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from floor_scene import floor_under
from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.errors import RendererError, SceneNotice
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import use_variant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.emission import emitter_arrays, patch_illumination
from fluorspar.staged.imaging import band_groups
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.renderers.mitsuba.renderer import MitsubaRenderer

GRID = Wavelengths(400, 600, 50)
DYE = Material(
    "dye",
    Spectrum.constant(0.5),
    (Fluorophore(Spectrum([400, 450, 500, 600], [0, 0, 0.24, 0.12]), Spectrum([400, 450, 500], [1, 1, 0])),),
)
BOX = {"rfilter": {"type": "box"}}
LIGHT = 2.0
# of the light of an even sky, by what a square hides of itself that is half a side above it
SQUARES = 0.4152529
SCATTER = 4 * 0.3 / np.sqrt(1024)  # of the mean of 1024 light paths, each with a scatter of 0.3


def floor_and(film: dict[str, Any] = BOX, sampler: str = "independent", **shapes: Any) -> Scene:
    """A fluorescent floor, 2 x 2, and white shapes, under even light, obliquely from above."""
    import mitsuba as mi

    with use_variant("scalar_rgb"):
        camera = mi.ScalarTransform4f().look_at([0, -3, 3], [0, 0, 0], [0, 0, 1])
        white = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 0.8}}
        return load_scene(
            {
                "type": "scene",
                "camera": {
                    "type": "perspective",
                    "fov": 45.0,
                    "to_world": camera,
                    "film": {"type": "hdrfilm", "width": 8, "height": 8, **film},
                    "sampler": {"type": sampler, "sample_count": 16},
                },
                "light": {"type": "constant", "radiance": {"type": "spectrum", "value": LIGHT}},
                "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
            }
            | {
                name: {"type": "rectangle", "to_world": place(mi.ScalarTransform4f()), "bsdf": white}
                for name, place in shapes.items()
            },
            materials={"floor": DYE},
        )


def wall(T: Any) -> Any:
    return T.translate([0, 1, 1]).rotate([1, 0, 0], 90)


def poster(gap: float) -> Any:
    """A sheet over the half of the floor where x < 0."""
    return lambda T: T.translate([-0.5, 0, gap]).scale([0.5, 1, 1])


def staged(scene: Scene) -> SpectralImage:
    options = StagedOptions(emitters=2, repeats=1, patch_samples=32)
    return render(scene, wavelengths=GRID, method="staged", staged=options)


def assert_same(one: SpectralImage, other: SpectralImage) -> None:
    assert (one.dataset["radiance"].values == other.dataset["radiance"].values).all()


def test_a_film_without_a_filter_is_as_one_with_a_box() -> None:
    """Rationale: a film's default is a Gaussian, which mixes neighbouring samples and the numbers of the
    shapes they show. Expected: bit for bit the same image."""
    assert_same(staged(floor_and({}, wall=wall)), staged(floor_and(BOX, wall=wall)))


@pytest.mark.parametrize("sampler", ["ldsampler", "orthogonal"])
def test_the_sampler_of_the_scene_does_not_matter(sampler: str) -> None:
    """Rationale: some samplers take four samples where one is asked for, and a small pixel would then be the
    mean of several surfaces. Expected: bit for bit the same image, and a notice."""
    with pytest.warns(SceneNotice, match=f"'{sampler}' is replaced"):
        other = staged(floor_and(sampler=sampler, wall=wall))
    assert_same(other, staged(floor_and(wall=wall)))


def test_any_name_will_do_for_a_shape() -> None:
    """Rationale: a wall of the user's must not vanish because emitters have the same name. Expected: bit for
    bit the same image."""
    named = floor_and(**{"patch-0": wall, "emitter-patch-1": wall, "patch-3": wall})
    plain = floor_and(a=wall, b=wall, c=wall)
    assert_same(staged(named), staged(plain))
    assert staged(plain).component("luminescent_reflection").values.any()


def test_what_each_sample_shows_is_checked() -> None:
    renderer = MitsubaRenderer()
    with renderer.session():
        loaded = renderer.load(floor_and(wall=wall))
        seen = loaded.rows_seen(seed=1, scale=4)
        assert set(np.unique(seen)) == {-1, 0, 1}
        loaded.known = loaded.known[:-1]
        with pytest.raises(RendererError, match="which surface each sample shows"):
            loaded.rows_seen(seed=1, scale=4)


def hollow_box(height: float = 1e-3) -> dict[str, Any]:
    """A low box over the half of the floor where x < 0, without a bottom, black inside."""

    def side(x: float, y: float, half: float, turn: float) -> Any:
        turned = [([0, 0, 1], turn), ([1, 0, 0], 90)]
        scale = [half, height / 2, 1]
        return lambda T: T.translate([x, y, height / 2]).rotate(*turned[0]).rotate(*turned[1]).scale(scale)

    return {
        "top": lambda T: T.translate([-0.5, 0, height]).scale([0.5, 1, 1]),
        "south": side(-0.5, -1, 0.5, 0),
        "east": side(0, 0, 1, 90),
        "north": side(-0.5, 1, 0.5, 180),
        "west": side(-1, 0, 1, 270),
    }


def light_on_floor(scene: Scene, emitters: int) -> np.ndarray:
    """E on the patches of the floor, sorted, ndarray of shape (emitters**2,)."""
    renderer = MitsubaRenderer()
    options = StagedOptions(emitters=emitters)
    matrices = [made.on(GRID) for made in scene.materials]
    with renderer.session():
        (array,) = emitter_arrays(renderer, scene, matrices, options)
        E = patch_illumination(
            renderer.load(scene),
            array,
            np.array([matrix.reflectance for matrix in matrices]),
            np.full((1, 5), LIGHT),
            band_groups(range(5), 3),
            samples=1024,
            max_depth=2,
            seed=1,
            glows=False,
        )
    return np.sort(E[:, 0])


def test_a_poster_close_to_a_wall_is_not_taken_for_it() -> None:
    """Rationale: a probe must start nearer to the surface than what hangs before it. Expected: no light on
    the half that is covered at a distance of 0.0005, but for 0.1 % at its rim; all of it on the other."""
    E = light_on_floor(floor_and(poster=poster(5e-4)), 2)
    assert E[:2] == pytest.approx(0, abs=0.01 * LIGHT)
    assert E[2:] == pytest.approx(LIGHT, rel=SCATTER)


def test_what_lies_on_a_surface_does_not_count() -> None:
    """Rationale: where a sheet lies on the floor, nothing arrives and nothing leaves. Expected: a patch that
    is half covered has the light of its other half."""
    assert light_on_floor(floor_and(poster=poster(2e-6)), 1) == pytest.approx(LIGHT, rel=SCATTER)
    assert light_on_floor(floor_and(poster=poster(2e-6)), 2)[:2].tolist() == [0, 0]


def test_what_is_inside_a_hollow_object_does_not_count() -> None:
    """Rationale: nothing arrives on the floor inside a box without a bottom, and nothing leaves. Expected: a patch that
    is half covered by a box has the light of its other half, which the low box hardly shades; and a floor that sees
    the black backs of sheets in some directions only counts."""
    assert light_on_floor(floor_and(**hollow_box()), 1) == pytest.approx(LIGHT, rel=SCATTER)
    assert light_on_floor(floor_and(**hollow_box()), 2)[:2].tolist() == [0, 0]
    roof = floor_and(roof=lambda T: T.translate([0, 0, 1]))
    assert light_on_floor(roof, 1)[0] == pytest.approx(LIGHT * (1 - SQUARES), rel=2 * SCATTER)


def test_a_room_that_is_black_inside_changes_nothing() -> None:
    """Rationale: a dark room around camera, lamp and floor sends nothing back, and hides nothing of the floor, though
    it is all that most points of the floor see. Expected: the same light as in the open, up to rounding."""
    lamp = {"type": "point", "position": [0.3, 0.2, 2.0], "intensity": {"type": "spectrum", "value": 1.0}}
    white = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 0.8}}
    ball = {"type": "sphere", "center": [0, 0, 1], "radius": 0.15, "bsdf": white}
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        room = {"type": "cube", "to_world": mi.ScalarTransform4f().scale(5), "bsdf": {"type": "diffuse"}}
    in_the_open, inside = (
        light_on_floor(floor_under(lamp, ball=ball, **more), 2) for more in ({}, {"room": room})
    )
    np.testing.assert_allclose(inside, in_the_open, rtol=1e-5)
