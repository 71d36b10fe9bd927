"""Scenes of many lights: each gets shadow rays by what it sends to the place, and the mean stays right.

Rationale
    Whatever the probabilities of the lights, the mean is right only if the density of a light that a path hits by
    chance is that of the same choice; a furnace, where both ways count, tests that. Noise tells whether the choice is a
    good one: of an even one it has a closed form.
Expected
    A point below 40 lamps: sum I cos / d^2 within 4 standard errors, and at most a thirtieth of the variance of an even
    choice, which is N sum e^2 - (sum e)^2 per sample. The same of light paths that were traced while the lamp that
    matters most was off, with at most 5 times the variance of an even choice. A furnace of 24 lights: 1 / (1 - S)
    within 4 standard errors, and within 0.5 %. All of it also among general surfaces, which another loop traces.
Result
    1/80 of the variance of an even choice, twice as much where the lamp was off: its share is that of a dim one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import Array, sensor, write

from fluorspar import Scene, SpectralImage, Spectrum, load_scene, render, trace

S = 0.6
GRID = "400:700:100"
SPP = 64
GREY = f'<bsdf type="diffuse"> <spectrum name="reflectance" value="{S}"/> </bsdf>'
# Out of sight and of light: with it a scene is one of general surfaces.
GLOSSY = """<shape type="rectangle"> <transform name="to_world"> <translate z="-7"/> </transform>
    <bsdf type="roughplastic"/> </shape>"""
both_loops = pytest.mark.parametrize("general", [False, True])


def lamps() -> tuple[Array, Array]:
    """Positions of 40 points and their intensities, some of them 1000 times as bright as others."""
    random = np.random.default_rng(3)
    places = random.uniform([-4, -4, 1], [4, 4, 3], (40, 3))
    powers = 10 ** random.uniform(-1.5, 1.5, 40)
    places[0], powers[0] = (0.5, 0, 1), 30
    return places, powers


def sheet(folder: Path, powers: Array, general: bool) -> Scene:
    """A square below the lamps, of which a narrow lens sees almost one point."""
    points = "".join(
        f'<emitter type="point" id="lamp-{number}"> <point name="position" x="{x}" y="{y}" z="{z}"/>'
        f'<spectrum name="intensity" value="{power}"/> </emitter>'
        for number, ((x, y, z), power) in enumerate(zip(lamps()[0], powers, strict=True))
    )
    camera = sensor(8, SPP, origin="0, 0, 10", target="0, 0, 0", fov=0.06)
    sheet = f'<shape type="rectangle"> {GREY} </shape>'
    scene = load_scene(
        write(
            folder, f'<scene version="3.0.0"> {camera} {points} {sheet} {GLOSSY if general else ""} </scene>'
        )
    )
    assert (scene.lobes is not None) == general
    return scene


def check(image: SpectralImage, of_even: float) -> None:
    """Compare mean and variance with closed forms; `of_even` is a share of the variance of an even choice."""
    places, powers = lamps()
    each = S / np.pi * powers * places[:, 2] / (places**2).sum(axis=1) ** 1.5
    found = image.total().values[..., 0].astype(float)
    assert abs(found.mean() - each.sum()) < 4 * found.std(ddof=1) / np.sqrt(found.size)
    even = len(each) * (each**2).sum() - each.sum() ** 2
    assert found.var(ddof=1) * SPP < of_even * even


@both_loops
def test_a_point_below_lamps(tmp_path: Path, general: bool) -> None:
    check(render(sheet(tmp_path, lamps()[1], general), wavelengths=GRID, seed=1), 1 / 30)


@both_loops
def test_the_lamp_that_matters_was_off(tmp_path: Path, general: bool) -> None:
    powers = lamps()[1]
    bright = Spectrum.constant(powers[0])
    powers[0] = 0
    paths = trace(sheet(tmp_path, powers, general), wavelengths=GRID, seed=1)
    check(paths.image(lights={"lamp-0": bright}), 5.0)


@both_loops
def test_furnace_of_many_lights(tmp_path: Path, general: bool) -> None:
    faces = [f'<rotate y="1" angle="{angle}"/>' for angle in (0, 90, 180, 270)]
    faces += [f'<rotate x="1" angle="{angle}"/>' for angle in (90, 270)]
    tiles = "".join(
        f"""<shape type="rectangle"> <transform name="to_world"> <scale value="0.5"/>
        <translate x="{x}" y="{y}" z="-1"/> {face} </transform> {GREY}
        <emitter type="area"> <spectrum name="radiance" value="1"/> </emitter> </shape>"""
        for face in faces
        for x in (-0.5, 0.5)
        for y in (-0.5, 0.5)
    )
    camera = sensor(32, SPP, origin="0.2, 0.1, 0.3", target="-1, -0.5, -0.4", fov=90)
    scene = load_scene(
        write(tmp_path, f'<scene version="3.0.0"> {camera} {tiles} {GLOSSY if general else ""} </scene>')
    )
    found = render(scene, wavelengths=GRID, seed=1).total().values[..., 0].astype(float)
    off = found.mean() * (1 - S) - 1
    assert abs(off) < 4 * found.std(ddof=1) * (1 - S) / np.sqrt(found.size)
    assert abs(off) < 0.005
