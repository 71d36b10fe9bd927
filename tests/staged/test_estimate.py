"""The procedure: which renders are asked for, what becomes of them, what is kept."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fluorspar.errors import ApproximationWarning
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.scene.scene import Scene, load_scene
from fluorspar.spectral.material import Fluorophore, Material
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.emission import emitter_arrays, patch_illumination, refine
from fluorspar.staged.estimate import render_staged
from fluorspar.staged.imaging import band_groups, plan_samples
from fluorspar.staged.mesh import TriangleMesh
from fluorspar.staged.mitsuba_renderer import MitsubaRenderer
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.timings import timing_table

GRID = Wavelengths(400, 600, 50)
DYE = Material(
    "dye",
    Spectrum.constant(0.5),
    (Fluorophore(Spectrum([400, 450, 500, 600], [0, 0, 0.4, 0.2]), Spectrum([350, 450, 500], [1, 1, 0])),),
)
QUICK = StagedOptions(emitters=2, repeats=1, patch_samples=32)


def floor_under(light: dict, size: int = 8, spp: int = 4, **more):
    """A square fluorescent floor, 2 x 2, seen from above."""
    import mitsuba as mi

    from fluorspar.scene.renderer import use_variant

    with use_variant("scalar_rgb"):
        T = mi.ScalarTransform4f
        return load_scene(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": -1, "rr_depth": 10},
                "camera": {
                    "type": "perspective",
                    "fov": 45.0,
                    "to_world": T().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                    "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
                    "sampler": {"type": "independent", "sample_count": spp},
                },
                "light": light,
                "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
            }
            | more,
            materials={"floor": DYE},
        )


class Flat:
    """A renderer in twenty lines: a closed cavity in which each pixel sees E = emission / (1 - albedo), by
    hand.

    It offers illumination without albedo, and shows what a renderer other than Mitsuba has to bring.
    """

    max_bands = 2

    def session(self, threads):
        return nullcontext()

    def mesh(self, scene, surface):
        return TriangleMesh(
            np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
        )

    def load(self, scene, array=None, *, keep_object=True):
        return FlatScene(scene)


class FlatScene:
    def __init__(self, scene):
        self.size = (scene.settings.height, scene.settings.width)
        self.calls = []

    def E(self, albedo, emission, max_depth):
        return emission.mean(0) * {1: 0, 2: 1}.get(max_depth, 1 / (1 - albedo[0]))

    def render(self, albedo, emission, *, max_depth, seed, scale):
        self.calls.append((max_depth, seed))
        height, width = (side * scale for side in self.size)
        return np.tile(emission.mean(0) + albedo[0] * self.E(albedo, emission, max_depth), (height, width, 1))

    def illumination(self, albedo, emission, *, max_depth, seed, scale):
        height, width = (side * scale for side in self.size)
        return np.tile(self.E(albedo, emission, max_depth), (height, width, 1))

    def rows_seen(self, *, seed, scale):
        return np.zeros([side * scale for side in self.size], dtype=np.int64)

    def probe(self, points, normals, albedo, emission, *, surface, back, offset, max_depth, seed):
        return np.tile(emission.mean(0) + albedo[0] * self.E(albedo, emission, max_depth), (len(points), 1))


def test_any_renderer_will_do():
    """Rationale: the procedure must hold for a renderer that is nothing but the protocol. Expected: in a
    cavity of albedo S under light L, E_D = L and E_I = L / (1 - S) - L; the five components follow by hand.
    The probe of a patch sees the lamp itself, which is not subtracted from a surface that has no light: E of
    a patch is too large by L / S."""
    scene = floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 2.0}})
    image = render_staged(scene, GRID, options=QUICK, renderer=Flat())
    D = DYE.on(GRID)
    L, S = 2.0 * np.ones(5), 0.5
    seen = {name: image.component(name).values[0, 0] for name in image.components}
    assert seen["source"] == pytest.approx(L)
    assert seen["direct_reflection"] == pytest.approx(S * L)
    assert seen["direct_luminescence"] == pytest.approx(D.apply_luminescent(L))
    assert seen["indirect_reflection"] == pytest.approx(S * L)
    assert seen["indirect_luminescence"] == pytest.approx(D.apply_luminescent(L))
    L_F = D.apply_luminescent(2 * L + L / S)
    assert seen["luminescent_reflection"] == pytest.approx(S * L_F / (1 - S))


def test_a_point_light_lights_the_emitters():
    """Rationale: an irradiance meter does not see point lights; the light on a patch must hold them.
    Expected: I cos / (pi d^2), averaged over each quarter of the floor by a fine sum; the scatter of 4000
    points on a patch is 30 % of the mean, so the bound is 4 x 0.3 / sqrt(4000) = 2 %."""
    scene = floor_under(
        {"type": "point", "position": [0.5, 0.5, 1.5], "intensity": {"type": "spectrum", "value": 3.0}}
    )
    renderer = MitsubaRenderer()
    with renderer.session():
        (array,) = emitter_arrays(renderer, scene, [DYE.on(GRID)], QUICK)
        E = patch_illumination(
            renderer.load(scene),
            array,
            np.full((1, 5), 0.5),
            np.full((1, 5), 3.0),
            band_groups(range(5), 3),
            samples=4000,
            max_depth=-1,
            seed=1,
            glows=False,
        )
    at = (np.arange(200) + 0.5) / 100 - 1
    x, y = np.meshgrid(at, at)
    squared = (x - 0.5) ** 2 + (y - 0.5) ** 2 + 1.5**2
    exact = 3.0 * 1.5 / (np.pi * squared**1.5)
    expected = sorted(exact[i : i + 100, j : j + 100].mean() for i in (0, 100) for j in (0, 100))
    assert len(array) == 4
    assert np.sort(E[:, 0]) == pytest.approx(expected, rel=0.02)
    assert pytest.approx(E[:, :1].repeat(5, 1)) == E


def refined(scene: Scene, tolerance: float, emitters: int = 2, samples: int = 64):
    """Emitters of the floor of a scene, refined, and their estimated error."""
    renderer = MitsubaRenderer()
    matrix = DYE.on(GRID)
    with renderer.session():
        base = renderer.load(scene)
        (array,) = emitter_arrays(renderer, scene, [matrix], replace(QUICK, emitters=emitters))

        def probe(cut, samples, stream):
            return patch_illumination(
                base,
                cut,
                np.full((1, 5), 0.5),
                np.ones((1, 5)),
                band_groups(range(5), 3),
                samples=samples,
                max_depth=-1,
                seed=stream,
                glows=False,
            )

        return refine(array, matrix, probe, tolerance=tolerance, samples=samples)


def spot(x: float, y: float, height: float) -> dict:
    intensity = {"type": "spectrum", "value": 1.0}
    return {"type": "point", "position": [x, y, height], "intensity": intensity}


def test_emitters_are_refined_where_the_light_varies():
    """Rationale: a point light close to one corner. Expected: the estimated error falls below the tolerance,
    with more and smaller patches near the light."""
    scene = floor_under(spot(0.7, 0.7, 0.3))
    coarse, before = refined(scene, 1.0)
    fine, after = refined(scene, 0.1)
    assert len(coarse) == 4
    assert before > 0.2
    assert after <= 0.1
    assert fine.areas.sum() == pytest.approx(4.0)
    centre = np.array([np.average(piece.centroids, axis=0, weights=piece.areas) for piece in fine.emitters()])
    near = np.linalg.norm(centre[:, :2] - 0.7, axis=1) < 0.4
    assert fine.areas[near].mean() < 0.5 * fine.areas[~near].mean()


@pytest.mark.parametrize("emitters", [1, 2])
def test_light_in_the_middle_of_a_patch_is_noticed(emitters):
    """Rationale: halves of such a patch are alike, and so are its quarters. Expected: refined all the same."""
    middle = 0.0 if emitters == 1 else 0.5
    cut, error = refined(floor_under(spot(middle, middle, 0.15)), 0.3, emitters)
    assert len(cut) > 4 * emitters**2
    assert error <= 0.3


def test_noise_alone_refines_nothing():
    """Rationale: 4 light paths per piece scatter by 15 %. Expected: under even light, four patches stay four
    although the tolerance is 1 %."""
    scene = floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}})
    cut, error = refined(scene, 0.01, samples=4)
    assert len(cut) == 4
    assert error <= 0.01


def test_intermediate_images_are_kept(tmp_path: Path):
    scene = load_scene("cornell-box").with_settings(width=8, height=8, spp=4)
    kept = StagedOptions(
        emitters=2, repeats=1, patch_samples=16, keep_intermediate=tmp_path / "kept", bounces=2
    )
    image = render_staged(scene, GRID, options=kept)
    names = {path.name for path in (tmp_path / "kept").iterdir()}
    for wall, paint in (("left-wall", "poster-red"), ("right-wall", "poster-green")):
        for name in (f"E_D-{paint}", f"E_I-{paint}", f"emitters-{wall}", f"emitters-2-{wall}"):
            assert {f"{name}.nc", f"{name}.png"} <= names
        assert f"L_F-{wall}.nc" in names
    shown = [
        SpectralImage.open(tmp_path / "kept" / f"emitters-{wall}.nc")
        .component("luminescent_reflection")
        .values
        for wall in ("left-wall", "right-wall")
    ]
    assert sum(shown) == pytest.approx(image.component("luminescent_reflection").values, rel=1e-4, abs=1e-7)
    assert image.attrs["single_bounce"] == 0
    assert image.component("reexcitation").values.any()


def test_same_seed_same_image_and_timings_relative_to_component_1():
    scene = load_scene("cornell-box").with_settings(width=8, height=8, spp=8)
    options = StagedOptions(emitters=2, repeats=2, patch_samples=16)
    calls = []
    one, two = (
        render_staged(
            scene, GRID, seed=7, options=options, progress=lambda done, every: calls.append((done, every))
        )
        for _ in range(2)
    )
    assert (one.dataset.radiance.values == two.dataset.radiance.values).all()
    assert one.attrs["timings"]["component 1"] == 1
    assert {"components 1 and 3", "component 5: left-wall", "total"} <= set(one.attrs["timings"])
    assert "component 5: left-wall" in timing_table(one.attrs["timings"])
    assert calls[-1][0] == calls[-1][1]
    assert one.attrs["spp"] == 8
    assert (one.standard_error().values >= 0).all()


@pytest.mark.parametrize(
    "options",
    [{"exclude_emitter_geometry": True}, {"filter_edges": True}, {"mode": "decimated", "patches": 20}],
    ids=str,
)
def test_options_give_finite_images_of_about_the_same_light(options):
    """Expected: what an option leaves out or smooths is less than half of the light."""
    scene = load_scene("cornell-mesh").with_settings(width=12, height=12, spp=16)
    grid = Wavelengths(400, 650, 125)
    plain, other = (
        render_staged(scene, grid, options=StagedOptions(repeats=1, patches=20, emitters=2, patch_samples=64))
        if not chosen
        else render_staged(
            scene,
            grid,
            options=StagedOptions(
                **({"repeats": 1, "patches": 20, "emitters": 2, "patch_samples": 64} | chosen)
            ),
        )
        for chosen in ({}, options)
    )
    values = other.dataset.radiance.values
    assert np.isfinite(values).all()
    assert values[1:].sum() == pytest.approx(plain.dataset.radiance.values[1:].sum(), rel=0.5)


def test_excluding_the_emitter_loses_what_it_reflects():
    """Expected: component 5 on the emitting wall itself is 0, because it neither reflects nor is seen."""
    scene = load_scene("cornell-box").with_settings(width=16, height=16, spp=16)
    options = StagedOptions(repeats=1, emitters=2, patch_samples=64, exclude_emitter_geometry=True)
    kept = render_staged(scene, GRID, options=options).component("luminescent_reflection").values
    full = (
        render_staged(scene, GRID, options=StagedOptions(repeats=1, emitters=2, patch_samples=64))
        .component("luminescent_reflection")
        .values
    )
    assert kept.mean() < full.mean()


def test_a_limited_depth_is_warned_of():
    scene = floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}}).with_settings(
        max_depth=5
    )
    with pytest.warns(ApproximationWarning, match="max_depth 5"):
        render_staged(scene, GRID, options=QUICK)


@pytest.mark.parametrize("depth", [1, 2])
def test_shallow_renders_hold_what_their_depth_allows(depth):
    """Expected: depth 1 is the lamp alone, depth 2 adds components 1 and 2."""
    image = render_staged(
        floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}}).with_settings(
            max_depth=depth
        ),
        GRID,
        options=QUICK,
    )
    lit = [name for name in image.components if image.component(name).values.any()]
    assert lit == ["source", "direct_reflection", "direct_luminescence"][: 1 if depth == 1 else 3]


def test_samples_are_spread_over_square_small_pixels():
    for samples in (1, 3, 16, 50, 64):
        plan = plan_samples(samples, 100, 80)
        assert samples <= plan.samples < 2 * samples + 1
    assert plan_samples(1024, 2048, 2048).scale == 2


def test_the_callers_variant_is_as_before():
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    render_staged(
        floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}}), GRID, options=QUICK
    )
    assert mi.variant() == "scalar_rgb"


def test_a_scene_without_fluorescence_has_components_1_and_3_only():
    scene = load_scene("cornell-classic").with_settings(width=8, height=8, spp=4)
    image = render_staged(scene, GRID, options=QUICK)
    lit = [name for name in image.components if image.component(name).values.any()]
    assert lit == ["source", "direct_reflection", "indirect_reflection"]
    assert image.attrs["emitters"] == {}


@pytest.mark.parametrize("shape", ["sphere", "disk", "cylinder", "cube", "rectangle"])
def test_every_shape_can_be_an_emitter(shape):
    """Expected: a piece for each patch, together as large as the shape (2 pi for a cylinder of radius and
    height 1; a tessellation of 256 x 256 loses less than 0.2 %), facing as Mitsuba says."""
    exact = {"sphere": 4 * np.pi, "disk": np.pi, "cylinder": 2 * np.pi, "cube": 24.0, "rectangle": 4.0}[shape]
    scene = floor_under(
        {"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}},
        solid={"type": shape, "bsdf": {"type": "diffuse", "id": "solid-paint"}},
    )
    renderer = MitsubaRenderer()
    with renderer.session():
        number = next(k for k, surface in enumerate(scene.surfaces) if surface.name == "solid")
        mesh = renderer.mesh(scene, number)
    assert mesh.areas.sum() == pytest.approx(exact, rel=2e-3)
    if shape in ("sphere", "cube"):
        assert ((mesh.centroids * mesh.face_normals).sum(axis=1) > 0).all()
    elif shape != "cylinder":
        assert (mesh.face_normals[:, 2] > 0.99).all()


@pytest.mark.parametrize("flip", [False, True])
def test_the_back_of_a_surface_emits_as_well(flip):
    """Rationale: a two-sided sheet lit from below and seen from below lights a plate under it with its back.
    Expected: component 5 of the plate is the same whichever way the sheet faces, that of the one-pass method.
    65,536 samples know it to 0.5 %; 8 x 8 emitters 0.8 from their lamp are held to 3 %."""
    import mitsuba as mi

    from fluorspar.scene.renderer import use_variant

    with use_variant("scalar_rgb"):
        T = mi.ScalarTransform4f
        sheet = T().translate([0, 0, 1.5])
        sheet = sheet if flip else sheet @ T().rotate([1, 0, 0], 180)
        scene = load_scene(
            {
                "type": "scene",
                "camera": {
                    "type": "perspective",
                    "fov": 40.0,
                    "to_world": T().look_at([0, -4, 1.0], [0, 0, 0], [0, 0, 1]),
                    "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
                },
                "integrator": {"type": "path", "rr_depth": 10},
                "lamp": {
                    "type": "point",
                    "position": [0, 0, 0.7],
                    "intensity": {"type": "spectrum", "value": 3.0},
                },
                "plate": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
                "sheet": {
                    "type": "rectangle",
                    "to_world": sheet,
                    "bsdf": {"type": "twosided", "id": "both", "bsdf": {"type": "diffuse"}},
                },
            },
            materials={"both": DYE},
        ).with_settings(spp=1024)
    image = render_staged(scene, GRID, options=StagedOptions(repeats=1))
    assert set(image.attrs["emitters"]) == {"sheet", "sheet (back)"}
    from fluorspar.rendering import render

    expected = (
        render(scene, wavelengths=GRID, spp=4096).component("luminescent_reflection").values.mean((0, 1))
    )
    found = image.component("luminescent_reflection").values.mean((0, 1))
    assert found[2:] == pytest.approx(expected[2:], rel=0.03)


@pytest.mark.parametrize("shape", ["sphere", "cube"])
def test_a_convex_body_in_uniform_light_is_lit_evenly(shape):
    """Design, section 5: E = L on every patch of a convex body in uniform light L, whether it is a mesh or,
    like a sphere, tessellated for its patches only. 2000 light paths of a scatter of 0.3 know it to 0.7 %."""
    import mitsuba as mi

    from fluorspar.scene.renderer import use_variant

    with use_variant("scalar_rgb"):
        scene = load_scene(
            {
                "type": "scene",
                "camera": {
                    "type": "perspective",
                    "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                    "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
                },
                "light": {"type": "constant", "radiance": {"type": "spectrum", "value": 2.0}},
                "body": {"type": shape, "bsdf": {"type": "diffuse"}},
            },
            materials={"body": DYE},
        )
    renderer = MitsubaRenderer()
    with renderer.session():
        (array,) = emitter_arrays(renderer, scene, [DYE.on(GRID)], StagedOptions(patches=12))
        E = patch_illumination(
            renderer.load(scene),
            array,
            np.full((1, 5), 0.5),
            np.full((1, 5), 2.0),
            band_groups(range(5), 3),
            samples=2000,
            max_depth=-1,
            seed=3,
            glows=False,
        )
    assert np.abs(E / 2.0 - 1).max() < 0.03
