"""`measure`, `compare` and `convert`: what they print and write, their exit codes, and what bad input gets."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import OLD, CommandLine
from PIL import Image, ImageCms

import fluorspar
from fluorspar import SpectralImage, Wavelengths, errors
from fluorspar.measuring.point_spectra import read_point_spectra

GRID = Wavelengths(400, 700, 20)
POINTS = "point,x,y,white\nleft,2,3,0.85\nright,9,4,\n"


def image(factor: float = 1.0, size: tuple[int, int] = (8, 12), grid: Wavelengths = GRID) -> SpectralImage:
    """Light in the components 1 and 2, random but the same for every factor, with standard errors."""
    radiance = np.zeros((7, *size, len(grid)))
    radiance[1:3] = factor * (0.1 + np.random.default_rng(1).random((2, *size, len(grid))))
    return SpectralImage.from_arrays(radiance, grid, 0.01 * radiance.sum(axis=0), {"scene": "room.xml"})


@pytest.fixture
def files(fluorspar: CommandLine) -> CommandLine:
    """A folder with two images, one twice as bright as the other, and two points in them."""
    image().save("a.nc")
    image(2.0).save("b.exr")
    fluorspar.write("points.csv", POINTS)
    return fluorspar


class TestMeasure:
    def test_spectra_and_a_figure(self, files: CommandLine) -> None:
        done = files("measure", "a.nc", "points.csv", "--aperture", "1px", "-o", "s.csv", "-o", "s.png")
        assert (done.code, done.err) == (0, "")
        assert "illuminance" in done.out
        spectra = read_point_spectra("s.csv")
        np.testing.assert_allclose(spectra.at("left"), image().total()[3, 2], rtol=1e-6)
        with Image.open("s.png") as figure:
            assert figure.width > 1000

    def test_it_is_the_function_of_that_name(self, files: CommandLine) -> None:
        assert files("measure", "a.nc", "points.csv", "--aperture", "3px", "-o", "s.csv").code == 0
        spectra = fluorspar.measure("a.nc", "points.csv", aperture="3px")
        np.testing.assert_array_equal(read_point_spectra("s.csv").radiance, spectra.radiance)
        assert spectra.title == "a.nc"

    def test_normalised_at_a_point(self, files: CommandLine) -> None:
        arguments = ("--aperture", "1px", "-o", "s.csv", "--normalise", "left")
        assert files("measure", "a.nc", "points.csv", *arguments).code == 0
        assert read_point_spectra("s.csv").at("left").mean() == pytest.approx(1)

    def test_no_candela_without_radiance(self, files: CommandLine) -> None:
        other = image()
        other.dataset.attrs["unit"] = "mW.cm^-2.sr^-1"
        other.save("c.nc")
        done = files("measure", "c.nc", "points.csv", "--aperture", "1px")
        assert done.code == 0
        assert "luminance, relative" in done.out
        assert "cd/m2" not in done.out
        assert f"{np.pi / 0.85 * image().luminance().values[3, 2]:.5g}" not in done.out

    def test_what_a_bandwidth_assumes_is_said(self, files: CommandLine) -> None:
        done = files("measure", "a.nc", "points.csv", "--aperture", "1px", "--bandwidth", "30")
        assert "the data are continued by point reflection" in done.out

    def test_values_for_a_scene_file(self, files: CommandLine) -> None:
        """The built-in box, rendered with a value of its own, names no built-in: it has to be said."""
        for command in (
            ("measure", "a.nc", "points.csv"),
            ("compare", "a.nc", "b.exr", "--points", "points.csv"),
        ):
            done = files(*command, "-D", "mesh=body.ply")
            assert done.code == 2
            assert done.says("values for a scene file are given without the scene", "--scene")
            done = files(*command, "--scene", "cornell-mesh", "-D", "mesh=body.ply")
            assert done.code == 2
            assert done.says("body.ply")

    @pytest.mark.parametrize(
        ("points", "said"),
        [
            ("point,x,y\n1,12,3\n", "a point is outside the image"),
            ("point,x,y,colour\n1,2,3,red\n", "unknown: colour"),
            ("point,x,y,z\n1,2,3,4\n", "the scene is needed"),
            ("name,x,y\n1,2,3\n", "unknown: name; missing: point"),
            ("1,2,3\n2,4,3\n", "write the names of the columns above the first point"),
            ("point,x,y,white\n1,2,3,85\n", "85 % is 0.85"),
        ],
    )
    def test_bad_points(self, files: CommandLine, points: str, said: str) -> None:
        files.write("points.csv", points)
        before = files.files()
        done = files("measure", "a.nc", "points.csv", "-o", "old.png")
        assert done.code == 2
        assert done.says(said)
        assert files.files() == before

    def test_image_and_points_in_the_wrong_order(self, files: CommandLine) -> None:
        done = files("measure", "points.csv", "a.nc")
        assert done.code == 2
        assert done.says("in the wrong order", "fluorspar measure IMAGE POINTS")

    @pytest.mark.parametrize(("suffix", "start"), [(".pdf", b"%PDF"), (".svg", b"<?xml")])
    def test_vector_figures(self, files: CommandLine, suffix: str, start: bytes) -> None:
        done = files("measure", "a.nc", "points.csv", "--aperture", "1px", "-o", f"s{suffix}")
        assert (done.code, done.err) == (0, "")
        done = files("compare", "a.nc", "b.exr", "--points", "points.csv", "-o", f"c{suffix}")
        assert (done.code, done.err) == (0, "")
        assert all(Path(f"{name}{suffix}").read_bytes().startswith(start) for name in "sc")

    def test_chromaticities_by_an_observer(self, files: CommandLine) -> None:
        """x and y by hand: of XYZ of the pixel, X and Y over the sum of all three."""
        name = "CIE 2015 10 Degree Standard Observer"
        xyz = image().xyz(observer=name).values[3, 2]
        done = files("measure", "a.nc", "points.csv", "--aperture", "1px", "--observer", name.lower())
        assert f"{xyz[0] / xyz.sum():.4f}  {xyz[1] / xyz.sum():.4f}" in done.out
        assert f"{image().luminance().values[3, 2]:.5g}" in done.out  # that stays CIE 1931

    def test_luminance_in_capitals(self, files: CommandLine) -> None:
        for word in ("luminance", "LUMINANCE"):
            arguments = ("--aperture", "1px", "--normalise", word, "-o", f"{word}.csv")
            assert files("measure", "a.nc", "points.csv", *arguments).code == 0
        assert Path("luminance.csv").read_bytes() == Path("LUMINANCE.csv").read_bytes()

    def test_a_reference_that_is_almost_one_of_the_points(self, files: CommandLine) -> None:
        done = files("measure", "a.nc", "points.csv", "--aperture", "1px", "--normalise", "LEFT")
        assert done.says("there is no such point", "did you mean left?")


class TestCompare:
    def test_help_names_both_arguments(self, files: CommandLine) -> None:
        """As the help below and the results call them; some versions of typer put braces around."""
        assert re.search(r"\[OPTIONS\] (A B|\{A\} \{B\})\n", files("compare", "--help").out)

    def test_an_image_with_itself(self, files: CommandLine) -> None:
        done = files("compare", "a.nc", "a.nc", "--fail-above", "rmse=0", "--fail-above", "de00_max=0")
        assert (done.code, done.err) == (0, "")

    def test_reports_have_the_same_numbers(self, files: CommandLine) -> None:
        outputs = ("-o", "r.json", "-o", "r.html", "-o", "r.png")
        assert files("compare", "a.nc", "b.exr", *outputs).code == 0
        numbers = json.loads((files.folder / "r.json").read_text())
        assert numbers["images"]["bias"] == pytest.approx(1.0)
        assert f"{numbers['images']['rmse']:.4g}" in (files.folder / "r.html").read_text()

    def test_matched_at_a_point_twice_as_bright_is_the_same(self, files: CommandLine) -> None:
        arguments = ("--points", "points.csv", "--aperture", "1px", "--match", "left")
        done = files("compare", "a.nc", "b.exr", *arguments, "--fail-above", "rmse=1e-5")
        assert done.code == 0
        assert "2 points" in done.out

    def test_beyond_a_limit_the_exit_code_is_1_and_the_report_is_there(self, files: CommandLine) -> None:
        done = files("compare", "a.nc", "b.exr", "--fail-above", "rmse=0.05", "-o", "r.json")
        assert done.code == 1
        assert done.says("rmse is", "above 0.05")
        assert (files.folder / "r.json").exists()

    @pytest.mark.parametrize(("limit", "code"), [("10", 0), ("0.05", 1)])
    def test_a_reader_that_goes_away_loses_no_file_and_no_exit_code(
        self, files: CommandLine, limit: str, code: int
    ) -> None:
        command = [
            sys.executable,
            "-c",
            "from fluorspar.cli.main import main; main()",
            "compare",
            "a.nc",
            "b.exr",
        ]
        reading, writing = os.pipe()
        os.close(reading)
        done = subprocess.run(
            [*command, "--fail-above", f"rmse={limit}", "-o", "r.json", "-o", "r.html"],
            env=os.environ | {"PYTHONPATH": str(Path(errors.__file__).parents[1])},
            stdout=writing,
            stderr=subprocess.PIPE,
            check=False,
        )
        os.close(writing)
        assert done.returncode == code
        assert b"Traceback" not in done.stderr
        assert b"Exception" not in done.stderr
        assert (files.folder / "r.json").exists()
        assert (files.folder / "r.html").exists()

    def test_it_is_the_function_of_that_name(self, files: CommandLine) -> None:
        arguments = ("--points", "points.csv", "--aperture", "1px", "--match", "left", "-o", "r.json")
        assert files("compare", "a.nc", "b.exr", *arguments).code == 0
        comparison = fluorspar.compare("a.nc", "b.exr", points="points.csv", aperture="1px", match="left")
        assert (files.folder / "r.json").read_text(encoding="utf-8") == comparison.to_json()

    def test_a_limit_on_equation_14(self, files: CommandLine) -> None:
        arguments = ("compare", "a.nc", "b.exr", "--fail-above", "rmse_eq14=1e-5")
        at_a_point = ("--points", "points.csv", "--aperture", "1px", "--match", "left")
        done = files(*arguments, *at_a_point)
        assert done.code == 0
        assert "RMSE, Eq. 14" in done.out
        done = files(*arguments)
        assert done.code == 2
        assert done.says("rmse_eq14 needs points", "one to match at")

    def test_what_was_done_is_said_on_the_terminal(self, files: CommandLine) -> None:
        image(grid=Wavelengths(420, 660, 40)).save("coarse.nc")
        arguments = ("--points", "points.csv", "--aperture", "1px", "--match", "left")
        out = files("compare", "a.nc", "coarse.nc", *arguments).out
        for said in ("brought to", "samples are assumed", "Scale: each side", "White of CIELAB"):
            assert said in out

    def test_a_table_and_an_image(self, files: CommandLine) -> None:
        assert files("measure", "a.nc", "points.csv", "--aperture", "1px", "-o", "s.csv").code == 0
        arguments = ("--points", "points.csv", "--aperture", "1px", "--fail-above", "rmse=1e-6")
        assert files("compare", "s.csv", "a.nc", *arguments).code == 0

    @pytest.mark.parametrize(
        ("arguments", "said"),
        [
            (("a.nc", "small.nc"), "the images differ in size"),
            (("a.nc", "infrared.nc"), "no wavelengths in common"),
            (("a.nc", "missing.nc"), "the image file does not exist"),
            (("a.nc", "truncated.exr"), "truncated or damaged"),
            (("a.nc", "rgb.exr"), "no spectral channel"),
            (("a.nc", "a.pdf"), "this kind of file cannot be compared"),
            (("a.nc", "a.nc", "--match", "7"), "no points are given"),
            (("a.nc", "a.nc", "--white", "daylight"), "there is no such illuminant"),
            (("a.nc", "a.nc", "--white", "12"), "give points (--points)"),
            (
                ("a.nc", "a.nc", "--aperture", "3px"),
                "an aperture is given, but no image is measured at points",
            ),
            (("a.nc", "a.nc", "--wavelengths", "360:700:20"), "reach beyond the data"),
            (("a.nc", "milliwatt.nc"), "different units"),
            (("a.nc", "a.nc", "--fail-above", "rsme=1"), "there is no such number"),
            (("a.nc", "a.nc", "--fail-above", "rmse=low"), "a limit is not a number"),
            (("a.nc", "a.nc", "--fail-above", "rmse=-1"), "a limit is impossible"),
            (("a.nc", "a.nc", "--fail-above", "rmse=inf"), "a limit is impossible"),
            (("a.nc", "a.nc", "--fail-above", "rmse=nan"), "a limit is impossible"),
            (("a.nc", "a.nc", "--fail-above", "rmse=1", "--fail-above", "rmse=2"), "a number has two limits"),
            (("a.nc", "a.nc", "--observer", "5"), "there is no such observer"),
            (("a.nc", "points.csv", "--points", "points.csv"), "this is a points file"),
            (("a.nc", "a.nc", "-o", "r.docx"), "this kind of file cannot be written"),
            (("a.nc", "a.nc", "-o", "none/r.json"), "the directory to write to does not exist"),
        ],
    )
    def test_bad_input_writes_nothing(
        self, files: CommandLine, arguments: tuple[str, ...], said: str
    ) -> None:
        import OpenEXR

        image(size=(4, 4)).save("small.nc")
        image(grid=Wavelengths(800, 900, 20)).save("infrared.nc")
        other = image()
        other.dataset.attrs["unit"] = "mW.cm^-2.sr^-1"
        other.save("milliwatt.nc")
        content = (files.folder / "b.exr").read_bytes()
        (files.folder / "truncated.exr").write_bytes(content[: len(content) // 2])
        with OpenEXR.File({}, {name: np.ones((8, 12), np.float32) for name in "RGB"}) as rgb:
            rgb.write("rgb.exr")
        before = files.files()
        outputs = () if "-o" in arguments else ("-o", "old.png")
        done = files("compare", *arguments, *outputs)
        assert done.code == 2, done
        assert done.says(said)
        assert files.files() == before


class TestConvert:
    @pytest.mark.parametrize("suffix", [".nc", ".exr"])
    def test_all_components_stay(self, files: CommandLine, suffix: str) -> None:
        assert files("convert", "a.nc", f"c{suffix}").code == 0
        with SpectralImage.open(f"c{suffix}") as read:
            np.testing.assert_array_equal(read.dataset.radiance, image().dataset.radiance)

    def test_a_component_to_envi(self, files: CommandLine) -> None:
        done = files("convert", "a.nc", "c.hdr", "--component", "direct_reflection")
        assert (done.code, done.err) == (0, "")
        read = SpectralImage.open("c.hdr")
        np.testing.assert_array_equal(read.total(), image().component("direct_reflection"))

    def test_envi_says_that_it_holds_the_total_only(self, files: CommandLine) -> None:
        assert files("convert", "a.nc", "c.hdr").says("the total was written")

    def test_the_total_on_other_wavelengths(self, files: CommandLine) -> None:
        assert files("convert", "a.nc", "c.nc", "--total", "--wavelengths", "420:660:40").code == 0
        with SpectralImage.open("c.nc") as read:
            assert (read.components, read.wavelengths) == (("total",), Wavelengths(420, 660, 40))
            np.testing.assert_allclose(read.total(), image().total()[..., 1:14:2], rtol=1e-6)
            assert "every sample that is needed" in read.attrs["converted"]

    def test_what_a_bandwidth_assumes_of_unknown_bands_is_said(self, files: CommandLine) -> None:
        done = files("convert", "a.nc", "c.nc", "--bandwidth", "40")
        assert done.code == 0
        assert done.says("a.nc: the band shape of the image is not known: samples are assumed")
        assert files("convert", "c.nc", "d.nc", "--bandwidth", "50").err == ""

    def test_a_picture_has_the_srgb_profile(self, files: CommandLine) -> None:
        assert files("convert", "a.nc", "c.png").code == 0
        with Image.open("c.png") as picture:
            profile = ImageCms.ImageCmsProfile(io.BytesIO(picture.info["icc_profile"]))
        assert "sRGB" in ImageCms.getProfileDescription(profile)

    @pytest.mark.parametrize(
        ("arguments", "said"),
        [
            (("a.nc", "a.nc"), "cannot be converted onto itself"),
            (("a.nc", "old.nc", "--component", "glow"), "no such component"),
            (("a.nc", "old.nc", "--component", "source", "--total"), "exclude each other"),
            (("a.nc", "old.nc", "--wavelengths", "300:700:20"), "outside the data"),
            (("a.nc", "old.tif"), "this kind of file cannot be written"),
            (("old.nc", "c.nc"), "not readable"),
        ],
    )
    def test_bad_input_writes_nothing(
        self, files: CommandLine, arguments: tuple[str, ...], said: str
    ) -> None:
        before = files.files()
        done = files("convert", *arguments)
        assert done.code == 2
        assert done.says(said)
        assert files.files() == before


def test_an_old_report_survives_a_comparison_that_fails(files: CommandLine) -> None:
    report = files.folder / "r.html"
    report.write_bytes(OLD)
    assert files("compare", "a.nc", "missing.nc", "-o", "r.html").code == 2
    assert report.read_bytes() == OLD


def test_names_of_files_may_be_any_bytes(files: CommandLine) -> None:
    """As those of an old camera's disk: they become text with a sign in place of what is no UTF-8."""
    table, output = os.fsdecode(b"s-\xe9.csv"), os.fsdecode(b"r-\xe9.html")
    try:
        (files.folder / table).write_text("")
    except OSError:
        pytest.skip("this file system takes UTF-8 only")
    places = ("--points", "points.csv", "--aperture", "1px")
    done = files("measure", "a.nc", "points.csv", "--aperture", "1px", "-o", table)
    assert (done.code, done.err) == (0, "")
    done = files("compare", table, "a.nc", *places, "-o", output, "-o", "r.json", "-o", "r.png")
    assert (done.code, done.err) == (0, "")
    assert json.loads((files.folder / "r.json").read_text(encoding="utf-8"))["a"] == "s-\ufffd.csv"
    assert "s-\ufffd.csv" in (files.folder / output).read_text(encoding="utf-8")
    again = os.fsdecode(b"i-\xe9.hdr")
    assert files("convert", "a.nc", again).code == 0
    done = files("measure", again, "points.csv", "--aperture", "1px", "-o", "t.csv")
    assert done.code == 0, done
    assert "i-\ufffd.hdr" in (files.folder / "t.csv").read_text(encoding="utf-8")
