"""Converted images: bandwidth is remembered, standard errors go where they still belong."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.errors import OptionError
from fluorspar.image.converted import ASSUMED, converted
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.bands import band_weights
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 700, 10)
PAIR = ("direct_reflection", "direct_luminescence")


def line(at: float = 550, **attrs) -> SpectralImage:
    """One pixel that shows a line, of one component."""
    radiance = (GRID.values == at).astype(np.float32)[np.newaxis, np.newaxis, np.newaxis]
    return SpectralImage.from_arrays(radiance, GRID, attrs=attrs, components=("total",))


def variance(image: SpectralImage) -> float:
    """The second moment of a spectrum about 550 nm, in nm2."""
    spectrum, at = image.total().values[0, 0].astype(float), image.wavelengths.values
    return float((spectrum * (at - 550) ** 2).sum() / spectrum.sum())


class TestBandwidth:
    def test_is_recorded(self):
        assert converted(line(), wavelengths=GRID, bandwidth=30).attrs["bandwidth_nm"] == 30.0
        assert "bandwidth_nm" not in converted(line(), wavelengths=Wavelengths(400, 700, 5)).attrs

    @pytest.mark.parametrize("suffix", [".nc", ".exr", ".hdr"])
    def test_is_carried_by_every_format(self, tmp_path, suffix):
        converted(line(), bandwidth=30).save(tmp_path / f"a{suffix}")
        with SpectralImage.open(tmp_path / f"a{suffix}") as image:
            assert image.attrs["bandwidth_nm"] == 30.0

    @pytest.mark.parametrize(("attrs", "assumed"), [({}, True), ({"method": "paths"}, False)])
    def test_of_an_image_of_unknown_bands_is_said_to_be_assumed(self, attrs, assumed):
        image = SpectralImage.from_arrays(np.ones((7, 2, 2, 69)), Wavelengths(), attrs=attrs)
        assert (ASSUMED in converted(image, bandwidth=10.0).attrs["converted"]) == assumed
        assert "converted" not in converted(image).attrs

    def test_applies_to_the_image_s_own_wavelengths(self):
        seen = converted(line(), bandwidth=30).total().values[0, 0]
        np.testing.assert_allclose(seen, band_weights(GRID.values, GRID.values, 30)[:, 15], atol=1e-7)

    def test_of_the_image_is_taken_into_account(self):
        """Second moments add: a triangle of width w has w^2 / 6, the polyline through the sample 10^2 / 6."""
        once = converted(line(), bandwidth=50)
        twice = converted(converted(line(), bandwidth=30), bandwidth=50)
        missing = np.sqrt(50.0**2 - 30.0**2)
        assert "triangular bands of 30 nm FWHM, brought to" in twice.attrs["converted"]
        assert f"triangles of {missing:g} nm" in twice.attrs["converted"]
        assert twice.attrs["bandwidth_nm"] == 50.0
        # each step also widens by the interpolation between samples, 10^2 / 6
        assert variance(once) == pytest.approx((50**2 + 10**2) / 6, rel=0.01)
        assert variance(twice) == pytest.approx((50**2 + 2 * 10**2) / 6, rel=0.01)

    def test_stays_when_only_wavelengths_change(self):
        finer = converted(line(bandwidth_nm=30.0), wavelengths=Wavelengths(400, 700, 5))
        assert finer.attrs["bandwidth_nm"] == 30.0
        assert "linear interpolation" in finer.attrs["converted"]

    def test_that_the_image_has_already_changes_nothing(self):
        image = line(bandwidth_nm=30.0)
        np.testing.assert_array_equal(converted(image, bandwidth=30).total(), image.total())

    def test_cannot_be_taken_back(self):
        with pytest.raises(OptionError, match=r"(?s)narrower.*20 nm.*30 nm"):
            converted(line(bandwidth_nm=30.0), bandwidth=20)

    @pytest.mark.parametrize("bandwidth", [-20, np.nan, np.inf])
    @pytest.mark.parametrize("wavelengths", [None, GRID])
    def test_that_is_impossible(self, bandwidth, wavelengths):
        with pytest.raises(OptionError, match="bandwidth is impossible"):
            converted(line(), wavelengths=wavelengths, bandwidth=bandwidth)


class TestErrors:
    @pytest.fixture
    def image(self):
        random = np.random.default_rng(5)
        radiance, of_components = random.random((2, 2, 3, 4, 31))
        return SpectralImage.from_arrays(
            radiance, GRID, random.random((3, 4, 31)), component_standard_error=of_components, components=PAIR
        )

    def test_of_components_stay_with_them(self, image):
        found = converted(image, wavelengths=Wavelengths(400, 700, 20))
        of_components = image.dataset["component_standard_error"].values
        np.testing.assert_allclose(found.dataset["component_standard_error"], of_components[..., ::2])
        np.testing.assert_allclose(found.standard_error(), image.standard_error()[..., ::2])

    def test_of_components_are_averaged_as_fully_correlated(self, image):
        found = converted(image, bandwidth=20).dataset["component_standard_error"].values
        weights = np.abs(band_weights(GRID.values, GRID.values, 20))
        expected = image.dataset["component_standard_error"].values @ weights.T
        np.testing.assert_allclose(found, expected, rtol=1e-5)

    @pytest.mark.parametrize("name", PAIR)
    def test_of_one_component_is_that_of_the_result(self, image, name):
        found = converted(image, name)
        expected = image.dataset["component_standard_error"].sel(component=name).values
        np.testing.assert_array_equal(found.standard_error(), expected)
        assert "component_standard_error" not in found.dataset

    def test_of_the_total_stays_with_it(self, image):
        found = converted(image, "total")
        np.testing.assert_array_equal(found.standard_error(), image.standard_error())
        assert "component_standard_error" not in found.dataset

    def test_of_one_component_is_not_known_without_its_own(self, image):
        bare = SpectralImage(image.dataset.drop_vars("component_standard_error"))
        assert "standard_error" not in converted(bare, PAIR[0]).dataset
