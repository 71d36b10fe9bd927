"""How much of a difference is noise: calibrated on synthetic noise, on renders, and on a small real change."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.measure.compare import compare
from fluorspar.measure.noise import explained_by_noise
from fluorspar.rendering import render
from fluorspar.scene.scene import load_scene
from fluorspar.spectral.library import material
from fluorspar.spectral.material import Material
from fluorspar.spectral.spectrum import Spectrum


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
