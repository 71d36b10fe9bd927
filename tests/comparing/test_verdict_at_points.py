"""Whether a difference at points is more than noise: independent bands, few samples, and one side without errors."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.comparing.compare import compare
from fluorspar.comparing.noise import explained_by_noise
from fluorspar.errors import OptionError
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.freedom import combined_freedom
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point
from fluorspar.measuring.spectroradiometer import measure
from fluorspar.spectral.bands import Bands
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 700, 10)
TILT = 0.03 * np.linspace(-1, 1, 31)


def table(radiance, error=0.01, correlated=False, freedom=None):
    names = tuple(map(str, range(len(radiance))))
    errors = None if error is None else np.broadcast_to(error, radiance.shape).copy()
    return PointSpectra(
        names, Bands(GRID), radiance, errors, correlated=correlated, freedom=freedom, title="table"
    )


def measured(random, count=13, change=0.0):
    """Points of even spectra with independent errors of 1 % in each band."""
    return table(1 + 0.01 * random.standard_normal((count, 31)) + change)


class TestIndependentBands:
    def test_a_tilt_that_is_zero_on_average_is_found(self):
        """Rationale: 13 points x 31 bands, noise 0.01 on either side: the variance of the difference is 2e-4, of the
        tilt 3.2e-4. Expected: a mean ratio of 2.6, with a standard deviation of sqrt(2 / 403) = 0.07 from noise."""
        random = np.random.default_rng(1)
        found = compare(measured(random), measured(random, change=TILT))
        noise = found.points.noise
        assert noise.share == pytest.approx(1 / (1 + np.mean(TILT**2) / 2e-4), rel=0.25)
        assert max(noise.block_z, abs(noise.mean_z)) < noise.block_bound
        assert noise.share_z > 10
        assert noise.differs

    @pytest.mark.parametrize("count", [1, 4])
    def test_false_alarms_and_the_deviation_of_the_share(self, count):
        """Rationale: 400 comparisons of noise alone, each with a chance of 0.001 of an alarm: more than 4 have a
        probability of 6e-5. The deviation of the share has a standard deviation of 1, to within 4 / sqrt(800)."""
        difference = np.random.default_rng(2).standard_normal((400, count, 31))
        ones = np.ones(count)
        sums = ((difference**2).sum(axis=-1), difference.mean(axis=-1))
        verdicts = [
            explained_by_noise(q, 31 * ones, m, ones / np.sqrt(31), square_variances=2 * 31 * ones)
            for q, m in zip(*sums, strict=True)
        ]
        assert sum(verdict.differs is True for verdict in verdicts) <= 4
        assert abs(np.std([verdict.share_z for verdict in verdicts]) - 1) < 4 / np.sqrt(800)

    def test_one_point_has_an_uncertainty(self):
        random = np.random.default_rng(3)
        found = compare(measured(random, 1), measured(random, 1))
        noise = found.points.noise
        assert noise.share_uncertainty == pytest.approx(noise.share * np.sqrt(2 / 31))
        assert "inf" not in found.text()

    def test_a_render_against_a_table_has_the_freedom_of_both(self):
        """By hand: C = diag(v) + e e' with v = e^2 = s: tr(C C) = N s^2 + 2 N s^2 + N^2 s^2, of (2 N s)^2 for the
        squared mean. With one point the uncertainty is that of theory."""
        random = np.random.default_rng(4)
        render = table(
            1 + 0.01 * random.standard_normal((1, 1)) * np.ones((1, 31)), correlated=True, freedom=None
        )
        noise = compare(render, measured(random, 1)).points.noise
        assert noise.share_uncertainty == pytest.approx(noise.share * np.sqrt(2 * (3 * 31 + 31**2)) / 62)


def render_of(random, samples, size=(1, 4)):
    """An image of noise whose standard errors are estimated from so many batches."""
    batches = random.standard_normal((samples, *size, 1)) * np.sqrt(samples) * 0.01 + 1
    error = batches.std(axis=0, ddof=1) / np.sqrt(samples)
    ones = np.ones(31)
    return SpectralImage.from_arrays(
        (batches.mean(axis=0) * ones)[np.newaxis], GRID, error * ones, components=("total",)
    )


class TestStandardErrorsOfFewSamples:
    points = tuple(Point(str(x), (x, 0)) for x in range(4))

    @pytest.mark.parametrize("samples", [6, 16, 32])
    def test_false_alarms(self, samples):
        """Rationale: 2000 comparisons of 4 points with noise alone. With a chance of 0.001 each, more than 8
        alarms have a probability of 2e-4; with the bounds of known errors 6 samples give more."""
        batches = np.random.default_rng(samples).standard_normal((2000, 2, 4, samples))
        variance = batches.var(axis=-1, ddof=1) / samples
        difference, both = np.diff(batches.mean(axis=-1), axis=1)[:, 0], variance.sum(axis=1)
        freedom = combined_freedom(both, (variance**2).sum(axis=1) / (samples - 1))
        cases = list(zip(difference, both, freedom, strict=True))
        alarms = [explained_by_noise(d**2, v, d, np.sqrt(v), freedom=f).differs for d, v, f in cases]
        assert None not in alarms
        assert sum(alarms) <= 8
        if samples == 6:
            as_if_known = [explained_by_noise(d**2, v, d, np.sqrt(v)).differs for d, v, _ in cases]
            assert sum(as_if_known) > 8

    @pytest.mark.parametrize(
        ("attrs", "freedom"),
        [
            ({"method": "paths", "spp": 16}, 15),
            ({"method": "paths", "spp": 1024}, 31),
            ({"method": "staged", "spp": 1024, "repeats": 4}, 3),
            ({"method": "another", "spp": 16}, np.inf),
        ],
    )
    def test_come_from_the_attributes(self, attrs, freedom):
        image = render_of(np.random.default_rng(6), 16)
        image.dataset.attrs.update(attrs)
        spectra = measure(image, self.points, aperture=Aperture(0.5, "px"))
        assert spectra.freedom == pytest.approx([freedom] * 4)

    def test_too_few_give_no_verdict(self):
        """One side of 4 repeats that is far the noisier: 3 degrees of freedom."""
        random = np.random.default_rng(7)
        sides = [
            table(1 + 0.01 * random.standard_normal((4, 1)) * np.ones(31), error, True, np.full(4, 3.0))
            for error in (0.01, 0.001)
        ]
        noise = compare(*sides).points.noise
        assert noise.differs is None
        assert noise.doubt.startswith("the standard errors come from 4 repeats")

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
        tables = [measure(side, self.points, aperture=Aperture(0.5, "px")) for side in sides]
        assert compare(*tables).points.noise.differs


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
            f"the noise of {other} is not known: no verdict; of {'AB'[swapped]} alone explains"
            in found.text()
        )
        with pytest.raises(OptionError, match=r"(?s)noise_z is not known.*the noise of"):
            found.value("noise_z")

    def test_nor_do_tables(self):
        random = np.random.default_rng(11)
        known, unknown = measured(random), table(np.ones((13, 31)), None)
        assert compare(unknown, known).points.noise.differs is None

    def test_whose_errors_are_known_is_said(self):
        random = np.random.default_rng(12)
        assert "of A and B explains" in compare(measured(random), measured(random)).text()
