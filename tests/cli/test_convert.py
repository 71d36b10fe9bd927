"""`convert`: bandwidth, whites, and files that are not to be touched."""

from __future__ import annotations

import numpy as np
import pytest
from command_line import CommandLine
from PIL import Image

from fluorspar import SpectralImage, Wavelengths

GRID = Wavelengths(400, 700, 20)
METADATA = {"wavelength": list(GRID.values), "wavelength units": "Nanometers"}


@pytest.fixture
def files(fluorspar: CommandLine) -> CommandLine:
    """A folder with the image a.nc, of two components with standard errors of their own."""
    radiance = np.zeros((7, 4, 5, len(GRID)))
    radiance[1:3] = 0.1 + np.random.default_rng(1).random((2, 4, 5, len(GRID)))
    error = 0.01 * radiance.sum(axis=0)
    image = SpectralImage.from_arrays(radiance, GRID, error, component_standard_error=0.02 * radiance)
    image.save("a.nc")
    return fluorspar


def test_the_bandwidth_is_recorded_and_taken_into_account(files: CommandLine) -> None:
    assert files("convert", "a.nc", "b.exr", "--bandwidth", "30").code == 0
    assert files("convert", "b.exr", "c.hdr", "--bandwidth", "50").code == 0
    with SpectralImage.open("b.exr") as once, SpectralImage.open("c.hdr") as twice:
        assert (once.attrs["bandwidth_nm"], twice.attrs["bandwidth_nm"]) == (30, 50)
    done = files("convert", "c.hdr", "d.nc", "--bandwidth", "30")
    assert done.code == 2
    assert done.says("bands cannot be made narrower", "30 nm FWHM", "50 nm of the image")


def test_errors_of_a_component_become_those_of_the_image(files: CommandLine) -> None:
    assert files("convert", "a.nc", "b.nc", "--component", "direct_reflection").code == 0
    with SpectralImage.open("b.nc") as image:
        np.testing.assert_allclose(image.standard_error(), 0.02 * image.total(), rtol=1e-5)


@pytest.mark.parametrize("white", ["A", "109.85,100,35.58"])
def test_a_picture_adapted_to_a_white(files: CommandLine, white: str) -> None:
    for name, options in (("plain.png", ()), ("adapted.png", ("--white", white))):
        assert files("convert", "a.nc", name, *options).code == 0
    plain, adapted = (np.asarray(Image.open(name), float) for name in ("plain.png", "adapted.png"))
    assert (adapted[..., 2] - adapted[..., 0]).mean() > (plain[..., 2] - plain[..., 0]).mean() + 20


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("b.nc", "--bandwidth", "-20"), "a bandwidth is impossible"),
        (("b.nc", "--bandwidth", "-20", "--wavelengths", "400:700:20"), "a bandwidth is impossible"),
        (("b.nc", "--white", "A"), "only a picture is adapted"),
        (("b.nc", "--exposure", "same"), "only a picture has an exposure"),
        (("b.png", "--exposure", "-1"), "the exposure is not readable"),
        (("b.png", "--exposure", "bright"), "the exposure is not readable"),
        (("b.png", "--exposure", "gone.nc"), "the image file does not exist"),
        (("b.png", "--white", "1,2"), "a white is impossible"),
        (("b.png", "--white", "1,2,blue"), "a white is not readable"),
        (("b.png", "--white", "daylight"), "there is no such illuminant"),
        (("b.hdr", "--compress"), "only a NetCDF file"),
        (("b.nc", "--channel-wavelengths", "400:700:10"), "only the channels of an EXR file"),
        (("keep.hdr",), "would replace a file that does not belong to it"),
    ],
)
def test_bad_options_write_nothing(files: CommandLine, arguments: tuple[str, ...], said: str) -> None:
    (files.folder / "keep.img").write_bytes(b"precious")
    before = files.files()
    done = files("convert", "a.nc", *arguments)
    assert done.code == 2
    assert done.says(said)
    assert files.files() == before


class TestEnviData:
    """A header as GDAL names it, scene.img.hdr, whose data are scene.img."""

    @pytest.fixture
    def scene(self, files: CommandLine) -> CommandLine:
        envi = pytest.importorskip("spectral.io.envi")
        cube = np.ones((2, 3, len(GRID)), np.float32)
        envi.save_image("scene.hdr", cube, metadata=METADATA, ext=".img")
        (files.folder / "scene.hdr").rename(files.folder / "scene.img.hdr")
        return files

    def test_are_not_replaced(self, scene: CommandLine) -> None:
        before = scene.files()
        done = scene("convert", "scene.img.hdr", "scene.hdr")
        assert done.code == 2
        assert done.says("an image cannot be converted onto itself", "where: scene.img", "got: scene.img")
        assert scene.files() == before

    def test_are_not_replaced_if_they_have_another_header_too(self, scene: CommandLine) -> None:
        (scene.folder / "scene.hdr").write_bytes((scene.folder / "scene.img.hdr").read_bytes())
        before = scene.files()
        assert scene("convert", "scene.img.hdr", "scene.hdr").says("cannot be converted onto itself")
        assert scene.files() == before


def test_compressed(files: CommandLine) -> None:
    assert files("convert", "a.nc", "b.nc", "--compress").code == 0
    with SpectralImage.open("a.nc") as plain, SpectralImage.open("b.nc") as packed:
        np.testing.assert_array_equal(plain.dataset.radiance, packed.dataset.radiance)
    assert (files.folder / "b.nc").stat().st_size < (files.folder / "a.nc").stat().st_size
    done = files("convert", "a.nc", "b.exr", "--compress")
    assert done.code == 2
    assert done.says("only a NetCDF file", "--compress")


@pytest.mark.parametrize("wavelengths", ["400:440:20", "400,420,440"])
def test_channels_are_given_wavelengths(files: CommandLine, wavelengths: str) -> None:
    import OpenEXR

    channels = {f"band_{k}": np.full((2, 3), k, np.float32) for k in (1, 2, 10)}
    with OpenEXR.File({}, channels) as file:
        file.write("bands.exr")
    assert files("convert", "bands.exr", "b.nc").says("no spectral channel", "--channel-wavelengths")
    assert files("convert", "bands.exr", "b.nc", "--channel-wavelengths", wavelengths).code == 0
    with SpectralImage.open("b.nc") as image:
        assert image.wavelengths == Wavelengths(400, 440, 20)
        np.testing.assert_array_equal(image.total()[0, 0], [1, 2, 10])
    done = files("convert", "bands.exr", "b.nc", "--channel-wavelengths", "red,green,blue")
    assert done.code == 2
    assert done.says("wavelengths are not readable", "'red,green,blue'")


def test_data_of_another_file_stop_a_render_before_it_begins(files: CommandLine) -> None:
    (files.folder / "keep.img").write_bytes(b"precious")
    before = files.files()
    done = files("render", "cornell-box", "-o", "keep.hdr", "--wavelengths", "not a grid")
    assert done.code == 2
    assert done.says("would replace a file that does not belong to it")
    assert files.files() == before


def test_pictures_of_components_share_an_exposure(files: CommandLine) -> None:
    """Expected: what each picture shows is the sum at the exposure of the picture of all, which is stated; a component
    by itself has another."""
    with SpectralImage.open("a.nc") as image:
        common = float(image.srgb().attrs["exposure"])
        shown = {
            name: np.asarray(image.srgb(name.split("+"), exposure=common) * 255)
            for name in ("direct_luminescence", "direct_reflection+direct_luminescence")
        }
    for name, expected in shown.items():
        for exposure in ("same", "a.nc", f"{common:.17g}"):
            done = files("convert", "a.nc", "b.png", "--component", name, "--exposure", exposure)
            assert (done.code, done.err) == (0, "")
            assert f"wrote b.png (white is {1 / common:.4g} cd/m2: exposure {common:.6g})" in done.out
            np.testing.assert_allclose(np.asarray(Image.open("b.png"), float), expected, atol=0.51)
    done = files("convert", "a.nc", "b.png", "--component", "direct_luminescence")
    assert f"exposure {common:.6g})" not in done.out


def test_an_image_whose_exposure_would_mean_nothing(files: CommandLine) -> None:
    """Expected: refused, where 1 / 1 cd/m2 and a luminance of other units would make a picture in silence."""
    SpectralImage.from_arrays(np.zeros((7, 4, 5, len(GRID))), GRID).save("dark.nc")
    stated = {"unit": "1", "quantity": "reflectance"}
    SpectralImage.from_arrays(np.ones((7, 4, 5, len(GRID))), GRID, attrs=stated).save("sheet.nc")
    for source, other, said in (
        ("a.nc", "dark.nc", "shows no light"),
        ("a.nc", "sheet.nc", "an image with another unit"),
        ("sheet.nc", "a.nc", "an image with another unit"),
    ):
        done = files("convert", source, "b.png", "--exposure", other)
        assert (done.code, done.says(said, f"where: {other}")) == (2, True)
    assert files("convert", "sheet.nc", "b.png", "--exposure", "sheet.nc").code == 0


def test_a_sum_of_components_by_name(files: CommandLine) -> None:
    sum_of_two = "direct_luminescence+direct_reflection"
    assert files("convert", "a.nc", "b.nc", "--component", sum_of_two).code == 0
    with SpectralImage.open("a.nc") as image, SpectralImage.open("b.nc") as summed:
        np.testing.assert_array_equal(image.total(), summed.total())
        assert summed.attrs["components"] == "direct_reflection + direct_luminescence"
    assert "RMSE" in files("compare", "a.nc", "b.nc", "--component", sum_of_two).out
    files.write("points.csv", "point,x,y\n1,2,2\n")
    arguments = ("points.csv", "--aperture", "1px", "--component", sum_of_two)
    assert f"1 pixel, {sum_of_two}" in files("measure", "a.nc", *arguments).out
    done = files("convert", "a.nc", "c.nc", "--component", "source+glow")
    assert done.code == 2
    assert done.says("no such component", "'glow'", "joined by +")
