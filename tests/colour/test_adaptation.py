"""Chromatic adaptation against colour-science."""

from __future__ import annotations

import numpy as np

from fluorspar.colour.adaptation import adapt_to_d65
from fluorspar.spectral.colour_science import colour_science


def test_adaptation_to_d65_against_colour_science() -> None:
    colour = colour_science()
    white, xyz = np.array([109.85, 100.0, 35.58]), np.array([40.0, 30.0, 5.0])
    expected = colour.adaptation.chromatic_adaptation_VonKries(
        xyz / 100, white / 100, np.array([0.9505, 1.0, 1.089]), transform="Bradford"
    )
    np.testing.assert_allclose(adapt_to_d65(xyz, white) / 100, expected, rtol=1e-6)
