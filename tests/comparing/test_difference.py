"""Eq. 14, CIEDE2000 and errors of bands, on arrays small enough to be computed by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar.comparing.difference import band_bias, band_error, ciede2000, expected_rmse, rmse
from fluorspar.errors import OptionError

PAIRS = Path(__file__).with_name("sharma2005.csv")


class TestEquation14:
    # A: point 1 is (1, 3), the normalising point 2 is (2, 6), mean 4; B: (2, 2) and (10, 6), mean 8
    a, b = np.array([[1.0, 3.0], [2.0, 6.0]]), np.array([[2.0, 2.0], [10.0, 6.0]])

    def test_each_point_by_hand(self):
        """(0.25, 0.75) - (0.25, 0.25) and (0.5, 1.5) - (1.25, 0.75)."""
        expected = [np.sqrt((0 + 0.25) / 2), np.sqrt((0.5625 + 0.5625) / 2)]
        np.testing.assert_allclose(rmse(self.a, self.b, 4.0, 8.0), expected, rtol=1e-15)

    def test_the_expectation_is_the_mean_over_points(self):
        expected = (np.sqrt(0.125) + 0.75) / 2
        assert expected_rmse(self.a, self.b, 4.0, 8.0) == pytest.approx(expected, rel=1e-15)

    def test_the_scale_of_either_side_does_not_count(self):
        found = expected_rmse(1000 * self.a, self.b / 7, 4000.0, 8 / 7)
        assert found == pytest.approx(expected_rmse(self.a, self.b, 4.0, 8.0), rel=1e-14)

    def test_a_black_normalising_point_is_refused(self):
        with pytest.raises(OptionError, match="cannot be normalised"):
            rmse(self.a, self.b, 0.0, 1.0)


class TestBands:
    a, b = np.array([[1.0, 2.0, 0.0], [3.0, 2.0, 0.0]]), np.array([[2.0, 3.0, 1.0], [2.0, 3.0, 1.0]])

    def test_relative_error_by_hand(self):
        np.testing.assert_allclose(band_error(self.a, self.b), [0.5, 0.5, np.nan])

    def test_bias_by_hand(self):
        np.testing.assert_allclose(band_bias(self.a, self.b), [0.0, 0.5, np.nan])


class TestColour:
    def test_ciede2000_of_the_34_published_pairs(self):
        rows = [line for line in PAIRS.read_text().splitlines() if not line.startswith(("#", "pair"))]
        table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
        assert len(table) == 34
        np.testing.assert_allclose(ciede2000(table[:, 1:4], table[:, 4:7]), table[:, 7], atol=1e-4)

    def test_equal_colours_differ_by_exactly_nothing(self):
        lab = np.random.default_rng(1).uniform(-80, 100, (200, 3))
        assert not ciede2000(lab, lab).any()
