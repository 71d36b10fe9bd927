"""Wavelength grids: each is held to its own closed form, and what two have in common to each other.

Rationale
    On a grid the Stokes limit and the integrals over excitation are sums, so a picture depends on the grid a
    little, and on the weight of excitation at the emission wavelength ("half" or "strict"). None of this may
    come from the renderer: the closed form of the furnace, with the matrix on the grid in use, has it all. Only
    wavelengths of the grid excite here; `test_ultraviolet` has those below it.
    Steps of 2.5, 5 and 10 nm; 360-700 nm and 300-780 nm.
Expected
    Components within 0.2 %, or 4.5 standard errors where these are larger. The visible part of a 300-780 nm
    render is the 360-700 nm render plus what 300-360 nm excites, to single precision: the light paths are the
    same.
Samples
    48 x 48 x 96 paths, which know direct reflection to 0.07 % and the total to 0.02 %. Roulette looks at the
    brightest band, which depends on the grid; where paths must be the same it is off, and paths end at 12
    scatterings.
Result
    Direct light within 0.10 %, all other components within 0.05 %, the total within 0.03 %, on every grid and
    with either Stokes rule. Ultraviolet and visible light add up to the whole within 1e-5.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import FINE, Array, bell, cavity, furnace, light_values, luminescence, paint, sampled, write

from fluorspar import COMPONENTS, SpectralImage, Wavelengths, load_scene, render

S = 0.25 + 0.35 * (FINE - 300) / 480
ALPHA = bell(530, 30, 0.45)
# Excitation reaches into the ultraviolet.
BETA = bell(490, 30) + 0.6 * bell(340, 25)


def rendered(
    folder: Path,
    grid: Wavelengths,
    *,
    stokes: str = "half",
    light: Array | None = None,
    depth: int = -1,
    spp: int = 96,
) -> SpectralImage:
    xml = furnace(48, spp, L=light, max_depth=depth, rr_depth=10 if depth < 0 else 1000)
    scene = load_scene(write(folder, xml), materials={"cavity": paint("dye", S, ALPHA, BETA)})
    return render(scene, wavelengths=grid, excitation="grid", seed=7, stokes=stokes)  # type: ignore[arg-type]


def closed(grid: Wavelengths, equal: float = 0.5) -> Array:
    return cavity(sampled(S, grid), luminescence(ALPHA, BETA, grid, equal), sampled(light_values(), grid))


def assert_closed(image: SpectralImage, expected: Array) -> None:
    values = image.dataset["radiance"].values.astype(float)
    scale = np.maximum(expected, 0.01 * expected.max(axis=1, keepdims=True))
    known = values.std((1, 2)) / np.sqrt(values[0, ..., 0].size) / scale
    off = (values.mean((1, 2)) - expected) / scale
    assert (np.abs(off) < np.maximum(0.002, 4.5 * known)).all(), dict(
        zip(COMPONENTS, np.abs(off).max(1), strict=True)
    )
    total = values.sum(0).mean((0, 1)) / expected.sum(0) - 1
    assert np.abs(total).max() < 0.002


# Ranges are chosen so that most grids share compiled code (bands are padded to a multiple of 16).
GRIDS = {"2.5 nm": Wavelengths(430, 620, 2.5), "5 nm": Wavelengths(), "10 nm": Wavelengths(440, 590, 10)}


@pytest.mark.parametrize("name", GRIDS)
def test_each_grid_against_its_own_closed_form(name: str, tmp_path: Path) -> None:
    assert_closed(rendered(tmp_path, GRIDS[name]), closed(GRIDS[name]))


def test_strict_stokes_limit(tmp_path: Path) -> None:
    """Eq. 1 of the paper to the letter: component 2 is lower by 1.2 %, component 6 by 6 %, as its closed
    form says."""
    grid = Wavelengths()
    strict, half = closed(grid, 0.0), closed(grid, 0.5)
    assert strict[2].sum() / half[2].sum() < 0.99
    assert strict[6].sum() / half[6].sum() < 0.95
    assert_closed(rendered(tmp_path, grid, stokes="strict"), strict)


def test_ultraviolet_adds_what_it_excites(tmp_path: Path) -> None:
    """300-780 nm = visible light alone, as on 360-700 nm, plus what light of 300-355 nm excites."""
    wide, narrow = Wavelengths(300, 780, 5), Wavelengths(360, 700, 5)
    ultraviolet = np.where(FINE < 360, light_values(), 0.0)
    ultraviolet[(FINE > 355) & (FINE < 360)] *= (360 - FINE[(FINE > 355) & (FINE < 360)]) / 5
    visible = light_values() - ultraviolet
    shared = (wide.values >= 360) & (wide.values <= 700)

    def total(grid: Wavelengths, light: Array) -> Array:
        return rendered(tmp_path, grid, light=light, depth=13, spp=16).total().values.astype(float)

    everything = total(wide, light_values())[..., shared]
    excited = total(wide, ultraviolet)[..., shared]
    seen = total(narrow, visible)
    assert excited.sum() > 0.02 * everything.sum()
    np.testing.assert_allclose(everything, seen + excited, rtol=2e-5)
    expected = cavity(sampled(S, wide), luminescence(ALPHA, BETA, wide), sampled(ultraviolet, wide), 12).sum(
        0
    )[shared]
    assert np.abs(excited.mean((0, 1)) - expected).max() < 0.005 * expected.max()
