"""Numbers, transforms and types that no image can be computed from, and what is said of those that distort it."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from fluorspar import load_scene, render
from fluorspar.errors import FluorsparError, FluorsparWarning, MaterialError, SceneError
from fluorspar.scene.variants import use_variant
from xml_scene import SENSOR, SKY, xml_scene

GRID = "400:700:100"
BALL = '<shape type="sphere" id="ball"/>'
MANY_LIGHTS = f"""
    <emitter type="point"> <point name="position" x="1" y="3" z="2"/> <spectrum name="intensity" value="10"/> </emitter>
    <emitter type="spot"> <transform name="to_world"> <lookat origin="2, 3, 1" target="0, 0, 0" up="0, 1, 0"/>
        </transform> <spectrum name="intensity" value="400:1, 700:2"/>
        <float name="cutoff_angle" value="30"/> </emitter>
    <emitter type="directional"> <vector name="direction" x="1" y="-1" z="-0.5"/>
        <spectrum name="irradiance" type="blackbody"> <float name="temperature" value="5000"/> </spectrum> </emitter>
    <emitter type="constant"> <rgb name="radiance" value="0.2, 0.3, 0.4"/> </emitter>
    <shape type="sphere"> <point name="center" x="0" y="0.1" z="0"/> <float name="radius" value="0.7"/> </shape>
    <shape type="rectangle"> <transform name="to_world"> <rotate x="1" angle="-90"/> <scale x="2" y="1" z="3"/>
        <translate y="-0.7"/> </transform> <bsdf type="fluorescent"> <float name="concentration" value="0.5"/>
        <spectrum name="reflectance" value="400:0.3, 700:0.5"/>
        <spectrum name="emission" value="500:0, 550:0.3, 600:0"/>
        <spectrum name="excitation" type="irregular"> <string name="wavelengths" value="400, 450, 500"/>
        <string name="values" value="0, 1, 0"/> </spectrum> </bsdf> </shape> {SENSOR}"""
NUMBER = re.compile(r'(?<=[" ,:])-?\d+(?:\.\d+)?(?=[" ,:])')


def test_numbers_of_a_scene_may_be_impossible(tmp_path: Path) -> None:
    """Every third is set to one of seven values in turn: the image is finite, or there is a message."""
    values = ("nan", "inf", "-1e38", "1e38", "0", "-1", "1e20")
    places = [match.span() for match in NUMBER.finditer(MANY_LIGHTS)][::3]
    assert len(places) > 20
    refused = 0
    for number, (start, end) in enumerate(places):
        value = values[number % len(values)]
        path = xml_scene(tmp_path, MANY_LIGHTS[:start] + value + MANY_LIGHTS[end:], sensor="", light="")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FluorsparWarning)
            try:
                image = render(path, wavelengths=GRID, spp=1)
            except FluorsparError:
                refused += 1
            else:
                assert np.isfinite(image.dataset["radiance"].values).all(), (value, start)
    assert len(places) / 3 < refused < len(places)


@pytest.mark.parametrize(
    "part",
    [
        '<emitter type="directional"> <vector name="direction" x="nan" y="0" z="1"/> </emitter>',
        '<emitter type="point"> <point name="position" x="inf" y="0" z="1"/> </emitter>',
        '<emitter type="point"> <spectrum name="intensity" value="400:1, 500:nan"/> </emitter>',
        '<emitter type="point"> <rgb name="intensity" value="1, 1e38, 1"/> </emitter>',
        '<shape type="sphere"> <float name="radius" value="1e38"/> </shape>',
        '<shape type="cube"> <transform name="to_world"> <translate x="-inf"/> </transform> </shape>',
    ],
)
def test_numbers_are_finite(part: str, tmp_path: Path) -> None:
    with pytest.raises(
        SceneError, match=r"(a number is too large|this is not a finite number)\n  where:    '\w+' of "
    ):
        load_scene(xml_scene(tmp_path, part))


def test_numbers_of_a_dict(tmp_path: Path) -> None:
    film = {"type": "hdrfilm", "filter": {"type": "box"}}
    scene = {"type": "scene", "c": {"type": "perspective", "film": film, "fov": float("nan")}}
    with pytest.raises(SceneError, match=r"(?s)(finite|too large).*'fov' of 'c'"):
        load_scene({**scene, "sky": {"type": "constant"}})


def test_a_light_may_be_too_bright(tmp_path: Path) -> None:
    lamp = '<emitter type="constant"> <spectrum name="radiance" type="irregular"> \
        <string name="wavelengths" value="400, 700"/> <string name="values" value="1, 1e35"/> </spectrum> </emitter>'
    with pytest.raises(SceneError, match="too bright"):
        load_scene(xml_scene(tmp_path, BALL, light=lamp))


def test_directions_have_a_length(tmp_path: Path) -> None:
    sun = '<emitter type="directional"> <vector name="direction" x="0" y="0" z="0"/> </emitter>'
    with pytest.raises(SceneError, match="a direction has length 0"):
        load_scene(xml_scene(tmp_path, BALL, sun))


@pytest.mark.parametrize(
    "inside", ['<scale value="0"/>', '<scale x="0"/>', '<matrix value="1 1 0 0 1 1 0 0 0 0 1 0 0 0 0 1"/>']
)
def test_transforms_can_be_inverted(inside: str, tmp_path: Path) -> None:
    flat = f'<shape type="cube" id="flat"> <transform name="to_world"> {inside} </transform> </shape>'
    with pytest.raises(SceneError, match=r"(?s)a transform maps space onto.*'flat'"):
        load_scene(xml_scene(tmp_path, flat))


def test_thin_and_small_things_are_no_planes(tmp_path: Path) -> None:
    thin = '<transform name="to_world"> <scale x="1e-9" y="1e-9" z="1e-12"/> </transform>'
    load_scene(xml_scene(tmp_path, BALL, f'<shape type="cube"> {thin} </shape>'))


def test_misspelt_properties_are_still_found(tmp_path: Path) -> None:
    """Mitsuba knows them by what nobody has read, so the checks must not read them."""
    ball = '<shape type="sphere"> <float name="radios" value="2"/> </shape>'
    with pytest.raises(SceneError, match=r"(?s)radios.*did you mean radius"):
        render(xml_scene(tmp_path, ball), wavelengths=GRID)


class TestRotations:
    @pytest.mark.parametrize("axis", ['x="1" y="1"', 'value="1, 1, 0"', 'z="2"'])
    def test_about_long_axes(self, axis: str, tmp_path: Path) -> None:
        turn = f'<transform name="to_world"> <rotate {axis} angle="45"/> </transform>'
        with pytest.warns(FluorsparWarning, match=r"about an axis of length (1\.414|2)"):
            load_scene(xml_scene(tmp_path, f'<shape type="cube"> {turn} </shape>'))

    @pytest.mark.parametrize(
        "axis", ['x="1"', 'value="0.6, 0.8, 0"', 'x="0.7071" y="0.7071"', 'y="-1"', 'x="$x"']
    )
    def test_about_others(self, axis: str, tmp_path: Path) -> None:
        turn = (
            f'<transform name="to_world"> <rotate {axis} angle="45"/> </transform> <!-- <rotate x="3"/> -->'
        )
        load_scene(
            xml_scene(tmp_path, '<default name="x" value="1"/>', f'<shape type="cube"> {turn} </shape>')
        )


class TestExtent:
    """Mitsuba's ray offset is not in proportion to the scene; see `fluorspar.scene.extent` for what it costs."""

    def scene(self, scale: float, away: float = 0.0) -> dict[str, Any]:
        with use_variant("scalar_rgb"):
            place = mi.ScalarTransform4f().translate([away, 0, 0]).scale(scale)
        film = {"type": "hdrfilm", "width": 4, "height": 4, "filter": {"type": "box"}}
        camera = {"type": "perspective", "near_clip": scale * 1e-3, "far_clip": scale * 9, "film": film}
        return {
            "type": "scene",
            "camera": camera,
            "sky": {"type": "constant"},
            "floor": {"type": "rectangle", "to_world": place},
        }

    @pytest.mark.parametrize("method", ["paths", "staged"])
    @pytest.mark.parametrize(("scale", "away"), [(1e-4, 0), (1e-2, 0), (1, 1e3), (1e10, 0)])
    def test_of_too_small_far_or_large_scenes(self, scale: float, away: float, method: str) -> None:
        with pytest.warns(FluorsparWarning, match="the scene measures"):
            render(self.scene(scale, away), wavelengths=GRID, spp=4, method=method)

    def test_of_too_small_general_scenes(self) -> None:
        scene = self.scene(1e-2)
        scene["floor"]["bsdf"] = {"type": "plastic"}
        with pytest.warns(FluorsparWarning, match="the scene measures"):
            render(scene, wavelengths=GRID, spp=4)

    @pytest.mark.parametrize("scale", [0.1, 1, 1e6])
    def test_of_others(self, scale: float) -> None:
        render(self.scene(scale), wavelengths=GRID, spp=1)


class TestTypes:
    @pytest.mark.parametrize(
        "inside",
        [
            '<spectrum name="concentration" value="0.5"/>',
            '<string name="concentration" value="0.5"/>',
            '<float name="material" value="1"/>',
            '<integer name="donaldson" value="1"/>',
            '<vector name="reflectance" x="1" y="1" z="1"/>',
        ],
    )
    def test_of_a_fluorescent_bsdf(self, inside: str, tmp_path: Path) -> None:
        ball = f'<shape type="sphere" id="ball"> <bsdf type="fluorescent"> {inside} </bsdf> </shape>'
        with pytest.raises(SceneError, match=r"(?s)(wrong type|is not a spectrum).*'ball'"):
            load_scene(xml_scene(tmp_path, ball))

    @pytest.mark.parametrize(
        "part",
        [
            '<integrator type="path"> <string name="max_depth" value="x"/> </integrator>',
            '<integrator type="prb"> <string name="max_depth" value="x"/> </integrator>',
            '<integrator type="volpath"> <spectrum name="rr_depth" value="1"/> </integrator>',
        ],
    )
    def test_of_an_integrator(self, part: str, tmp_path: Path) -> None:
        with pytest.raises(FluorsparError, match=r"max_depth|rr_depth"):
            load_scene(xml_scene(tmp_path, BALL, part))

    @pytest.mark.parametrize("name", ["width", "sample_count"])
    @pytest.mark.parametrize("value", ['string name="{}" value="x"', 'float name="{}" value="4.5"'])
    def test_of_the_sensor(self, name: str, value: str, tmp_path: Path) -> None:
        sensor = re.sub(rf'integer name="{name}" value="\d+"', value.format(name), SENSOR)
        with pytest.raises(FluorsparError, match=name):
            load_scene(xml_scene(tmp_path, BALL, sensor=sensor))

    def test_text_is_utf_8(self, tmp_path: Path) -> None:
        path = xml_scene(tmp_path, '<bsdf type="dif@use"/>')
        path.write_bytes(path.read_bytes().replace(b"@", b"\xff"))
        with pytest.raises(SceneError, match=r"(?s)cannot read the scene.*utf-8"):
            load_scene(path)


class TestDyes:
    LOW, HIGH = "400:0, 450:1, 500:0", "480:0, 550:0.01, 600:0"

    def load(self, folder: Path, emission: str, excitation: str) -> None:
        bsdf = f'<bsdf type="fluorescent"> <spectrum name="reflectance" value="0.3"/> \
            <spectrum name="emission" value="{emission}"/> <spectrum name="excitation" value="{excitation}"/> </bsdf>'
        load_scene(xml_scene(folder, f'<shape type="sphere" id="ball"> {bsdf} </shape>'))

    def test_swapped_spectra(self, tmp_path: Path) -> None:
        self.load(tmp_path, self.HIGH, self.LOW)
        with pytest.raises(MaterialError, match=r"(?s)shorter wavelengths.*'ball'.*swapped"):
            self.load(tmp_path, self.LOW, self.HIGH)

    def test_one_spectrum_twice_is_legal(self, tmp_path: Path) -> None:
        self.load(tmp_path, self.HIGH, self.HIGH)


class TestMitsubaTakesIt:
    """What stock Mitsuba accepts and an image does not depend on."""

    @pytest.mark.parametrize(
        "part",
        [
            '<integrator type="path"> <integer name="block_size" value="16"/> </integrator>',
            '<integrator type="path"> <integer name="samples_per_pass" value="16"/> </integrator>',
            '<integrator type="direct"> <integer name="block_size" value="16"/> </integrator>',
        ],
    )
    def test_integrators(self, part: str, tmp_path: Path) -> None:
        load_scene(xml_scene(tmp_path, BALL, part))

    @pytest.mark.parametrize("plugin", ["prb", "prb_basic", "prbvolpath", "volpathmis", "moment"])
    def test_other_integrators(self, plugin: str, tmp_path: Path) -> None:
        part = f'<integrator type="{plugin}"> <integer name="max_depth" value="6"/> </integrator>'
        with pytest.warns(FluorsparWarning, match=f"'{plugin}' is replaced"):
            assert load_scene(xml_scene(tmp_path, BALL, part)).settings.max_depth == 6

    def test_film(self, tmp_path: Path) -> None:
        banner = '<boolean name="banner" value="false"/>'
        path = xml_scene(tmp_path, BALL, sensor=SENSOR.replace("<rfilter", f"{banner} <rfilter"))
        assert render(path, wavelengths=GRID).total().values.any()

    def test_bands_are_said_to_be_ignored(self, tmp_path: Path) -> None:
        band = '<spectrum name="green" value="500:0, 550:1, 600:0"/>'
        sensor = SENSOR.replace('"hdrfilm"', '"specfilm"').replace("<rfilter", f"{band} <rfilter")
        path = xml_scene(tmp_path, BALL, sensor=sensor)
        with pytest.warns(FluorsparWarning, match="bands of the film 'specfilm' are ignored"):
            assert render(path, wavelengths=GRID).total().values.any()

    @pytest.mark.parametrize("method", ["paths", "staged"])
    def test_the_response_of_the_camera_is_said_to_be_ignored(self, method: str, tmp_path: Path) -> None:
        srf = '<spectrum name="srf" value="500:0, 510:1, 520:0"/>'
        path = xml_scene(tmp_path, BALL, sensor=SENSOR.replace("<film", f"{srf} <film"))
        with pytest.warns(FluorsparWarning, match=r"spectral response of the camera \(srf\) is ignored"):
            assert render(path, wavelengths=GRID, method=method).total().values.any()


class TestSuggestions:
    @pytest.mark.parametrize(
        ("part", "suggestion"),
        [
            ('<integrator type="pth"/>', "path"),
            ('<shape type="sphere"> <bsdf type="diffus"/> </shape>', "diffuse"),
            ('<shape type="spere"/>', "sphere"),
            ('<emitter type="constnat"/>', "constant"),
            (
                '<shape type="sphere"> <bsdf type="diffuse"> <float name="reflectanc" value="1"/> </bsdf> </shape>',
                "refl",
            ),
            ('<emitter type="point"> <float name="intensty" value="2"/> </emitter>', "intensity"),
        ],
    )
    def test_of_plugins_and_properties(self, part: str, suggestion: str, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match=f"did you mean .*{suggestion}"):
            render(xml_scene(tmp_path, BALL, part), wavelengths=GRID)

    def test_of_a_camera(self, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match="did you mean perspective"):
            load_scene(xml_scene(tmp_path, BALL, sensor=SENSOR.replace("perspective", "perspectiv")))


def test_a_scene_that_mitsuba_has_built() -> None:
    with use_variant("scalar_rgb"):
        built = mi.load_dict({"type": "scene", "sky": {"type": "constant"}})
        with pytest.raises(
            SceneError, match=r"(?s)already built by Mitsuba.*fix: +give the dict or the file"
        ):
            render(built)


def test_lights_without_id_are_named_by_what_they_are(tmp_path: Path) -> None:
    lamp = '<shape type="sphere" id="ball"> <emitter type="area"/> </shape>'
    names = [light.name for light in load_scene(xml_scene(tmp_path, lamp, light=SKY)).lights]
    assert names[0] == "shape 'ball' (sphere)"
    assert names[1].startswith("constant (node ")
