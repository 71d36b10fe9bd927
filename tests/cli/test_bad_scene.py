"""What a bad scene file gets: a message that says what, where and how to mend it, exit code 2, no file touched."""

from __future__ import annotations

import pytest
from command_line import BALL, OLD, SENSOR, SKY, CommandLine, ball, painted, scene

from fluorspar import SpectralImage

GLOSSY = ball('<bsdf type="roughconductor" id="brass"/>')


def test_missing_file(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(None)
    assert said.says(
        "the scene file does not exist",
        "where: scene.xml",
        "expected: a Mitsuba 3 XML file, or the name of a built-in scene",
        "fix: check the path; 'fluorspar scenes' lists",
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<scene>", "line 1"),
        ("no xml at all", "line 1"),
        ('<scene version="3.0.0"> <shape type="sphere"> </scene>', "line 1"),
        (scene(SENSOR, SKY, BALL, '<bsdf type="diffuse"> <spectrum value="0.5" </bsdf>'), "line 3"),
    ],
)
def test_malformed(fluorspar: CommandLine, text: str, reason: str) -> None:
    said = fluorspar.refuses(text)
    assert said.says(
        "cannot read the scene", "where: scene.xml", "got:", reason, "expected: a valid Mitsuba 3 scene"
    )


def test_unknown_plugin(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(scene(SENSOR, SKY, '<shape type="no-such-shape" id="thing"/>'))
    assert said.says("no-such-shape")


def test_missing_mesh(fluorspar: CommandLine) -> None:
    mesh = '<shape type="obj" id="chair"> <string name="filename" value="no-such.obj"/> </shape>'
    assert fluorspar.refuses(scene(SENSOR, SKY, mesh)).says(
        "the file of a shape does not exist", "no-such.obj"
    )


def test_no_light(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(scene(SENSOR, BALL))
    assert said.says(
        "the scene has no light", "expected: an emitter, one of area", "fix: add an emitter to the scene"
    )


def test_unknown_light(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(scene(SENSOR, '<emitter type="sunsky" id="noon"/>', BALL))
    assert said.says(
        "light 'sunsky' is not supported", "where: light 'noon'", "expected: one of area", "or use --matte"
    )


def test_no_camera(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(scene(SKY, BALL))
    assert said.says(
        "the scene has no camera", "expected: a sensor, one of perspective", "fix: add a sensor to the scene"
    )


def test_unknown_camera(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(scene(SENSOR.replace('"perspective"', '"irradiancemeter"'), SKY, BALL))
    assert said.says("sensor 'irradiancemeter' is not supported", "expected: one of perspective")


def test_unsupported_surface(fluorspar: CommandLine) -> None:
    """It is named, with the shape it is on, and there is advice."""
    said = fluorspar.refuses(ball('<bsdf type="pplastic" id="brass"/>'))
    assert said.says("BSDF 'pplastic'", "where:", "'brass' (pplastic) of shape 'ball'", "fix: did you mean")


def test_unsupported_texture(fluorspar: CommandLine) -> None:
    texture = '<texture type="checkerboard" name="eta"/> <spectrum name="k" value="1"/>'
    said = fluorspar.refuses(ball(f'<bsdf type="roughconductor" id="tiles"> {texture} </bsdf>'))
    assert said.says("'checkerboard' varies over the surface", "eta of BSDF 'tiles' (roughconductor)")


def test_matte_renders_it_with_a_warning(fluorspar: CommandLine) -> None:
    done = fluorspar.render(GLOSSY, "--matte")
    assert done.code == 0
    assert done.err.count("warning:") == 1
    assert done.says("warning: BSDF 'brass' (roughconductor) of shape 'ball'", "average reflectance")
    assert SpectralImage.open("old.exr").component("direct_reflection").max() > 0
    assert OLD not in fluorspar.files().values()


def test_error_inside_a_surface_names_the_shape(fluorspar: CommandLine) -> None:
    assert fluorspar.refuses(painted('value="-0.1"')).says("negative", "'paint' (diffuse) of shape 'ball'")


def test_participating_medium(fluorspar: CommandLine) -> None:
    fog = '<shape type="cube" id="fog"> <medium type="homogeneous" name="interior"/> </shape>'
    assert fluorspar.refuses(scene(SENSOR, SKY, fog)).says(
        "participating media are not supported", "expected: surfaces only"
    )
