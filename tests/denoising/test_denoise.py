"""Denoised images: nearer to converged ones, spectra and energy kept, with an error that holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import fluorspar
from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import xyz_from_radiance
from fluorspar.comparing.whites import lab_of
from fluorspar.denoising.windows import mean_around, noisy_share
from fluorspar.errors import FluorsparError, FluorsparWarning, ImageError
from fluorspar.extras import check_extra
from fluorspar.image import computed, dataset
from fluorspar.image.converted import converted
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.point_spectra import read_point_spectra, write_point_spectra
from fluorspar.measuring.points import Point
from fluorspar.spectral.wavelengths import Wavelengths

SIZE = 96, 96
GRID = "400:700:10"


@dataclass
class Renders:
    """A scene of few samples, denoised, and of many."""

    noisy: SpectralImage
    clean: SpectralImage
    converged: SpectralImage


@pytest.fixture(scope="module")
def box() -> Renders:
    def render(spp: int, seed: int) -> SpectralImage:
        return fluorspar.render("cornell-box", size=SIZE, spp=spp, seed=seed, wavelengths=GRID)

    noisy = render(16, 1)
    return Renders(noisy, noisy.denoised(), render(512, 2))


def lit(image: SpectralImage) -> np.ndarray:
    """The total without the lamp seen directly."""
    return image.total().values - image.component("source").values


def colour_difference(a: SpectralImage, b: SpectralImage) -> float:
    """Mean CIEDE2000 of two images, against a white that is as bright as the brightest surfaces."""
    grid = a.wavelengths
    xyz = [xyz_from_radiance(np.maximum(lit(image), 0), grid) for image in (a, b)]
    white = np.array([0.95047, 1, 1.08883]) * np.percentile(xyz[1][..., 1], 99) / 0.8
    return float(np.mean(ciede2000(*(lab_of(values, white) for values in xyz))))


def test_colours_come_near_those_of_a_converged_image(box: Renders) -> None:
    before, after = (colour_difference(image, box.converged) for image in (box.noisy, box.clean))
    assert after < 0.35 * before
    assert after < 2.5  # 1.1 at 256 x 256


def test_errors_become_far_smaller(box: Renders) -> None:
    errors = [lit(image) - lit(box.converged) for image in (box.noisy, box.clean)]
    before, after = (np.sqrt(np.mean(error**2)) for error in errors)
    assert after < before / 2.5  # a fifth at 256 x 256, where a pixel has more neighbours that are like it


def test_components_keep_their_energy_and_add_up(box: Renders) -> None:
    for name in box.noisy.components:
        before, after = (image.component(name).values for image in (box.noisy, box.clean))
        error = box.noisy.component(name).values.mean(axis=2).std() / np.sqrt(before[..., 0].size)
        assert abs(after.mean() - before.mean()) < 0.01 * before.mean() + 3 * error, name
    blocks = [
        lit(image).mean(axis=2).reshape(3, 32, 3, 32).mean(axis=(1, 3)) for image in (box.noisy, box.clean)
    ]
    error = box.noisy.standard_error().values.mean(axis=2).reshape(3, 32, 3, 32)
    error = np.sqrt((error**2).sum(axis=(1, 3))) / 32**2
    assert (np.abs(blocks[1] - blocks[0]) < 0.01 * blocks[0] + 3 * error).all()


def test_components_add_up_to_the_total_denoised_on_its_own(box: Renders) -> None:
    total = SpectralImage.from_arrays(
        lit(box.noisy)[np.newaxis],
        box.noisy.wavelengths,
        box.noisy.standard_error().values,
        {"method": "paths", "spp": box.noisy.attrs["spp"]},  # guided by as many rays
        components=["total"],
    )
    lamps = box.noisy.component("source").values.max(axis=2) > 0  # where its errors are not those of the rest
    alone = total.denoised(scene="cornell-box").total().values
    np.testing.assert_allclose(lit(box.clean)[~lamps], alone[~lamps], rtol=1e-3, atol=1e-4 * alone.mean())


def test_the_lamp_is_left_as_it_is(box: Renders) -> None:
    np.testing.assert_array_equal(box.clean.component("source").values, box.noisy.component("source").values)


def test_the_estimated_error_holds(box: Renders) -> None:
    """68 % and 95 % of normal errors are within one and two; those of a denoiser have longer tails."""
    error = box.clean.dataset["denoised_error"].values.mean(axis=2)
    seen = box.clean.component("source").values.max(axis=2) == 0
    off = np.abs(lit(box.clean) - lit(box.converged)).mean(axis=2) / error
    assert 0.6 < np.mean(off[seen] < 1) < 0.95
    assert np.mean(off[seen] < 2) > 0.88
    # and it is of use: well below the noise
    assert np.mean(error[seen]) < 0.6 * np.mean(box.noisy.standard_error().values.mean(axis=2)[seen])


def test_the_image_says_that_it_is_denoised(box: Renders, tmp_path: Path) -> None:
    assert "standard_error" not in box.clean.dataset
    np.testing.assert_array_equal(
        box.clean.dataset["noisy_standard_error"], box.noisy.dataset["standard_error"]
    )
    for name in ("box.nc", "box.exr"):
        box.clean.save(tmp_path / name)
        with SpectralImage.open(tmp_path / name) as read:
            assert read.attrs["denoised"] == box.clean.attrs["denoised"]
            for variable in ("radiance", "denoised_error", "noisy_standard_error"):
                np.testing.assert_array_equal(read.dataset[variable], box.clean.dataset[variable])
    with pytest.raises(ImageError, match="denoised already"):
        box.clean.denoised()


def test_measurements_use_the_estimated_error(box: Renders) -> None:
    spectra = fluorspar.measure(box.clean, [Point("floor", (48, 80))], aperture="9px")
    assert spectra.standard_error is not None
    assert "denoised" in " ".join(spectra.notes)
    single = box.clean.dataset["denoised_error"].values[76:85, 44:53].mean(axis=(0, 1))
    # pixels share their errors: a mean over many is no better known than one
    np.testing.assert_allclose(spectra.standard_error[0], single, rtol=0.2)


def test_comparisons_give_no_verdict_on_noise(box: Renders) -> None:
    found = fluorspar.compare(box.clean, box.converged)
    assert found.images is not None
    assert found.images.noise is not None
    assert found.images.noise.differs is None
    assert "A is denoised" in found.images.noise.doubt


def test_spectra_of_points_remember_that_the_image_was_denoised(box: Renders, tmp_path: Path) -> None:
    measured = fluorspar.measure(box.clean, [Point("floor", (48, 80))], aperture="9px")
    write_point_spectra(measured, tmp_path / "points.csv")
    truth = fluorspar.measure(box.converged, [Point("floor", (48, 80))], aperture="9px")
    for table in measured, read_point_spectra(tmp_path / "points.csv"):
        found = fluorspar.compare(table, truth)
        assert found.points is not None
        assert found.points.noise is not None
        assert found.points.noise.differs is None
        assert "A is denoised" in found.points.noise.doubt


def test_converted_images_keep_both_errors(box: Renders) -> None:
    kept = converted(box.clean, wavelengths=Wavelengths(400, 700, 20)).dataset
    assert "standard_error" not in kept
    for name in "denoised_error", "noisy_standard_error":
        np.testing.assert_array_equal(kept[name], box.clean.dataset[name][..., ::2])


def test_the_same_image_gives_the_same_result(box: Renders) -> None:
    again = box.noisy.denoised(threads=1)
    for name in ("radiance", "denoised_error"):
        np.testing.assert_allclose(again.dataset[name], box.clean.dataset[name], rtol=1e-5, atol=1e-9)


def two_dyes(noise: float) -> SpectralImage:
    """Left and right half of one reflectance with different dyes, and nothing else to tell them apart."""
    grid = Wavelengths.parse(GRID)
    peak = {540: (slice(None), slice(0, 30)), 580: (slice(None), slice(30, 64))}
    light = np.full((64, 64, len(grid)), 0.4)
    for nanometres, where in peak.items():
        light[where] += np.exp(-(((grid.values - nanometres) / 20) ** 2))
    draw = np.random.default_rng(3).normal(1, noise, light.shape[:2])
    error = np.broadcast_to(noise * light, light.shape)
    return SpectralImage.from_arrays(
        (light * draw[..., np.newaxis])[np.newaxis], grid, error, {"method": "paths"}, components=["total"]
    )


def test_a_sharp_edge_between_dyes_stays_sharp() -> None:
    clean, truth = two_dyes(0.15).denoised().total().values, two_dyes(0.0).total().values
    contrast = truth[0, 30] - truth[0, 29]
    across = (
        (clean.mean(axis=0) - truth[0, 29]) @ contrast / (contrast @ contrast)
    )  # 0 on the left, 1 on the right
    assert across[29] < 0.2
    assert across[30] > 0.8
    np.testing.assert_allclose(across[[26, 27, 32, 33]], [0, 0, 1, 1], atol=0.05)


def test_a_component_without_noise_stays_as_it_is() -> None:
    exact, grid = two_dyes(0.0), two_dyes(0.0).wavelengths
    known = exact.total().values
    light = np.full_like(known, known.mean())
    noisy = light * np.random.default_rng(4).normal(1, 0.2, (64, 64, 1))
    image = SpectralImage.from_arrays(
        np.stack([known, noisy]),
        grid,
        0.2 * light,
        {"method": "paths"},
        components=["direct_reflection", "indirect_reflection"],
    )
    clean = image.denoised()
    np.testing.assert_allclose(clean.component("direct_reflection").values, known, rtol=0.02)
    assert np.std(clean.component("indirect_reflection").values - light) < 0.25 * np.std(noisy - light)


def test_pixels_that_were_not_rendered_stay_unknown() -> None:
    image = two_dyes(0.15)
    image.dataset["radiance"].values[:, 40:] = np.nan
    clean = image.denoised().total().values
    assert np.isnan(clean[40:]).all()
    assert np.isfinite(clean[:40]).all()


@pytest.mark.parametrize("bands", [2, 4])
def test_few_bands_and_no_standard_error(bands: int) -> None:
    rng = np.random.default_rng(1)
    noisy = (1 + 0.2 * rng.standard_normal((1, 40, 33, 1))) * np.linspace(1, 2, bands)
    image = SpectralImage.from_arrays(
        noisy, Wavelengths.from_values(500 + 10.0 * np.arange(bands)), components=["total"]
    )
    clean = image.denoised()
    assert np.std(clean.total().values[..., 0]) < 0.25 * np.std(noisy[..., 0])
    assert "noisy_standard_error" not in clean.dataset
    assert (clean.dataset["denoised_error"] > 0).all()


def test_noise_that_is_not_known_is_estimated() -> None:
    """Of one sample per pixel no standard error is known, and it is not 0."""
    noisy = fluorspar.render("cornell-box", size=SIZE, spp=1, wavelengths=GRID)
    assert np.isnan(noisy.dataset["standard_error"]).all()
    clean = noisy.denoised()
    converged = fluorspar.render("cornell-box", size=SIZE, spp=256, seed=1, wavelengths=GRID)
    assert colour_difference(clean, converged) < 0.25 * colour_difference(noisy, converged)
    lit = converged.component("source").values.max(axis=-1) == 0
    off = np.abs(clean.total() - converged.total()).values[lit]
    assert np.mean(off < 2 * clean.dataset["denoised_error"].values[lit]) > 0.8


def test_bands_of_noise_around_zero_stay_as_they_are() -> None:
    """As of a camera whose dark signal was taken off."""
    rng = np.random.default_rng(2)
    values = np.repeat(1 + 0.2 * rng.standard_normal((1, 40, 40, 1)), 31, axis=3)
    values[..., -6:] = 0.01 * rng.standard_normal((1, 40, 40, 6)) - 0.002
    image = SpectralImage.from_arrays(values, Wavelengths.parse(GRID), components=["total"])
    with pytest.warns(FluorsparWarning, match="noise around zero instead of light: 650-700 nm"):
        clean = image.denoised()
    total, error = clean.total().values, clean.dataset["denoised_error"].values
    assert np.isfinite(total).all()
    assert np.isfinite(error).all()
    assert total[..., :20].std() < 0.25 * values[0, ..., :20].std()
    np.testing.assert_allclose(total[..., -6:].mean(), values[..., -6:].mean(), atol=0.0005)
    assert error[..., -5:].mean() > 0.003  # the noise, which is left: 0.01 in each of 6 bands


def test_a_band_that_is_not_known_does_not_matter_to_others() -> None:
    rng = np.random.default_rng(4)
    values = np.repeat(1 + 0.2 * rng.standard_normal((1, 40, 40, 1)), 31, axis=3)
    image = SpectralImage.from_arrays(values, Wavelengths.parse(GRID), components=["total"])
    image.dataset["radiance"].values[..., -1] = np.nan
    image.dataset["radiance"].values[:, 5, 7, 3] = np.nan
    clean = image.denoised()
    total, error = clean.total().values, clean.dataset["denoised_error"].values
    for found in total, error:
        np.testing.assert_array_equal(np.isnan(found), np.isnan(image.dataset["radiance"].values[0]))
    assert np.nanstd(total) < 0.25 * np.nanstd(values)
    assert np.nanmean(total) == pytest.approx(1, abs=0.02)


def test_what_was_not_rendered_does_not_darken_what_was() -> None:
    rng = np.random.default_rng(5)
    values = np.repeat(1 + 0.2 * rng.standard_normal((1, 48, 48, 1)), 31, axis=3)
    values[:, 30:] = np.nan
    image = SpectralImage.from_arrays(values, Wavelengths.parse(GRID), components=["total"])
    clean = image.denoised()
    assert clean.total().values[25:30].mean() == pytest.approx(values[0, 25:30].mean(), rel=0.02)
    error = clean.dataset["denoised_error"].values
    assert np.isnan(error[30:]).all()
    assert (error[:30] < 0.2).all()


def test_a_component_of_noise_around_zero_stays_as_it_is() -> None:
    rng = np.random.default_rng(6)
    values = np.repeat(1 + 0.2 * rng.standard_normal((2, 40, 40, 1)), 31, axis=3)
    values[1] -= 1
    names = ["direct_reflection", "indirect_reflection"]
    image = SpectralImage.from_arrays(values, Wavelengths.parse(GRID), components=names)
    with pytest.warns(
        FluorsparWarning, match="noise around zero instead of light: component indirect_reflection"
    ):
        clean = image.denoised()
    np.testing.assert_array_equal(clean.component(names[1]), image.component(names[1]))
    assert clean.component(names[0]).values.std() < 0.25 * 0.2


@pytest.mark.parametrize("size", [np.inf, -1e36])
def test_a_value_that_is_no_radiance_is_named(size: float) -> None:
    image = two_dyes(0.15)
    image.dataset["radiance"].values[0, 5, 7, 3] = size
    with pytest.raises(ImageError, match=r"too large to denoise\n.*pixel \(7, 5\)"):
        image.denoised()


def test_guides_of_another_scene_are_told(box: Renders) -> None:
    with pytest.warns(
        FluorsparWarning, match="of scene 'furnace', and the image says that it shows 'cornell-box'"
    ):
        box.noisy.denoised(scene="furnace")
    paths = fluorspar.trace("cornell-box", size=(16, 16), spp=4, wavelengths=GRID)
    with pytest.warns(FluorsparWarning, match="materials, and the image shows others: poster-orange"):
        paths.image(materials={"left-wall": "poster-orange"}).denoised()


def test_no_radiance_becomes_negative_and_errors_stay_small() -> None:
    noisy = fluorspar.render("still-life", size=(160, 120), spp=16, wavelengths=GRID)
    clean = noisy.denoised()
    assert noisy.dataset["radiance"].values.min() >= 0
    assert clean.dataset["radiance"].values.min() >= 0
    assert clean.dataset["denoised_error"].values.max() < noisy.total().values.max()


def test_shares_are_none_beyond_one() -> None:
    """Means over windows are running sums: beside bright pixels those of dark ones may be a little below 0."""
    bright = np.zeros((48, 48), np.float32)
    bright[:, :8] = 1e4
    rest = mean_around(bright, 7) - mean_around(bright.astype(np.float64), 7)
    variance = np.full((48, 48), -1e-6, np.float32)
    removed = np.full((48, 48), 1e-3, np.float32)
    assert rest.min() < 0  # where it comes from
    assert noisy_share(removed, variance, 7).max() <= 1


def test_darkness_stays_dark() -> None:
    clean = SpectralImage.from_arrays(np.zeros((7, 16, 16, 31)), Wavelengths.parse(GRID)).denoised()
    assert not clean.total().values.any()


def test_errors_are_numbers_where_half_of_the_image_is_black() -> None:
    """An error there is no share of the light, of which there is none."""
    radiance = np.zeros((7, 64, 64, 31), np.float32)
    radiance[1] = np.random.default_rng(0).gamma(2, 1, (64, 64, 1))
    radiance[1, :, 32:] = 0
    errors = np.full((64, 64, 31), 0.5)
    image = SpectralImage.from_arrays(radiance, Wavelengths.parse(GRID), standard_error=errors)
    assert np.isfinite(image.denoised().dataset["denoised_error"]).all()


@pytest.mark.parametrize("spp", [70_000, "four", [4, 4], float("nan")])
def test_samples_that_no_render_has_do_not_matter(spp: object) -> None:
    attrs = {"method": "paths", "spp": spp}
    image = SpectralImage.from_arrays(np.ones((7, 8, 8, 31)), Wavelengths.parse(GRID), attrs=attrs)
    assert np.isfinite(image.denoised(scene="cornell-box").total()).all()


def test_a_negative_image_is_refused() -> None:
    image = SpectralImage.from_arrays(
        np.full((1, 8, 8, 3), -1.0), Wavelengths(400, 600, 100), components=["total"]
    )
    with pytest.raises(ImageError, match="no light to denoise"):
        image.denoised()


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fluorspar.extras.find_spec", lambda name: None)
    with pytest.raises(FluorsparError, match=r'pip install "fluorspar\[denoise\]"'):
        check_extra("denoise")


def test_a_large_image_is_denoised_strip_by_strip(
    box: Renders, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(computed, "_LARGEST_KEPT", 0)
    monkeypatch.setattr(dataset, "_BLOCK_BYTES", 20 * 4 * 96 * 31)
    box.noisy.save(tmp_path / "noisy.nc")
    with SpectralImage.open(tmp_path / "noisy.nc") as noisy:
        clean = noisy.denoised()
        assert not clean.dataset["radiance"].variable._in_memory
        clean.save(tmp_path / "clean.nc")
    with SpectralImage.open(tmp_path / "clean.nc") as saved:
        xr.testing.assert_identical(saved.dataset.load(), box.clean.dataset)
