"""Open scenes whose light is known: what a surface shows is D E, with E from school physics.

Rationale
    Closed forms of single surfaces pin down the units of every kind of light (radiance, intensity,
    irradiance), the factor 1 / pi and each material's own row, without bounces and almost without noise.
Expected
    Exact where the estimator has no variance (directional light), else within 4.5 standard errors or the size
    of a pixel.
Result
    As expected: 1e-5 for directional light, 0.1 % for point and spot light.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import FINE, Array, bell, curve, light_values, luminescence, paint, sampled, sensor, write

from fluorspar import SpectralImage, Wavelengths, load_scene, render
from fluorspar.errors import FluorsparWarning

GRID = Wavelengths(400, 700, 20)
S = 0.25 + 0.35 * (FINE - 300) / 480
ALPHA, BETA = bell(560, 40, 0.5), bell(500, 40)
D_L = luminescence(ALPHA, BETA, GRID)
L = sampled(light_values(), GRID)


def shown(
    folder: Path, light: str, shape: str = '<shape type="rectangle" id="sheet"/>', spp: int = 16
) -> SpectralImage:
    """The square from -1 to 1, seen from above through a narrow lens (0.57 degrees, so almost one point)."""
    xml = f"""<scene version="3.0.0"> {sensor(8, spp, origin="0, 0, 10", target="0, 0, 0", fov=0.57)}
        {light} {shape} </scene>"""
    scene = load_scene(write(folder, xml), materials={"sheet": paint("dye", S, ALPHA, BETA)})
    return render(scene, wavelengths=GRID, excitation="grid", seed=8)


def assert_shows(image: SpectralImage, E: Array, rtol: float) -> None:
    values = image.dataset["radiance"].values.astype(float).mean((1, 2))
    expected = np.zeros_like(values)
    expected[1], expected[2] = sampled(S, GRID) * E, D_L @ E
    np.testing.assert_allclose(values, expected, rtol=rtol, atol=1e-6 * expected.max())


def test_directional_light(tmp_path: Path) -> None:
    """Irradiance H at 60 degrees from the normal: E = H cos 60 / pi."""
    light = f"""<emitter type="directional"> <vector name="direction" x="0.8660254" y="0" z="-0.5"/>
        {curve("irradiance", light_values())} </emitter>"""
    assert_shows(shown(tmp_path, light), L * 0.5 / np.pi, 1e-5)


def test_point_light(tmp_path: Path) -> None:
    """Intensity I at 2 m straight above: E = I / (4 pi); 0.05 m off the axis it is 0.1 % less."""
    light = f"""<emitter type="point"> <point name="position" x="0" y="0" z="2"/>
        {curve("intensity", light_values())} </emitter>"""
    assert_shows(shown(tmp_path, light), L / (4 * np.pi), 0.001)


def test_spot_light(tmp_path: Path) -> None:
    """Within its beam a spot light is a point light."""
    light = f"""<emitter type="spot"> <transform name="to_world">
        <lookat origin="0, 0, 2" target="0, 0, 0" up="0, 1, 0"/>
        </transform> <float name="cutoff_angle" value="30"/> <float name="beam_width" value="20"/>
        {curve("intensity", light_values())} </emitter>"""
    assert_shows(shown(tmp_path, light), L / (4 * np.pi), 0.001)


def test_disk_light(tmp_path: Path) -> None:
    """Radiance L of a disk of radius 1 at a distance of 1 on the axis: E = L R^2 / (R^2 + d^2) = L / 2."""
    light = f"""<shape type="disk"> <transform name="to_world"> <rotate x="1" angle="180"/>
        <translate z="11"/> </transform>
        <emitter type="area"> {curve("radiance", light_values())} </emitter> </shape>"""
    sheet = (
        '<shape type="rectangle" id="sheet"> <transform name="to_world"> <translate z="10"/>'
        "</transform> </shape>"
    )
    xml = f"""<scene version="3.0.0"> {sensor(8, 4096, origin="0.7, 0, 10.7", target="0, 0, 10", fov=2)}
        {light} {sheet} </scene>"""
    scene = load_scene(write(tmp_path, xml), materials={"sheet": paint("dye", S, ALPHA, BETA)})
    image = render(scene, wavelengths=GRID, excitation="grid", seed=8, max_depth=2)
    # 64 x 4096 samples that scatter by less than 0.5: known to 0.1 %
    assert_shows(image, L / 2, 0.0045)


def test_convex_body_in_uniform_light(tmp_path: Path) -> None:
    """A convex body in uniform light L shows D L everywhere: 2e4 samples that scatter by 0.4, so known to 0.3 %."""
    sky = f'<emitter type="constant"> {curve("radiance", light_values())} </emitter>'
    image = shown(tmp_path, sky, '<shape type="sphere" id="sheet"/>', spp=1024)
    values = image.dataset["radiance"].values.astype(float)
    expected = np.zeros_like(values[:, 0, 0])
    expected[1], expected[2] = sampled(S, GRID) * L, D_L @ L
    known = values.std((1, 2)) / 8
    assert (known < 0.005 * expected.max()).all()
    assert (np.abs(values.mean((1, 2)) - expected) <= 4.5 * known).all()


def test_back_of_a_one_sided_surface_is_black(tmp_path: Path) -> None:
    light = f"""<emitter type="directional"> <vector name="direction" x="0" y="0" z="-1"/>
        {curve("irradiance", light_values())} </emitter>"""
    sheet = '<shape type="rectangle" id="sheet"> <boolean name="flip_normals" value="true"/> </shape>'
    with pytest.warns(FluorsparWarning, match="0 everywhere"):
        assert not shown(tmp_path, light, sheet).total().values.any()


@pytest.mark.parametrize("side", ["front", "back"])
def test_two_sides(side: str, tmp_path: Path) -> None:
    """`twosided` with two BSDFs: each side shows its own material, lit from its own side."""
    sign = 1 if side == "front" else -1
    light = f"""<emitter type="directional"> <vector name="direction" x="0" y="0" z="{-sign}"/>
        {curve("irradiance", light_values())} </emitter>"""
    xml = f"""<scene version="3.0.0"> {sensor(4, 4, origin=f"0, 0, {5 * sign}", target="0, 0, 0", fov=1)} {light}
        <shape type="rectangle"> <bsdf type="twosided">
            <bsdf type="diffuse" id="front"/> <bsdf type="diffuse" id="back"/> </bsdf> </shape> </scene>"""
    other = paint("white", 0.7)
    materials = {"front": paint("dye", S, ALPHA, BETA), "back": other}
    image = render(load_scene(write(tmp_path, xml), materials=materials), wavelengths=GRID, excitation="grid")
    if side == "front":
        assert_shows(image, L / np.pi, 1e-5)
    else:
        np.testing.assert_allclose(image.total().values[0, 0], 0.7 * L / np.pi, rtol=1e-5)
