"""SpectralImage: sums of components, colours, spectra, and what is said about wrong data."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fluorspar.colour.whiteness import CIE_1964
from fluorspar.colour.xyz import observer_weights
from fluorspar.errors import ImageError, OptionError
from fluorspar.image.components import COMPONENTS, SINGLE_BOUNCE
from fluorspar.image.dataset import decoded_attrs, plain_attrs
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths


class TestSums:
    def test_the_components_add_up_to_the_total_bit_for_bit(self, image):
        expected = np.zeros(image.shape[1:], np.float32)
        for name in COMPONENTS:
            expected += image.component(name).values
        np.testing.assert_array_equal(image.total().values, expected)

    def test_each_sum_takes_its_components_and_no_others(self, make_image):
        """Component k holds the number 2^k, so every sum tells which components are in it."""
        image = make_image(height=2, width=2)
        image.dataset["radiance"][...] = 2.0 ** np.arange(7)[:, None, None, None]
        assert np.unique(image.total()) == 127
        assert np.unique(image.total(single_bounce=True)) == 63
        assert np.unique(image.reflected()) == 2 + 8
        assert np.unique(image.luminescent()) == 4 + 16 + 32
        assert np.unique(image.component("direct_luminescence")) == 4

    def test_an_image_of_the_staged_method_has_no_reexcitation_and_still_a_total(self, image):
        staged = SpectralImage(image.dataset.sel(component=list(SINGLE_BOUNCE)))
        np.testing.assert_array_equal(staged.total(), image.total(single_bounce=True))
        with pytest.raises(OptionError, match="no such component"):
            staged.component("reexcitation")

    def test_sums_leave_the_components_as_they_are(self, image):
        before = image.dataset.copy(deep=True)
        image.total(), image.srgb(), image.luminance(), repr(image)
        xr.testing.assert_identical(image.dataset, before)


class TestLabels:
    def test_sizes_and_grid(self, make_image):
        image = make_image(height=3, width=5, grid=Wavelengths(300, 780, 2.5))
        assert image.shape == (7, 3, 5, 193)
        assert image.size == (5, 3)
        assert image.wavelengths == Wavelengths(300, 780, 2.5)

    def test_units_are_stated(self, image):
        assert image.total().attrs["units"] == "W m-2 sr-1 nm-1"
        assert image.total().wavelength.attrs == {
            "units": "nm",
            "standard_name": "radiation_wavelength",
        }

    def test_attributes_can_be_written_to_any_file_and_come_back(self, image):
        assert all(isinstance(value, str | int | float) for value in image.dataset.attrs.values())
        assert image.attrs["timings"]["trace"] == 1.2345678901234567
        odd = {"none": None, "flag": np.True_, "count": np.int64(3), "sizes": (1, 2), "text": "{not json"}
        expected = {"flag": 1, "count": 3, "sizes": [1, 2], "text": "{not json"}
        assert decoded_attrs(plain_attrs(odd)) == expected

    def test_float32_arrays_are_not_copied(self):
        radiance = np.ones((7, 2, 2, 69), np.float32)
        image = SpectralImage.from_arrays(radiance, Wavelengths())
        assert np.shares_memory(image.component("source").values, radiance)


class TestSpectrumAt:
    def test_it_is_the_pixel_asked_for(self, image):
        pixel = image.spectrum_at(x=3, y=11)
        np.testing.assert_array_equal(pixel.radiance, image.dataset.radiance[:, 11, 3])
        np.testing.assert_array_equal(pixel.total, image.total()[11, 3])
        np.testing.assert_array_equal(pixel.standard_error, image.dataset.standard_error[11, 3])

    @pytest.mark.parametrize(("x", "y"), [(20, 0), (0, 12), (-21, 0), (0, -13)])
    def test_a_pixel_outside_is_an_error_that_states_the_range(self, image, x, y):
        with pytest.raises(OptionError, match=r"(?s)outside.*x from 0 to 19, y from 0 to 11"):
            image.spectrum_at(x, y)


class TestColour:
    def test_luminance_of_monochromatic_light_is_683_lm_per_watt_at_555_nm(self, make_image):
        """1 W m-2 sr-1 within the band at 555 nm, in one component: V = 1, so 683 cd/m2."""
        image = make_image(height=1, width=1)
        image.dataset["radiance"][...] = 0
        image.dataset["radiance"].loc[{"component": "direct_reflection", "wavelength": 555}] = 1 / 5
        assert image.luminance().item() == pytest.approx(683, rel=1e-4)
        assert image.luminance("luminescent").item() == 0

    def test_xyz_adds_up_over_components(self, image):
        parts = sum(image.xyz(name).values for name in COMPONENTS)
        np.testing.assert_allclose(image.xyz().values, parts, rtol=1e-5)

    def test_rows_are_taken_in_blocks_without_a_seam(self, image, monkeypatch):
        whole = image.xyz().values
        monkeypatch.setattr("fluorspar.image.dataset._BLOCK_BYTES", 5 * 4 * 20 * 69)
        np.testing.assert_allclose(image.xyz().values, whole, rtol=1e-12)

    def test_a_visible_lamp_does_not_set_the_exposure(self, image):
        dim = image.srgb().exposure
        image.dataset["radiance"][0] *= 1000
        assert image.srgb().exposure == dim

    def test_a_visible_lamp_is_seen_all_the_same(self, image):
        assert image.srgb()[:2, :3].min() > 0.999

    def test_one_pixel_in_a_hundred_does_not_set_the_exposure(self, make_image):
        image = make_image(height=20, width=20)
        before = image.srgb().exposure
        image.dataset["radiance"][1, 7, 7] *= 1000  # a firefly
        assert image.srgb().exposure == pytest.approx(before, rel=0.02)

    def test_automatic_exposure_shows_the_brightest_channel_just_below_its_end(self, image):
        for component in ("direct_reflection", "luminescent_reflection", "total"):
            brightest = image.srgb(component).max("channel").values[3:]
            assert 0.97 < np.percentile(brightest, 99) <= 1.0

    def test_a_given_exposure_is_used_and_reported(self, image):
        picture = image.srgb("reflected", exposure=1e-4)
        assert picture.exposure == 1e-4
        assert picture.dtype == np.float32
        half = image.srgb("reflected", exposure=5e-5)
        assert (half <= picture).all()
        assert (half < picture).any()

    def test_twice_the_light_at_half_the_exposure_looks_the_same(self, image):
        before = image.srgb(exposure=1e-4).values
        image.dataset["radiance"][...] *= 2
        np.testing.assert_allclose(image.srgb(exposure=5e-5).values, before, atol=1e-6)

    def test_colours_beyond_srgb_are_counted(self, make_image):
        image = make_image(height=2, width=2)
        image.dataset["radiance"][...] = 0
        image.dataset["radiance"][1, 0, :, 32] = 1  # 520 nm alone: more saturated than any display
        assert image.srgb(exposure=1e-6).out_of_gamut == 0.5

    def test_pixels_that_were_not_rendered_stay_unknown_and_disturb_nothing(self, image):
        complete = image.srgb(exposure=1e-4).values
        image.dataset["radiance"][:, 6:] = np.nan
        partial = image.srgb(exposure=1e-4).values
        np.testing.assert_array_equal(partial[:6], complete[:6])
        assert np.isnan(partial[6:]).all()
        assert np.isfinite(image.srgb().exposure)

    def test_a_black_image_is_black(self, image):
        image.dataset["radiance"][...] = 0
        assert image.srgb().max() == 0

    def test_the_observer_of_10_degrees(self, image):
        """Luminance is that of CIE 1931 whoever looks; the weights of both observers differ."""
        wide = image.xyz(observer=CIE_1964)
        expected = image.total().values.astype(float) @ observer_weights(image.wavelengths, CIE_1964)
        np.testing.assert_allclose(wide, expected, rtol=1e-5)
        assert not np.allclose(wide, image.xyz(), rtol=0.01)
        assert (image.xyz().attrs["units"], wide.attrs["units"]) == ("cd m-2", "relative")
        assert "CIE 1964" in wide.attrs["long_name"]

    def test_an_unknown_observer_is_an_error(self, image):
        with pytest.raises(OptionError, match="no such observer"):
            image.xyz(observer="CIE 2100")

    @pytest.mark.parametrize("white", ["A", [109.85, 100.0, 35.58]])
    def test_a_white_that_the_eye_is_adapted_to_is_shown_as_white(self, make_image, white):
        image = make_image(height=2, width=2, grid=Wavelengths(360, 780, 5))
        image.dataset["radiance"][...] = 0
        image.dataset["radiance"][1] = illuminant("A").on(image.wavelengths)
        plain, adapted = image.srgb(), image.srgb(white=white)
        assert float(np.ptp(plain.values[0, 0])) > 0.3
        np.testing.assert_allclose(adapted[0, 0], 1, atol=3e-3)

    @pytest.mark.parametrize("white", [[1, 0, 1], [1, 1], [1, np.nan, 1]])
    def test_an_impossible_white_is_an_error(self, image, white):
        with pytest.raises(OptionError, match="a white is impossible"):
            image.srgb(white=white)

    @pytest.mark.parametrize("exposure", [0, -1, np.nan, np.inf])
    def test_an_impossible_exposure_is_an_error(self, image, exposure):
        with pytest.raises(OptionError, match="exposure"):
            image.srgb(exposure=exposure)


class TestRepr:
    def test_it_says_what_the_image_is(self, image):
        text = repr(image)
        for fact in ("20 x 12 pixels", "360-700 nm by 5, 69 bands", "paths", "64 per pixel, seed 7"):
            assert fact in text
        assert "partial" not in text

    def test_the_shares_of_the_components_are_those_of_the_luminance(self, image):
        whole = image.luminance().mean()
        lines = [line.split() for line in repr(image).splitlines()]
        for name in COMPONENTS:
            share = 100 * float(image.luminance(name).mean() / whole)
            assert [name, f"{share:.3g}", "%"] in lines

    def test_the_standard_error_is_relative_to_the_light_without_lamps(self, image):
        assert "2 % of the radiance without lamps" in repr(image)

    def test_an_unfinished_image_says_so(self, image):
        image.dataset.attrs["partial"] = 1
        image.dataset["radiance"][:, 6:] = np.nan
        assert "partial" in repr(image)
        assert " nan" not in repr(image).split()

    @pytest.mark.parametrize(
        ("attrs", "text"),
        [
            ({"timings": '{"render": 1.5}'}, "the render was stopped before its end"),
            ({}, "not finished, being written or stopped"),  # a store that is not closed
        ],
    )
    def test_it_is_stopped_only_if_its_writer_says_so(self, image, attrs, text):
        image.dataset.attrs.pop("timings", None)
        image.dataset.attrs |= {"partial": 1, **attrs}
        assert f"{text}: 100 % of the pixels" in repr(image)

    def test_a_bare_image_has_one_too(self):
        assert "0 cd/m2" in repr(SpectralImage.from_arrays(np.zeros((7, 2, 2, 69)), Wavelengths()))

    def test_notebooks_get_a_picture(self, image):
        assert image._repr_png_().startswith(b"\x89PNG")
        assert "data:image/png;base64," in image._repr_html_()
        assert "synthetic, with a µ" in image._repr_html_()


class TestWrongData:
    @pytest.mark.parametrize(
        ("change", "problem"),
        [
            (lambda d: d.drop_vars("radiance"), "no variable 'radiance'"),
            (lambda d: d.transpose("y", "x", "component", "wavelength"), "the dims"),
            (lambda d: d.drop_vars("wavelength"), "no coordinate 'wavelength'"),
            (lambda d: d.isel(component=slice(None, None, -1)), "its components are reexcitation"),
            (lambda d: d.isel(wavelength=[0, 5, 1]), "wavelengths do not ascend"),
        ],
    )
    def test_another_layout_is_an_error_that_names_the_difference(self, image, change, problem):
        with pytest.raises(ImageError, match=problem):
            SpectralImage(change(image.dataset))

    @pytest.mark.parametrize(
        ("shape", "error_shape", "where"),
        [
            ((6, 2, 3, 69), None, "radiance"),
            ((7, 2, 3, 68), None, "radiance"),
            ((7, 2, 69), None, "radiance"),
            ((7, 2, 3, 69), (3, 2, 69), "standard_error"),
        ],
    )
    def test_a_wrong_shape_is_an_error_that_names_the_array(self, shape, error_shape, where):
        error = None if error_shape is None else np.zeros(error_shape)
        with pytest.raises(ImageError, match=rf"wrong shape\n  where:    {where}\n"):
            SpectralImage.from_arrays(np.zeros(shape), Wavelengths(), error)

    def test_an_attribute_that_cannot_be_stored_is_an_error(self):
        with pytest.raises(ImageError, match=r"(?s)cannot be stored.*scene"):
            SpectralImage.from_arrays(np.zeros((7, 1, 1, 69)), Wavelengths(), attrs={"scene": object()})

    @pytest.mark.parametrize("name", ["room", "room.tif", "room.png"])
    def test_an_unknown_suffix_is_an_error_that_lists_the_known_ones(self, name):
        with pytest.raises(ImageError, match=r"(?s)kind of file.*\.nc, \.exr"):
            SpectralImage.open(name)

    def test_saving_to_an_unknown_suffix_writes_nothing(self, image, tmp_path):
        with pytest.raises(ImageError, match=r"\.nc, \.exr, \.hdr, \.zarr, \.png"):
            image.save(tmp_path / "room.tif")
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("observer", ["2", 2, "cie 1931 2 degree standard observer"])
def test_the_observer_of_1931_in_any_spelling_gives_luminance(image, observer):
    assert image.xyz(observer=observer).attrs["units"] == "cd m-2"
    np.testing.assert_array_equal(image.xyz(observer=observer), image.xyz())


class TestPartial:
    def test_what_is_finished_is_described(self, image):
        """The upper three of twelve rows."""
        expected = repr(SpectralImage(image.dataset.isel(y=slice(0, 3))))
        image.dataset.attrs["partial"] = 1
        for name in ("radiance", "standard_error"):
            image.dataset[name].loc[{"y": slice(3, None)}] = np.nan
        said = repr(SpectralImage(image.dataset))
        assert "25 % of the pixels are finished" in said
        assert " nan" not in said
        for line in expected.splitlines()[6:]:
            assert line in said

    def test_nothing_is_finished(self, image):
        image.dataset.attrs["partial"] = 1
        image.dataset["radiance"][:] = np.nan
        image.dataset["standard_error"][:] = np.nan
        said = repr(SpectralImage(image.dataset))
        assert ": 0 % of the pixels are finished" in said
        assert " nan" not in said

    def test_errors_of_single_samples(self, image):
        image.dataset["standard_error"][:] = np.nan
        assert " nan" not in repr(SpectralImage(image.dataset))
