"""Spectra of different grids and band shapes, brought together: what must not change does not."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.errors import OptionError, SpectrumError
from fluorspar.spectral.bands import Bands, band_weights, common_bands, conversion
from fluorspar.spectral.wavelengths import Wavelengths

FIVE, TEN = Wavelengths(360, 700, 5), Wavelengths(400, 700, 10)


@pytest.mark.parametrize("fwhm", [0, 5, 8, 10, 33])
@pytest.mark.parametrize("target", [TEN, Wavelengths(360, 700, 20), Wavelengths(401, 699, 2)])
class TestWhatIsPreserved:
    def test_a_constant(self, target, fwhm):
        np.testing.assert_allclose(
            band_weights(FIVE.values, target.values, fwhm) @ np.ones(69), 1, rtol=1e-14
        )

    def test_a_linear_spectrum_up_to_the_ends(self, target, fwhm):
        line = 2.0 + 0.01 * FIVE.values
        converted = band_weights(FIVE.values, target.values, fwhm) @ line
        np.testing.assert_allclose(converted, 2.0 + 0.01 * target.values, rtol=1e-13)


class TestTriangles:
    def test_energy_of_a_line_is_integrated_rightly(self):
        """Triangles as wide as their distance add up to 1 everywhere, so sums times steps are equal."""
        spectrum = np.zeros(69)
        spectrum[[20, 21, 40]] = 1.0, 3.0, 0.5
        bands = band_weights(FIVE.values, TEN.values, 10.0) @ spectrum
        assert bands.sum() * 10 == pytest.approx(spectrum.sum() * 5, rel=1e-13)

    def test_by_hand_against_a_fine_sum(self):
        """The mean of the polyline under a triangle at 453 nm, FWHM 7 nm, by a sum in steps of 0.001 nm."""
        samples = np.random.default_rng(3).random(69)
        at = np.arange(446, 460, 0.001) + 0.0005
        weight = 1 - np.abs(at - 453) / 7
        expected = np.sum(weight * np.interp(at, FIVE.values, samples)) / weight.sum()
        assert (band_weights(FIVE.values, [453.0], 7.0) @ samples)[0] == pytest.approx(expected, rel=1e-7)

    def test_symmetric_samples_give_symmetric_weights(self):
        weights = band_weights([400, 405, 410, 415, 420], [410.0], 10.0)[0]
        np.testing.assert_allclose(weights, weights[::-1], rtol=1e-14)
        assert (weights >= 0).all()

    def test_bands_beyond_the_data_are_refused(self):
        with pytest.raises(SpectrumError, match="outside the data"):
            band_weights(FIVE.values, [705.0])

    def test_bands_wider_than_the_data_are_refused(self):
        with pytest.raises(SpectrumError, match="wider than the data"):
            band_weights([400, 410], [405.0], 20.0)


class TestCommonBands:
    def test_the_coarser_grid_as_far_as_both_have_data(self):
        common = common_bands(Bands(FIVE), Bands(Wavelengths(380, 780, 10), 8.0))
        assert (common.grid, common.fwhm) == (Wavelengths(380, 700, 10), 8.0)

    def test_a_coarser_table_of_unknown_bands_counts_as_triangular_of_its_step(self):
        assert common_bands(Bands(FIVE), Bands(TEN, None)).fwhm == 10
        assert common_bands(Bands(FIVE), Bands(Wavelengths(400, 700, 5), None)).fwhm == 0

    def test_samples_of_a_coarser_render_stay_samples(self):
        common = common_bands(Bands(FIVE), Bands(TEN))
        weights, said = conversion(Bands(FIVE), common, "A")
        np.testing.assert_array_equal(weights @ np.arange(69.0), np.arange(8, 69, 2))
        assert "every sample that is needed, unchanged" in said

    def test_no_common_wavelengths(self):
        with pytest.raises(SpectrumError, match=r"(?s)no wavelengths in common.*360-400 nm by 5 and 500-700"):
            common_bands(Bands(Wavelengths(360, 400, 5)), Bands(Wavelengths(500, 700, 5)))

    def test_widths_add_as_variances(self):
        """Bands of 6 nm become bands of 10 nm through a triangle of 8 nm."""
        _, said = conversion(Bands(FIVE, 6.0), Bands(TEN, 10.0), "A")
        assert "triangles of 8 nm FWHM" in said

    def test_what_reaches_beyond_the_data_is_said(self):
        _, said = conversion(Bands(Wavelengths(400, 700, 5)), Bands(TEN, 10.0), "A")
        assert "below 400 and above 700 nm the data are continued" in said

    def test_nothing_is_done_to_equal_bands(self):
        assert conversion(Bands(FIVE), Bands(FIVE))[0] is None

    def test_a_negative_width_is_refused(self):
        with pytest.raises(OptionError, match="bandwidth"):
            Bands(FIVE, -1.0)
