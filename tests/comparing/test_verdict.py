"""The verdict on noise through `compare`: images, points, renders, and when there is none."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import image_of, table_of

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.comparing.compare import compare
from fluorspar.comparing.sides import PointSide
from fluorspar.errors import OptionError
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.measure import measure
from fluorspar.measuring.point_spectra import PointSpectra, read_point_spectra, write_point_spectra
from fluorspar.measuring.points import Point
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.spectral.bands import Bands, conversion
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

FINE = Wavelengths(400, 700, 10)


def measured(random, count=13, change=0.0):
    """Points of even spectra with independent errors of 1 % in each of 31 bands."""
    return table_of(1 + 0.01 * random.standard_normal((count, 31)) + change, FINE, error=0.01)


def noisy(number, pattern=0.0, **attrs):
    """An even image with a noise of 1 % and a pattern (Y, X, N) of 5 %."""
    noise = 0.01 * np.random.default_rng(number).standard_normal((64, 64, 1))
    return image_of(1 + noise + 0.05 * pattern * np.ones(7), error=0.01, **attrs)


class TestImages:
    def test_noise_alone_is_no_difference(self):
        assert compare(noisy(1), noisy(2)).images.noise.differs is False

    def test_the_noise_of_b_is_in_the_scale_of_a(self):
        """B is 10 times brighter, and so is its noise: after matching it is that of A again."""
        random = np.random.default_rng(8)
        a, b = (
            image_of(
                factor * (1 + 0.02 * random.standard_normal((64, 64, 1)) * np.ones(7)), error=0.02 * factor
            )
            for factor in (1.0, 10.0)
        )
        noise = compare(a, b, match="luminance").images.noise
        assert abs(noise.share - 1) < 4 * noise.share_uncertainty
        assert noise.differs is False


class TestPatternsThatAreZeroOnAverage:
    """A change that leaves the mean of a block alone shows in the squares only.

    Expected: 5 standard errors of each side are (5 / sqrt(2))^2 = 12.5 variances.
    """

    y, x = np.mgrid[0:64, 0:64]
    tilt = np.sqrt(7 / 6) * np.array([-1, -1, -1, 0, 1, 1, 1]) * np.ones((64, 64, 1))
    checkerboard = np.where((x + y) % 2, 1.0, -1.0)[..., np.newaxis]

    @pytest.mark.parametrize("pattern", [tilt, checkerboard], ids=["a tilt over the bands", "a checkerboard"])
    def test_it_is_found(self, pattern):
        assert abs(pattern.mean()) < 1e-12
        found = compare(noisy(1), noisy(2, pattern))
        noise = found.images.noise
        assert noise.share == pytest.approx(1 / 13.5, rel=0.05)
        assert max(noise.block_z, abs(noise.mean_z)) < noise.block_bound
        assert noise.differs
        assert found.value("noise_z") > 10
        assert "more than noise" in found.text()
        assert "no more than noise" not in found.text()

    def test_a_tilt_at_points_with_independent_bands(self):
        """A tilt of 3 % that leaves the means alone is found.

        13 points x 31 bands, noise 0.01 on either side: the variance of the difference is 2e-4, of the tilt 3.2e-4.
        Expected: a mean ratio of 2.6, which scatters by 0.07 from noise.
        """
        random, tilt = np.random.default_rng(1), 0.03 * np.linspace(-1, 1, 31)
        noise = compare(measured(random), measured(random, change=tilt)).points.noise
        assert noise.share == pytest.approx(1 / (1 + np.mean(tilt**2) / 2e-4), rel=0.25)
        assert max(noise.block_z, abs(noise.mean_z)) < noise.block_bound
        assert noise.share_z > noise.block_bound
        assert noise.differs


class TestPixelsWithoutNoise:
    def test_their_difference_cannot_be_noise(self):
        """A quarter of the image is a lamp without noise, 2 % brighter in B; the rest differs by noise alone."""
        a, b = noisy(1), noisy(2)
        for image, lamp in ((a, 1.0), (b, 1.02)):
            image.dataset["standard_error"][:32, :32] = 0.0
            image.dataset["radiance"][1, :32, :32] = lamp
        found = compare(a, b)
        assert found.images.noise.differs
        assert found.images.noise.unexplained == 32 * 32
        assert "1024 pixels differ where there is no noise" in found.text()
        assert found.value("noise_z") == np.inf

    def test_one_of_them_inside_a_block(self):
        a, b = noisy(1), noisy(2)
        for image, lamp in ((a, 1.0), (b, 1.001)):
            image.dataset["standard_error"][20, 20] = 0.0
            image.dataset["radiance"][1, 20, 20] = lamp
        assert compare(a, b).images.noise.unexplained == 1

    def test_rounding_is_not_a_difference(self):
        a, b = noisy(1), noisy(2)
        for image, lamp in ((a, 1.0), (b, 1 + 5e-7)):
            image.dataset["standard_error"][:32, :32] = 0.0
            image.dataset["radiance"][1, :32, :32] = lamp
        assert compare(a, b).images.noise.differs is False

    def test_nor_is_the_error_of_a_matched_luminance(self):
        """The lamp is the same in both, but after matching it differs by what the noise does to the factor."""
        a, b = noisy(1), noisy(2)
        for image in (a, b):
            image.dataset["standard_error"][:2, :2] = 0.0
            image.dataset["radiance"][1, :2, :2] = 1.0
        found = compare(a, b, match="luminance")
        assert abs(found.scale - 1) > 1e-5
        assert found.images.noise.differs is False


class TestSameSeed:
    def test_one_seed_on_both_sides_gives_no_verdict(self):
        """Everything is 0.1 % brighter, with the same noise: the share would be 80,000 %."""
        a = noisy(1, seed=0, method="paths")
        b = SpectralImage(a.dataset.assign(radiance=a.dataset.radiance * np.float32(1.001)))
        found = compare(a, b)
        assert found.images.noise.differs is None
        assert (
            "no verdict (the noise of both is correlated, same seed 0; render one with seed 1)"
            in found.text()
        )
        assert "%" not in found.text().split("noise ")[1]
        with pytest.raises(OptionError, match=r"(?s)noise_z is not known.*same seed 0"):
            found.value("noise_z")

    def test_a_seed_that_is_no_number_is_none(self):
        a, b = noisy(1, seed="abc", method="another"), noisy(2, seed="abc", method="another")
        assert compare(a, b).images.noise.differs is False

    def test_it_is_the_seed_and_the_method_together(self):
        a, b = noisy(1, seed=0, method="paths"), noisy(2, seed=0, method="staged")
        assert compare(a, b).images.noise.differs is False

    def test_variants_trace_the_same_paths_of_a_seed(self):
        a, b = (noisy(1, seed=0, method="paths", variant=variant) for variant in ("llvm", "cuda"))
        b = SpectralImage(b.dataset.assign(radiance=b.dataset.radiance * np.float32(1.001)))
        assert compare(a, b).images.noise.differs is None

    def test_an_image_and_itself_is_no_alarm(self):
        a = noisy(1, seed=0, method="paths")
        found = compare(a, a)
        assert found.images.noise.differs is False
        assert found.value("noise_z") == 0
        assert "there is no difference" in found.text()


def render_of(random, samples, size=(1, 4)):
    """An image of noise whose standard errors are estimated from so many batches."""
    batches = random.standard_normal((samples, *size, 1)) * np.sqrt(samples) * 0.01 + 1
    error = batches.std(axis=0, ddof=1) / np.sqrt(samples)
    ones = np.ones(31)
    return SpectralImage.from_arrays(
        (batches.mean(axis=0) * ones)[np.newaxis],
        FINE,
        error * ones,
        components=("total",),
    )


class TestOneSideWithoutErrors:
    def images(self):
        random = np.random.default_rng(10)
        sides = [render_of(random, 256, size=(64, 64)) for _ in range(2)]
        sides[0].dataset["standard_error"][:8, :8] = 0.0
        return sides[0], SpectralImage(sides[1].dataset.drop_vars("standard_error"))

    @pytest.mark.parametrize("swapped", [False, True])
    def test_two_renders_give_no_verdict(self, swapped):
        """Half of the variance of the difference is that of the side whose errors are known."""
        a, b = self.images()
        found = compare(b, a) if swapped else compare(a, b)
        noise, other = found.images.noise, "AB"[not swapped]
        assert noise.differs is None
        assert noise.unexplained == 0
        assert noise.share == pytest.approx(0.5, abs=0.05)
        assert (
            f"no verdict (the noise of {other} is not known; share of the squared difference, {'AB'[swapped]} alone, "
            in found.text()
        )
        with pytest.raises(OptionError, match=r"(?s)noise_z is not known.*the noise of"):
            found.value("noise_z")

    def test_nor_do_tables(self):
        random = np.random.default_rng(11)
        assert compare(table_of(np.ones((13, 31)), FINE), measured(random)).points.noise.differs is None


class TestDegreesOfFreedom:
    points = tuple(Point(str(x), (x, 0)) for x in range(4))

    @pytest.mark.parametrize(
        ("attrs", "freedom"),
        [
            ({"method": "paths", "spp": 16}, 15),
            ({"method": "paths", "spp": 1024}, 31),
            ({"method": "staged", "spp": 1024, "repeats": 4}, 3),
            ({"method": "another", "spp": 16}, np.inf),
        ],
    )
    def test_they_come_from_the_attributes(self, attrs, freedom):
        image = render_of(np.random.default_rng(6), 16)
        image.dataset.attrs.update(attrs)
        spectra = measure(image, self.points, aperture=Aperture(1, "px"))
        assert spectra.freedom == pytest.approx([freedom] * 4)

    def test_an_aperture_of_many_pixels_has_more(self):
        image = render_of(np.random.default_rng(8), 4, size=(9, 9))
        image.dataset["standard_error"][:] = 0.01
        image.dataset.attrs.update(method="staged", repeats=4)
        spectra = measure(image, (Point("1", (4, 4)),), aperture=Aperture(5, "px"))
        assert spectra.freedom[0] == pytest.approx(3 * 5**2 * np.pi / 4, rel=0.25)

    def test_a_real_change_is_still_found(self):
        random = np.random.default_rng(9)
        sides = [render_of(random, 32) for _ in range(2)]
        for side, factor in zip(sides, (1.0, 1.2), strict=True):
            side.dataset.attrs.update(method="paths", spp=64)
            side.dataset["radiance"] *= np.float32(factor)
        tables = [measure(side, self.points, aperture=Aperture(1, "px")) for side in sides]
        assert compare(*tables).points.noise.differs


class TestPoints:
    def test_a_noisy_match_point(self):
        """A match point that is 2 standard errors off does not make the others differ.

        The white of B is 6 % too bright, the other points are right: after matching they are 6 % too dark,
        60 of their own standard errors, and yet no more than noise.
        """
        b = np.ones((4, 7))
        b[0] = 1.06
        error = np.full((4, 7), 1e-3)
        error[0] = 0.02
        a, b = (table_of(values, error=error, correlated=True) for values in (np.ones((4, 7)), b))
        found = compare(a, b, match="a")
        assert not found.points.noise.differs
        assert any("uncertain by 2.7 %" in note for note in found.notes)
        assert compare(a, b).points.noise.block_z == pytest.approx(0.06 / (0.02 * np.sqrt(2)))

    def test_independent_errors_average_out(self):
        """Errors of bands and points average out where they are independent.

        13 points, errors of 2 % in each of 7 bands, one side 4 % brighter: the mean over the bands has an error of
        2 % / sqrt(7), that over the points 1 / sqrt(13) of it.
        """
        random = np.random.default_rng(11)
        exact = table_of(np.ones((13, 7)))
        brighter = table_of(1.04 + 0.02 * random.standard_normal((13, 7)), error=0.02)
        found = compare(exact, brighter)
        assert found.points.noise.mean_z == pytest.approx(0.04 / 0.02 * np.sqrt(13 * 7), abs=4)
        assert any(
            "B: standard errors of the bands of a point count as independent" in n for n in found.notes
        )

    def test_errors_after_bands_were_made_of_samples(self):
        """Bands that overlap share the errors of their samples.

        Samples of 5 nm under triangles of 10 nm: the mean over all bands has the error of a mean of samples.
        """
        fine, coarse = Wavelengths(400, 700, 5), Bands(Wavelengths(410, 690, 10), 10.0)
        table = PointSpectra(("1",), Bands(fine), np.ones((1, 61)), np.ones((1, 61)))
        weights, _ = conversion(Bands(fine), coarse)
        expected = np.sqrt(np.sum(weights.mean(axis=0) ** 2))
        side = PointSide(table, coarse, weights)
        assert side.error_of_sum(np.full(29, 1 / 29))[0] == pytest.approx(expected)
        assert expected == pytest.approx(1 / np.sqrt(2 * 29), rel=0.03)

    def test_errors_of_a_render_stay_correlated_through_a_file(self, tmp_path):
        image = image_of(np.ones((4, 4, 7)), error=0.1)
        write_point_spectra(
            measure(image, (Point("1", (1, 1)),), aperture=Aperture(1, "px")), tmp_path / "a.csv"
        )
        assert read_point_spectra(tmp_path / "a.csv").correlated

    def test_of_few_samples_they_stay_so_through_a_file(self, tmp_path):
        """A table counts like the image it was measured in: 3 degrees of freedom, not errors that are known."""
        image = image_of(np.random.default_rng(2).random((4, 4, 7)), error=0.1)
        image.dataset.attrs.update(method="staged", repeats=4)
        points = (Point("1", (1, 1)), Point("2", (3, 2)))
        measured = measure(image, points, aperture=Aperture(1, "px"))
        write_point_spectra(measured, tmp_path / "a.csv")
        read = read_point_spectra(tmp_path / "a.csv")
        np.testing.assert_array_equal(read.freedom, [3, 3])
        other = PointSpectra(read.names, read.bands, 2 * read.radiance, read.standard_error, read.unit)
        direct, by_file = (
            compare(side, other).points.noise.block_z for side in (measured, tmp_path / "a.csv")
        )
        assert by_file == pytest.approx(direct, rel=1e-6)


def rendered(seed, white=None):
    scene = load_scene("cornell-box", materials={"white": white} if white else None)
    return render(scene, size=(64, 64), spp=128, seed=seed, wavelengths="400:700:20")


@pytest.fixture(scope="module")
def first():
    return rendered(seed=1)


@pytest.fixture(scope="module")
def darker():
    """One per cent less of the white of floor, back wall and ceiling, 0.85."""
    return Material("white", Spectrum.constant(0.99 * material("white-85").reflectance.at(550)))


class TestRenders:
    def test_two_seeds_differ_by_noise_and_nothing_else(self, first):
        """The standard errors of two renders of one scene explain their difference.

        Expected: a share of 1 within 4 of its own standard errors, which are below 5 %.
        """
        noise = compare(first, rendered(seed=2)).images.noise
        assert noise.observations == 64 * 64
        assert noise.share_uncertainty < 0.05
        assert abs(noise.share - 1) < 4 * noise.share_uncertainty
        assert not noise.differs

    def test_one_per_cent_of_one_reflectance_is_detected(self, first, darker):
        assert compare(first, rendered(seed=2, white=darker)).images.noise.differs

    def test_one_seed_for_two_materials_gives_no_verdict(self, first, darker):
        assert compare(first, rendered(seed=1, white=darker)).images.noise.differs is None
