"""Eq. 14 and errors of bands, on arrays small enough to be computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.comparing.difference import band_bias, band_error, mean_rmse, rmse_eq14, rmse_of_each
from fluorspar.errors import OptionError


class TestEquation14:
    # A: point 1 is (1, 3), the normalising point 2 is (2, 6), mean 4; B: (2, 2) and (10, 6), mean 8
    a, b = np.array([[1.0, 3.0], [2.0, 6.0]]), np.array([[2.0, 2.0], [10.0, 6.0]])

    def test_one_root_over_all_points_and_bands(self):
        """Squares of (0, 0.5) and (-0.75, 0.75): 0 + 0.25 + 0.5625 + 0.5625 = 1.375 over four numbers."""
        assert rmse_eq14(self.a, self.b, 4.0, 8.0) == pytest.approx(np.sqrt(1.375 / 4), rel=1e-15)

    def test_each_point_has_a_root_of_its_own(self):
        """(0.25, 0.75) - (0.25, 0.25) and (0.5, 1.5) - (1.25, 0.75)."""
        expected = [np.sqrt((0 + 0.25) / 2), np.sqrt((0.5625 + 0.5625) / 2)]
        np.testing.assert_allclose(rmse_of_each(self.a, self.b, 4.0, 8.0), expected, rtol=1e-15)

    def test_the_mean_of_those_is_another_number(self):
        """(0.35355 + 0.75) / 2 = 0.55178, and one root over all is 0.58630."""
        mean = mean_rmse(rmse_of_each(self.a, self.b, 4.0, 8.0))
        assert mean == pytest.approx((np.sqrt(0.125) + 0.75) / 2, rel=1e-15)
        assert rmse_eq14(self.a, self.b, 4.0, 8.0) - mean == pytest.approx(0.0345, abs=1e-4)

    def test_the_scale_of_either_side_does_not_count(self):
        scaled = rmse_eq14(1000 * self.a, self.b / 7, 4000.0, 8 / 7)
        assert scaled == pytest.approx(rmse_eq14(self.a, self.b, 4.0, 8.0), rel=1e-14)

    @pytest.mark.parametrize("rmse", [rmse_eq14, rmse_of_each])
    def test_a_black_normalising_point_is_refused(self, rmse):
        with pytest.raises(OptionError, match="cannot be normalised"):
            rmse(self.a, self.b, 0.0, 1.0)


class TestBands:
    a, b = np.array([[1.0, 2.0, 0.0], [3.0, 2.0, 0.0]]), np.array([[2.0, 3.0, 1.0], [2.0, 3.0, 1.0]])

    def test_relative_error_by_hand(self):
        np.testing.assert_allclose(band_error(self.a, self.b), [0.5, 0.5, np.nan])

    def test_bias_by_hand(self):
        np.testing.assert_allclose(band_bias(self.a, self.b), [0.0, 0.5, np.nan])
