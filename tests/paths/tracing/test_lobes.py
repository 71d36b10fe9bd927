"""Identity, without Monte Carlo: coefficients of lobes times their spectra are what stock Mitsuba's BSDFs say."""

from pathlib import Path

import numpy as np
import pytest

from fluorspar import load_scene
from fluorspar.errors import ApproximationWarning
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import LOBE_VARIANTS
from fluorspar.scene.lobes.lobe import ANGLES, METAL, REST, Lobes, operate
from fluorspar.scene.lobes.rows import Metal
from fluorspar.scene.lobes.textures import sigmoid
from fluorspar.scene.variants import use_variant
from fluorspar.spectral.wavelengths import Wavelengths

COUNT = 4096
TEXELS = np.array([5, 3])  # columns, rows
PICKS = 64  # of the random number that interpolates
GRID = Wavelengths(450, 600, 50)  # as many wavelengths as stock evaluates at a time
PAINT = {"type": "spectrum", "value": [(400, 0.1), (500, 0.7), (600, 0.3), (700, 0.9)]}
TINT = {"type": "spectrum", "value": [(400, 0.9), (550, 0.5), (700, 0.8)]}
COLOUR = {"type": "rgb", "value": [0.2, 0.5, 0.8]}


def scene_with(bsdf, named=None, others=None):
    return {
        "type": "scene",
        **(named or {}),
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
        "light": {"type": "constant"},
        "shape": {"type": "sphere", "bsdf": bsdf},
        **(others or {}),
    }


def geometry(mi, rng_seed=0):
    """Interactions with the shape, directions and random numbers; the same in every variant."""
    rng = np.random.default_rng(rng_seed)
    wi, wo = rng.normal(size=(2, COUNT, 3))
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    texel = (rng.integers(0, 15, size=(COUNT, 2)) % TEXELS + 0.5) / TEXELS
    return wi, wo, texel, rng.random((COUNT, 3))


def interaction(mi, dr, scene, wi, uv):
    si = dr.zeros(mi.SurfaceInteraction3f, COUNT)
    si.t = mi.Float(1)
    si.wi = mi.Vector3f(wi.T.astype(np.float32))
    si.uv = mi.Point2f(uv.T.astype(np.float32))
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    si.shape = mi.ShapePtr(scene.shapes()[0])
    return si


def metal(spectra, operation):
    """The rows of the metal that a texel is on; NaN if it is on none."""
    if operation > METAL:
        return np.full((ANGLES, 4), np.nan)
    return spectra[(first := int(METAL - operation)) : first + ANGLES]


def sums_of_lobes(bsdf, **around):
    """Value for wo, sampled weight times density, sampled wo, type and density; spectra of shape (COUNT, 4)."""
    job = RenderJob.of(scene_with(bsdf, **around), wavelengths=GRID)
    lobes = job.scene.lobes
    assert lobes is not None
    spectra = np.array([matrix.reflectance for matrix in job.scene.matrices(GRID)])
    colours = lobes.colours
    of_colours = sigmoid(colours[:, :3], GRID.values)
    on_metal = np.array(
        [
            colour * row
            for colour, (*_, op) in zip(of_colours, colours, strict=True)
            for row in metal(spectra, op)
        ]
    ).reshape(-1, 4)
    spectra = np.concatenate([spectra, operate(of_colours, colours[:, 3:]), on_metal])
    wi, wo, uv, random = geometry(None)
    with use_variant(LOBE_VARIANTS["llvm"]):
        import drjit as dr
        import mitsuba as mi

        from fluorspar.paths.tracing.lobe_scene import build_lobe_scene
        from fluorspar.paths.tracing.lobe_tracer import LobeTracer

        scene = build_lobe_scene(job.scene)
        tracer = LobeTracer(scene, job.scene.settings, np.ones(len(spectra)), 0)
        si = interaction(mi, dr, scene.mitsuba_scene, wi, uv)
        towards = mi.Vector3f(wo.T.astype(np.float32))
        samples = mi.Float(random[:, 0].astype(np.float32)), mi.Point2f(random[:, 1:].T.astype(np.float32))
        value, _, bs, weight = si.bsdf().eval_pdf_sample(mi.BSDFContext(), si, towards, *samples)
        pdf = np.array(bs.pdf)
        found, sent = np.zeros((2, COUNT, len(GRID)))
        picks = (np.arange(PICKS) + 0.5) / PICKS if tracer.metallic else [0.5]
        for pick in picks:
            between = mi.Point3f(pick) if tracer.products else mi.Point2f(pick)
            for row, d, c in tracer.terms_of(si, value, weight, towards, bs, between, mi.Bool(True)):
                of_row = spectra[np.broadcast_to(np.array(row), COUNT)] / len(picks)
                found += np.array(d)[:, np.newaxis] * of_row
                sent += (np.array(c) * pdf)[:, np.newaxis] * of_row
        return found, sent, np.array(bs.wo).T, np.array(bs.sampled_type), pdf


def sums_of_stock(bsdf, sampled_wo, **around):
    wi, wo, uv, random = geometry(None)
    with use_variant("llvm_ad_spectral"):
        import drjit as dr
        import mitsuba as mi

        scene = mi.load_dict(scene_with(bsdf, **around))
        si = interaction(mi, dr, scene, wi, uv)
        si.wavelengths = mi.Spectrum(*(float(w) for w in GRID.values))
        context, plugin = mi.BSDFContext(), si.bsdf()
        value = np.array(plugin.eval(context, si, mi.Vector3f(wo.T.astype(np.float32)))).T
        of_sample = np.array(plugin.eval(context, si, mi.Vector3f(sampled_wo.T))).T
        samples = mi.Float(random[:, 0].astype(np.float32)), mi.Point2f(random[:, 1:].T.astype(np.float32))
        bs, weight = plugin.sample(context, si, *samples)
        pdf = np.array(bs.pdf)
        return (
            value,
            of_sample,
            np.array(bs.sampled_type),
            np.array(weight).T * pdf[:, np.newaxis],
            np.array(bs.wo).T,
        )


def check(bsdf, tolerance=1e-6, **around):
    found, sent, wo, kind, pdf = sums_of_lobes(bsdf, **around)
    value, of_sample, stock_kind, of_stock_sample, stock_wo = sums_of_stock(bsdf, wo, **around)

    def error(ours, stock):
        return np.max(np.abs(ours - stock) / (np.abs(stock) + 1), initial=0.0)

    assert error(found, value) <= tolerance
    import mitsuba as mi

    delta = (kind & int(mi.BSDFFlags.Delta)) > 0
    same = (stock_kind == kind) & (np.abs(stock_wo - wo).max(axis=1) < 1e-6)
    other = ~same & ~delta & (pdf > 0)  # of another lobe, because stock's mean colours differ a little
    assert error(sent[same], of_stock_sample[same]) <= tolerance
    assert error(sent[other], of_sample[other]) <= tolerance
    assert same[delta].mean() > 0.9 if delta.any() else True  # lobes are chosen as stock chooses them
    return found


@pytest.fixture
def picture(tmp_path: Path) -> str:
    """A small picture in colours."""
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        texels = (np.random.default_rng(1).random((3, 5, 3)) * 255).astype(np.uint8)
        mi.Bitmap(texels).write(str(tmp_path / "texels.png"))
    return str(tmp_path / "texels.png")


PLAIN = {
    "plastic": {"type": "plastic", "diffuse_reflectance": PAINT},
    "tinted plastic": {"type": "plastic", "diffuse_reflectance": PAINT, "specular_reflectance": TINT},
    "nonlinear plastic": {
        "type": "plastic",
        "diffuse_reflectance": COLOUR,
        "nonlinear": True,
        "int_ior": 1.9,
    },
    "rough plastic": {"type": "roughplastic", "diffuse_reflectance": PAINT, "alpha": 0.3},
    "rough nonlinear plastic": {
        "type": "roughplastic",
        "diffuse_reflectance": PAINT,
        "distribution": "ggx",
        "nonlinear": True,
    },
    "glass": {"type": "dielectric"},
    "tinted glass": {"type": "dielectric", "specular_transmittance": TINT},
    "pane": {"type": "thindielectric", "specular_transmittance": TINT},
    "rough glass": {"type": "roughdielectric", "alpha": 0.2, "specular_transmittance": TINT},
    "two sides": {
        "type": "twosided",
        "a": {"type": "diffuse", "reflectance": PAINT},
        "b": {"type": "plastic"},
    },
    "null": {"type": "null"},
    "mask": {"type": "mask", "opacity": 0.3, "bsdf": {"type": "plastic", "diffuse_reflectance": PAINT}},
    "blend": {
        "type": "blendbsdf",
        "weight": 0.3,
        "a": {"type": "diffuse", "reflectance": PAINT},
        "b": {"type": "roughplastic", "diffuse_reflectance": TINT},
    },
}


@pytest.mark.parametrize("name", PLAIN)
def test_lobes_times_spectra_are_the_bsdf(name):
    found = check(PLAIN[name])
    if name not in ("glass", "tinted glass", "pane", "null"):
        assert found.max() > 0.05


PRINCIPLED = {
    "plain": {},
    "metallic": {"metallic": 0.7, "roughness": 0.3, "anisotropic": 0.5},
    "coat and sheen": {"clearcoat": 0.8, "clearcoat_gloss": 0.4, "sheen": 0.6},
    "flat": {"flatness": 0.5, "roughness": 0.6},
    "tint of no sheen": {"sheen_tint": 0.8, "roughness": 0.6},
    "glass": {"spec_trans": 0.8, "roughness": 0.3, "eta": 1.5},
}


def test_blends_share_their_parts():
    """Whatever the order of the parts, and whatever else is beside one."""
    parts = {"a": PAINT, "b": TINT, "c": COLOUR}
    named = {name: {"type": "diffuse", "id": name, "reflectance": value} for name, value in parts.items()}
    blends = [
        {"type": "blendbsdf", "weight": 0.3, **{part: {"type": "ref", "id": part} for part in pair}}
        for pair in ("ab", "ca", "cb")
    ]
    for blend in blends:  # of which the one that is checked is on the first sphere
        others = {f"other {number}": {"type": "sphere", "bsdf": bsdf} for number, bsdf in enumerate(blends)}
        check(blend, named=named, others=others)
    balls = {
        f"ball {name}": {"type": "sphere", "bsdf": {"type": "ref", "id": name}} for name in (*parts, "blend")
    }
    scene = scene_with({"type": "diffuse"}, named=named | {"blend": blends[0] | {"id": "blend"}} | balls)
    assert [len(front) for front, _ in load_scene(scene).lobes.of_surface.values()] == [1, 1, 1, 2, 1]


@pytest.mark.parametrize("name", PRINCIPLED)
def test_principled(name):
    check({"type": "principled", "base_color": PAINT, **PRINCIPLED[name]}, tolerance=3e-6)
    check({"type": "principled", "base_color": COLOUR, **PRINCIPLED[name]}, tolerance=3e-6)


def test_thin_principled():
    thin = {"type": "principledthin", "spec_trans": 0.5, "diff_trans": 0.6, "roughness": 0.4, "eta": 1.4}
    check({**thin, "base_color": PAINT}, tolerance=3e-6)


METALS = {
    "gold": {"type": "conductor", "material": "Au"},
    "rough copper": {"type": "roughconductor", "material": "Cu", "alpha": 0.3, "specular_reflectance": TINT},
    "numbers": {"type": "roughconductor", "eta": 1.2, "k": 4.0},
}


@pytest.mark.parametrize("name", METALS)
def test_a_conductor_is_interpolated_between_angles(name):
    check(METALS[name], tolerance=3e-4)


def test_texels_are_those_of_the_picture(picture):
    for filter_type in ("nearest", "bilinear"):
        bitmap = {"type": "bitmap", "filename": picture, "filter_type": filter_type}
        check({"type": "diffuse", "reflectance": bitmap}, tolerance=1e-5)
        check({"type": "roughplastic", "diffuse_reflectance": bitmap}, tolerance=1e-5)
    nearest = {"type": "bitmap", "filename": picture, "filter_type": "nearest"}
    check({"type": "roughplastic", "diffuse_reflectance": nearest, "nonlinear": True}, tolerance=1e-5)


def test_the_brightest_value_of_a_texel():
    rng = np.random.default_rng(2)
    # Parabolas with their vertex at, beside and far from visible light, up and down, and none.
    vertex, width, top = rng.uniform(200, 1000, 300), rng.uniform(20, 300, 300), rng.uniform(-3, 3, 300)
    a = np.where(rng.random(300) < 0.1, 0, rng.choice([-1, 1], 300) / width**2)
    colours = np.stack([a, -2 * a * vertex, a * vertex**2 + top], axis=1).astype(np.float32)
    everywhere = np.linspace(360, 830, 4701)
    for operation in (0.0, REST, 0.6):  # S itself, the rest, and under a coat
        texels = np.concatenate([colours, np.full((300, 1), operation, np.float32)], axis=1)
        expected = operate(sigmoid(colours, everywhere), operation).max(axis=1)
        np.testing.assert_allclose(Lobes(colours=texels).brightest, expected, atol=2e-5)


@pytest.mark.parametrize("bsdf", ["plastic", "roughplastic", "principled"])
def test_of_an_interpolated_texture_that_is_not_used_linearly_is_warned_once(picture, bsdf):
    kinds = {"principled": ("base_color", {"spec_trans": 0.5})}
    name, nonlinear = kinds.get(bsdf, ("diffuse_reflectance", {"nonlinear": True}))
    nearest, bilinear = (
        {"type": bsdf, name: {"type": "bitmap", "filename": picture, "filter_type": kind}, **nonlinear}
        for kind in ("nearest", "bilinear")
    )
    load_scene(scene_with(nearest))  # says nothing
    with pytest.warns(ApproximationWarning, match="depend linearly") as warned:
        load_scene(scene_with(bilinear) | {"other": {"type": "sphere", "bsdf": bilinear}})
    assert len(warned) == 1


def test_a_metal_with_a_texture(picture):
    bitmap = {"type": "bitmap", "filename": picture}
    check({"type": "conductor", "material": "Au", "specular_reflectance": bitmap}, tolerance=3e-4)
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        to_uv = mi.ScalarTransform4f().scale([1.7, 2.3, 1])
    board = {"type": "checkerboard", "color0": PAINT, "color1": TINT, "to_uv": to_uv}
    rough = {"type": "roughconductor", "eta": 1.2, "k": 4.0, "alpha": 0.3}
    check({**rough, "specular_reflectance": board}, tolerance=3e-4)


@pytest.mark.parametrize("wrap", ["repeat", "mirror", "clamp"])
def test_a_picture_goes_on_beyond_its_edge(picture, wrap):
    place = np.array([[2.0, 0.0, -0.4], [0.0, 3.0, 0.6], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:2, :2], matrix[:2, 3] = place[:2, :2], place[:2, 2]
    bitmap = {"type": "bitmap", "filename": picture, "filter_type": "nearest", "wrap_mode": wrap}
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        bitmap["to_uv"] = mi.ScalarTransform4f(matrix)
        check({"type": "diffuse", "reflectance": bitmap}, tolerance=1e-5)


def test_a_checkerboard_is_two_spectra():
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        to_uv = mi.ScalarTransform4f().scale([1.7, 2.3, 1])
    board = {"type": "checkerboard", "color0": PAINT, "color1": TINT, "to_uv": to_uv}
    check({"type": "diffuse", "reflectance": board})


def test_a_metal_given_by_its_index_alone():
    check({"type": "conductor", "eta": 1.3}, tolerance=3e-4)
    check({"type": "roughconductor", "k": 2.0}, tolerance=3e-4)


def test_a_metal_given_as_rgb():
    rgb = {"eta": [0.2, 0.9, 0.6], "k": [0.9, 0.6, 0.8]}  # below 1, where stock does not clamp them
    with pytest.warns(ApproximationWarning, match="rgb"):
        job = RenderJob.of(
            scene_with({"type": "conductor"} | {n: {"type": "rgb", "value": v} for n, v in rgb.items()}),
            wavelengths="450:610:80",
        )
    metals = [row for row in job.scene.lobes.rows if isinstance(row, Metal)]
    assert metals[0].eta.on(Wavelengths(450, 610, 160)) == pytest.approx([0.6, 0.2])
    assert metals[0].k.on(Wavelengths(300, 800, 500)) == pytest.approx([0.8, 0.9])


@pytest.mark.parametrize("index", [1.0, 1.000277])
def test_a_coat_of_air_is_none(index):
    bare = {"type": "fluorescent", "material": "poster-red"}
    coated = load_scene(scene_with({**bare, "int_ior": index, "ext_ior": index})).lobes.rows[-1]
    material = load_scene(scene_with(bare)).materials[0]
    # Mitsuba's formula for the light that a coat sends back gives 0.0017 for one of air.
    assert coated.on(GRID).band() == pytest.approx(material.on(GRID).band(), abs=1e-3)
