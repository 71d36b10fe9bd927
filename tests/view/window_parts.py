"""What tests of the window share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fluorspar import SpectralImage, Wavelengths

TOKEN = "a-token-that-nobody-knows"
HOST = "127.0.0.1:8123"
GRID = Wavelengths(400, 700, 20)

Ask = Callable[..., Any]


def image_of(seed: int, *, component_errors: bool = False) -> SpectralImage:
    """An image of random spectra, 8 x 6 pixels, with standard errors."""
    random = np.random.default_rng(seed)
    shape = (7, 6, 8, len(GRID))
    radiance = random.uniform(0.1, 1.0, shape) * np.linspace(1, 3, 8)[:, np.newaxis]
    return SpectralImage.from_arrays(
        radiance,
        GRID,
        random.uniform(0.01, 0.02, shape[1:]),
        {"method": "paths", "spp": 16, "seed": seed},
        component_standard_error=random.uniform(0.01, 0.02, shape) if component_errors else None,
    )
