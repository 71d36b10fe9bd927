"""NetCDF files: nothing is lost, whole or in pieces, and no older file is harmed."""

from __future__ import annotations

import signal

import numpy as np
import pytest
import xarray as xr

from fluorspar.errors import ImageError, OptionError
from fluorspar.image.formats import netcdf_layout
from fluorspar.image.formats.netcdf import NetcdfWriter, read_netcdf, write_netcdf
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths


def by_pixels(image):
    """Radiance (pixels, C, N) and standard errors (pixels, N) of an image, as a renderer hands them over."""
    components, height, width, bands = image.shape
    pixels = height * width
    radiance = np.moveaxis(image.dataset.radiance.values, 0, 2).reshape(pixels, components, bands)
    return radiance, image.dataset.standard_error.values.reshape(pixels, bands)


class TestRoundTrip:
    @pytest.mark.parametrize("grid", ["360:700:5", "300:780:2.5", "400:700:0.3"])
    def test_values_labels_and_attributes_come_back_as_they_were(self, make_image, tmp_path, grid):
        image = make_image(grid=Wavelengths.parse(grid), component_errors=True)
        image.dataset["radiance"][:, 5:, 7] = np.nan
        write_netcdf(image.dataset, tmp_path / "a.nc")
        with SpectralImage.open(tmp_path / "a.nc") as read:
            xr.testing.assert_identical(read.dataset.load(), image.dataset)
            assert read.dataset.radiance.dtype == np.float32
            assert read.attrs == image.attrs

    def test_xarray_reads_it_without_us(self, image, tmp_path):
        image.save(tmp_path / "a.nc")
        with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as dataset:
            xr.testing.assert_identical(dataset.load(), image.dataset)

    def test_an_image_is_read_when_it_is_used(self, image, tmp_path):
        image.save(tmp_path / "a.nc")
        with SpectralImage.open(tmp_path / "a.nc") as read:
            np.testing.assert_array_equal(read.total(), image.total())
            np.testing.assert_array_equal(read.xyz(), image.xyz())
            assert not read.dataset.radiance.variable._in_memory

    def test_an_image_can_be_saved_over_the_file_it_is_read_from(self, image, tmp_path):
        image.save(tmp_path / "a.nc")
        with SpectralImage.open(tmp_path / "a.nc") as read:
            read.save(tmp_path / "a.nc")
        with SpectralImage.open(tmp_path / "a.nc") as read:
            xr.testing.assert_identical(read.dataset.load(), image.dataset)

    def test_compressed(self, image, tmp_path):
        image.save(tmp_path / "a.nc")
        image.save(tmp_path / "b.nc", compress=True)
        with SpectralImage.open(tmp_path / "b.nc") as read:
            xr.testing.assert_identical(read.dataset.load(), image.dataset)
        plain, packed = ((tmp_path / name).stat().st_size for name in ("a.nc", "b.nc"))
        assert packed < 0.8 * plain
        with pytest.raises(OptionError, match=r"(?s)only a NetCDF file.*c\.exr"):
            image.save(tmp_path / "c.exr", compress=True)

    def test_attributes_may_be_long(self, image, tmp_path):
        """HDF5 keeps attributes above 64 KiB in another way."""
        image.dataset.attrs["materials"] = "m" * 300_000
        image.save(tmp_path / "a.nc")
        with SpectralImage.open(tmp_path / "a.nc") as read:
            assert read.dataset.attrs == image.dataset.attrs


class TestWriter:
    @pytest.mark.parametrize("count", [1, 7, 20, 33, 240])
    @pytest.mark.parametrize("order", ["forward", "shuffled"])
    def test_pieces_of_any_length_in_any_order_make_the_same_file(
        self, image, tmp_path, monkeypatch, count, order
    ):
        """Blocks of 3 rows, so that pieces begin and end within them."""
        monkeypatch.setattr(netcdf_layout, "chunk_rows", lambda *_: 3)
        radiance, error = by_pixels(image)
        firsts = np.arange(0, len(radiance), count)
        if order == "shuffled":
            np.random.default_rng(0).shuffle(firsts)
        with NetcdfWriter(tmp_path / "a.nc", image.wavelengths, 12, 20, image.attrs) as writer:
            for first in firsts:
                writer.write_pixels(first, radiance[first : first + count], error[first : first + count])
        xr.testing.assert_identical(read_netcdf(tmp_path / "a.nc").load(), image.dataset)

    def test_errors_of_components_are_kept_if_announced(self, make_image, tmp_path):
        image = make_image(component_errors=True)
        radiance, error = by_pixels(image)
        of_components = np.moveaxis(image.dataset.component_standard_error.values, 0, 2).reshape(
            radiance.shape
        )
        with NetcdfWriter(tmp_path / "a.nc", image.wavelengths, 12, 20, image.attrs, True) as writer:
            writer.write_pixels(0, radiance, error, of_components)
        xr.testing.assert_identical(read_netcdf(tmp_path / "a.nc").load(), image.dataset)

    def test_what_was_not_rendered_is_nan_and_the_file_says_partial(self, image, tmp_path):
        radiance, error = by_pixels(image)
        writer = NetcdfWriter(tmp_path / "a.nc", image.wavelengths, 12, 20, {"spp": 64})
        writer.write_pixels(30, radiance[30:75], error[30:75])
        writer.close(partial=True, attrs={"timings": {"trace": 2.5}})
        with SpectralImage.open(tmp_path / "a.nc") as read:
            assert read.attrs == {"spp": 64, "timings": {"trace": 2.5}, "partial": 1}
            known, errors = by_pixels(read)
        np.testing.assert_array_equal(known[30:75], radiance[30:75])
        np.testing.assert_array_equal(errors[30:75], error[30:75])
        for pixels in (known, errors):
            assert np.isnan(pixels[:30]).all()
            assert np.isnan(pixels[75:]).all()

    def test_missing_pixels_make_a_file_partial_even_if_nobody_said_so(self, image, tmp_path):
        radiance, error = by_pixels(image)
        with NetcdfWriter(tmp_path / "a.nc", image.wavelengths, 12, 20) as writer:
            writer.write_pixels(0, radiance[:-1], error[:-1])
        assert read_netcdf(tmp_path / "a.nc").attrs == {"partial": 1}

    def test_pixels_written_twice_count_once(self, image, tmp_path):
        radiance, error = by_pixels(image)
        with NetcdfWriter(tmp_path / "a.nc", image.wavelengths, 12, 20) as writer:
            writer.write_pixels(0, 0 * radiance[:200], error[:200])
            writer.write_pixels(0, radiance[:200], error[:200])
        dataset = read_netcdf(tmp_path / "a.nc").load()
        assert dataset.attrs == {"partial": 1}
        expected = radiance[:200]
        np.testing.assert_array_equal(by_pixels(SpectralImage(dataset))[0][:200], expected)

    @pytest.mark.parametrize(
        ("first", "shape", "error_shape", "problem"),
        [
            (-1, (5, 7, 69), (5, 69), r"(?s)outside the image.*0 to 239"),
            (236, (5, 7, 69), (5, 69), "outside the image"),
            (0, (5, 7, 68), (5, 68), r"(?s)wrong shape.*radiance.*\(5, 7, 69\)"),
            (0, (5, 7, 69), (4, 69), r"(?s)wrong shape.*standard_error"),
        ],
    )
    def test_pixels_that_do_not_fit_are_an_error(self, tmp_path, first, shape, error_shape, problem):
        with (
            NetcdfWriter(tmp_path / "a.nc", Wavelengths(), 12, 20) as writer,
            pytest.raises(ImageError, match=problem),
        ):
            writer.write_pixels(first, np.zeros(shape), np.zeros(error_shape))

    def test_a_closed_file_takes_no_more(self, tmp_path):
        writer = NetcdfWriter(tmp_path / "a.nc", Wavelengths(), 1, 1)
        writer.write_pixels(0, np.zeros((1, 7, 69)), np.zeros((1, 69)))
        writer.close()
        with pytest.raises(ImageError, match="closed"):
            writer.write_pixels(0, np.zeros((1, 7, 69)), np.zeros((1, 69)))
        with pytest.raises(ImageError, match="closed"):
            writer.close()

    def test_ctrl_c_tears_no_row_apart(self, image, tmp_path, monkeypatch):
        """The signal comes while pixels are being filed; all are there when KeyboardInterrupt is raised."""
        radiance, error = by_pixels(image)
        put = NetcdfWriter._put

        def interrupted(writer, *what):
            signal.raise_signal(signal.SIGINT)
            put(writer, *what)

        with NetcdfWriter(tmp_path / "a.nc", image.wavelengths, 12, 20, image.attrs) as writer:
            monkeypatch.setattr(NetcdfWriter, "_put", interrupted)
            with pytest.raises(KeyboardInterrupt):
                writer.write_pixels(0, radiance, error)
        xr.testing.assert_identical(read_netcdf(tmp_path / "a.nc").load(), image.dataset)


class TestFailures:
    """Whatever goes wrong, an older file is intact and no temporary file is left."""

    @pytest.fixture
    def target(self, tmp_path):
        path = tmp_path / "old.nc"
        path.write_bytes(b"precious")
        yield path
        assert path.read_bytes() == b"precious"
        assert [file.name for file in tmp_path.iterdir()] == ["old.nc"]

    def test_an_exception_while_rendering(self, target):
        def render():
            with NetcdfWriter(target, Wavelengths(), 12, 20) as writer:
                writer.write_pixels(0, np.zeros((30, 7, 69)), np.zeros((30, 69)))
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            render()

    def test_a_full_disk_while_rendering(self, target, file_size_limit):
        def render():
            with NetcdfWriter(target, Wavelengths(), 120, 200) as writer:
                for first in range(0, 24_000, 1000):
                    writer.write_pixels(first, np.ones((1000, 7, 69)), np.ones((1000, 69)))

        with file_size_limit(2_000_000), pytest.raises(ImageError, match=r"(?s)disk is full.*unchanged"):
            render()

    def test_a_full_disk_at_the_very_end(self, target, image, tmp_path_factory, file_size_limit):
        """Only the last 100 bytes do not fit, which are written while the file is being closed."""
        elsewhere = tmp_path_factory.mktemp("whole") / "a.nc"
        radiance, error = by_pixels(image)

        def render(path):
            with NetcdfWriter(path, image.wavelengths, 12, 20) as writer:
                writer.write_pixels(0, radiance, error)

        render(elsewhere)
        with (
            file_size_limit(elsewhere.stat().st_size - 100),
            pytest.raises(ImageError, match="disk is full"),
        ):
            render(target)

    @pytest.mark.parametrize("share", [0.2, 0.999])
    def test_a_full_disk_while_saving(self, image, target, tmp_path_factory, share, file_size_limit):
        elsewhere = tmp_path_factory.mktemp("whole") / "a.nc"
        image.save(elsewhere)
        with (
            file_size_limit(int(share * elsewhere.stat().st_size)),
            pytest.raises(ImageError, match="disk is full"),
        ):
            image.save(target)

    def test_too_little_space_is_noticed_before_rendering(self, target):
        with pytest.raises(ImageError, match=r"too little space"):
            NetcdfWriter(target, Wavelengths(), 10_000_000, 10_000_000)

    def test_an_attribute_that_cannot_be_stored_is_noticed_before_rendering(self, target):
        with pytest.raises(ImageError, match="cannot be stored"):
            NetcdfWriter(target, Wavelengths(), 1, 1, {"scene": object()})

    def test_an_attribute_that_cannot_be_stored_at_the_end(self, target):
        writer = NetcdfWriter(target, Wavelengths(), 1, 1)
        with pytest.raises(ImageError, match="cannot be stored"):
            writer.close(attrs={"timings": object()})


@pytest.mark.parametrize("name", ["a.nc", "a.exr", "a.png"])
def test_a_missing_directory_is_an_error_that_says_how_to_make_it(image, tmp_path, name):
    with pytest.raises(ImageError, match=rf"(?s)directory .* does not exist.*{name}.*mkdir -p"):
        image.save(tmp_path / "nowhere" / name)


class TestUnreadableFiles:
    def test_missing(self, tmp_path):
        with pytest.raises(ImageError, match=r"(?s)does not exist.*a\.nc"):
            SpectralImage.open(tmp_path / "a.nc")

    @pytest.mark.parametrize("left", [0.99, 0.5, 0.001])
    def test_truncated(self, image, tmp_path, left):
        image.save(tmp_path / "a.nc")
        content = (tmp_path / "a.nc").read_bytes()
        (tmp_path / "a.nc").write_bytes(content[: int(left * len(content))])
        with pytest.raises(ImageError, match=r"truncated|not readable"):
            SpectralImage.open(tmp_path / "a.nc")

    def test_not_netcdf(self, tmp_path):
        (tmp_path / "a.nc").write_text("wavelength,value\n400,1\n")
        with pytest.raises(ImageError, match=r"(?s)not readable.*a\.nc"):
            SpectralImage.open(tmp_path / "a.nc")

    def test_another_data_set(self, tmp_path):
        xr.Dataset({"temperature": ("x", [1.0, 2.0])}).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with pytest.raises(ImageError, match=r"(?s)not a spectral image of Fluorspar.*a\.nc"):
            SpectralImage.open(tmp_path / "a.nc")
