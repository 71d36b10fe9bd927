"""Whether a difference is more than noise: false alarms at the stated rate, and real changes found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fluorspar.comparing.noise import Differences, explained_by_noise, normal_score
from fluorspar.comparing.noise_text import noise_sentence, share_text
from fluorspar.measuring.error_freedom import combined_freedom


def observed(difference, error, level=0.0, freedom=np.inf):
    """What `explained_by_noise` takes, of differences (Y, X, N) or (P, N), their standard errors, and B."""
    difference, error, level = np.broadcast_arrays(difference, error, level)
    return Differences(
        (difference**2).sum(axis=-1),
        (error**2).sum(axis=-1),
        difference.mean(axis=-1),
        error.mean(axis=-1),
        level.mean(axis=-1),
        (level**2).sum(axis=-1),
        freedom,
    )


@pytest.fixture(scope="module")
def noise():
    """Noise of 96 x 96 pixels and 20 fully correlated bands, whose size varies a thousandfold over the image."""
    random = np.random.default_rng(5)
    error = 10 ** random.uniform(-3, 0, (96, 1, 1)) * np.ones((96, 96, 20))
    return error * random.standard_normal((96, 96, 1)), error


def batches_of(random, comparisons, points, samples):
    """Noise alone: differences of two sides, their estimated variance, and its degrees of freedom."""
    batches = random.standard_normal((comparisons, 2, points, samples))
    variance = batches.var(axis=-1, ddof=1) / samples
    difference, both = np.diff(batches.mean(axis=-1), axis=1)[:, 0], variance.sum(axis=1)
    return difference, both, combined_freedom(both, (variance**2).sum(axis=1) / (samples - 1))


class TestFalseAlarms:
    """Noise alone is called a difference no more often than stated.

    2000 comparisons, each with a chance of 0.001 of an alarm: more than 8 alarms have a probability of 2e-4.
    """

    @pytest.mark.parametrize("points", [1, 2, 4, 13])
    @pytest.mark.parametrize("samples", [2, 4, 6, 16, 32])
    def test_of_points_with_errors_of_few_samples(self, points, samples):
        cases = zip(*batches_of(np.random.default_rng(samples), 2000, points, samples), strict=True)
        alarms = [
            explained_by_noise(observed(d[:, None], np.sqrt(v)[:, None], freedom=f)).differs
            for d, v, f in cases
        ]
        assert None not in alarms
        assert sum(alarms) <= 8

    def test_the_bounds_of_known_errors_would_give_more(self):
        differences, variances, _ = batches_of(np.random.default_rng(4), 2000, 4, 4)
        alarms = [
            explained_by_noise(observed(d[:, None], np.sqrt(v)[:, None])).differs
            for d, v in zip(differences, variances, strict=True)
        ]
        assert sum(alarms) > 20

    @pytest.mark.parametrize("points", [1, 4, 13])
    def test_of_points_with_independent_bands(self, points):
        random = np.random.default_rng(points)
        error_of_mean = np.full(points, 1 / np.sqrt(31))
        alarms = 0
        for difference in random.standard_normal((2000, points, 31)):
            case = replace(observed(difference, np.ones((points, 31))), mean_errors=error_of_mean)
            alarms += explained_by_noise(case).differs
        assert alarms <= 8

    @pytest.mark.parametrize("points", [2, 4, 13])
    def test_of_points_that_share_the_error_of_the_scale(self, points):
        """The scale is as uncertain as the noise of a point."""
        random = np.random.default_rng(points)
        alarms = 0
        for difference in random.standard_normal((2000, points, 1)) + random.standard_normal((2000, 1, 1)):
            case = observed(difference, np.ones((points, 1)), np.ones((points, 1)))
            alarms += explained_by_noise(case, scale_error=1.0).differs
        assert alarms <= 8

    @pytest.mark.parametrize("samples", [4, 32])
    def test_of_images(self, samples):
        """500 images of 4 x 4 blocks: more than 4 alarms have a probability of 2e-4."""
        random = np.random.default_rng(samples)
        alarms = 0
        for _ in range(500):
            batches = random.standard_normal((samples, 32, 32), dtype=np.float32)
            error = batches.std(axis=0, ddof=1) / np.sqrt(samples)
            case = observed(batches.mean(axis=0)[..., None], error[..., None], freedom=samples - 1)
            alarms += explained_by_noise(case).differs
        assert alarms <= 4

    def test_the_score_of_t_is_as_rare(self):
        """Student's t of 3 is beyond 12.924 as often as a normal variable beyond 3.29: once in a thousand."""
        assert normal_score(12.924, 3) == pytest.approx(3.2905, abs=1e-4)
        assert normal_score(-3.2905, np.inf) == -3.2905


class TestPureNoise:
    def test_it_explains_everything(self, noise):
        verdict = explained_by_noise(observed(*noise))
        assert abs(verdict.share - 1) < 3 * verdict.share_uncertainty
        assert verdict.share_uncertainty < 0.05
        assert not verdict.differs

    def test_the_uncertainty_is_right(self):
        """The share deviates from 1 as much as its uncertainty says.

        Expected: over 60 independent images, deviations in units of it with a standard deviation of 1, to within
        4 / sqrt(120).
        """
        random = np.random.default_rng(6)
        deviations = []
        for _ in range(60):
            verdict = explained_by_noise(observed(random.standard_normal((64, 64, 1)) * np.ones(3), 1.0))
            deviations.append((verdict.share - 1) / verdict.share_uncertainty)
        assert abs(np.std(deviations) - 1) < 4 / np.sqrt(120)

    def test_the_share_is_right_although_errors_are_estimates(self):
        """The mean of 1 over an estimate of 3 degrees of freedom, 64 times in a block, is 192 / 190 of the truth."""
        batches = np.random.default_rng(7).standard_normal((4, 128, 128))
        error = batches.std(axis=0, ddof=1) / 2
        verdict = explained_by_noise(observed(batches.mean(axis=0)[..., None], error[..., None], freedom=3))
        assert abs(verdict.share - 1) < 3 * verdict.share_uncertainty
        assert verdict.share_uncertainty < 0.02

    def test_blocks_that_scatter_more_than_their_pixels_count_as_fewer(self):
        """Standard errors are estimates, so blocks scatter more than independent pixels would.

        Here by 50 % of their own, over 60 images of 64 blocks. Expected: deviations of the squares with a standard
        deviation of 1, to within 4 / sqrt(120).
        """
        random = np.random.default_rng(14)
        deviations = []
        for _ in range(60):
            of_blocks = np.kron(random.gamma(4, 1 / 4, (8, 8)), np.ones((8, 8)))[..., np.newaxis]
            case = observed(np.sqrt(of_blocks) * random.standard_normal((64, 64, 1)), 1.0)
            deviations.append(explained_by_noise(case).share_z)
        assert abs(np.std(deviations) - 1) < 4 / np.sqrt(120)

    def test_bands_are_not_counted_as_observations(self, noise):
        few = explained_by_noise(observed(*(values[..., :1] for values in noise)))
        many = explained_by_noise(observed(*noise))
        assert many.share_uncertainty == pytest.approx(few.share_uncertainty, rel=1e-9)
        assert many.block_z == pytest.approx(few.block_z, rel=1e-9)

    def test_never_more_than_all_is_explained(self, noise):
        verdict = explained_by_noise(observed(noise[0], noise[1] * 1.05))
        assert verdict.share > 1 + verdict.share_uncertainty
        assert share_text(verdict).startswith("100.0 ± ")

    def test_without_noise_there_is_no_verdict(self):
        assert explained_by_noise(observed(np.ones((4, 4, 3)), 0.0)) is None

    def test_the_share_of_one_point_has_no_uncertainty(self):
        verdict = explained_by_noise(observed(np.full((1, 7), 2.0), 1.0))
        assert verdict.share == 0.25
        assert noise_sentence(verdict).endswith("share of the squared difference 25.0 %)")
        assert "inf" not in noise_sentence(verdict)


class TestWords:
    def test_the_verdict_is_first_and_no_share_is_beyond_all(self):
        verdict = explained_by_noise(observed([[0.0], [0.01], [1.5]], 1.0, level=100.0))
        assert verdict.share > 1
        assert noise_sentence(verdict) == (
            "no more than noise (z of the mean 0.9, worst point 1.5, squares 0.0, bound 3.8; "
            "share of the squared difference not known)"
        )

    @pytest.mark.parametrize("shape", [(13, 20), (16, 16, 20)])
    def test_noise_that_would_hide_what_a_person_sees(self, shape):
        """The verdict says below which difference it is blind.

        13 points have a bound of 4.13 standard errors; 4 blocks of 64 pixels one of 3.77, of an eighth of a pixel's.
        Expected: with an error of 30 % of the level, 124 % of a point, and 14 % of a block.
        """
        difference = 0.3 * np.random.default_rng(3).standard_normal((*shape[:-1], 1)) * np.ones(shape[-1])
        loud = noise_sentence(explained_by_noise(observed(difference, 0.3, level=1.0)))
        least = "124 % of a point" if len(shape) == 2 else "14 % of a block"
        assert loud.startswith(f"no more than noise, but too noisy to tell differences below {least} (")
        quiet = noise_sentence(explained_by_noise(observed(difference / 100, 0.003, level=1.0)))
        assert quiet.startswith("no more than noise (")


class TestRealDifferences:
    def test_a_change_of_a_corner_is_found(self, noise):
        difference, error = noise[0].copy(), noise[1]
        difference[:24, :24] += error[:24, :24]
        assert explained_by_noise(observed(difference, error)).differs

    def test_errors_that_are_too_small_are_found(self, noise):
        verdict = explained_by_noise(observed(noise[0], noise[1] / 2))
        assert abs(verdict.share - 0.25) < 4 * verdict.share_uncertainty
        assert verdict.share_z > verdict.block_bound

    @pytest.mark.parametrize(("samples", "bound"), [(4, 28.0), (16, 5.239), (32, 4.461)])
    def test_one_point_of_four_that_changed(self, samples, bound):
        """The bound is that of Student's t of 3, 15, 31 degrees of freedom.

        10 deviations are looked at, so the bound of each has a chance of 5e-5 on each side.
        """
        difference = np.array([[0.0], [0.0], [bound], [0.0]])
        for factor, differs in ((1.02, True), (0.98, False)):
            case = observed(factor * difference, 1.0, freedom=samples - 1.0)
            assert explained_by_noise(case).differs is differs

    def test_a_shape_that_changed_at_a_point_but_not_its_mean(self):
        """A red surface that became green: 20 standard errors more in one half of the bands, 20 less in the other."""
        difference = np.zeros((13, 30))
        difference[3] = np.where(np.arange(30) < 15, 20.0, -20.0)
        verdict = explained_by_noise(observed(difference, 1.0, freedom=15.0))
        assert abs(verdict.mean_z) < 1e-9
        assert verdict.differs

    def test_the_noise_of_the_normalising_point_is_counted(self, noise):
        """All of B is 3 standard errors of the scale too large: not more than noise."""
        case = observed(noise[0] + 0.03, noise[1], level=1.0)
        assert explained_by_noise(case).differs
        assert not explained_by_noise(case, scale_error=0.01).differs
