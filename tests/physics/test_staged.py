"""The staged method against closed forms and against the one-pass method.

Rationale
    `staged` and `paths` share the scene and the spectra, and nothing of how they estimate: agreement checks
    both.
Discretisation
    The emitters of an object emit evenly over each patch. Where the light is the same everywhere, as in the
    cavities here, that is exact for any number of patches, so the closed forms hold without an allowance for
    it.
Statistics
    Each scene is rendered with K independent seeds; the mean over the pixels that count, of each component
    and band, is one observation. Its standard error is the scatter of the K over sqrt(K), pooled over bands
    (they are almost fully correlated), and the bound is Student-t's for a chance of 1e-4 per component. Where
    a relative tolerance is stated, the standard error is checked to be a quarter of it or less.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lab import (
    FINE,
    Array,
    bell,
    cavity,
    curve,
    furnace,
    integrator,
    light_values,
    luminescence,
    paint,
    sampled,
    sensor,
    two_part_sphere,
    write,
)
from scipy.stats import t as student

from fluorspar import COMPONENTS, Material, Scene, Wavelengths, load_scene, render
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.staged.emission import emitter_arrays, patch_illumination
from fluorspar.staged.options import ALBEDO_FLOOR, StagedOptions
from fluorspar.staged.renderers.mitsuba.renderer import MitsubaRenderer

GRID = Wavelengths(400, 680, 40)
S = 0.25 + 0.35 * (FINE - 300) / 480
DYE = (bell(560, 40, 0.5), bell(480, 40))
FAST = StagedOptions(emitters=2, patches=6, repeats=1, patch_samples=256)


def observations(scene: Scene, options: StagedOptions, seeds: int = 6, mask: Array | None = None) -> Array:
    """Means over the pixels that count, one per seed; ndarray of shape (seeds, components, N)."""
    means = []
    for seed in range(seeds):
        image = render(scene, wavelengths=GRID, excitation="grid", method="staged", seed=seed, staged=options)
        values = image.dataset["radiance"].values.astype(float)
        means.append(values[:, mask].mean(1) if mask is not None else values.mean((1, 2)))
    return np.array(means)


def assert_mean(found: Array, expected: Array, tolerance: float, allowance: float = 0.0) -> None:
    """Hold K observations (K, N) of one component against the truth (N,)."""
    scale = np.maximum(expected, 0.05 * expected.max())
    off = (found.mean(0) - expected) / scale
    error = np.sqrt(np.mean(found.var(0, ddof=1) / scale**2) / len(found))
    assert error < tolerance / 4, f"standard error {error:.2%}"
    assert np.abs(off).max() < student.ppf(1 - 5e-5, len(found) - 1) * error + allowance + 1e-6, (off, error)
    assert np.abs(off).max() < tolerance, off


def closed_form(reflectance: Array) -> Array:
    """Components 0 to 6 of the furnace, 6 for exactly two luminescences; ndarray of shape (7, N)."""
    s, D_L = sampled(reflectance, GRID), luminescence(*DYE, GRID)
    y = cavity(s, D_L, sampled(light_values(), GRID))
    F = y[5] / np.where(s > 0, s, 1) if (s > 0).all() else np.zeros_like(s)
    y[6] = D_L @ F + s * (D_L @ F) / (1 - s)
    return y


def test_furnace_with_two_luminescences(tmp_path: Path) -> None:
    """Expected: components 1 to 5 as in `lab.cavity`, and component 6 of `bounces=2`, which is all light that
    luminesced exactly twice: D_L F + S F' with F' = (1 - S)^-1 D_L F. Result: within 0.3 %."""
    scene = load_scene(write(tmp_path, furnace(16, 256)), materials={"cavity": paint("dye", S, *DYE)})
    found = observations(scene, replace(FAST, bounces=2, patch_samples=1024), seeds=4)
    for number, expected in enumerate(closed_form(S)):
        assert_mean(found[:, number], expected, 0.02)


def test_furnace_that_reflects_nothing_where_it_is_excited(tmp_path: Path) -> None:
    """Rationale: E = y / S has no answer where S = 0, and that is where the dye is excited.
    Expected: E_D is exact all the same. E_I is that of a surface which reflects ALBEDO_FLOOR there: too large
    by that share of E, in a closed cavity, where all light comes back. Nothing is NaN, and what is reflected
    is 0."""
    dark = np.where(FINE < 530, 0.0, 0.4)
    scene = load_scene(write(tmp_path, furnace(16, 256)), materials={"cavity": paint("black", dark, *DYE)})
    found = observations(scene, replace(FAST, patch_samples=1024), seeds=4)
    assert np.isfinite(found).all()
    s, D_L, L = sampled(dark, GRID), luminescence(*DYE, GRID), sampled(light_values(), GRID)
    y = cavity(s, D_L, L)
    assert found[:, 0] == pytest.approx(
        np.broadcast_to(L, found[:, 0].shape), rel=1e-5
    )  # the lamp, whatever S
    assert (found[:, 1][:, s == 0] == 0).all()
    assert (found[:, 3][:, s == 0] == 0).all()
    assert_mean(found[:, 1], y[1], 0.02)
    assert_mean(found[:, 2], y[2], 0.02)
    excess = found[:, 4].mean(0) - y[4]
    assert (excess > -0.02 * y[4].max()).all()
    assert (excess < 0.02 * y[4].max() + 1.5 * ALBEDO_FLOOR * y[2]).all()
    assert_mean(found[:, 5], y[5], 0.02, allowance=ALBEDO_FLOOR)


def test_stripes_finer_than_pixels(tmp_path: Path) -> None:
    """Rationale: pixels that show two materials are where the paper sees artefacts. Here every pixel shows
    four stripes of a bright red and four of a dark green fluorescent one, in even light L from all around.
    Expected: y1 is the mean S times L and y2 the mean D_L times L; dividing pixel by pixel by either S would
    be wrong by a factor of up to 6."""
    stripes = "".join(
        f"""<shape type="rectangle" id="stripe-{k}"> <bsdf type="diffuse" id="paint-{k % 2}-{k}"/>
        <transform name="to_world"> <scale x="{0.5 / 64}" y="1"/> <translate x="{(k + 0.5) / 64 - 1}"/>
        </transform> </shape>"""
        for k in range(128)
    )
    light = f'<emitter type="constant"> {curve("radiance", light_values())} </emitter>'
    camera = sensor(16, 64, origin="0, 0, 1", target="0, 0, 0", fov=2 * np.degrees(np.arctan(1)))
    text = f'<scene version="3.0.0"> {integrator()} {camera} {stripes} {light} </scene>'
    paints = [
        paint("bright", 0.6, bell(560, 40, 0.3), bell(480, 40)),
        paint("dark", 0.1, bell(600, 30, 0.4), bell(440, 30)),
    ]
    scene = load_scene(write(tmp_path, text), materials={f"stripe-{k}": paints[k % 2] for k in range(128)})
    scene = replace(scene, settings=replace(scene.settings, max_depth=2))
    image = render(
        scene, wavelengths=GRID, excitation="grid", method="staged", staged=replace(FAST, repeats=2)
    )
    E = sampled(light_values(), GRID)
    D_L = (
        luminescence(bell(560, 40, 0.3), bell(480, 40), GRID)
        + luminescence(bell(600, 30, 0.4), bell(440, 30), GRID)
    ) / 2
    y1, y2 = (image.component(name).values.astype(float) for name in COMPONENTS[1:3])
    # 16 x 16 x 128 samples that scatter by less than 0.5 each know the mean to 0.3 %
    assert y1.mean((0, 1)) == pytest.approx(0.35 * E, rel=0.01)
    assert y2.mean((0, 1)) == pytest.approx(D_L @ E, rel=0.01)
    assert y2.std((0, 1)).max() < 0.1 * y2.mean((0, 1)).max()


def test_a_two_material_edge_across_every_pixel(tmp_path: Path) -> None:
    """Rationale: where two materials share a pixel, components 4 and 5 must be right too: an edge across each
    of 2 x 2 pixels, a bright red and a dark green paint, both fluorescent, under a white ceiling and even
    light. Discretisation: a stripe of 2 x 1/2 is 4 x 4 emitters, smaller than half the distance to
    the ceiling. Expected: means of components 1 to 5 as those of the one-pass method, whose standard error is
    at most as large as this one's, 1 %, within 4 %."""
    stripes = "".join(
        f"""<shape type="rectangle" id="stripe-{k}"> <bsdf type="diffuse"/>
        <transform name="to_world"> <scale x="0.25" y="1"/> <translate x="{(k + 0.5) / 2 - 1}"/>
        </transform> </shape>"""
        for k in range(4)
    )
    ceiling = f"""<shape type="rectangle"> <bsdf type="diffuse"> {curve("reflectance", 0.8)} </bsdf>
        <transform name="to_world"> <rotate x="1" angle="180"/> <translate z="1.2"/> </transform> </shape>"""
    light = f'<emitter type="constant"> {curve("radiance", light_values())} </emitter>'
    camera = sensor(2, 16384, origin="0, 0, 1", target="0, 0, 0", fov=2 * np.degrees(np.arctan(1)))
    text = f'<scene version="3.0.0"> {integrator()} {camera} {stripes} {ceiling} {light} </scene>'
    paints = [
        paint("bright", 0.6, bell(560, 40, 0.3), bell(480, 40)),
        paint("dark", 0.1, bell(600, 30, 0.4), bell(440, 30)),
    ]
    scene = load_scene(write(tmp_path, text), materials={f"stripe-{k}": paints[k % 2] for k in range(4)})
    found = observations(scene, replace(FAST, emitters=4), seeds=4)
    expected = render(scene, wavelengths=GRID, excitation="grid", spp=65536)
    for number in range(1, 6):
        values = expected.component(COMPONENTS[number]).values.astype(float).mean((0, 1))
        assert_mean(found[:, number], values, 0.04, allowance=0.01)


def test_negative_emission_keeps_its_sign(tmp_path: Path) -> None:
    """Rationale: noise makes cells of a measured matrix negative; clipping what a surface emits would make
    component 5 too bright on average. Expected: the closed form, which is linear, in the bands where the
    emission is negative too."""
    D_L = luminescence(*DYE, GRID, equal=0.0)
    negative = GRID.values == 640
    D_L[negative] *= -0.5
    matrix = MeasuredMatrix(GRID.values, GRID.values, D_L + np.diag(sampled(S, GRID)))
    scene = load_scene(
        write(tmp_path, furnace(16, 256)), materials={"cavity": Material.from_matrix("noisy", matrix)}
    )
    found = observations(scene, replace(FAST, patch_samples=1024), seeds=4)
    expected = cavity(sampled(S, GRID), D_L, sampled(light_values(), GRID))
    assert expected[5][negative] < -0.01 * expected[5].max()
    off = (found[:, 5].mean(0) - expected[5]) / np.abs(expected[5]).max()
    error = found[:, 5].std(0, ddof=1).max() / np.abs(expected[5]).max() / np.sqrt(len(found))
    assert np.abs(off).max() < student.ppf(1 - 5e-5, len(found) - 1) * error
    assert error < 0.002


@pytest.mark.parametrize(
    ("body", "patches", "smooth"),
    [("box", 12, False), ("box", 100, False), ("ball", 50, True)],
    ids=["box-12", "box-100", "ball-50"],
)
def test_rendered_power_of_emitters(body: str, patches: int, smooth: bool, tmp_path: Path) -> None:
    """Rationale: emitted power is not only a sum of areas, for a renderer uses vertex normals as well.
    Expected: emitters of radiance 1 on a convex body send pi times its area to a black sphere around it, for
    any number of patches, with face normals exactly; with vertex normals (a ball of 1280 faces, 5 degrees off
    its faces) within 0.3 %. 40,000 light paths of a scatter of 1 know it to 0.5 %."""
    import trimesh

    mesh = trimesh.creation.box() if body == "box" else trimesh.creation.icosphere(3, radius=0.7)
    mesh.export(tmp_path / "body.obj", include_normals=smooth)
    text = f"""<scene version="3.0.0"> {integrator()} {sensor(8, 4, origin="0, 0, 2", target="0, 0, 0", fov=40)}
        <shape type="obj" id="body"> <string name="filename" value="body.obj"/> <bsdf type="diffuse"/>
            <boolean name="face_normals" value="{str(not smooth).lower()}"/> </shape>
        <shape type="sphere" id="shell"> <float name="radius" value="3"/> <bsdf type="diffuse"/>
            <boolean name="flip_normals" value="true"/> </shape>
        <emitter type="constant"/> </scene>"""
    made = {"body": paint("dye", 0.2, *DYE), "shell": paint("shell", 0.2, *DYE)}
    scene = load_scene(write(tmp_path, text), materials=made)
    renderer = MitsubaRenderer()
    matrices = [scene.materials[row].on(GRID) for row in range(2)]
    with renderer.session():
        arrays = emitter_arrays(renderer, scene, matrices, StagedOptions(patches=patches))
        inner, shell = sorted(arrays, key=lambda array: array.areas.sum())
        E = patch_illumination(
            renderer.load(scene, inner),
            shell,
            np.full((2, 1), 0.2),
            np.ones((patches, 1)),
            [np.array([0])],
            samples=40_000 // patches,
            max_depth=2,
            seed=1,
            glows=True,
        )
    power = np.pi * float((E[:, 0] * shell.areas).sum())
    assert power == pytest.approx(np.pi * inner.areas.sum(), rel=4 * 0.005 + 0.003 * smooth)


def test_sphere_of_two_materials(tmp_path: Path) -> None:
    """Rationale: the light in a sphere is uniform (`lab.two_part_sphere`). Expected: within 0.8 % of the closed
    form, of which 0.1 % is that of a sphere of 1280 triangles (see test_sphere.py)."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3)
    cap = ball.triangles_center[:, 2] > 0.2
    shapes, lamp = "", light_values()
    for name, chosen in (("cap", cap), ("rest", ~cap)):
        part = trimesh.Trimesh(ball.vertices, ball.faces[chosen][:, ::-1], process=False)
        part.export(tmp_path / f"{name}.obj", include_normals=False)
        shapes += f"""<shape type="obj" id="{name}"> <string name="filename" value="{name}.obj"/>
            <boolean name="face_normals" value="true"/>
            <emitter type="area"> {curve("radiance", lamp)} </emitter> </shape>"""
    camera = sensor(16, 256, origin="0.1, 0, 0", target="1, 0, 0.3", fov=100, up="0, 0, 1")
    dyes, bright = [DYE, (bell(620, 30, 0.3), bell(540, 50))], [S, 0.7 - 0.3 * (FINE - 300) / 480]
    scene = load_scene(
        write(tmp_path, f'<scene version="3.0.0"> {integrator()} {camera} {shapes} </scene>'),
        materials={
            name: paint(name, s, *dye) for name, s, dye in zip(("cap", "rest"), bright, dyes, strict=True)
        },
    )
    areas = ball.area_faces
    share = np.array([areas[cap].sum(), areas[~cap].sum()]) / areas.sum()
    light = sampled(lamp, GRID)
    closed = two_part_sphere(
        share,
        np.array([sampled(s, GRID) for s in bright]),
        np.array([luminescence(*dye, GRID) for dye in dyes]),
        np.array([light, light]),
    )
    # which pixels show the cap: those whose reflection is the cap's
    first = render(
        scene, wavelengths=GRID, excitation="grid", method="staged", staged=replace(FAST, repeats=1)
    )
    y1 = first.component("direct_reflection").values.mean(-1)
    levels = closed[:, 1].mean(-1)
    mask = np.abs(y1 - levels[0]) < 0.1 * np.abs(levels[1] - levels[0])
    assert mask.sum() > 40
    found = observations(scene, replace(FAST, patch_samples=1024), seeds=4, mask=mask)
    for number in range(1, 6):
        assert_mean(found[:, number], closed[0, number], 0.03, allowance=2e-3)


def test_agrees_with_paths_in_the_cornell_box() -> None:
    """Rationale: two methods that share only scene and spectra. Discretisation: with 8 x 8 emitters the light
    of a wall is in the right place to a sixteenth of its side; seen from the middle of the box that is well
    below 1 % of component 5. Expected: image means agree within 1 % (total) and 3 % (each component), pixels
    without bias."""
    scene = load_scene("cornell-box").with_settings(width=24, height=24, spp=256)
    staged = render(
        scene, wavelengths=GRID, excitation="grid", method="staged", staged=StagedOptions(repeats=4)
    )
    paths = render(scene, wavelengths=GRID, excitation="grid", spp=1024)
    means = {
        method: np.array([image.component(name).values.mean((0, 1)) for name in COMPONENTS[1:6]])
        for method, image in (("staged", staged), ("paths", paths))
    }
    scale = np.maximum(means["paths"], 0.05 * means["paths"].max(-1, keepdims=True))
    assert np.abs((means["staged"] - means["paths"]) / scale).max() < 0.03
    lit = staged.component("source").values.max(-1) + paths.component("source").values.max(-1) == 0
    totals = [image.total(single_bounce=True).values[lit].mean(0) for image in (staged, paths)]
    assert totals[0] == pytest.approx(totals[1], rel=0.01)
    assert staged.attrs["single_bounce"] == 1
    assert "reexcitation" not in staged.components
