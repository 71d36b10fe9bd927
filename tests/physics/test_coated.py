"""A fluorescent base under a clear coat, against closed forms."""

import numpy as np
import pytest

import fluorspar
from fluorspar.bispectral.coated import under_a_coat
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.scene.loading import load_scene
from fluorspar.scene.variants import use_variant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

EVEN = {"type": "spectrum", "value": 1.0}
GRID = Wavelengths(400, 700, 10)


def base_matrix(kind: str, stokes="half") -> DonaldsonMatrix:
    w = GRID.values
    S = 0.3 + 0.4 * (w > 550)
    alpha = np.exp(-(((w - 560) / 40) ** 2))[np.newaxis]
    beta = 0.004 * np.exp(-(((w - 480) / 40) ** 2))[np.newaxis]
    if kind == "one dye":
        return DonaldsonMatrix(GRID, S, alpha, beta, stokes=stokes)
    if kind == "two dyes":
        other = 0.5 * np.exp(-(((w - 620) / 30) ** 2))[np.newaxis]
        return DonaldsonMatrix(
            GRID, S, np.concatenate([alpha, other]), np.concatenate([beta, 0.7 * beta]), stokes=stokes
        )
    full = np.tril(0.4 * alpha.T @ beta)
    return DonaldsonMatrix(GRID, S, luminescent=full, stokes=stokes)


@pytest.mark.parametrize("kind", ["one dye", "two dyes", "full"])
@pytest.mark.parametrize("stokes", ["half", "strict"])
def test_all_answers_of_the_base_are_counted_once(kind, stokes):
    base = base_matrix(kind, stokes)
    once, more = under_a_coat(base, 0.6)
    D = base.band()
    S, L = np.diag(base.reflectance), D - np.diag(base.reflectance)
    A = np.linalg.inv(np.eye(len(S)) - 0.6 * S)
    np.testing.assert_allclose(once.band(), S @ A + A @ L @ A, atol=1e-12)
    np.testing.assert_allclose(
        once.band() + more.band(), D @ np.linalg.inv(np.eye(len(D)) - 0.6 * D), atol=1e-12
    )


def test_a_coat_that_reflects_nothing_back_changes_nothing():
    base = base_matrix("one dye")
    once, more = under_a_coat(base, 0.0)
    np.testing.assert_allclose(once.band(), base.band(), atol=1e-15)
    np.testing.assert_allclose(more.band(), 0, atol=1e-15)


def plate(coat, material):
    """A plate under a distant light, seen from above; neither the coat's mirror nor other surfaces are in view."""
    spectra = {
        "emission": material.fluorophores[0].emission,
        "excitation": material.fluorophores[0].excitation,
    }
    inline = {
        name: {"type": "spectrum", "value": list(zip(s.wavelengths.tolist(), s.values.tolist(), strict=True))}
        for name, s in {"reflectance": material.reflectance, **spectra}.items()
    }
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        look = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
        to_world = look @ mi.ScalarTransform4f().scale([0.5, 0.5, 1])
    return {
        "type": "scene",
        "sensor": {
            "type": "orthographic",
            "to_world": to_world,
            "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
        },
        "light": {
            "type": "directional",
            "direction": [0.6, 0.0, -0.8],
            "irradiance": {"type": "spectrum", "value": 1.0},
        },
        "plate": {"type": "rectangle", "bsdf": {"type": "fluorescent", **coat, **inline}},
    }


@pytest.mark.parametrize("coat", [{"int_ior": 1.5}, {"int_ior": 1.5, "alpha": 0.2, "distribution": "ggx"}])
def test_a_coated_plate_under_a_distant_light(coat):
    w = np.arange(400.0, 701.0, 10.0)
    material = Material(
        "dyed",
        Spectrum(w, 0.3 + 0.4 * (w > 550)),
        [
            Fluorophore(
                Spectrum(w, 0.4 * np.exp(-(((w - 560) / 40) ** 2))),
                Spectrum(w, 0.002 * np.exp(-(((w - 480) / 40) ** 2))),
            )
        ],
    )
    scene = load_scene(plate(coat, material))
    row = next(row for row in scene.lobes.rows if hasattr(row, "r"))
    once, more = under_a_coat(row.base.on(GRID), row.r)
    E = np.ones(len(GRID))
    image = fluorspar.render(scene, spp=16, wavelengths=GRID)
    y = image.dataset.radiance.values.mean(axis=(1, 2)).astype(np.float64)
    if "alpha" not in coat:  # a rough coat has a highlight, too
        scale = y[1].sum() / once.reflect(E).sum()
        np.testing.assert_allclose(y[1], scale * once.reflect(E), rtol=2e-5)
    else:
        scale = y[2].sum() / once.apply_luminescent(E).sum()
    np.testing.assert_allclose(y[2], scale * once.apply_luminescent(E), rtol=2e-5, atol=1e-7)
    np.testing.assert_allclose(y[6], scale * more.apply(E), rtol=1e-4, atol=1e-6 * y[1].max())
    assert y[6].max() > 0.01 * y[2].max()
