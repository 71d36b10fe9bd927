"""Images that do not fit into memory are compared strip by strip, as others are."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.comparing import sides
from fluorspar.comparing.compare import compare
from fluorspar.image import dataset
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths


def test_strips_of_files_give_the_numbers_of_whole_images(tmp_path, monkeypatch):
    grid, random = Wavelengths(400, 700, 20), np.random.default_rng(3)
    images = []
    for name in ("a.nc", "b.nc"):
        radiance = 1 + random.random((7, 40, 24, 16))
        image = SpectralImage.from_arrays(radiance, grid, 0.3 * np.ones((40, 24, 16)), {"spp": 16})
        image.save(tmp_path / name)
        images.append(image)
    whole = compare(*images)
    monkeypatch.setattr(sides, "_KEEP_BYTES", 0)
    monkeypatch.setattr(dataset, "_BLOCK_BYTES", 3 * 4 * 24 * 16)
    strips = compare(tmp_path / "a.nc", tmp_path / "b.nc")
    for name in ("rmse", "de00", "rgb_a", "rgb_b", "rgb_difference"):
        np.testing.assert_array_equal(getattr(strips.images, name), getattr(whole.images, name))
    for name in ("mean_a", "mean_b", "band_error", "band_bias"):
        np.testing.assert_allclose(getattr(strips.images, name), getattr(whole.images, name), rtol=1e-12)
    assert strips.value("noise_z") == pytest.approx(whole.value("noise_z"), rel=1e-9)
