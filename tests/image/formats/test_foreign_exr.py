"""Spectral EXR files of other writers: pbrt's names, half floats, further channels, reflectance, and faults."""

from __future__ import annotations

import warnings

import numpy as np
import OpenEXR
import pytest

from fluorspar.errors import ApproximationWarning, ImageError, OptionError
from fluorspar.image.components import TOTAL
from fluorspar.image.formats.foreign_exr import channel_wavelength
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

PIXELS = np.random.default_rng(4).random((5, 6, 16)).astype(np.float32)


def write(path, channels, header=None):
    with OpenEXR.File(dict(header or {}), {k: np.ascontiguousarray(v) for k, v in channels.items()}) as file:
        file.write(str(path))


def pbrt_channels(pixels=PIXELS):
    """Sixteen buckets of 360-830 nm as pbrt-v4 names them, and its R, G, B; no attribute is written."""
    centres = 360 + 470 / 16 * (np.arange(16) + 0.5)
    named = {
        f"S0.{at:.3f}nm".replace(".", ",").replace("S0,", "S0."): pixels[..., k]
        for k, at in enumerate(centres)
    }
    rgb = {name: np.ones(pixels.shape[:2], pixels.dtype) for name in "RGB"}
    # other writers need not sort: reversed here
    return dict(reversed(list((named | rgb).items())))


class TestNames:
    @pytest.mark.parametrize(
        ("name", "expected"),
        [
            ("S0.550,000000nm", ("", "S0", 550.0)),
            ("S0.550,938nm", ("", "S0", 550.938)),
            ("S0.550nm", ("", "S0", 550.0)),
            ("S0.5,5e-7m", ("", "S0", 550.0)),
            ("S0.0,55um", ("", "S0", 550.0)),
            ("S2.600nm", ("", "S2", 600.0)),
            ("left.eye.T.400,5nm", ("left.eye", "T", 400.5)),
            ("S0.500THz", ("", "S0", pytest.approx(599.584916))),
            ("R", None),
            ("S0.R", None),
            ("S4.550nm", None),
            ("Normal.550nm", None),
            ("S0.0nm", None),
        ],
    )
    def test_what_a_name_says(self, name, expected):
        assert channel_wavelength(name) == expected


class TestOtherWriters:
    def test_pbrt(self, tmp_path):
        write(tmp_path / "a.exr", pbrt_channels())
        image = SpectralImage.open(tmp_path / "a.exr")
        assert image.components == (TOTAL,)
        np.testing.assert_array_equal(image.total(), PIXELS)
        np.testing.assert_allclose(image.wavelengths.values, 374.6875 + 29.375 * np.arange(16), atol=6e-4)
        assert image.attrs["unit"] == "not stated"

    def test_half_floats(self, tmp_path):
        half = PIXELS.astype(np.float16)
        write(tmp_path / "a.exr", pbrt_channels(half))
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "a.exr").total(), half.astype(np.float32))

    def test_frequencies_come_in_ascending_wavelengths(self, tmp_path):
        light = 299_792_458.0
        names = {
            f"S0.{light / (at * 1e3):.9f}THz".replace(".", ",").replace("S0,", "S0."): at
            for at in (400, 500, 600)
        }
        write(tmp_path / "a.exr", {name: np.full((2, 2), at, np.float32) for name, at in names.items()})
        image = SpectralImage.open(tmp_path / "a.exr")
        np.testing.assert_array_equal(image.total()[0, 0], [400, 500, 600])
        np.testing.assert_allclose(image.wavelengths.values, [400, 500, 600], rtol=1e-9)

    def test_the_layout_of_fichet_by_colour_science(self, tmp_path):
        pytest.importorskip("OpenImageIO")
        with warnings.catch_warnings(), np.printoptions():  # colour-science changes how arrays are printed
            warnings.simplefilter("ignore")  # colour-science announces what else is not installed
            import colour

            components = {"S0": (np.arange(400.0, 701, 20), PIXELS.astype(np.float64))}
            specification = colour.Specification_Fichet2021(is_emissive=True)
            colour.write_spectral_image_Fichet2021(
                components,
                str(tmp_path / "a.exr"),
                "float32",
                specification,
                lambda *_: (PIXELS[..., :3], []),
            )
        image = SpectralImage.open(tmp_path / "a.exr")
        assert image.wavelengths == Wavelengths(400, 700, 20)
        np.testing.assert_array_equal(image.total(), PIXELS)

    def test_reflectance_is_said_to_be_none_of_light(self, tmp_path):
        write(
            tmp_path / "a.exr",
            {f"T.{at}nm": np.full((2, 2), at / 1000, np.float32) for at in (400, 500, 600)},
        )
        with pytest.warns(ApproximationWarning, match="holds reflectance, and is kept as such"):
            image = SpectralImage.open(tmp_path / "a.exr")
        assert image.attrs["quantity"] == "reflectance"

    def test_polarisation_is_left_out_and_said(self, tmp_path):
        channels = {f"S{s}.{at}nm": np.full((2, 2), s, np.float32) for s in range(4) for at in (400, 500)}
        write(tmp_path / "a.exr", channels)
        with pytest.warns(ApproximationWarning, match="polarisation"):
            image = SpectralImage.open(tmp_path / "a.exr")
        assert not image.total().any()

    @pytest.mark.parametrize("order", [("T", "S0"), ("S0", "T")])
    def test_light_comes_before_reflectance_in_whatever_part(self, tmp_path, order):
        parts = [
            OpenEXR.Part(
                {}, {f"{kind}.{at}nm": np.full((2, 2), len(kind), np.float32) for at in (400, 500)}, kind
            )
            for kind in order
        ]
        with OpenEXR.File(parts) as file:
            file.write(str(tmp_path / "a.exr"))
        with pytest.warns(ApproximationWarning, match="not read: part 'T'"):
            image = SpectralImage.open(tmp_path / "a.exr")
        assert (image.total() == 2).all()

    def test_a_second_part_is_left_out_and_said(self, tmp_path):
        parts = [
            OpenEXR.Part({}, {f"S0.{at}nm": np.full((2, 2), level, np.float32) for at in (400, 500)}, name)
            for level, name in enumerate(("left", "right"))
        ]
        with OpenEXR.File(parts) as file:
            file.write(str(tmp_path / "a.exr"))
        with pytest.warns(ApproximationWarning, match="not read: part 'right'"):
            image = SpectralImage.open(tmp_path / "a.exr")
        assert not image.total().any()

    def test_uneven_wavelengths_are_kept_as_they_are(self, tmp_path):
        channels = {f"S0.{at}nm": np.full((2, 2), at, np.float32) for at in (400, 430, 500, 550)}
        write(tmp_path / "a.exr", channels)
        image = SpectralImage.open(tmp_path / "a.exr")
        np.testing.assert_array_equal(image.wavelengths.values, [400, 430, 500, 550])
        np.testing.assert_array_equal(image.total()[0, 0], [400, 430, 500, 550])

    def test_through_our_own_formats_and_back(self, tmp_path):
        write(tmp_path / "a.exr", pbrt_channels())
        SpectralImage.open(tmp_path / "a.exr").save(tmp_path / "b.exr")
        SpectralImage.open(tmp_path / "b.exr").save(tmp_path / "c.nc")
        with SpectralImage.open(tmp_path / "c.nc") as image:
            np.testing.assert_array_equal(image.total(), PIXELS)
            assert image.components == (TOTAL,)
        parts = OpenEXR.File(str(tmp_path / "b.exr"), separate_channels=True).parts
        assert [part.name() for part in parts] == ["total"]


class TestNamesOfWavelengthsAlone:
    """As Mitsuba's specfilm writes channels, named as the user named the bands."""

    @pytest.mark.parametrize(
        "name", ["band_{}nm", "{}", "w{}", "{}nm", "S0_{}", "{}.5", "band {},5 nm", "b1-{}", "0{}", "{}_nir"]
    )
    def test_are_read_and_this_is_said(self, tmp_path, name):
        channels = {name.format(at): np.full((2, 3), at, np.float32) for at in range(1000, 400, -100)}
        write(tmp_path / "a.exr", channels)
        with pytest.warns(ApproximationWarning, match="wavelengths of their names"):
            image = SpectralImage.open(tmp_path / "a.exr")
        np.testing.assert_array_equal(image.total()[0, 0], range(500, 1001, 100))
        np.testing.assert_allclose(image.wavelengths.values, np.arange(500, 1001, 100), atol=0.5)
        assert image.attrs["unit"] == "not stated"

    def test_other_channels_are_said(self, tmp_path):
        names = ["w400", "w500", "w600", "depth", "R", "A", "mask1"]
        write(tmp_path / "a.exr", {name: np.ones((2, 2), np.float32) for name in names})
        with pytest.warns(ApproximationWarning) as said:
            SpectralImage.open(tmp_path / "a.exr")
        assert str(said[1].message).endswith("not read: channels depth, mask1")

    def test_numbers_of_bands_are_no_wavelengths(self, tmp_path):
        write(tmp_path / "a.exr", {f"band_{k}": np.ones((2, 2), np.float32) for k in range(1, 32)})
        with pytest.raises(ImageError, match=r"(?s)no spectral channel.*--channel-wavelengths"):
            SpectralImage.open(tmp_path / "a.exr")

    def test_wavelengths_are_given_in_the_order_of_the_numbers(self, tmp_path):
        channels = {f"band_{k}": np.full((2, 2), k, np.float32) for k in range(1, 13)}
        write(tmp_path / "a.exr", channels | {"R": np.ones((2, 2), np.float32)})
        at = 400 + 10.0 * np.arange(12)
        image = SpectralImage.open(tmp_path / "a.exr", channel_wavelengths=at)
        np.testing.assert_array_equal(image.total()[0, 0], range(1, 13))
        np.testing.assert_array_equal(image.wavelengths.values, at)
        with pytest.raises(
            ImageError, match=r"(?s)do not fit.*11 wavelengths.*12 different ones.*band_1, band_2"
        ):
            SpectralImage.open(tmp_path / "a.exr", channel_wavelengths=at[1:])

    def test_only_channels_are_given_wavelengths(self, image, tmp_path):
        image.save(tmp_path / "a.nc")
        with pytest.raises(OptionError, match="only the channels of an EXR file"):
            SpectralImage.open(tmp_path / "a.nc", channel_wavelengths=[400, 500])


class TestWhatIsNotRead:
    def test_bispectral_channels(self, tmp_path):
        """The reradiation of a material: a diagonal T.400nm and cells T.400nm.500nm."""
        at = [400, 450, 500]
        names = [f"T.{a}nm" for a in at] + [f"T.{a}nm.{b}nm" for a in at for b in at if b > a]
        write(tmp_path / "a.exr", {name: np.ones((2, 2), np.float32) for name in names})
        with pytest.warns(ApproximationWarning) as said:
            SpectralImage.open(tmp_path / "a.exr")
        texts = [str(each.message) for each in said]
        assert any("3 bispectral channels are not read (T.400nm.450nm, " in text for text in texts)
        assert any("Donaldson matrix" in text for text in texts)

    def test_other_channels(self, tmp_path):
        write(
            tmp_path / "a.exr",
            pbrt_channels() | {"Z": np.ones((5, 6), np.float32), "N.x": np.ones((5, 6), np.float32)},
        )
        with pytest.warns(ApproximationWarning, match=r"not read: channel N\.x"):
            SpectralImage.open(tmp_path / "a.exr")


class TestFaults:
    def test_no_spectral_channel(self, tmp_path):
        write(tmp_path / "a.exr", {name: np.ones((2, 2), np.float32) for name in "RGB"})
        with pytest.raises(ImageError, match=r"(?s)no spectral channel.*a\.exr.*B, G, R.*S0\.550"):
            SpectralImage.open(tmp_path / "a.exr")

    def test_one_spectral_channel(self, tmp_path):
        write(tmp_path / "a.exr", {"S0.550nm": np.ones((2, 2), np.float32)})
        with pytest.raises(ImageError, match="only one spectral channel"):
            SpectralImage.open(tmp_path / "a.exr")

    def test_one_wavelength_twice(self, tmp_path):
        names = ("S0.400nm", "S0.0,4um", "S0.500nm")
        write(tmp_path / "a.exr", {name: np.ones((2, 2), np.float32) for name in names})
        with pytest.raises(ImageError, match="two channels have one wavelength"):
            SpectralImage.open(tmp_path / "a.exr")

    @pytest.mark.parametrize("left", [0.99, 0.5, 0.1])
    def test_truncated(self, tmp_path, left):
        write(
            tmp_path / "a.exr",
            pbrt_channels(np.random.default_rng(1).random((50, 60, 16)).astype(np.float32)),
        )
        content = (tmp_path / "a.exr").read_bytes()
        (tmp_path / "a.exr").write_bytes(content[: int(left * len(content))])
        with pytest.raises(ImageError, match=r"(?s)truncated or damaged.*a\.exr"):
            SpectralImage.open(tmp_path / "a.exr")

    def test_an_image_that_is_not_split_has_no_components(self, tmp_path):
        write(tmp_path / "a.exr", pbrt_channels())
        with pytest.raises(OptionError, match=r"(?s)no such component.*not split"):
            SpectralImage.open(tmp_path / "a.exr").component("reexcitation")


class TestNumberedChannels:
    def test_numbers_that_begin_small_are_no_wavelengths(self, tmp_path):
        path = tmp_path / "camera.exr"
        write(path, {f"ch{k}": PIXELS[..., 0] for k in range(95, 106)})
        with pytest.raises(ImageError, match="no spectral channel"):
            SpectralImage.open(path)

    def test_other_parts_are_said_to_be_left_out(self, tmp_path):
        path = tmp_path / "two.exr"
        parts = [
            OpenEXR.Part({}, {f"{at}": np.full((4, 5), k, np.float32) for at in (400, 500)}, f"part-{k}")
            for k in range(2)
        ]
        with OpenEXR.File(parts) as file:
            file.write(str(path))
        for given in (None, [400, 500]):
            with pytest.warns(ApproximationWarning) as said:
                image = SpectralImage.open(path, channel_wavelengths=given)
            assert any("not read: part 'part-1'" in str(warning.message) for warning in said)
            assert image.total().values.max() == 0

    def test_a_part_behind_a_preview_is_read(self, tmp_path):
        path = tmp_path / "preview.exr"
        parts = [
            OpenEXR.Part({}, {name: np.zeros((4, 5), np.float32) for name in names}, part)
            for part, names in (("rgb", "RGB"), ("bands", ("400", "500")))
        ]
        with OpenEXR.File(parts) as file:
            file.write(str(path))
        with pytest.warns(ApproximationWarning, match="taken for light"):
            assert np.array_equal(SpectralImage.open(path).wavelengths.values, [400, 500])

    def test_stated_wavelengths_are_not_overruled(self, tmp_path):
        path = tmp_path / "stated.exr"
        write(path, pbrt_channels())
        own = tmp_path / "own.exr"
        SpectralImage.from_arrays(np.ones((7, 2, 2, 3)), Wavelengths(400, 420, 10)).save(own)
        for file in (path, own):
            with pytest.raises(OptionError, match="states the wavelengths"):
                SpectralImage.open(file, channel_wavelengths=[400, 410, 420])
