"""What guides a denoiser: pixels with edges get more samples than others."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.paths.seen_first import seen_first
from fluorspar.paths.tracing import first_hits
from fluorspar.scene.loading import load_scene
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 700, 20)


@pytest.mark.parametrize("named", ["cornell-box", "still-life"])
def test_edges_are_as_sharp_as_if_all_pixels_had_many_samples(
    named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load_scene(named).with_settings(width=48, height=48, spp=64)

    def colours() -> np.ndarray:
        return seen_first(scene, GRID, GRID)[0]

    usual = colours()
    monkeypatch.setattr(first_hits, "_SPREAD", np.inf)  # no pixel gets more than the first
    few = colours()
    for name in "_FIRST", "_MOST":
        monkeypatch.setattr(first_hits, name, 4096)
    many = colours()
    edges = np.abs(few - many).max(axis=2) > 0.02
    assert edges.mean() > 0.01

    def error(found: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.square(found - many)[edges])))

    assert error(usual) < 0.5 * error(few)
    assert np.abs(usual - many)[~edges].mean() < 0.005
