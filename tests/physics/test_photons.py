"""Photon balance: a material that turns each photon it gets into exactly one photon.

Rationale
    In the uniformly emitting cavity, light that was scattered k times has the radiance D^k L_e. If D
    conserves photons, each of these holds as many photons as L_e, so with paths of at most N scatterings
    sum(lambda y) = (N + 1) sum(lambda L_e), max_depth = N + 1. The rule holds for whatever D does between
    wavelengths; it is about how often light is scattered, and about luminescence in units of photons.
Expected
    The image mean of sum(lambda y) / sum(lambda L_e) is N + 1 within 4.5 standard errors of it, which are
    below 0.1 % of N + 1.
Samples
    48 x 48 pixels, 64 samples: 1.5e5 paths, each of which scatters by less than 0.33 of its value.
    N = 60 is more than the vertices a record holds at a time.
Result
    Off by 0.03, 0.05, 0.05, 0.02 and 0.02 % of N + 1 for N = 1, 2, 5, 20, 60; standard errors 0.04 to 0.01 %.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import PHOTON_GRID, furnace, light_values, photon_conserving, sampled, write

from fluorspar import load_scene, render

GRID = PHOTON_GRID


@pytest.mark.parametrize("scatterings", [0, 1, 2, 5, 20, 60])
def test_every_scattering_conserves_photons(scatterings: int, tmp_path: Path) -> None:
    xml = furnace(48, 64, max_depth=scatterings + 1, rr_depth=1000)
    scene = load_scene(write(tmp_path, xml), materials={"cavity": photon_conserving()})
    image = render(scene, wavelengths=GRID, excitation="grid", seed=6)
    photons = image.total().values.astype(float) @ GRID.values / (GRID.values @ sampled(light_values(), GRID))
    if scatterings == 0:
        np.testing.assert_allclose(photons, 1, rtol=1e-6)
        return
    error = photons.std() / np.sqrt(photons.size)
    assert error < 0.001 * (scatterings + 1)
    assert abs(photons.mean() - (scatterings + 1)) < 4.5 * error
