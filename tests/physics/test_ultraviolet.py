"""Light excites whether an image holds its wavelength or not, and lines count wherever they are.

Rationale
    A matte plane that a lamp of the near ultraviolet lights directly shows y2 / y1 = (D_L L) / (S L), whatever the
    geometry: every light path has the same ratio. So a render is held to the closed form, and to the colour of a flat
    sample, without noise; and an image of visible bands to one that holds the ultraviolet too.
Expected
    Single precision, 1e-5, on any grid (of few widths, because code is compiled for each). An image is a part of the
    one that holds all bands it was computed on, bit for bit, also by the staged procedure.
Samples
    4 x 4 pixels of 4 paths: there is no noise in a ratio.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from lab import integrator, sensor, write

from fluorspar import Material, Scene, SpectralImage, Spectrum, load_scene, render, trace
from fluorspar.bispectral.lamp_colour import colour_under_lamp
from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Fluorophore
from fluorspar.errors import ApproximationWarning
from fluorspar.job import read_grid
from fluorspar.staged.options import StagedOptions

BLACK_LIGHT = "300:0, 330:0, 340:0.1, 350:0.5, 360:0.9, 370:0.9, 380:0.4, 390:0.1, 400:0.02, 780:0.02"
PAINT = Material(
    "brightened",
    Spectrum.constant(0.5),
    (
        Fluorophore(
            Spectrum([400, 440, 520, 700], [0, 0.05, 0.03, 0]), Spectrum([310, 330, 370, 420], [0, 0.4, 1, 0])
        ),
    ),
)


def plane(folder: Path, paint: Material, light: str = BLACK_LIGHT, depth: int = 2) -> Scene:
    """A square that fills the view, under a sky."""
    xml = f"""<scene version="3.0.0"> {integrator(depth)}
        {sensor(4, 4, origin="0, 0, 3", target="0, 0, 0", fov=20)}
        <shape type="rectangle" id="sample"> <bsdf type="diffuse"/> </shape>
        <emitter type="constant"> <spectrum name="radiance" value="{light}"/> </emitter> </scene>"""
    return load_scene(write(folder, xml), materials={"sample": paint})


def lamp(light: str) -> Spectrum:
    pairs = [pair.split(":") for pair in light.split(",")]
    return Spectrum([float(w) for w, _ in pairs], [float(v) for _, v in pairs])


def luminescence_over_reflection(image: SpectralImage, bands: np.ndarray) -> np.ndarray:
    """y2 / y1 of every pixel, which has no noise."""
    y = image.dataset["radiance"].values.astype(float)[..., bands]
    return y[2] / y[1]


@pytest.mark.filterwarnings("ignore::fluorspar.errors.ApproximationWarning")  # of 20 nm; both average alike
@pytest.mark.parametrize("name", ["dye-stilbene", "paper-whitened"])
@pytest.mark.parametrize("grid", ["430:630:20", "360:700:5", "305:700:5"])
def test_a_lit_plane_shows_what_a_flat_sample_shows(name: str, grid: str, tmp_path: Path) -> None:
    image = render(plane(tmp_path, material(name)), wavelengths=grid)
    flat = colour_under_lamp(material(name), lamp(BLACK_LIGHT), wavelengths=read_grid(grid))
    assert image.wavelengths == flat.grid == read_grid(grid)
    lit = flat.light > 0
    expected = (flat.luminescent / np.where(lit, flat.reflected, 1.0))[lit]
    assert expected.max() > 0.5
    found = luminescence_over_reflection(image, lit)
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), rtol=1e-5, atol=1e-6)


def test_luminescence_does_not_depend_on_where_the_image_begins(tmp_path: Path) -> None:
    """beta L, summed here from 300 nm on, times alpha; before, an image from 360 nm on lost a third of it."""
    scene = plane(tmp_path, PAINT)
    L, dye = lamp(BLACK_LIGHT), PAINT.fluorophores[0]
    w = np.arange(300.0, 430.0, 5.0)
    beta = np.interp(w, dye.excitation.wavelengths, dye.excitation.values, 0, 0)
    taken_up = 5 * (beta * np.interp(w, L.wavelengths, L.values)).sum()
    for start in (305, 330, 360, 400, 430):
        image = render(scene, wavelengths=f"{start}:700:5")
        seen = image.dataset.wavelength.values >= 430
        alpha = dye.emission.on(image.wavelengths, outside="zero")
        exact = taken_up * alpha[seen] / (0.5 * L.on(image.wavelengths)[seen])
        found = luminescence_over_reflection(image, seen)
        np.testing.assert_allclose(found, np.broadcast_to(exact, found.shape), rtol=1.1e-4)
        assert image.attrs["excitation"] == f"{min(start, 335)}:700:5"
    of_grid = render(scene, wavelengths="400:700:5", excitation="grid")
    assert of_grid.attrs["excitation"] == "400:700:5"
    assert of_grid.component("direct_luminescence").sum() < 0.1 * image.component("direct_luminescence").sum()


@pytest.mark.parametrize("method", ["paths", "staged"])
def test_an_image_is_part_of_the_one_that_holds_all_that_is_computed(method: str, tmp_path: Path) -> None:
    """Bit for bit, Russian roulette included; standard errors too."""
    scene = load_scene("cornell-box").with_settings(width=8, height=8, spp=8, rr_depth=3)
    held, computed = ("400:700:50", "300:700:50") if method == "staged" else ("400:700:5", "305:700:5")
    options: dict[str, Any] = {"method": method, "seed": 3}
    if method == "staged":
        options["staged"] = StagedOptions(emitters=2, patch_samples=16, repeats=2, keep_intermediate=tmp_path)
    else:
        options["component_errors"] = True
    image = render(scene, wavelengths=held, **options)
    assert image.attrs["excitation"] == computed
    if method == "staged":
        assert SpectralImage.open(next(tmp_path.glob("E_D-*.nc"))).wavelengths == image.wavelengths
        with xr.open_dataset(next(tmp_path.glob("L_F-*.nc")), engine="h5netcdf") as patches:
            # the light that excites is in it
            assert np.array_equal(patches.wavelength, read_grid(computed).values)
    wide = render(scene, wavelengths=computed, excitation="grid", **options)
    for name, values in image.dataset.data_vars.items():
        bands = values.sizes["wavelength"]
        assert bands == len(read_grid(held))
        assert np.array_equal(values, wide.dataset[name][..., -bands:], equal_nan=True)
    if method == "paths":
        paths = trace(scene, wavelengths=held, seed=3)
        assert np.array_equal(paths.image().dataset["radiance"], image.dataset["radiance"])
        of_grid = paths.image(excitation="grid")
        luminescent = "direct_luminescence"
        assert of_grid.component(luminescent).sum() < 0.95 * image.component(luminescent).sum()
        assert np.array_equal(of_grid.component("source"), image.component("source"))


@pytest.mark.parametrize("at", [488.0, 490.0, 491.3])
def test_a_laser_counts_wherever_its_line_is(at: float, tmp_path: Path) -> None:
    """1 W in 1 nm, seen directly: so it is in the image. Before, at 488 nm an image by 5 nm was black."""
    light = f"{at - 0.5}:0, {at}:2, {at + 0.5}:0"
    scene = plane(tmp_path, Material("grey", Spectrum.constant(0.5)), light)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        image = render(scene)
        flat = colour_under_lamp(
            Material("grey", Spectrum.constant(0.5)), lamp(light + ", 560:0, 600:1, 640:0")
        )
    assert {w.category for w in said} == {ApproximationWarning}
    reflected = image.component("direct_reflection").values.astype(float)
    power = 5 * reflected.sum(axis=-1)  # of a sky of radiance L on a plane of reflectance 1/2, 16 pixels
    assert abs(power.mean() - 0.5) < 4.5 * power.std(ddof=1) / 4 + 1e-5
    np.testing.assert_allclose(
        reflected / reflected.sum(-1, keepdims=True) @ image.wavelengths.values, at, atol=1e-4
    )
    assert flat.grid.step * flat.light[flat.grid.values < 550].sum() == pytest.approx(1.0)
