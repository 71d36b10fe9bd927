"""`fluorspar trace`, `relight` and `sheet`: what they write is what the Python functions give."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from command_line import GOOD, QUICK, CommandLine, ball, painted, stop_at

import fluorspar as package
from fluorspar import SpectralImage
from fluorspar.cli.changes import light_of, split_materials
from fluorspar.paths.chunks import CHUNK
from fluorspar.sheets.sheet_picture import write_sheet_picture
from fluorspar.sheets.sheet_table import write_sheet_table

DYED = ball('<bsdf type="fluorescent" id="paint"> <string name="material" value="poster-red"/> </bsdf>')
LAMP = "wavelength,value\n300,1\n780,2\n"
MATERIAL = "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,0.5\n"


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of light paths: a ball of a fluorescent paint under an even sky."""
    folder = tmp_path_factory.mktemp("traced")
    (folder / "scene.xml").write_text(DYED)
    package.trace(
        folder / "scene.xml", size=(8, 8), spp=4, wavelengths="400:700:20", output=folder / "box.paths"
    )
    return folder / "box.paths"


@pytest.fixture
def box(traced: Path, fluorspar: CommandLine) -> Path:
    """A copy of that file in the folder of the command line."""
    return Path(shutil.copy(traced, fluorspar.folder / "box.paths"))


def same(a: str, b: SpectralImage) -> bool:
    with SpectralImage.open(a) as image:
        return image.dataset.drop_attrs().identical(b.dataset.drop_attrs())


class TestTrace:
    def test_image_is_that_of_render(self, fluorspar: CommandLine) -> None:
        fluorspar.write("scene.xml", DYED)
        options = (*QUICK, "--seed", "3", "--material", "paint=poster-orange", "--max-depth", "3")
        assert fluorspar("render", "scene.xml", *options, "-o", "direct.nc").code == 0
        done = fluorspar("trace", "scene.xml", *options, "-o", "box.paths")
        assert (done.code, done.err) == (0, "")
        assert "8 x 8 pixels, 4 samples, seed 3" in done.out
        assert "wrote box.paths" in done.out
        assert fluorspar("relight", "box.paths", "-o", "kept.nc").code == 0
        with SpectralImage.open("direct.nc") as direct:
            assert same("kept.nc", direct)

    def test_other_kinds_of_files(self, fluorspar: CommandLine) -> None:
        fluorspar.write("scene.xml", GOOD)
        done = fluorspar("trace", "scene.xml", *QUICK, "-o", "box.nc")
        assert done.code == 2
        assert done.says("this kind of file cannot be written", "got: box.nc", "expected: .paths")

    def test_over_the_scene(self, fluorspar: CommandLine) -> None:
        fluorspar.write("scene.paths", GOOD)
        before = fluorspar.files()
        done = fluorspar("trace", "scene.paths", *QUICK, "-o", "scene.paths")
        assert done.code == 2
        assert done.says("the file to write is one that is read")
        assert fluorspar.files() == before

    def test_interrupted(self, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 16 * 4)
        fluorspar.write("scene.xml", GOOD)
        assert fluorspar("render", "scene.xml", *QUICK, "-o", "whole.nc").code == 0
        stop_at(32, monkeypatch)
        done = fluorspar("trace", "scene.xml", *QUICK, "-o", "box.paths")
        assert done.code == 130
        assert done.says("interrupted: the paths of 32 of 64 pixels are kept")
        monkeypatch.undo()
        monkeypatch.chdir(fluorspar.folder)
        image = package.load_paths("box.paths").image()
        with SpectralImage.open("whole.nc") as whole:
            np.testing.assert_array_equal(image.total()[:4], whole.total()[:4])
        assert np.isnan(image.total()[4:]).all()
        done = fluorspar("relight", "box.paths", "-o", "a.nc")
        assert done.code == 2
        assert done.says("box.paths holds the paths of 32 of 64 pixels, the others are NaN", "--resume")
        assert same("a.nc", image)
        stop_at(16, monkeypatch)
        assert fluorspar("relight", "box.paths", "-o", "b.nc").code == 130


class TestRelight:
    @pytest.mark.parametrize(
        ("options", "arguments"),
        [
            (("--light", "sky=FL11"), {"lights": {"sky": "FL11"}}),
            (("--light", "sky=0.5"), {"lights": {"sky": 0.5}}),
            (("--light", "sky=Ax0.5"), {"lights": {"sky": ("A", 0.5)}}),
            (("--light", "sky=lamp.csv"), {"lights": {"sky": "lamp.csv"}}),
            (
                ("--light", "sky=lamp.csvx2", "--same-luminance"),
                {"lights": {"sky": ("lamp.csv", 2)}, "same_luminance": True},
            ),
            (
                ("--material", "ball=poster-green:0.4,mine:0.6", "--library", "lib"),
                {"materials": {"ball": "poster-green:0.4,mine:0.6"}, "library": ["lib"]},
            ),
            (("--concentration", "paint=0.25"), {"concentration": {"paint": 0.25}}),
            (
                ("--wavelengths", "380:700:40", "--excitation", "grid", "--stokes", "strict"),
                {"wavelengths": "380:700:40", "excitation": "grid", "stokes": "strict"},
            ),
            (("--component-errors", "--threads", "1"), {"component_errors": True, "threads": 1}),
        ],
    )
    @pytest.mark.filterwarnings("ignore::fluorspar.errors.FluorsparWarning")
    def test_the_same_as_image(
        self, box: Path, fluorspar: CommandLine, options: tuple[str, ...], arguments: dict[str, Any]
    ) -> None:
        fluorspar.write("lamp.csv", LAMP)
        (fluorspar.folder / "lib").mkdir()
        fluorspar.write("lib/mine.csv", MATERIAL)
        done = fluorspar("relight", box.name, *options, "-o", "new.nc", "-o", "new.png", "--pictures", "all")
        assert done.code == 0, done.err
        assert Path("all/total.png").is_file()
        assert same("new.nc", package.load_paths(box).image(**arguments))

    def test_says_what_was_changed(self, box: Path, fluorspar: CommandLine) -> None:
        fluorspar("relight", box.name, "--light", "sky=Ax0.5", "-o", "new.nc")
        with SpectralImage.open("new.nc") as image:
            assert image.attrs["relit"] == {"lights": {"sky": "A x 0.5"}}


SHEET = ("--light", "sky=D65,0.5,A,Ax0.5", "--material", "ball=poster-red,poster-red:0.5,poster-green:0.5")
SETTINGS: dict[str, Any] = {
    "lights": {"sky": ["D65", 0.5, "A", ("A", 0.5)]},
    "materials": {"ball": ["poster-red", "poster-red:0.5,poster-green:0.5"]},
}


class TestSheet:
    @pytest.mark.parametrize("exposure", ["same", "each", "0.0001"])
    def test_the_same_as_python(self, box: Path, fluorspar: CommandLine, exposure: str) -> None:
        fluorspar.write("points.csv", "point,x,y\nedge,2,4\nmiddle,4,4\n")
        more = ("--points", "points.csv", "--aperture", "1px", "--white", "middle", "--exposure", exposure)
        done = fluorspar("sheet", box.name, *SHEET, *more, "-o", "sheet.png", "-o", "table.csv")
        assert (done.code, done.err) == (0, "")
        assert "8 combinations on 400-700 nm by 20" in done.out
        expected = package.sheet(
            box,
            **SETTINGS,
            points="points.csv",
            aperture="1px",
            white="middle",
            exposure=float(exposure) if exposure[0] == "0" else exposure,
        )
        write_sheet_picture(expected, "expected.png")
        write_sheet_table(expected, "expected.csv")
        assert Path("sheet.png").read_bytes() == Path("expected.png").read_bytes()
        assert Path("table.csv").read_bytes() == Path("expected.csv").read_bytes()

    def test_an_option_that_is_repeated_adds_to_its_list(self, box: Path, fluorspar: CommandLine) -> None:
        one = fluorspar("sheet", box.name, "--light", "sky=A,D65", "-o", "one.csv")
        two = fluorspar("sheet", box.name, "--light", "sky=A", "--light", "sky=D65", "-o", "two.csv")
        assert one.code == two.code == 0
        assert Path("one.csv").read_bytes() == Path("two.csv").read_bytes()

    def test_many_are_refused_without_a_terminal(self, box: Path, fluorspar: CommandLine) -> None:
        hundred = ",".join(f"{n}" for n in range(1, 101))
        many = ("--light", f"sky={hundred}", "--concentration", f"ball={hundred}")
        done = fluorspar("sheet", box.name, *many, "-o", "sheet.png")
        assert done.code == 2
        assert done.says("these are 10000 combinations", "expected: at most 64", "--yes")
        assert not Path("sheet.png").exists()

    @pytest.mark.parametrize(("answer", "code"), [("y", 0), ("n", 130), ("", 130)])
    def test_many_are_asked_for_on_a_terminal(
        self, box: Path, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch, answer: str, code: int
    ) -> None:
        import io

        terminal = io.StringIO(f"{answer}\n")
        monkeypatch.setattr(terminal, "isatty", lambda: True)
        monkeypatch.setattr(sys, "stdin", terminal)
        many = ",".join(f"{n}" for n in range(1, 66))
        done = fluorspar("sheet", box.name, "--light", f"sky={many}", "-o", "table.csv")
        assert done.code == code
        assert done.says("Compute 65 combinations?")
        assert Path("table.csv").exists() == (code == 0)

    def test_many_with_yes(self, box: Path, fluorspar: CommandLine) -> None:
        many = ",".join(f"{n}" for n in range(1, 66))
        done = fluorspar("sheet", box.name, "--light", f"sky={many}", "--yes", "-o", "table.csv")
        assert (done.code, done.err) == (0, "")

    def test_interrupted(self, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 16 * 4)
        fluorspar.write("scene.xml", GOOD)
        assert fluorspar("trace", "scene.xml", *QUICK, "-o", "box.paths").code == 0
        stop_at(64 + 32, monkeypatch)
        done = fluorspar("sheet", "box.paths", "--light", "sky=A,D65", "-o", "table.csv")
        assert (done.code, done.err) == (130, "error: interrupted\n")
        assert not Path("table.csv").exists()


def damaged(box: Path) -> None:
    box.write_bytes(box.read_bytes()[: box.stat().st_size // 2])


def of_another_version(box: Path) -> None:
    with h5py.File(box, "r+") as file:
        file.attrs["format_version"] = 99


def flipped(box: Path) -> None:
    with h5py.File(box, "r+") as file:
        numbers = next(iter(file["chunks"].values()))["numbers"]
        numbers[0] = numbers[0] + 1


@pytest.mark.parametrize("command", [("relight", "--light", "sky=A"), ("sheet", "--light", "sky=A,D65")])
class TestBadInput:
    @pytest.mark.parametrize(
        ("spoil", "says"),
        [
            (damaged, ("is damaged", "where:", "box.paths")),
            (of_another_version, ("of another version", "got: version 99", "expected: version 2")),
            (flipped, ("are damaged", "a checksum is wrong", "fix: trace the scene again")),
            (Path.unlink, ("there is no such file", "where:", "box.paths")),
            (lambda box: box.write_text(GOOD), ("holds no light paths", "expected: a file written by")),
        ],
    )
    def test_files(
        self, box: Path, fluorspar: CommandLine, command: tuple[str, ...], spoil: Any, says: tuple[str, ...]
    ) -> None:
        spoil(box)
        refused(fluorspar, command, (), says)

    @pytest.mark.parametrize(
        ("options", "says"),
        [
            (("--light", "lamp=A"), ("there is no light 'lamp'", "expected: one of sky")),
            (("--light", "sky=FL99x2"), ("no such illuminant", "got: 'FL99'", "fix: did you mean")),
            (("--light", "sky"), ("an option is not readable", "where: --light", "got: sky")),
            (("--light", "sky=-1"), ("factor of light 'sky' is impossible", "got: -1.0")),
            (("--light", "sky=nan"), ("factor of light 'sky' is impossible", "got: nan")),
            (("--light", "sky=lost.csv"), ("lost.csv",)),
            (
                ("--material", "bal=poster-red"),
                ("there is no shape or BSDF 'bal'", "one of ball, paint", "mean ball"),
            ),
            (("--material", "ball=poster-rde"), ("there is no such material", "did you mean poster-red")),
            (("--concentration", "ball=much"), ("a concentration is not a number", "got: much")),
            (("--concentration", "ball=-1"), ("concentration of 'ball' is impossible", "got: -1.0")),
        ],
    )
    def test_changes(
        self,
        box: Path,
        fluorspar: CommandLine,
        command: tuple[str, ...],
        options: tuple[str, ...],
        says: tuple[str, ...],
    ) -> None:
        refused(fluorspar, command[:1], options, says)

    def test_a_material_that_cannot_be_exchanged(
        self, fluorspar: CommandLine, command: tuple[str, ...]
    ) -> None:
        metal = '<bsdf type="roughconductor"> <string name="material" value="Au"/> </bsdf>'
        fluorspar.write("scene.xml", ball(metal))
        assert fluorspar("trace", "scene.xml", *QUICK, "-o", "box.paths").code == 0
        says = ("the material of 'ball' cannot be exchanged", "metal")
        refused(fluorspar, command[:1], ("--material", "ball=poster-red"), says)


@pytest.mark.parametrize("target", ["lamp.csv", "mine.csv", "lib/other.csv", "points.csv"])
def test_output_is_input(box: Path, fluorspar: CommandLine, target: str) -> None:
    (fluorspar.folder / "lib").mkdir()
    fluorspar.write("lamp.csv", LAMP)
    fluorspar.write("points.csv", "point,x,y\n1,4,4\n")
    for name in ("mine.csv", "lib/other.csv"):
        fluorspar.write(name, MATERIAL)
    options = ("--light", "sky=A,lamp.csvx2", "--material", "ball=poster-red,mine.csv:0.5,other:0.5")
    options = (*options, "--library", "lib", "--points", "points.csv", "-o", target)
    refused(fluorspar, ("sheet",), options, ("the file to write is one that is read",))


def test_no_combinations(box: Path, fluorspar: CommandLine) -> None:
    refused(fluorspar, ("sheet",), (), ("there is nothing to combine", "fix: give some, such as --light"))


def test_an_empty_place(box: Path, fluorspar: CommandLine) -> None:
    refused(
        fluorspar, ("sheet",), ("--light", "sky=A,,D65"), ("a list has an empty place", "got: sky=A,,D65")
    )


def test_a_light_that_is_given_twice(box: Path, fluorspar: CommandLine) -> None:
    """Which of the two is meant?"""
    options = ("--light", "sky=A", "--light", "sky=0.5")
    refused(fluorspar, ("relight",), options, ("a key is given twice", "got: sky=A and sky=0.5"))


@pytest.mark.parametrize("command", ["render", "trace"])
def test_a_material_that_is_given_twice(fluorspar: CommandLine, command: str) -> None:
    fluorspar.write("scene.xml", painted('value="0.5"'))
    twice = ("--material", "paint=poster-red", "--material", "paint=poster-green")
    done = fluorspar(command, "scene.xml", *twice, "-o", "box.nc" if command == "render" else "box.paths")
    assert done.code == 2
    assert done.says("a key is given twice", "where: --material")


@pytest.mark.parametrize(
    ("text", "light"),
    [
        ("D65", "D65"),
        ("E", "E"),
        ("1e-3", 1e-3),
        ("FL3.1x2", ("FL3.1", 2.0)),
        ("lamp2x4.csv", "lamp2x4.csv"),
        ("box", "box"),
        ("twice.x2", "twice.x2"),
        ("twice.x2x3", ("twice.x2", 3.0)),
        ("Ax1.2.3", "Ax1.2.3"),
    ],
)
def test_lights_and_factors(text: str, light: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file whose name ends like a factor is that file."""
    monkeypatch.chdir(tmp_path)
    Path("twice.x2").write_text(LAMP)
    assert light_of(text) == light


@pytest.mark.parametrize(
    ("text", "materials"),
    [
        ("a,b", ["a", "b"]),
        ("a:0.3,b:0.7", ["a:0.3,b:0.7"]),
        ("a:0.3, b:0.7,c", ["a:0.3,b:0.7", "c"]),
        ("c,a:0.25,b:0.25,d:0.5,a:1", ["c", "a:0.25,b:0.25,d:0.5", "a:1"]),
        ("a:0.3,c,b:0.7", ["a:0.3", "c", "b:0.7"]),  # no mixtures, as `material` then says
        ("one,two.csv", ["one,two.csv"]),
        ("a" * 300, ["a" * 300]),
    ],
)
def test_mixtures_hold_commas(
    text: str, materials: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("one,two.csv").write_text(MATERIAL)
    assert split_materials(text) == materials


def refused(
    fluorspar: CommandLine, command: tuple[str, ...], options: tuple[str, ...], says: tuple[str, ...]
) -> None:
    """Check that it ends with exit code 2 and one message, and that every file is as it was."""
    before = fluorspar.files()
    output = () if "-o" in options else ("-o", "new.png")
    done = fluorspar(command[0], "box.paths", *command[1:], *options, *output)
    assert (done.code, done.out) == (2, ""), done
    assert done.err.count("error: ") == 1
    assert done.says(*says), done.err
    assert fluorspar.files() == before
