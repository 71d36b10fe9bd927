"""Furnace: a closed cavity of one fluorescent material that emits everywhere.

Rationale
    The light in a closed, uniformly emitting cavity is the same at every point and in every direction,
    whatever its shape. So each of the seven components of each pixel has a closed form (`lab.cavity`),
    with all bounces and all re-excitation in it. Nothing else tests every part of the method at once:
    shading, sampling weights, Russian roulette, reflection, luminescence and the Stokes limit.
Expected
    Component `source` exactly; every other component's image mean within 0.2 % of its closed form in each of
    69 bands that carry it; z-scores of the pixels with mean 0 and standard deviation 0.95-1.05.
Samples
    64 x 64 pixels: the standard deviation of z over 4096 pixels is known to 1.2 %, so 0.95-1.05 is +-4
    standard errors. Direct reflection scatters most, 0.33 of its value per sample: at 128 samples the image
    mean is known to 0.33 / sqrt(4096 x 128) = 0.045 %, and 0.2 % is 4.4 standard errors. Pixel values have a
    skewness below 0.1 there, which shifts the mean z by less than 0.05. With S = 0.95 each path costs ten
    times as much, so there 32 samples; direct light then is known to 0.09 % and may be 4.5 times that off,
    the rest 0.2 %. Long paths are counted to the end instead of being left to roulette: roulette makes
    component 6 scatter by 4.3 of its value per sample, and 0.2 % would take 10^8 paths. Roulette has a test
    of its own.
Result
    Component 6 is 3.8 % of the light of the strong dye. Largest deviation of an image mean: 0.017 % with the
    strong dye; with S = 0.95 0.11 % for direct light and 0.035 % for the rest. Standard deviation of z
    0.992-1.013.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import (
    Array,
    bell,
    cavity,
    furnace,
    light_values,
    luminescence,
    paint,
    sampled,
    values_and_errors,
    write,
    z_scores,
)

from fluorspar import COMPONENTS, SpectralImage, Wavelengths, load_scene, render

SIZE = 64


class Furnace:
    """A rendered furnace and what it should show."""

    def __init__(
        self,
        folder: Path,
        grid: Wavelengths,
        S: Array,
        alpha: Array,
        beta: Array,
        spp: int,
        max_depth: int,
        rr_depth: int,
    ) -> None:
        xml = furnace(SIZE, spp, max_depth=max_depth, rr_depth=rr_depth)
        scene = load_scene(write(folder, xml), materials={"cavity": paint("dye", S, alpha, beta)})
        self.spp = spp
        self.image: SpectralImage = render(
            scene, wavelengths=grid, excitation="grid", seed=1, component_errors=True
        )
        scatterings = None if max_depth < 0 else max_depth - 1
        D_L = luminescence(alpha, beta, grid)
        self.expected = cavity(sampled(S, grid), D_L, sampled(light_values(), grid), scatterings)


@pytest.fixture(scope="module")
def strong(tmp_path_factory: pytest.TempPathFactory) -> Furnace:
    """Strong dye whose excitation (490 nm) and emission (530 nm) overlap, 69 bands, unlimited, roulette from 10."""
    S = 0.25 + 0.35 * (np.arange(481) / 480)
    folder = tmp_path_factory.mktemp("strong")
    return Furnace(folder, Wavelengths(), S, bell(530, 30, 0.55), bell(490, 30), 128, -1, 10)


@pytest.fixture(scope="module")
def bright(tmp_path_factory: pytest.TempPathFactory) -> Furnace:
    """S = 0.95 and a dye, 16 bands; every path has 199 vertices (0.95^199 = 4e-5 of the light is beyond)."""
    folder = tmp_path_factory.mktemp("bright")
    grid = Wavelengths(400, 700, 20)
    return Furnace(folder, grid, np.full(481, 0.95), bell(540, 50, 0.03), bell(480, 50), 32, 200, 1000)


def check_component(furnace: Furnace, name: str) -> None:
    index = COMPONENTS.index(name)
    expected = furnace.expected[index]
    values, errors = values_and_errors(furnace.image, name)
    if name == "source":
        np.testing.assert_allclose(values, np.broadcast_to(expected, values.shape), rtol=1e-6)
        return
    # Where a component is next to nothing (far from the dye's bands), its share of the peak counts.
    scale = np.maximum(expected, 1e-3 * expected.max())
    off = (values.mean((0, 1)) - expected) / scale
    known = np.sqrt((errors**2).sum((0, 1))) / SIZE**2 / scale
    assert (np.abs(off) < np.maximum(0.002, 4.5 * known)).all(), f"{name}: {100 * off} %"
    band = int(expected.argmax())
    check_scores(values[..., band], errors[..., band], expected[band], furnace.spp)


def check_scores(values: Array, errors: Array, expected: float, spp: int) -> None:
    z = z_scores(values, errors, np.array(expected), spp)
    assert 0.95 < z.std() < 1.05
    assert abs(z.mean()) < 4 / np.sqrt(z.size) + 0.05, "mean of z: 4 standard errors, and what skewness adds"


@pytest.mark.parametrize("name", COMPONENTS)
def test_strong_dye_every_component(strong: Furnace, name: str) -> None:
    check_component(strong, name)


@pytest.mark.parametrize("name", COMPONENTS)
def test_long_paths_every_component(bright: Furnace, name: str) -> None:
    """Of the light at S = 0.95, 8.5 % has passed 48 vertices: a method that ends there would show it."""
    check_component(bright, name)


def test_reexcited_light_counts(strong: Furnace) -> None:
    """The dye overlaps with itself so much that component 6 is more than 2 % of all light."""
    share = strong.expected[6].sum() / strong.expected.sum()
    assert share > 0.02
    measured = strong.image.component("reexcitation").values.sum() / strong.image.total().values.sum()
    assert measured == pytest.approx(share, rel=0.002)


@pytest.mark.parametrize("which", ["strong", "bright"])
def test_total(which: str, request: pytest.FixtureRequest) -> None:
    """Image mean of the total within 0.2 % in every band; z-scores as stated in bands all over the spectrum."""
    furnace = request.getfixturevalue(which)
    expected = furnace.expected.sum(0)
    values, errors = values_and_errors(furnace.image)
    assert np.abs(values.mean((0, 1)) / expected - 1).max() < 0.002
    for band in range(0, len(expected), len(expected) // 5):
        check_scores(values[..., band], errors[..., band], expected[band], furnace.spp)


def test_roulette_at_high_reflectance(tmp_path: Path) -> None:
    """S = 0.95, unlimited, roulette from depth 10: the path length is left to chance and nothing is lost.

    One sample scatters by 1.37 of its value (the number of bounces is geometric), so 64 x 64 x 64 samples
    know the mean to 0.27 %; one bounce weighted wrongly beyond depth 10 would show as far more than that.
    """
    grid = Wavelengths(400, 700, 20)
    scene = load_scene(write(tmp_path, furnace(SIZE, 64)), materials={"cavity": paint("white", 0.95)})
    image = render(scene, wavelengths=grid, seed=2, component_errors=True)
    values, errors = values_and_errors(image)
    known = np.sqrt((errors**2).sum((0, 1))) / SIZE**2
    expected = sampled(light_values(), grid) / 0.05
    assert (known / expected < 0.004).all()
    assert (np.abs(values.mean((0, 1)) - expected) < 4.5 * known).all()
