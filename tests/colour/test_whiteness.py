"""CIE whiteness and tint against numbers written out and against colour-science."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.colour.whiteness import CIE_1964, cie_whiteness
from fluorspar.colour.xyz import CIE_1931
from fluorspar.spectral.colour_science import colour_science


def test_whiteness_and_tint_of_known_numbers() -> None:
    """Written out for x = 0.31, y = 0.325, Y = 85 beside D65 of the 10 degree observer."""
    x, y, Y = 0.31, 0.325, 85.0
    white = np.array([94.811, 100.0, 107.304])
    xn, yn = white[:2] / white.sum()
    found = cie_whiteness([Y * x / y, Y, Y * (1 - x - y) / y], white, CIE_1964)
    assert found.whiteness == pytest.approx(Y + 800 * (xn - x) + 1700 * (yn - y))
    assert found.tint == pytest.approx(900 * (xn - x) - 650 * (yn - y))
    assert cie_whiteness([Y * x / y, Y, Y * (1 - x - y) / y], white, CIE_1931).tint == pytest.approx(
        1000 * (xn - x) - 650 * (yn - y)
    )


def test_whiteness_against_colour_science() -> None:
    colour = colour_science()
    xyz, white = np.array([88.0, 92.0, 108.0]), np.array([94.811, 100.0, 107.304])
    xy, xy_n = xyz[:2] / xyz.sum(), white[:2] / white.sum()
    expected = colour.colorimetry.whiteness_CIE2004(xy, xyz[1], xy_n, observer=CIE_1964)
    found = cie_whiteness(xyz, white)
    np.testing.assert_allclose([found.whiteness, found.tint], expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("xyz", "limit"),
    [
        ([37.9, 40.0, 42.9], "whiteness must be above 40"),
        ([60.0, 60.0, 100.0], "5 Y - 280"),
        ([93.0, 85.0, 100.0], "tint"),
    ],
)
def test_outside_the_limits_of_whiteness_it_says_so(xyz: list[float], limit: str) -> None:
    found = cie_whiteness(xyz, [94.811, 100.0, 107.304])
    assert not found.valid
    assert any(limit in text for text in found.outside)
