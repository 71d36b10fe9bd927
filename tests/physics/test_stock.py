"""Against stock Mitsuba: without luminescence, Fluorspar must show what the `path` integrator shows.

Rationale
    With D_L = 0 the method is an ordinary path tracer. Stock Mitsuba is an independent one, with all kinds of
    lights and cameras. Three bands of ours are its three channels: in rgb variants, `rgb` values are used as
    they are.
Expected
    No block mean of any band further off than noise explains, bounded for the number of blocks and bands, and
    the image mean within 0.1 % (Cornell box) in each band.
Samples
    Both sides are estimates. Noise of ours from `standard_error`, of stock from the scatter of independent
    seeds, pooled over the 64 pixels of a block. In the Cornell box a sample scatters by 0.85 of the image
    mean on either side, so 64 x 64 x 3072 samples on each know the difference to 0.035 %, and 0.1 % is 3
    standard errors. The mean over many samples of a block is normal to a good approximation: 64 pixels x 1024
    samples, skewness of single samples below 10.
Result
    Cornell box: image means differ by 0.03 % in each band, the largest of 192 |z| is 3.1 (bound 4.6). Lights:
    image means differ by 0.01 to 0.25 %, the largest of 48 |z| is 2.9 (bound 4.3).
"""

from __future__ import annotations

from pathlib import Path

import pytest
from lab import BANDS, assert_agrees, colour, integrator, sensor, stock_renders, write

from fluorspar import load_scene, render


def plane(kind: str, identity: str, transform: str, bsdf: str, emitter: str = "") -> str:
    return f"""<shape type="{kind}" id="{identity}"> <transform name="to_world"> {transform} </transform>
        {bsdf} {emitter} </shape>"""


def diffuse(value: object, *, stock: bool) -> str:
    return f'<bsdf type="diffuse"> {colour("reflectance", value, stock=stock)} </bsdf>'


def cornell(size: int, *, stock: bool) -> str:
    """A box with white, red and green walls, two blocks and a lamp that reflects too."""
    white, red, green = (
        diffuse(value, stock=stock)
        for value in ((0.885, 0.698, 0.666), (0.57, 0.043, 0.044), (0.105, 0.378, 0.076))
    )
    lamp = f'<emitter type="area"> {colour("radiance", (3.9, 2.7, 1.7), stock=stock)} </emitter>'
    down, up = '<rotate x="1" angle="90"/>', '<rotate x="1" angle="-90"/>'
    return f"""<scene version="3.0.0"> {integrator(-1, 5)}
        {sensor(size, 4, origin="0, 0, 3.9", target="0, 0, 0", fov=39.3)}
        {plane("rectangle", "floor", up + '<translate y="-1"/>', white)}
        {plane("rectangle", "ceiling", down + '<translate y="1"/>', white)}
        {plane("rectangle", "back", '<translate z="-1"/>', white)}
        {plane("rectangle", "left", '<rotate y="1" angle="90"/><translate x="-1"/>', red)}
        {plane("rectangle", "right", '<rotate y="1" angle="-90"/><translate x="1"/>', green)}
        {
        plane(
            "rectangle",
            "lamp",
            '<scale value="0.5"/>' + down + '<translate y="0.99"/>',
            diffuse(0.78, stock=stock),
            lamp,
        )
    }
        {
        plane(
            "cube",
            "low",
            '<scale value="0.3"/><rotate y="1" angle="-17"/><translate x="0.33" y="-0.7" z="0.38"/>',
            white,
        )
    }
        {
        plane(
            "cube",
            "high",
            '<scale x="0.3" y="0.61" z="0.3"/><rotate y="1" angle="18"/>'
            '<translate x="-0.33" y="-0.4" z="-0.28"/>',
            white,
        )
    } </scene>"""


def test_cornell_box(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, cornell(64, stock=False)))
    ours = render(scene, spp=3072, wavelengths=BANDS, seed=4)
    stock = stock_renders(cornell(64, stock=True), spp=384, seeds=8)
    assert_agrees(ours, stock, blocks=8, bias=0.001)


LIGHTS = {
    "area": '<shape type="rectangle"> <transform name="to_world"> <scale value="0.4"/>'
    '<rotate x="1" angle="90"/>'
    '<translate x="-0.8" y="1.9"/> </transform> <bsdf type="diffuse"/>'
    '<emitter type="area"> {radiance} </emitter> </shape>',
    "other-area": '<shape type="sphere"> <point name="center" x="0.9" y="0.9" z="0.6"/>'
    '<float name="radius" value="0.15"/>'
    '<emitter type="area"> {radiance} </emitter> </shape>',
    "point": '<emitter type="point"> <point name="position" x="0.5" y="1.4" z="0.7"/> {intensity} </emitter>',
    "spot": '<emitter type="spot"> <float name="cutoff_angle" value="30"/>'
    '<float name="beam_width" value="15"/>'
    '<transform name="to_world"> <lookat origin="-0.5, 1.7, 1" target="0, -0.5, 0" up="0, 0, 1"/>'
    "</transform> {intensity} </emitter>",
    "directional": '<emitter type="directional">'
    '<vector name="direction" x="0.5" y="-1" z="-0.4"/> {irradiance} </emitter>',
    "constant": '<emitter type="constant"> {radiance} </emitter>',
}
SPECTRA = {
    "area": (5.0, 1.0, 0.2),
    "other-area": (0.5, 3.0, 12.0),
    "point": (0.3, 1.2, 2.0),
    "spot": (3.0, 0.4, 1.5),
    "directional": (0.4, 1.6, 0.8),
    "constant": (0.2, 0.5, 0.9),
}
COMBINATIONS = {
    "two area lights": ("area", "other-area"),
    "point": ("point",),
    "spot": ("spot",),
    "directional": ("directional",),
    "constant": ("constant",),
    "all": tuple(LIGHTS),
}


def room(lights: tuple[str, ...], *, stock: bool) -> str:
    """A corner and a block, open to the sky, under lights of different spectra."""
    grey, warm = (diffuse(value, stock=stock) for value in ((0.5, 0.6, 0.7), (0.8, 0.5, 0.2)))
    emitters = ""
    for name in lights:
        values = {
            unit: colour(unit, SPECTRA[name], stock=stock) for unit in ("radiance", "intensity", "irradiance")
        }
        emitters += LIGHTS[name].format(**values)
    return f"""<scene version="3.0.0"> {integrator(-1, 5)}
        {sensor(32, 4, origin="0.4, 0.6, 3.9", target="0, 0, 0", fov=39.3)} {emitters}
        {
        plane(
            "rectangle", "floor", '<scale value="1.4"/><rotate x="1" angle="-90"/><translate y="-1"/>', grey
        )
    }
        {
        plane(
            "rectangle",
            "back",
            '<scale value="1.2"/><translate z="-1"/>',
            f'<bsdf type="twosided"> {warm} </bsdf>',
        )
    }
        {
        plane("cube", "block", '<scale value="0.4"/><rotate y="1" angle="20"/><translate y="-0.6"/>', warm)
    } </scene>"""


@pytest.mark.parametrize("name", COMBINATIONS)
def test_lights(name: str, tmp_path: Path) -> None:
    """Each kind of light alone, and several of different spectra seen from the same surfaces.

    32 x 32 pixels in 16 blocks, 1024 samples on either side, which know the image mean to 0.03-0.12 %; 8192
    for the two area lights, of which the small one scatters most: to 0.12 % too. The image mean is allowed
    0.5 %.
    """
    lights = COMBINATIONS[name]
    scene = load_scene(write(tmp_path, room(lights, stock=False)))
    assert len(scene.lights) == len(lights)
    spp = 8192 if name == "two area lights" else 1024
    ours = render(scene, spp=spp, wavelengths=BANDS, seed=5)
    stock = stock_renders(room(lights, stock=True), spp=spp // 8, seeds=8)
    assert_agrees(ours, stock, blocks=4, bias=0.005)


@pytest.mark.parametrize("max_depth", [1, 2, 3, 5])
def test_depth_counts_as_in_mitsuba(max_depth: int, tmp_path: Path) -> None:
    """All lights at once, cut off at a depth: the image mean is allowed 1 %.

    A depth more or less would change it by more.
    """
    lights = tuple(LIGHTS)
    ours = render(
        load_scene(write(tmp_path, room(lights, stock=False))),
        spp=512,
        wavelengths=BANDS,
        seed=9,
        max_depth=max_depth,
    )
    stock = room(lights, stock=True).replace(
        'name="max_depth" value="-1"', f'name="max_depth" value="{max_depth}"'
    )
    assert_agrees(ours, stock_renders(stock, spp=64, seeds=8), blocks=4, bias=0.01)
