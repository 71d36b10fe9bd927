"""A small spectral image made by formula: smooth in space, different spectra, noise in every low bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import numpy as np
import pytest

from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

ATTRS = {
    "version": "0.1.0",
    "method": "paths",
    "spp": 64,
    "seed": 7,
    "scene": "synthetic, with a µ",
    "materials": {"left wall": "red", "right wall": ["green", 0.7]},
    "timings": {"trace": 1.2345678901234567, "sweep": 1e-9},
}


def synthetic(
    height: int = 12, width: int = 20, grid: Wavelengths | None = None, component_errors: bool = False
) -> SpectralImage:
    """Component k is 4^-k times a bump in space and in wavelength; the lamp fills the top left corner."""
    grid = grid or Wavelengths()
    random = np.random.default_rng(1)
    y, x = np.mgrid[0:height, 0:width] / max(height, width)
    radiance = np.empty((7, height, width, len(grid)), np.float32)
    for k in range(7):
        shading = 4.0**-k * np.exp(-((x - k / 7) ** 2) - (y - 0.3) ** 2)
        spectrum = np.exp(-(((grid.values - 420 - 40 * k) / 60) ** 2))
        noise = 1 + 0.05 * random.random((height, width, len(grid)))
        radiance[k] = shading[..., np.newaxis] * spectrum * noise
    radiance[0] = 0
    radiance[0, :2, :3] = 30
    error = np.asarray(0.02 * radiance[1:].sum(axis=0), np.float32)
    of_components = np.asarray(0.03 * radiance, np.float32) if component_errors else None
    return SpectralImage.from_arrays(radiance, grid, error, ATTRS, component_standard_error=of_components)


@pytest.fixture
def make_image() -> Callable[..., SpectralImage]:
    return synthetic


@pytest.fixture
def image() -> SpectralImage:
    return synthetic()


@pytest.fixture
def file_size_limit() -> Callable[[int], AbstractContextManager[None]]:
    """Let no file grow beyond a number of bytes: to a program that looks like a full disk."""
    resource = pytest.importorskip("resource", reason="there are no resource limits here")

    @contextmanager
    def limited(size: int) -> Iterator[None]:
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return limited
