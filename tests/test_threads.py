"""Threads of one process that render at the same time: each gets the image that it would get alone, bit for bit."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray

import fluorspar

Array = NDArray[np.float32]
SIZE = (8, 8)
GRID = "400:700:100"
GLOSSY = {
    "type": "scene",
    "sky": {"type": "constant"},
    "camera": {"type": "perspective", "film": {"type": "hdrfilm"}},
    "ball": {"type": "sphere", "center": [0, 0, 4], "bsdf": {"type": "roughplastic"}},
}


def one_pass(seed: int) -> Array:
    return values(fluorspar.render("furnace", size=SIZE, spp=4, wavelengths=GRID, seed=seed))


def box(seed: int) -> Array:
    return values(fluorspar.render("cornell-box", size=SIZE, spp=4, wavelengths=GRID, seed=seed))


def traced(seed: int) -> Array:
    return values(fluorspar.trace("cornell-classic", size=SIZE, spp=4, wavelengths=GRID, seed=seed).image())


def averaged(seed: int) -> Array:
    scene = fluorspar.load_scene(GLOSSY, matte=True)
    return values(fluorspar.render(scene, size=SIZE, spp=4, wavelengths=GRID, seed=seed))


def values(image: fluorspar.SpectralImage) -> Array:
    return np.asarray(image.dataset.radiance.values)


@pytest.mark.filterwarnings("ignore::fluorspar.errors.ApproximationWarning")
def test_each_as_if_alone() -> None:
    def run(task: tuple[Callable[[int], Array], int]) -> Array:
        return task[0](task[1])

    tasks = [(work, seed) for seed in range(2) for work in (one_pass, box, traced, averaged)]
    alone = list(map(run, tasks))
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(run, tasks))
    for (work, seed), expected, got in zip(tasks, alone, together, strict=True):
        np.testing.assert_array_equal(got, expected, f"{work.__name__}, seed {seed}")
