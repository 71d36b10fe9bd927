"""What an impossible spectrum gets, in the scene file, in a file beside it, and in a material file."""

from __future__ import annotations

import pytest
from command_line import BALL, GOOD, SENSOR, CommandLine, ball, painted, scene

GREY = "400:0.5, 500:0.4, 700:0.2"

# What Fluorspar says of its fault, by the values of a spectrum.
FAULTS = {
    "not a number": (GREY.replace("0.4", "nan"), ("not a finite number", "where:", "500 nm")),
    "infinite": (GREY.replace("0.4", "inf"), ("not a finite number", "where:", "500 nm")),
    "negative": (
        GREY.replace("0.4", "-0.1"),
        ("a reflectance is negative", "500 nm", "got: -0.1", "expected: 0 to 1"),
    ),
    "above 1": (
        GREY.replace("0.4", "1.2"),
        ("greater than 1", "500 nm", "got: 1.2", "expected: 0 to 1", "fix: reflectances are fractions"),
    ),
    "elsewhere": (
        "800:0.5, 900:0.2",
        (
            "a spectrum and the wavelength grid do not overlap",
            "where:",
            "got: 400-700 nm by 20",
            "expected: a grid that meets 800-900 nm",
        ),
    ),
}
DESCENDING = "400:0.5, 700:0.4, 500:0.2"


def table(pairs: str, separator: str = " ") -> str:
    return pairs.replace(", ", "\n").replace(":", separator) + "\n"


def material_file(pairs: str) -> str:
    return f"# fluorspar-material: 1\n# name: mine\nwavelength,reflectance\n{table(pairs, ',')}"


@pytest.mark.parametrize("fault", FAULTS)
def test_in_the_scene(fluorspar: CommandLine, fault: str) -> None:
    pairs, message = FAULTS[fault]
    said = fluorspar.refuses(painted(f'value="{pairs}"'))
    assert said.says(*message)
    assert said.says("'paint' (diffuse)")


@pytest.mark.parametrize("fault", FAULTS)
def test_in_a_file_beside_the_scene(fluorspar: CommandLine, fault: str) -> None:
    pairs, message = FAULTS[fault]
    fluorspar.write("paint.spd", table(pairs))
    said = fluorspar.refuses(painted('filename="paint.spd"'))
    assert said.says(*message)
    assert said.says("'paint' (diffuse)")


@pytest.mark.parametrize("fault", FAULTS)
def test_in_a_material_file(fluorspar: CommandLine, fault: str) -> None:
    pairs, message = FAULTS[fault]
    fluorspar.write("mine.csv", material_file(pairs))
    said = fluorspar.refuses(GOOD, "--material", "ball=mine.csv")
    assert said.says(*message)
    assert said.says("where:", "mine")


def test_not_ascending(fluorspar: CommandLine) -> None:
    """The two kinds of file that Mitsuba reads it refuses by itself, without naming the wavelength."""
    inline = fluorspar.refuses(painted(f'value="{DESCENDING}"'))
    assert inline.says("where: scene.xml", "line 3", "Wavelengths must be specified in increasing order")
    fluorspar.write("paint.spd", table(DESCENDING))
    beside = fluorspar.refuses(painted('filename="paint.spd"'))
    assert beside.says("where: scene.xml", "paint.spd", "increasing order")
    fluorspar.write("mine.csv", material_file(DESCENDING))
    mine = fluorspar.refuses(GOOD, "--material", "ball=mine.csv")
    assert mine.says(
        "where: mine.csv", "the wavelengths do not ascend", "got: 700 nm, then 500 nm", "fix: sort the rows"
    )


def test_unreadable_file(fluorspar: CommandLine) -> None:
    assert fluorspar.refuses(painted('filename="paint.spd"')).says("paint.spd", "does not exist")
    fluorspar.write("paint.spd", "400 0.5\n500 half\n")
    assert fluorspar.refuses(painted('filename="paint.spd"')).says("line 2", "paint.spd", "500 half")
    fluorspar.write("mine.csv", material_file("400:0.5, 500:half"))
    said = fluorspar.refuses(GOOD, "--material", "ball=mine.csv")
    assert said.says("a cell is not a number", "where: mine.csv, line 5", "got: 'half'")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("400:1, 500:nan, 700:1", ("not a finite number", "where: 'radiance' of 'sky' (constant), 500 nm")),
        ("400:1, 500:-2, 700:1", ("light 'sky' is negative", "got: -2", "expected: 0 or more")),
        (
            "900:1, 999:1",
            ("do not overlap", "where: radiance of light 'sky'", "a grid that meets 900-999 nm"),
        ),
    ],
)
def test_of_a_light(fluorspar: CommandLine, values: str, message: tuple[str, ...]) -> None:
    sky = f'<emitter type="constant" id="sky"> <spectrum name="radiance" value="{values}"/> </emitter>'
    assert fluorspar.refuses(scene(SENSOR, sky, BALL)).says(*message)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ("emission", ("an emission spectrum is negative", "emission of BSDF 'dye'", "500 nm", "got: -1")),
        ("excitation", ("an excitation spectrum is negative", "excitation of BSDF 'dye'", "500 nm", "-1")),
    ],
)
def test_of_a_dye(fluorspar: CommandLine, part: str, message: tuple[str, ...]) -> None:
    spectra = {"emission": "400:0, 500:1, 700:0", "excitation": "400:0, 500:1, 700:0"}
    spectra[part] = spectra[part].replace("500:1", "500:-1")
    inside = " ".join(f'<spectrum name="{name}" value="{values}"/>' for name, values in spectra.items())
    said = fluorspar.refuses(ball(f'<bsdf type="fluorescent" id="dye"> {inside} </bsdf>'))
    assert said.says(*message, "expected: >= 0")


class TestEndsInsideTheGrid:
    """Never silent: which spectrum, where its data end, what is assumed there. Once, and the image is made."""

    ASSUMED = (
        "data for 450-650 nm",
        "used on 400-700 nm by 20",
        "assumed: the end value held",
        "below 450 nm (0.5)",
        "above 650 nm (0.3)",
    )

    def test_in_the_scene(self, fluorspar: CommandLine) -> None:
        done = fluorspar.render(painted('value="450:0.5, 650:0.3"'))
        assert done.code == 0
        assert done.err.count("warning:") == 1
        assert done.says("warning: BSDF 'paint' (diffuse) of shape 'ball'", *self.ASSUMED)

    def test_in_a_file_beside_the_scene(self, fluorspar: CommandLine) -> None:
        fluorspar.write("paint.spd", "450 0.5\n650 0.3\n")
        done = fluorspar.render(painted('filename="paint.spd"'))
        assert done.code == 0
        assert done.says("warning: BSDF 'paint' (diffuse) of shape 'ball'", *self.ASSUMED)

    def test_in_a_material_file(self, fluorspar: CommandLine) -> None:
        fluorspar.write("mine.csv", material_file("450:0.5, 650:0.3"))
        done = fluorspar.render(GOOD, "--material", "ball=mine.csv")
        assert done.code == 0
        assert done.err.count("warning:") == 1
        assert done.says("warning: reflectance of 'mine'", *self.ASSUMED)

    def test_of_a_light(self, fluorspar: CommandLine) -> None:
        sky = '<emitter type="constant" id="sky"> <spectrum name="radiance" value="450:0.5, 650:0.3"/> </emitter>'
        done = fluorspar.render(scene(SENSOR, sky, BALL))
        assert done.code == 0
        assert done.says("warning: radiance of light 'sky'", *self.ASSUMED[:2], "assumed: no light outside")

    def test_of_a_measured_matrix(self, fluorspar: CommandLine) -> None:
        rows = ["nm,440,480,520", "440,0.4,0,0", "480,0.1,0.4,0", "520,0.1,0.1,0.4"]
        fluorspar.write("sheet.csv", "\n".join(["# quantity: band", "# step: 40", *rows]))
        done = fluorspar.render(GOOD, "--material", "ball=sheet.csv")
        assert done.code == 0
        assert done.err.count("warning:") == 1
        assert done.says(
            "warning: sheet.csv",
            "used on 400-700 nm by 20",
            "reflectance measured for 440-520 nm (end value held outside)",
            "excitation measured for 440-520 nm (0 assumed outside)",
        )
