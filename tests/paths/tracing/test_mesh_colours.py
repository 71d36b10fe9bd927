"""Identity, without Monte Carlo: the colours of faces and vertices are those of stock Mitsuba at each place."""

import numpy as np
import pytest

from fluorspar import load_scene
from fluorspar.errors import SceneError
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import LOBE_VARIANTS
from fluorspar.scene.lobes.lobe import operate
from fluorspar.scene.lobes.textures import sigmoid
from fluorspar.scene.variants import use_variant
from fluorspar.spectral.wavelengths import Wavelengths
from xml_scene import coloured_ply

GRID = Wavelengths(450, 600, 50)
PLACES = 64
PICKS = 100
MESH = coloured_ply(
    """-1 -1 0 0.2 0.7 0.1
1 -1 0 0.8 0.3 0.6
1 1 0 0.1 0.1 0.9
-1 1 0 0.9 0.9 0.2""",
    """3 0 1 2 0.1 0.5 0.8
3 0 2 3 0.7 0.2 0.3""",
)


@pytest.fixture
def scene(tmp_path):
    """Makes a scene of two meshes with one BSDF; the second has its first two vertices in another colour."""
    (tmp_path / "first.ply").write_text(MESH)
    (tmp_path / "second.ply").write_text(
        MESH.replace("0.2 0.7 0.1", "0.9 0 0").replace("0.8 0.3 0.6", "0 0.9 0")
    )

    def make(bsdf, name, attribute):
        with use_variant("scalar_rgb"):
            import mitsuba as mi

            aside = mi.ScalarTransform4f().translate([5, 0, 0])
        colours = {"type": "mesh_attribute", "name": attribute}
        paint = {"type": bsdf, "id": "paint", name: colours}
        return {
            "type": "scene",
            "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
            "light": {"type": "constant"},
            "paint": paint,
            "first": {
                "type": "ply",
                "filename": str(tmp_path / "first.ply"),
                "bsdf": {"type": "ref", "id": "paint"},
            },
            "second": {
                "type": "ply",
                "filename": str(tmp_path / "second.ply"),
                "to_world": aside,
                "bsdf": {"type": "ref", "id": "paint"},
            },
        }

    return make


def hits(mi, scene):
    """Places on both meshes."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-0.99, 0.99, (2, PLACES)).astype(np.float32)
    x[PLACES // 2 :] += 5
    ray = mi.Ray3f(mi.Point3f(x, y, 1), mi.Vector3f(0.0, 0.0, -1.0))
    return scene.ray_intersect(ray)


@pytest.mark.parametrize("attribute", ["face_color", "vertex_color"])
@pytest.mark.parametrize(("bsdf", "name"), [("diffuse", "reflectance"), ("principled", "base_color")])
def test_coefficients_times_spectra_are_the_bsdf(scene, bsdf, name, attribute):
    plain = scene(bsdf, name, attribute)
    job = RenderJob.of(plain, wavelengths=GRID)
    lobes = job.scene.lobes
    spectra = np.array([matrix.reflectance for matrix in job.scene.matrices(GRID)])
    of_colours = operate(sigmoid(lobes.colours[:, :3], GRID.values), lobes.colours[:, 3:])
    spectra = np.concatenate([spectra, of_colours])
    ours = np.zeros((PLACES, len(GRID)))
    with use_variant(LOBE_VARIANTS["llvm"]):
        import drjit as dr
        import mitsuba as mi

        from fluorspar.paths.tracing.lobe_scene import build_lobe_scene
        from fluorspar.paths.tracing.lobe_tracer import LobeTracer

        built = build_lobe_scene(job.scene)
        tracer = LobeTracer(built, job.scene.settings, np.ones(len(spectra)), 0)
        si = hits(mi, built.mitsuba_scene)
        wo = mi.Vector3f(0.3, 0.4, 0.75**0.5)
        value, _, bs, weight = si.bsdf().eval_pdf_sample(mi.BSDFContext(), si, wo, 0.5, mi.Point2f(0.5))
        for pick in (np.arange(PICKS) + 0.5) / PICKS:
            number = dr.opaque(mi.Float, float(pick))  # not compiled into the code
            for row, d, _ in tracer.terms_of(si, value, weight, wo, bs, mi.Point2f(number), si.is_valid()):
                ours += np.array(d)[:, np.newaxis] * spectra[np.broadcast_to(np.array(row), PLACES)] / PICKS
    with use_variant("llvm_ad_spectral"):
        import mitsuba as mi

        stock = mi.load_dict(plain)
        si = hits(mi, stock)
        si.wavelengths = mi.Spectrum(*(float(w) for w in GRID.values))
        expected = np.array(si.bsdf().eval(mi.BSDFContext(), si, mi.Vector3f(0.3, 0.4, 0.75**0.5))).T
    assert np.ptp(expected, axis=0).min() > 0.05
    assert ours == pytest.approx(expected, abs=3e-6 if attribute == "face_color" else 1 / PICKS)


def test_an_attribute_that_a_shape_does_not_have(scene):
    with pytest.raises(SceneError, match=r"(?s)no attribute 'vertex_colour'.*'first'.*vertex_color"):
        load_scene(scene("plastic", "diffuse_reflectance", "vertex_colour"))
