"""Standard errors that neighbours share: against the formula, and against converged images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import uniform_filter

import fluorspar
from fluorspar.paths.sweeping.pooled_errors import pool_errors

OPEN = """<scene version="3.0.0"> <sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0,2,6" target="0,0.5,0" up="0,1,0"/> </transform>
    <film type="hdrfilm"> <integer name="width" value="48"/> <integer name="height" value="48"/> </film> </sensor>
    <shape type="rectangle"> <transform name="to_world"> <rotate x="1" angle="-90"/> <scale value="4"/> </transform>
    <bsdf type="diffuse"> <spectrum name="reflectance" value="0.6"/> </bsdf> </shape>
    <shape type="sphere"> <point name="center" x="0" y="0.7" z="0"/> <float name="radius" value="0.7"/>
    <bsdf type="diffuse"> <spectrum name="reflectance" value="0.3"/> </bsdf> </shape>
    <emitter type="point"> <point name="position" x="-2" y="3" z="2"/> <spectrum name="intensity" value="20"/>
    </emitter>
    <shape type="rectangle"> <transform name="to_world"> <scale value="0.5"/> <rotate x="1" angle="90"/>
    <translate x="1" y="4" z="0"/> </transform> <emitter type="area"> <spectrum name="radiance" value="10"/>
    </emitter> </shape> </scene>"""


@pytest.mark.parametrize(
    ("width", "first", "pixels"), [(20, 0, 400), (20, 35, 187), (200, 0, 150), (9, 4, 300)]
)
def test_the_formula(width: int, first: int, pixels: int) -> None:
    """mean(v) (0.7 + 0.3 s / mean(s)) over the window, within the run and the row, without rims of lamps."""
    rng = np.random.default_rng(3)
    batches, halves = rng.uniform(1, 3, (2, pixels, 5)).astype(np.float32)
    lamps = rng.uniform(size=pixels) < 0.1
    rows = max(1, min(5, pixels // width))
    shape = -(-(first + pixels) // width), width
    there = np.zeros(shape)
    there.flat[first : first + pixels] = ~lamps
    window = 2 * (rows // 2) + 1, 2 * (25 // rows // 2) + 1

    def mean(values: np.ndarray) -> np.ndarray:
        whole = np.zeros((*shape, values.shape[1]))
        whole.reshape(-1, values.shape[1])[first : first + pixels] = np.nan_to_num(values) ** 2
        sums = uniform_filter(whole * there[..., None], (*window, 1), mode="constant")
        means = sums / np.maximum(uniform_filter(there, window, mode="constant"), 1e-9)[..., None]
        return means.reshape(-1, values.shape[1])[first : first + pixels]

    expected = np.sqrt(mean(halves) * (0.7 + 0.3 * batches**2 / mean(batches)))
    expected[lamps] = batches[lamps]
    halves[lamps] = np.nan
    for work in pool_errors(batches, halves, first, width):
        work()
    np.testing.assert_allclose(batches, expected, rtol=1e-5)


@pytest.mark.parametrize(("scene", "spp"), [("cornell-box", 64), ("cornell-box", 16), ("open", 64)])
def test_deviations_from_a_converged_image(scene: str, spp: int, tmp_path: Path) -> None:
    """In standard errors their standard deviation is 1; the mean square error is what the errors say.

    10,000 deviations, of which neighbours share errors: 3 standard errors of the estimate are 0.04 at least, and the
    noise of edges is not Gaussian.
    """
    (tmp_path / "open.xml").write_text(OPEN)
    options = {"size": (48, 48), "wavelengths": "400:700:100"}
    file = tmp_path / "open.xml" if scene == "open" else scene
    images = [
        fluorspar.render(file, spp=n, seed=seed, **options)
        for n, seed in ((4096, 9), *((spp, s) for s in range(5)))
    ]
    truth, errors = (
        np.array([of(image) for image in images])
        for of in (lambda image: image.total().values, lambda image: image.standard_error().values)
    )
    dark = ~np.any([image.component("source").values.any(axis=-1) for image in images], axis=0)
    lit = dark & (truth[0] > 0).all(axis=-1)
    deviations = (truth[1:] - truth[0])[:, lit]
    variances = (errors[1:] ** 2 + errors[0] ** 2)[:, lit]
    assert np.std(deviations / np.sqrt(variances)) == pytest.approx(1, abs=0.07)
    assert np.mean(variances) / np.mean(deviations**2) == pytest.approx(1, abs=0.15)
    assert images[1].attrs["error_freedom"] == 25


def test_a_pixel_alone_keeps_the_errors_of_its_batches() -> None:
    """Two sets say next to nothing about the noise of a single pixel, so there each batch is a set."""
    images = [
        fluorspar.render("cornell-box", size=(1, 1), spp=256, seed=seed, wavelengths="400:700:100")
        for seed in range(30)
    ]
    values = np.array([image.total().values.ravel() for image in images])
    errors = np.array([image.standard_error().values.ravel() for image in images])
    assert images[0].attrs["error_freedom"] == 31
    # 30 seeds know the scatter to 13 %, and bands go together
    np.testing.assert_allclose(values.std(axis=0, ddof=1), errors.mean(axis=0), rtol=0.45)
