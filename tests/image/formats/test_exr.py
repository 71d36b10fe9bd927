"""Spectral EXR files: the layout of Fichet, Pacanowski, Wilkie (2021), nothing lost, readable by others."""

from __future__ import annotations

import warnings

import numpy as np
import OpenEXR
import pytest
import xarray as xr

from fluorspar.errors import ImageError
from fluorspar.image.components import COMPONENTS, SINGLE_BOUNCE
from fluorspar.image.formats.exr import channel_name
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths


def parts_of(path):
    return {part.name(): part for part in OpenEXR.File(str(path), separate_channels=True).parts}


class TestRoundTrip:
    @pytest.mark.parametrize("grid", ["360:700:5", "300:780:2.5", "980:1010:0.3"])
    def test_values_labels_and_attributes_come_back_as_they_were(self, make_image, tmp_path, grid):
        """The last grid crosses 1000 nm, where the order of the names is not that of the numbers."""
        image = make_image(grid=Wavelengths.parse(grid), component_errors=True)
        image.dataset["radiance"][:, 5:, 7] = np.nan
        image.dataset.attrs["partial"] = 1
        image.save(tmp_path / "a.exr")
        read = SpectralImage.open(tmp_path / "a.exr")
        xr.testing.assert_identical(read.dataset, image.dataset)
        assert read.dataset.radiance.dtype == np.float32
        assert read.attrs == image.attrs

    def test_more_rows_than_are_transposed_at_a_time(self, make_image, tmp_path):
        image = make_image(height=37, width=3)
        image.save(tmp_path / "a.exr")
        xr.testing.assert_identical(SpectralImage.open(tmp_path / "a.exr").dataset, image.dataset)

    def test_an_image_without_errors_and_without_reexcitation(self, image, tmp_path):
        staged = image.dataset.sel(component=list(SINGLE_BOUNCE)).drop_vars("standard_error")
        SpectralImage(staged).save(tmp_path / "a.exr")
        xr.testing.assert_identical(SpectralImage.open(tmp_path / "a.exr").dataset, staged)

    def test_from_netcdf_and_back(self, image, tmp_path):
        image.save(tmp_path / "a.nc")
        with SpectralImage.open(tmp_path / "a.nc") as lazy:
            lazy.save(tmp_path / "b.exr")
        SpectralImage.open(tmp_path / "b.exr").save(tmp_path / "c.nc")
        with SpectralImage.open(tmp_path / "c.nc") as read:
            xr.testing.assert_identical(read.dataset.load(), image.dataset)


class TestLayout:
    def test_channel_names_have_a_decimal_comma(self):
        assert channel_name(550) == "S0.550,000000nm"
        assert channel_name(302.5) == "S0.302,500000nm"
        assert channel_name(1000 / 3) == "S0.333,333333nm"

    def test_the_total_comes_first_and_then_every_component(self, image, tmp_path):
        image.save(tmp_path / "a.exr")
        parts = parts_of(tmp_path / "a.exr")
        assert list(parts) == ["total", *COMPONENTS, "standard_error"]
        names = {channel_name(wavelength) for wavelength in image.wavelengths.values}
        assert set(parts["total"].channels) == names | {"R", "G", "B"}
        for name in (*COMPONENTS, "standard_error"):
            assert set(parts[name].channels) == names
        at_550 = parts["total"].channels["S0.550,000000nm"].pixels
        np.testing.assert_array_equal(at_550, image.total().sel(wavelength=550))

    def test_every_part_states_layout_and_unit(self, image, tmp_path):
        image.save(tmp_path / "a.exr")
        for part in parts_of(tmp_path / "a.exr").values():
            assert part.header["spectralLayoutVersion"] == "1.0"
            assert part.header["emissiveUnits"] == "W.m^-2.sr^-1"
            assert part.compression() == OpenEXR.ZIP_COMPRESSION

    def test_the_preview_is_linear_srgb_at_the_exposure_it_states(self, image, tmp_path):
        """Its luminance, of linear R, G, B, is that of the image times 2^EV; clipped at white."""
        image.save(tmp_path / "a.exr")
        first = parts_of(tmp_path / "a.exr")["total"]
        red, green, blue = (first.channels[name].pixels for name in "RGB")
        luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
        expected = image.luminance().values * 2 ** first.header["EV"]
        np.testing.assert_allclose(luminance, np.minimum(expected, 1), atol=2e-3)

    def test_colour_science_reads_the_total_bit_for_bit(self, make_image, tmp_path):
        image = make_image(grid=Wavelengths(300, 780, 2.5))
        image.save(tmp_path / "a.exr")
        pytest.importorskip("OpenImageIO")
        with warnings.catch_warnings(), np.printoptions():  # colour-science changes how arrays are printed
            warnings.simplefilter("ignore")  # colour-science announces what else is not installed
            import colour

            components, specification = colour.read_spectral_image_Fichet2021(
                str(tmp_path / "a.exr"), additional_data=True
            )
        wavelengths, values = components["S0"]
        np.testing.assert_array_equal(wavelengths, image.wavelengths.values)
        np.testing.assert_array_equal(values, image.total())
        assert specification.is_emissive
        attributes = {attribute.name: attribute.value for attribute in specification.attributes}
        assert attributes["spectralLayoutVersion"] == "1.0"
        assert attributes["emissiveUnits"] == "W.m^-2.sr^-1"

    def test_the_threads_of_openexr_are_as_before(self, image, tmp_path):
        before = OpenEXR.global_thread_count()
        image.save(tmp_path / "a.exr")
        SpectralImage.open(tmp_path / "a.exr")
        assert OpenEXR.global_thread_count() == before


class TestFailures:
    def test_a_full_disk_leaves_an_older_file_intact(self, make_image, tmp_path, file_size_limit):
        target = tmp_path / "old.exr"
        target.write_bytes(b"precious")
        image = make_image(height=40, width=50)
        with file_size_limit(100_000), pytest.raises(ImageError, match=r"(?s)disk is full.*unchanged"):
            image.save(target)
        assert target.read_bytes() == b"precious"
        assert list(tmp_path.iterdir()) == [target]

    def test_missing(self, tmp_path):
        with pytest.raises(ImageError, match=r"(?s)does not exist.*a\.exr"):
            SpectralImage.open(tmp_path / "a.exr")

    @pytest.mark.parametrize("left", [0.999, 0.5, 0.01, 0.0001])
    def test_truncated(self, image, tmp_path, left):
        image.save(tmp_path / "a.exr")
        content = (tmp_path / "a.exr").read_bytes()
        (tmp_path / "a.exr").write_bytes(content[: int(left * len(content))])
        with pytest.raises(ImageError, match=r"(?s)(truncated|not an OpenEXR file).*a\.exr"):
            SpectralImage.open(tmp_path / "a.exr")

    def test_not_exr(self, tmp_path):
        (tmp_path / "a.exr").write_text("wavelength,value\n400,1\n")
        with pytest.raises(ImageError, match="not an OpenEXR file"):
            SpectralImage.open(tmp_path / "a.exr")

    @pytest.mark.parametrize("note", ["plain text", "{}", '{"wavelengths": [1], "parts": [], "attrs": 1}'])
    def test_a_note_that_is_not_ours(self, tmp_path, note):
        header = {"fluorspar": note}
        pixels = {"S0.550,000000nm": np.ones((2, 3), np.float32)}
        with OpenEXR.File(header, pixels) as file:
            file.write(str(tmp_path / "a.exr"))
        with pytest.raises(ImageError, match=r"(?s)not a spectral image of Fluorspar.*a\.exr"):
            SpectralImage.open(tmp_path / "a.exr")
