"""Two noisy images that differ, and their comparison at points."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.comparing.compare import compare
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.points import Point
from fluorspar.spectral.wavelengths import Wavelengths

POINTS = (Point("left", (10, 20)), Point("<white> & wide", (40, 30)), Point("7", (30, 10)))


def noisy(seed: int, scene: str) -> SpectralImage:
    """64 x 48 pixels, a slope of light and colour, 2 % noise, and more light below the diagonal for seed 2."""
    grid = Wavelengths(400, 700, 20)
    y, x = np.mgrid[0:48, 0:64]
    spectrum = 1 + (x / 64)[..., np.newaxis] * np.sin(grid.values / 60)
    level = 0.01 * (1 + y / 48)[..., np.newaxis] * spectrum
    noise = 1 + 0.02 * np.random.default_rng(seed).standard_normal((48, 64, 1))
    radiance = np.zeros((7, 48, 64, len(grid)))
    radiance[1] = level * noise * (1 + 0.2 * (seed == 2) * (x > y))[..., np.newaxis]
    return SpectralImage.from_arrays(radiance, grid, 0.02 * level, {"scene": scene})


@pytest.fixture(scope="module")
def compared():
    """The comparison of two images at three points."""
    a, b = noisy(1, "first <script>alert(1)</script>"), noisy(2, "second")
    return compare(a, b, points=POINTS, aperture=Aperture(5, "px"), match="left")
