"""Good runs: `render` in all formats, and what the small commands print."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from command_line import GOOD, OLD, QUICK, CommandLine
from PIL import Image

import fluorspar as package
from fluorspar import COMPONENTS, SpectralImage
from fluorspar.cli.main import app
from fluorspar.image.formats.registry import SUFFIXES_WRITTEN
from fluorspar.paths.sweeping.gpu import why_not_on_gpu
from fluorspar.scene.builtin import BUILTIN


def commands(group: Any, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """Every command of the command line, those of groups too."""
    found = [path]
    for name, command in getattr(group, "commands", {}).items():
        found += commands(command, (*path, name))
    return found


class TestRender:
    def test_all_formats_and_pictures(self, fluorspar: CommandLine) -> None:
        outputs = [part for suffix in SUFFIXES_WRITTEN for part in ("-o", f"box{suffix}")]
        done = fluorspar("render", "cornell-box", *QUICK, *outputs, "--pictures", "pictures/of/box")
        assert done.code == 0
        assert done.err.splitlines() == [
            "warning: an ENVI file holds one quantity: the total was written (see --component)"
        ]
        for suffix in SUFFIXES_WRITTEN:
            assert f"wrote box{suffix}" in done.out
        with SpectralImage.open("box.nc") as image, SpectralImage.open("box.hdr") as total:
            np.testing.assert_array_equal(image.total(), total.total())
        with SpectralImage.open("box.nc") as image, SpectralImage.open("box.exr") as same:
            assert image.shape == (7, 8, 8, 16)
            assert image.attrs["spp"] == 4
            np.testing.assert_array_equal(image.dataset.radiance, same.dataset.radiance)
        with Image.open("box.png") as picture:
            assert picture.size == (8, 8)
        pictures = {path.stem for path in Path("pictures/of/box").iterdir()}
        assert pictures == {*COMPONENTS, "total", "components"}
        assert not [name for name in fluorspar.files() if name.endswith(".tmp")]

    def test_another_camera_and_lamp(self, fluorspar: CommandLine) -> None:
        """Expected: `info` says both, and what it says of the camera can be given again; `trace` takes them too."""
        fluorspar.write("scene.xml", GOOD)
        changes = ("--camera", "origin=0, 0, 4 fov=50", "--light", "sky=Ax0.5")
        assert fluorspar("render", "scene.xml", *QUICK, *changes, "-o", "a.nc").code == 0
        said = fluorspar("info", "a.nc").out
        camera = "origin=0,0,4 target=0,0,3 up=0,1,0 fov=50"
        assert re.search(rf"camera: +{camera}$", said, re.MULTILINE)
        assert "{'sky': 'A x 0.5'}" in said
        again = ("--camera", camera, "--light", "sky=Ax0.5")
        assert fluorspar("trace", "scene.xml", *QUICK, *again, "-o", "a.paths").code == 0
        assert fluorspar("relight", "a.paths", "-o", "b.nc").code == 0
        with SpectralImage.open("a.nc") as rendered, SpectralImage.open("b.nc") as relit:
            np.testing.assert_array_equal(rendered.dataset.radiance, relit.dataset.radiance)
            assert rendered.attrs["camera"] == relit.attrs["camera"]
        assert fluorspar.refuses(GOOD, "--camera", "position=0,0,4").says(
            "a camera has no 'position'", "where: the camera", "origin=X,Y,Z"
        )
        assert fluorspar.refuses(GOOD, "--light", "sun=A").says("there is no light 'sun'", "one of sky")
        fluorspar.write("old.png", "wavelength,value")
        assert fluorspar.refuses(GOOD, "--light", "sky=old.png").says("old.png")

    def test_pictures_of_one_exposure(self, fluorspar: CommandLine) -> None:
        arguments = (
            "render",
            "cornell-box",
            *QUICK,
            "-o",
            "box.png",
            "--exposure",
            "1e-3",
            "--pictures",
            "parts.v2",
        )
        done = fluorspar(*arguments)
        assert done.code == 0
        assert "wrote box.png (white is 1000 cd/m2: exposure 0.001)" in done.out
        assert Path("box.png").read_bytes() == Path("parts.v2/total.png").read_bytes()
        assert fluorspar("render", "cornell-box", *QUICK, "-o", "box.nc", *arguments[-4:]).code == 0
        assert fluorspar.refuses(GOOD, "--exposure", "0").says(
            "the exposure is not readable", "where: --exposure"
        )
        done = fluorspar("render", "cornell-box", "-o", "box.nc", "--exposure", "1")
        assert (done.code, done.says("only a picture has an exposure", "got: box.nc")) == (2, True)

    def test_replaces_old_files(self, fluorspar: CommandLine) -> None:
        assert fluorspar.render(GOOD).code == 0
        assert OLD not in fluorspar.files().values()

    def test_suffix_in_capitals(self, fluorspar: CommandLine) -> None:
        fluorspar.write("scene.xml", GOOD)
        done = fluorspar("render", "scene.xml", *QUICK, "-o", "BOX.NC", "-o", "BOX.PNG")
        assert done.code == 0
        assert {"BOX.NC", "BOX.PNG"} <= set(fluorspar.files())

    @pytest.mark.parametrize("name", BUILTIN)
    def test_built_in_scenes_warn_of_nothing(self, fluorspar: CommandLine, name: str) -> None:
        """From 300 nm on, as their tables promise; close where there is a lamp of lines."""
        wavelengths = "300:780:5" if name == "still-life" else "300:780:32"
        grid = ("--wavelengths", wavelengths, "--size", "8x8", "--spp", "1")
        done = fluorspar("render", name, *grid, "-o", "box.png")
        assert (done.code, done.err) == (0, "")

    def test_seed_decides(self, fluorspar: CommandLine) -> None:
        fluorspar.write("scene.xml", GOOD)
        for name, seed in (("a", 1), ("b", 1), ("c", 2)):
            assert fluorspar("render", "scene.xml", *QUICK, "--seed", seed, "-o", f"{name}.png").code == 0
        files = fluorspar.files()
        assert files["a.png"] == files["b.png"] != files["c.png"]

    def test_material_from_outside(self, fluorspar: CommandLine) -> None:
        assert fluorspar.render(GOOD, "--material", "ball=poster-red").code == 0
        with SpectralImage.open("old.nc") as image:
            assert float(image.component("direct_luminescence").max()) > 0
            assert "poster-red" in image.attrs["materials"]


class TestInfo:
    @pytest.mark.parametrize("name", ["old.nc", "old.exr"])
    def test_image(self, fluorspar: CommandLine, name: str) -> None:
        fluorspar.render(GOOD)
        done = fluorspar("info", name)
        assert (done.code, done.err) == (0, "")
        for part in (
            "8 x 8 pixels",
            "400-700 nm by 20, 16 bands",
            "scene.xml",
            "version:",
            package.__version__,
        ):
            assert part in done.out

    def test_scene(self, fluorspar: CommandLine) -> None:
        fluorspar.write("scene.xml", GOOD)
        assert "on ball" in fluorspar("info", "scene.xml").out
        box = fluorspar("info", "cornell-box")
        assert box.code == 0
        assert "512 x 512 pixels" in box.out
        assert "material poster-red (fluorescent): on left-wall" in box.out

    def test_material(self, fluorspar: CommandLine) -> None:
        """A summary, the peaks of it as in its table, and no list of numbers."""
        done = fluorspar("info", "poster-red")
        assert done.code == 0
        material = package.material("poster-red")
        dye = material.fluorophores[0]
        peaks = [s.wavelengths[s.values.argmax()] for s in (dye.excitation, dye.emission)]
        for part in (
            "Material 'poster-red'",
            material.description,
            material.credit,
            material.assumed,
            "300-780 nm",
            f"excitation peak {peaks[0]:g} nm, emission peak {peaks[1]:g} nm",
        ):
            assert part in done.out
        assert "array" not in done.out
        assert re.search(
            r"photon yield: +at most 0\.\d+ \(light of \d+ nm\), 0\.\d+ with what is reflected", done.out
        )
        assert re.search(r"under D65: +sRGB 255 \d+ \d+, L\*a\*b\* 7\d\.\d \d\d\.\d \d\d\.\d", done.out)

    def test_material_that_does_not_fluoresce(self, fluorspar: CommandLine) -> None:
        done = fluorspar("info", "gray-45")
        assert "0.45 everywhere" in done.out
        assert re.search(r"fluorescent: +no", done.out)
        assert "sRGB 179 179 179, L*a*b* 72.9 0.0 0.0" in done.out  # L* of Y = 0.45 is 72.89

    def test_impossible_material_is_described(self, fluorspar: CommandLine) -> None:
        """What is wrong with it is what one wants to see."""
        rows = ["400,0.1,0,0.01", "500,0.1,0,0.01", "510,0.1,2,0", "610,0.1,2,0", "700,0.1,0,0"]
        head = ["# fluorspar-material: 1", "wavelength,reflectance,emission,excitation"]
        fluorspar.write("wrong.csv", "\n".join(head + rows))
        done = fluorspar("info", "wrong.csv")
        assert done.code == 0
        told = re.search(r"at most ([\d.]+)", done.out)
        assert told
        assert float(told[1]) > 2

    def test_measured_matrix(self, fluorspar: CommandLine) -> None:
        """Its own cells count: 0.3 at 400 nm seen at 500 nm is 0.3 x 500 / 400 photons, and S is 0.4."""
        rows = [
            "# quantity: band",
            "# step: 50",
            "nm,400,450,500",
            "400,0.4,0,0",
            "450,0,0.5,0",
            "500,0.3,0,0.6",
        ]
        fluorspar.write("sheet.csv", "\n".join(rows))
        done = fluorspar("info", "sheet.csv")
        assert "excitation 400-500 nm, emission 400-500 nm by 50, peak 400 nm to 500 nm" in done.out
        assert "at most 0.375 (light of 400 nm), 0.775 with what is reflected (light of 400 nm)" in done.out

    def test_mixture(self, fluorspar: CommandLine) -> None:
        done = fluorspar("info", "poster-red:0.5,gray-45:0.5")
        assert done.code == 0
        assert "Material 'poster-red:0.5,gray-45:0.5'" in done.out

    @pytest.mark.parametrize(
        ("name", "message"),
        [
            ("none.nc", ("does not exist", "where: none.nc")),
            ("none.xml", ("the scene file does not exist", "where: none.xml", "fix:")),
            ("none.csv", ("the material file does not exist", "where: none.csv", "fix:")),
            (
                "poster-rad",
                ("there is no such material", "got: 'poster-rad'", "fix: did you mean poster-red"),
            ),
            ("old.nc", ("old.nc",)),
            ("old.exr", ("old.exr",)),
            (
                "notes.txt",
                ("not an image, a scene or a material", "expected: .nc, .exr, .hdr, .zarr, .xml, .csv, .bfc"),
            ),
            (
                "old.png",
                ("a picture holds red, green and blue, no spectra", "where: old.png", ".nc, .exr, .hdr"),
            ),
        ],
    )
    def test_nothing_of_the_kind(self, fluorspar: CommandLine, name: str, message: tuple[str, ...]) -> None:
        fluorspar.write("notes.txt", "wavelength,reflectance\n300,0.5\n780,0.5")
        done = fluorspar("info", name)
        assert done.code == 2
        assert done.says("error: ", *message)
        assert "Traceback" not in done.err


def test_scenes(fluorspar: CommandLine) -> None:
    done = fluorspar("scenes")
    assert done.code == 0
    assert [line.split()[0] for line in done.out.splitlines()] == list(BUILTIN)
    files = [line.split(maxsplit=1)[1] for line in fluorspar("scenes", "--paths").out.splitlines()]
    assert all(Path(file).is_file() for file in files)


def test_materials_list(fluorspar: CommandLine) -> None:
    done = fluorspar("materials", "list")
    assert (done.code, done.err) == (0, "")
    assert all(name in done.out for name in package.materials())


def test_materials_of_the_user(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    fluorspar.write("mine.csv", "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,0.5\n")
    monkeypatch.setenv("FLUORSPAR_MATERIALS", str(fluorspar.folder))
    (fluorspar.folder / "old.nc").unlink()
    assert "mine" in fluorspar("materials", "list").out


def test_doctor(fluorspar: CommandLine) -> None:
    """Where this suite runs, rendering works; each variant is tried in a process of its own."""
    done = fluorspar("doctor")
    assert done.code == 0
    facts = dict(re.findall(r"^(\S+(?: \S+)?)\s{2,}(.*)$", done.out, re.MULTILINE))
    assert facts["fluorspar"] == package.__version__
    assert facts["cores"].split()[0].isdigit()
    assert "LLVM" in facts["LLVM library"]
    assert re.fullmatch(r"works, with LLVM \d+\..*", facts["llvm_ad_mono"])
    assert facts["scalar_spectral"] == "works"
    assert facts["cuda_ad_mono"].startswith(("works", "does not work: "))
    assert facts["OptiX"].startswith(("found", "not found: libnvoptix.so.1"))
    assert facts["GPU sweep"] == (why_not_on_gpu() or "works")
    assert facts["numba-cuda"] == "not installed" or "numba-cuda is missing" not in facts["GPU sweep"]


@pytest.mark.parametrize("command", commands(typer.main.get_command(app)), ids=" ".join)
def test_help_shows_an_example(fluorspar: CommandLine, command: tuple[str, ...]) -> None:
    done = fluorspar(*command, "--help")
    assert done.code == 0
    assert "Example" in done.out
    assert re.search(rf"^ *(Example: +)?fluorspar {' '.join(command)}", done.out, re.MULTILINE)


def test_a_fault_of_our_own_has_an_exit_code_of_its_own(
    fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not 1, which `compare --fail-above` gives beyond a limit; with the traceback, for the report."""

    def broken(*arguments: object, **options: object) -> None:
        raise ZeroDivisionError("nobody thought of this")

    monkeypatch.setattr("fluorspar.comparing.compare.compare", broken)
    done = fluorspar("compare", "old.nc", "old.nc", "--fail-above", "rmse=1")
    assert done.code == 70
    assert done.says("Traceback", "in broken", "nobody thought of this", "error: a fault of Fluorspar itself")


def test_help_lists_the_exit_codes(fluorspar: CommandLine) -> None:
    said = " ".join(fluorspar("--help").out.split())
    for code in ("0 done", "1 a limit", "2 an error in the input", "70 a fault", "130 interrupted"):
        assert code in said


def test_version(fluorspar: CommandLine) -> None:
    done = fluorspar("--version")
    assert (done.code, done.out.strip()) == (0, f"fluorspar {package.__version__}")


class TestAsAModule:
    """`python -m fluorspar`, for those who have no script on the path."""

    def run(self, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "fluorspar", *arguments],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )

    def test_renders(self, fluorspar: CommandLine) -> None:
        done = self.run(fluorspar.folder, "render", "furnace", *QUICK, "-o", "old.nc")
        assert (done.returncode, done.stderr) == (0, "")
        with SpectralImage.open(fluorspar.folder / "old.nc") as image:
            assert image.shape == (7, 8, 8, 16)

    def test_refuses(self, fluorspar: CommandLine) -> None:
        done = self.run(fluorspar.folder, "render", "no-such.xml", "-o", "old.nc")
        assert done.returncode == 2
        assert done.stderr.startswith("error: the scene file does not exist\n  where:    no-such.xml\n")
        assert set(fluorspar.files().values()) == {OLD}

    def test_without_a_command_shows_the_help(self, fluorspar: CommandLine) -> None:
        done = self.run(fluorspar.folder)
        assert "Example:  fluorspar render cornell-box" in done.stdout + done.stderr
