"""How much of a difference is noise: calibrated on synthetic noise, on renders, and on a small real change."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.comparing.compare import compare
from fluorspar.comparing.noise import explained_by_noise, share_text
from fluorspar.comparing.pair import paired
from fluorspar.errors import OptionError
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.point_spectra import PointSpectra, read_point_spectra, write_point_spectra
from fluorspar.measuring.points import Point
from fluorspar.measuring.spectroradiometer import measure
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.spectral.bands import Bands, conversion
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 700, 50)


def observed(difference, error):
    """What `explained_by_noise` takes, of differences (Y, X, N) and their standard errors."""
    return (
        (difference**2).sum(axis=-1),
        (error**2).sum(axis=-1),
        difference.mean(axis=-1),
        error.mean(axis=-1),
    )


@pytest.fixture(scope="module")
def noise():
    """Noise of 96 x 96 pixels and 20 fully correlated bands, whose size varies a thousandfold over the image."""
    random = np.random.default_rng(5)
    error = 10 ** random.uniform(-3, 0, (96, 1, 1)) * np.ones((96, 96, 20))
    return error * random.standard_normal((96, 96, 1)), error


class TestSynthetic:
    def test_pure_noise_explains_everything(self, noise):
        verdict = explained_by_noise(*observed(*noise))
        assert abs(verdict.share - 1) < 3 * verdict.share_uncertainty
        assert verdict.share_uncertainty < 0.05
        assert not verdict.differs

    def test_the_uncertainty_is_right(self):
        """Rationale: over 60 independent images the deviations of the share, in units of its stated
        uncertainty, have a standard deviation of 1, to within 4 / sqrt(120)."""
        random = np.random.default_rng(6)
        deviations = []
        for _ in range(60):
            difference = random.standard_normal((64, 64, 1)) * np.ones(3)
            verdict = explained_by_noise(*observed(difference, np.ones((64, 64, 3))))
            deviations.append((verdict.share - 1) / verdict.share_uncertainty)
        assert abs(np.std(deviations) - 1) < 4 / np.sqrt(120)

    def test_bands_are_not_counted_as_observations(self, noise):
        few = explained_by_noise(*observed(*(values[..., :1] for values in noise)))
        many = explained_by_noise(*observed(*noise))
        assert many.share_uncertainty == pytest.approx(few.share_uncertainty, rel=1e-9)
        assert many.block_z == pytest.approx(few.block_z, rel=1e-9)

    def test_a_change_of_a_corner_is_found(self, noise):
        difference, error = noise[0].copy(), noise[1]
        difference[:24, :24] += error[:24, :24]
        assert explained_by_noise(*observed(difference, error)).differs

    def test_errors_that_are_too_small_are_found(self, noise):
        verdict = explained_by_noise(*observed(noise[0], noise[1] / 2))
        assert abs(verdict.share - 0.25) < 4 * verdict.share_uncertainty

    def test_without_noise_there_is_no_verdict(self):
        assert explained_by_noise(*observed(np.ones((4, 4, 3)), np.zeros((4, 4, 3)))) is None

    def test_the_noise_of_the_normalising_point_is_counted(self, noise):
        """All of B is 3 standard errors of the scale too large: not more than noise."""
        level = np.ones_like(noise[0])
        difference, scale_error = noise[0] + 0.03 * level, 0.01
        sums = observed(difference, noise[1])
        assert explained_by_noise(*sums).differs
        verdict = explained_by_noise(
            *sums, scale_error=scale_error, levels=level.mean(axis=-1), level_squares=(level**2).sum(axis=-1)
        )
        assert not verdict.differs

    def test_a_noisy_match_point_through_compare(self):
        """The white of B is 6 % too bright, 2 standard errors of the difference, the other points are right:
        after matching they are 6 % too dark, 60 of their own standard errors, and yet no more than noise."""
        b = np.ones((4, 7))
        b[0] = 1.06
        error = np.full((4, 7), 1e-3)
        error[0] = 0.02
        a, b = (table_of(values, error) for values in (np.ones((4, 7)), b))
        found = compare(a, b, match="0")
        assert not found.points.noise.differs
        assert any("uncertain by 2.7 %" in note for note in found.notes)
        assert compare(a, b).points.noise.block_z == pytest.approx(0.06 / (0.02 * np.sqrt(2)))

    def test_the_noise_of_b_is_in_the_scale_of_a(self):
        """B is 10 times brighter, and so is its noise: after matching it is that of A again."""
        random = np.random.default_rng(8)
        a, b = (
            image_of(factor * (1 + 0.02 * random.standard_normal((64, 64, 1)) * np.ones(7)), 0.02 * factor)
            for factor in (1.0, 10.0)
        )
        noise = compare(a, b, match="luminance").images.noise
        assert abs(noise.share - 1) < 4 * noise.share_uncertainty
        assert noise.differs is False


def table_of(radiance, error, correlated=True):
    names = tuple(map(str, range(len(radiance))))
    return PointSpectra(names, Bands(GRID), radiance, error, correlated=correlated)


def image_of(total, error, **attrs):
    radiance = np.zeros((7, *np.shape(total)), np.float32)
    radiance[1] = total
    return SpectralImage.from_arrays(radiance, GRID, np.broadcast_to(error, np.shape(total)), attrs)


def noisy(number, pattern=0.0, **attrs):
    """An even image with a noise of 1 % and a pattern (Y, X, N) of 5 %."""
    noise = 0.01 * np.random.default_rng(number).standard_normal((64, 64, 1))
    return image_of(1 + noise + 0.05 * pattern * np.ones(7), 0.01, **attrs)


class TestPatternsThatAreZeroOnAverage:
    """Rationale: the mean difference of a block is 0 for a change that leaves its mean alone, so the squared
    differences must tell. Expected: 5 standard errors of each side are (5 / sqrt(2))^2 = 12.5 variances."""

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
        assert found.value("noise_z") > 50
        assert "more than noise" in found.text()
        assert "no more than noise" not in found.text()

    def test_noise_alone_is_not(self):
        assert compare(noisy(1), noisy(2)).images.noise.differs is False

    @pytest.mark.parametrize("count", [2, 5, 13])
    def test_false_alarms_of_few_points(self, count):
        """Rationale: 2000 comparisons of points with noise alone, each with a chance of 0.001 of an alarm: more
        than 8 alarms have a probability below 3e-4. The scatter of two ratios must not count as known."""
        random = np.random.default_rng(count)
        alarms = 0
        for difference in random.standard_normal((2000, count, 1)):
            alarms += explained_by_noise(*observed(difference, np.ones((count, 1)))).differs
        assert alarms <= 8

    def test_blocks_that_scatter_more_than_their_pixels_count_as_fewer(self):
        """Rationale: standard errors are estimates, so the ratios of blocks scatter by more than independent
        pixels would. Here by 50 % of their own, over 60 images of 64 blocks: in units of what the pixels alone
        would leave, the deviations of the share have a standard deviation of 2.8. Expected: 1, to within
        4 / sqrt(120)."""
        random = np.random.default_rng(14)
        deviations = []
        for _ in range(60):
            of_blocks = np.kron(random.gamma(4, 1 / 4, (8, 8)), np.ones((8, 8)))[..., np.newaxis]
            difference = np.sqrt(of_blocks) * random.standard_normal((64, 64, 1))
            deviations.append(explained_by_noise(*observed(difference, np.ones((64, 64, 1)))).share_z)
        assert abs(np.std(deviations) - 1) < 4 / np.sqrt(120)


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


class TestCorrelatedNoise:
    def test_one_seed_on_both_sides_gives_no_verdict(self):
        """Everything is 0.1 % brighter, with the same noise: the share would be 80,000 %."""
        a = noisy(1, seed=0, method="paths")
        b = SpectralImage(a.dataset.assign(radiance=a.dataset.radiance * np.float32(1.001)))
        found = compare(a, b)
        assert found.images.noise.differs is None
        assert (
            "the noise of both is correlated (same seed 0): no verdict; render one with --seed 1"
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

    def test_an_image_and_itself_is_no_alarm(self):
        a = noisy(1, seed=0, method="paths")
        found = compare(a, a)
        assert found.images.noise.differs is False
        assert found.value("noise_z") == 0
        assert "there is no difference" in found.text()

    def test_a_difference_far_below_the_noise_gives_none_either(self):
        a = noisy(1)
        noise = compare(
            a, SpectralImage(a.dataset.assign(radiance=a.dataset.radiance * np.float32(1.001)))
        ).images.noise
        assert noise.differs is None
        assert "far smaller than its standard errors" in noise.doubt

    def test_never_more_than_all_is_explained(self, noise):
        verdict = explained_by_noise(*observed(noise[0], noise[1] * 1.05))
        assert verdict.share > 1 + verdict.share_uncertainty
        assert share_text(verdict) == "all"


class TestBandsOfTables:
    def test_independent_errors_average_out(self):
        """13 points, independent errors of 2 % in each of 7 bands, one side 4 % brighter: the mean over the bands
        has an error of 2 % / sqrt(7), that over the points 1 / sqrt(13) of it."""
        random = np.random.default_rng(11)
        error = np.full((13, 7), 0.02)
        exact = table_of(np.ones((13, 7)), None)
        measured = table_of(1.04 + error * random.standard_normal((13, 7)), error, correlated=False)
        found = compare(exact, measured)
        assert found.points.noise.mean_z == pytest.approx(0.04 / 0.02 * np.sqrt(13 * 7), abs=4)
        assert any(
            "B: standard errors of the bands of a point count as independent" in n for n in found.notes
        )

    def test_after_bands_were_made_of_samples(self):
        """Samples of 5 nm under triangles of 10 nm: the mean over all bands has the error of a mean of samples
        although the bands overlap."""
        fine, coarse = Wavelengths(400, 700, 5), Bands(Wavelengths(410, 690, 10), 10.0)
        table = PointSpectra(("1",), Bands(fine), np.ones((1, 61)), np.ones((1, 61)))
        weights, _ = conversion(Bands(fine), coarse)
        pair = paired((table, table), (weights, weights), coarse)
        shares = np.full(29, 1 / 29)
        expected = np.sqrt(np.sum(weights.mean(axis=0) ** 2))
        assert pair.error_of_sum(0, shares)[0] == pytest.approx(expected)
        assert expected == pytest.approx(1 / np.sqrt(2 * 29), rel=0.03)

    def test_errors_of_a_render_stay_correlated_through_a_file(self, tmp_path):
        image = image_of(np.ones((4, 4, 7)), 0.1)
        write_point_spectra(
            measure(image, (Point("1", (1, 1)),), aperture=Aperture(1, "px")), tmp_path / "a.csv"
        )
        assert read_point_spectra(tmp_path / "a.csv").correlated


def rendered(seed, white=None):
    scene = load_scene("cornell-box", materials={"white": white} if white else None)
    return render(scene, size=(64, 64), spp=128, seed=seed, wavelengths="400:700:20")


@pytest.fixture(scope="module")
def first():
    return rendered(seed=1)


class TestRenders:
    def test_two_seeds_differ_by_noise_and_nothing_else(self, first):
        """Rationale: the standard errors of two renders of one scene must explain their difference.
        Expected: a share of 1 within 4 of its own standard errors, which are below 5 %."""
        noise = compare(first, rendered(seed=2)).images.noise
        assert noise.observations == 64 * 64
        assert noise.share_uncertainty < 0.05
        assert abs(noise.share - 1) < 4 * noise.share_uncertainty
        assert not noise.differs

    def test_one_per_cent_of_one_reflectance_is_detected(self, first):
        """The white of floor, back wall and ceiling, 0.85, becomes 0.8415."""
        white = material("white-85")
        darker = Material("white", Spectrum.constant(0.99 * white.reflectance.at(550)))
        assert compare(first, rendered(seed=2, white=darker)).images.noise.differs

    def test_one_seed_for_two_materials_gives_no_verdict(self, first):
        white = material("white-85")
        darker = Material("white", Spectrum.constant(0.99 * white.reflectance.at(550)))
        assert compare(first, rendered(seed=1, white=darker)).images.noise.differs is None
