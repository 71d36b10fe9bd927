"""Zarr stores: nothing is lost, whole or in pieces; they can be read meanwhile, and no older one is harmed."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fluorspar.errors import ImageError, OptionError
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

pytest.importorskip("zarr")

from fluorspar.image.formats import zarr_layout, zarr_writer
from fluorspar.image.formats.zarr import read_zarr
from fluorspar.image.formats.zarr_writer import ZarrWriter


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    """Of 5 rows and 10 columns, so that images of the tests have several, some of them cut."""
    monkeypatch.setattr(zarr_layout, "_CHUNK_ROWS", 5)
    monkeypatch.setattr(zarr_layout, "_CHUNK_BYTES", 5 * 12 * 69 * 4)


def by_pixels(image):
    """Radiance (pixels, C, N) and standard errors (pixels, N) of an image, as a renderer hands them over."""
    components, height, width, bands = image.shape
    pixels = height * width
    radiance = np.moveaxis(image.dataset.radiance.values, 0, 2).reshape(pixels, components, bands)
    return radiance, image.dataset.standard_error.values.reshape(pixels, bands)


class TestRoundTrip:
    @pytest.mark.parametrize("grid", ["360:700:5", "300:780:20", "400:700:0.3"])
    def test_values_labels_and_attributes_come_back_as_they_were(self, make_image, tmp_path, grid):
        image = make_image(grid=Wavelengths.parse(grid), component_errors=True)
        image.dataset["radiance"][:, 5:, 7] = np.nan
        image.save(tmp_path / "a.zarr")
        with SpectralImage.open(tmp_path / "a.zarr") as read:
            xr.testing.assert_identical(read.dataset.load(), image.dataset)
            assert read.dataset.radiance.dtype == np.float32
            assert read.attrs == image.attrs

    @pytest.mark.parametrize("options", [{}, {"chunks": None}], ids=["dask", "no dask"])
    def test_xarray_reads_it_without_us(self, image, tmp_path, options):
        if not options:
            pytest.importorskip("dask")
        image.save(tmp_path / "a.zarr")
        with xr.open_zarr(tmp_path / "a.zarr", **options) as dataset:
            assert dataset.radiance.encoding["chunks"] == (1, 5, 10, 69)
            np.testing.assert_array_equal(SpectralImage(dataset).total(), image.total())
            names = [str(name) for name in dataset.component.values]
            xr.testing.assert_identical(dataset.load().assign_coords(component=names), image.dataset)

    def test_a_store_that_xarray_wrote_is_read(self, image, tmp_path):
        image.dataset.to_zarr(tmp_path / "a.zarr", zarr_format=2, consolidated=False)
        xr.testing.assert_identical(read_zarr(tmp_path / "a.zarr").load(), image.dataset)

    def test_only_the_chunks_that_are_used_are_read(self, image, tmp_path):
        image.save(tmp_path / "a.zarr")
        with SpectralImage.open(tmp_path / "a.zarr") as read:
            for chunk in (tmp_path / "a.zarr/radiance/c/3").rglob("0/0/0"):
                chunk.write_bytes(b"damaged")
            np.testing.assert_array_equal(read.component("source"), image.component("source"))
            np.testing.assert_array_equal(read.spectrum_at(15, 2).radiance, image.spectrum_at(15, 2).radiance)
            with pytest.raises(ImageError, match=r"(?s)cannot be read.*a\.zarr"):
                read.total()

    def test_an_image_can_be_saved_over_the_store_it_is_read_from(self, image, tmp_path):
        image.save(tmp_path / "a.zarr")
        with SpectralImage.open(tmp_path / "a.zarr") as read:
            read.save(tmp_path / "a.zarr")
        xr.testing.assert_identical(read_zarr(tmp_path / "a.zarr").load(), image.dataset)
        assert [path.name for path in tmp_path.iterdir()] == ["a.zarr"]

    def test_it_takes_no_choice_of_compression(self, image, tmp_path):
        with pytest.raises(OptionError, match="only a NetCDF file"):
            image.save(tmp_path / "a.zarr", compress=True)


class TestWriter:
    @pytest.mark.parametrize("count", [1, 7, 20, 33, 240])
    @pytest.mark.parametrize("order", ["forward", "shuffled"])
    def test_pieces_of_any_length_in_any_order_make_the_same_store(
        self, image, tmp_path, monkeypatch, count, order
    ):
        """Only two rows of chunks fit into memory, so that shuffled pieces have to be put aside."""
        monkeypatch.setattr(zarr_writer, "_BUFFER_BYTES", 0)
        radiance, error = by_pixels(image)
        firsts = np.arange(0, len(radiance), count)
        if order == "shuffled":
            np.random.default_rng(0).shuffle(firsts)
        with ZarrWriter(tmp_path / "a.zarr", image.wavelengths, 12, 20, image.attrs) as writer:
            for first in firsts:
                writer.write_pixels(first, radiance[first : first + count], error[first : first + count])
                assert len(writer._blocks) <= 2
            assert writer.finished_pixels == 240
        xr.testing.assert_identical(read_zarr(tmp_path / "a.zarr").load(), image.dataset)
        assert [path.name for path in tmp_path.iterdir()] == ["a.zarr"]

    def test_errors_of_components_are_kept_if_announced(self, make_image, tmp_path):
        image = make_image(component_errors=True)
        radiance, error = by_pixels(image)
        errors = np.moveaxis(image.dataset.component_standard_error.values, 0, 2).reshape(radiance.shape)
        with ZarrWriter(tmp_path / "a.zarr", image.wavelengths, 12, 20, image.attrs, True) as writer:
            writer.write_pixels(0, radiance, error, errors)
        xr.testing.assert_identical(read_zarr(tmp_path / "a.zarr").load(), image.dataset)

    def test_it_is_read_while_it_is_being_written(self, image, tmp_path):
        radiance, error = by_pixels(image)
        with ZarrWriter(tmp_path / "a.zarr", image.wavelengths, 12, 20, image.attrs) as writer:
            writer.write_pixels(0, radiance[:130], error[:130])
            with xr.open_zarr(tmp_path / "a.zarr", chunks=None) as seen:
                assert seen.attrs["partial"] == 1
                np.testing.assert_array_equal(seen.radiance[:, :5], image.dataset.radiance[:, :5])
                assert np.isnan(seen.radiance[:, 7:]).all()
            writer.write_pixels(130, radiance[130:], error[130:])
        assert "partial" not in read_zarr(tmp_path / "a.zarr").attrs

    def test_what_was_not_rendered_is_nan_and_the_store_says_partial(self, image, tmp_path):
        radiance, error = by_pixels(image)
        writer = ZarrWriter(tmp_path / "a.zarr", image.wavelengths, 12, 20, {"spp": 64})
        writer.write_pixels(30, radiance[30:75], error[30:75])
        writer.close(partial=True, attrs={"timings": {"trace": 2.5}})
        with SpectralImage.open(tmp_path / "a.zarr") as read:
            assert read.attrs == {"spp": 64, "timings": {"trace": 2.5}, "partial": 1}
            known, errors = by_pixels(read)
        np.testing.assert_array_equal(known[30:75], radiance[30:75])
        np.testing.assert_array_equal(errors[30:75], error[30:75])
        for pixels in (known, errors):
            assert np.isnan(pixels[:30]).all()
            assert np.isnan(pixels[75:]).all()

    @pytest.mark.parametrize(
        ("first", "shape", "error_shape", "problem"),
        [
            (-1, (5, 7, 69), (5, 69), r"(?s)outside the image.*0 to 239"),
            (236, (5, 7, 69), (5, 69), "outside the image"),
            (0, (5, 7, 68), (5, 68), r"(?s)wrong shape.*radiance.*\(5, 7, 69\)"),
        ],
    )
    def test_pixels_that_do_not_fit_are_an_error(self, tmp_path, first, shape, error_shape, problem):
        with (
            ZarrWriter(tmp_path / "a.zarr", Wavelengths(), 12, 20) as writer,
            pytest.raises(ImageError, match=problem),
        ):
            writer.write_pixels(first, np.zeros(shape), np.zeros(error_shape))

    def test_a_closed_store_takes_no_more(self, tmp_path):
        writer = ZarrWriter(tmp_path / "a.zarr", Wavelengths(), 1, 1)
        writer.write_pixels(0, np.zeros((1, 7, 69)), np.zeros((1, 69)))
        writer.close()
        with pytest.raises(ImageError, match="closed"):
            writer.write_pixels(0, np.zeros((1, 7, 69)), np.zeros((1, 69)))
        with pytest.raises(ImageError, match="closed"):
            writer.close()

    def test_ctrl_c_tears_no_row_apart(self, image, tmp_path, monkeypatch):
        radiance, error = by_pixels(image)
        file_pixels = ZarrWriter._block

        def interrupted(writer, number):
            signal.raise_signal(signal.SIGINT)
            return file_pixels(writer, number)

        with ZarrWriter(tmp_path / "a.zarr", image.wavelengths, 12, 20, image.attrs) as writer:
            monkeypatch.setattr(ZarrWriter, "_block", interrupted)
            with pytest.raises(KeyboardInterrupt):
                writer.write_pixels(0, radiance, error)
        xr.testing.assert_identical(read_zarr(tmp_path / "a.zarr").load(), image.dataset)


@pytest.fixture(params=["nothing", "older store"])
def target(request, image, tmp_path):
    """Where a store is to be written; in the end what was there is as it was, and nothing else is."""
    path = tmp_path / "old.zarr"
    if request.param == "nothing":
        yield path
        assert not list(tmp_path.iterdir())
        return
    image.save(path)
    before = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    yield path
    assert {file: file.read_bytes() for file in path.rglob("*") if file.is_file()} == before
    assert [file.name for file in tmp_path.iterdir()] == ["old.zarr"]


class TestFailures:
    def test_an_exception_while_rendering(self, target):
        def render():
            with ZarrWriter(target, Wavelengths(), 12, 20) as writer:
                writer.write_pixels(0, np.zeros((130, 7, 69)), np.zeros((130, 69)))
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            render()

    def test_a_full_disk_while_rendering(self, target, file_size_limit):
        noise = np.random.default_rng(0).random((240, 7, 69))

        def render():
            with ZarrWriter(target, Wavelengths(), 12, 20) as writer:
                writer.write_pixels(0, noise, noise[:, 0])

        with file_size_limit(10_000), pytest.raises(ImageError, match=r"(?s)disk is full.*unchanged"):
            render()

    def test_a_full_disk_while_saving(self, image, target, file_size_limit):
        with file_size_limit(10_000), pytest.raises(ImageError, match="disk is full"):
            image.save(target)

    def test_an_attribute_that_cannot_be_stored_at_the_end(self, target):
        writer = ZarrWriter(target, Wavelengths(), 1, 1)
        with pytest.raises(ImageError, match="cannot be stored"):
            writer.close(attrs={"timings": object()})


def test_a_killed_writer_leaves_the_older_store_and_the_next_one_tidies_up(image, tmp_path):
    image.save(tmp_path / "a.zarr")
    killed = """
        import os, sys, numpy as np
        from fluorspar.image.formats.zarr_writer import ZarrWriter
        from fluorspar.spectral.wavelengths import Wavelengths
        writer = ZarrWriter(sys.argv[1], Wavelengths(), 12, 20)
        writer.write_pixels(0, np.zeros((200, 7, 69)), np.zeros((200, 69)))
        os.kill(os.getpid(), 9)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(killed), str(tmp_path / "a.zarr")], check=False)
    assert len(list(tmp_path.iterdir())) == 3  # with its lock
    xr.testing.assert_identical(read_zarr(tmp_path / "a.zarr").load(), image.dataset)
    image.save(tmp_path / "a.zarr")
    assert [path.name for path in tmp_path.iterdir()] == ["a.zarr"]


class TestTargets:
    def test_a_folder_that_is_no_store_is_not_replaced(self, image, tmp_path):
        (tmp_path / "a.zarr").mkdir()
        (tmp_path / "a.zarr" / "thesis.txt").write_text("precious")
        with pytest.raises(ImageError, match=r"(?s)not a Zarr store.*a\.zarr"):
            image.save(tmp_path / "a.zarr")
        assert (tmp_path / "a.zarr" / "thesis.txt").read_text() == "precious"

    @pytest.mark.parametrize("zarr_format", [2, 3])
    @pytest.mark.filterwarnings("ignore:The data type:zarr.errors.UnstableSpecificationWarning")
    def test_a_store_of_something_else_is_not_replaced(self, image, tmp_path, zarr_format):
        """Nor one that holds something else beside an image; one that is ours, or empty, is."""
        weather = xr.Dataset({"rain": ("day", np.arange(3.0))})
        weather.to_zarr(tmp_path / "a.zarr", zarr_format=zarr_format, consolidated=False)
        image.dataset.to_zarr(tmp_path / "b.zarr", zarr_format=zarr_format, consolidated=False)
        for name in ("a.zarr", "b.zarr"):
            weather.to_zarr(tmp_path / name, mode="a", zarr_format=zarr_format, consolidated=False)
            with pytest.raises(ImageError, match=r"(?s)not a Zarr store of a spectral image.*\.zarr"):
                image.save(tmp_path / name)
            with pytest.raises(ImageError, match="not a Zarr store of a spectral image"):
                ZarrWriter(tmp_path / name, Wavelengths(), 12, 20)
            assert xr.open_zarr(tmp_path / name, consolidated=False).rain.values.tolist() == [0, 1, 2]
        image.dataset.to_zarr(tmp_path / "c.zarr", zarr_format=zarr_format, consolidated=False)
        image.save(tmp_path / "c.zarr")
        xr.testing.assert_identical(read_zarr(tmp_path / "c.zarr").load(), image.dataset)

    def test_a_link_stays_and_what_it_leads_to_is_replaced(self, image, tmp_path):
        image.save(tmp_path / "a.zarr")
        (tmp_path / "link.zarr").symlink_to("a.zarr")
        image.dataset.attrs["spp"] = 128
        image.save(tmp_path / "link.zarr")
        assert (tmp_path / "link.zarr").is_symlink()
        assert read_zarr(tmp_path / "a.zarr").attrs["spp"] == 128

    def test_a_missing_directory(self, image, tmp_path):
        with pytest.raises(ImageError, match=r"(?s)directory .* does not exist.*mkdir -p"):
            image.save(tmp_path / "nowhere" / "a.zarr")


class TestUnreadableStores:
    def test_missing(self, tmp_path):
        with pytest.raises(ImageError, match=r"(?s)does not exist.*a\.zarr"):
            SpectralImage.open(tmp_path / "a.zarr")

    def test_a_file(self, tmp_path):
        (tmp_path / "a.zarr").write_text("no store")
        with pytest.raises(ImageError, match=r"(?s)not readable.*a\.zarr"):
            SpectralImage.open(tmp_path / "a.zarr")

    def test_another_store(self, tmp_path):
        xr.Dataset({"t": ("time", np.zeros(3))}).to_zarr(tmp_path / "a.zarr", consolidated=False)
        with pytest.raises(ImageError, match=r"(?s)no variable 'radiance'.*a\.zarr"):
            SpectralImage.open(tmp_path / "a.zarr")

    @pytest.mark.parametrize("part", [Path("zarr.json"), Path("radiance/zarr.json")])
    def test_damaged(self, image, tmp_path, part):
        image.save(tmp_path / "a.zarr")
        (tmp_path / "a.zarr" / part).write_text("{")
        with pytest.raises(ImageError, match=r"(?s)a\.zarr"):
            SpectralImage.open(tmp_path / "a.zarr")


def test_a_render_into_a_store_is_the_one_in_memory(tmp_path):
    import fluorspar

    options = {"size": (24, 18), "spp": 4, "wavelengths": "400:700:20"}
    expected = fluorspar.render("cornell-box", **options)
    with fluorspar.render("cornell-box", **options, output=tmp_path / "a.zarr") as image:
        np.testing.assert_array_equal(image.dataset.radiance, expected.dataset.radiance)
        np.testing.assert_array_equal(image.standard_error(), expected.standard_error())
        assert set(image.attrs) == set(expected.attrs)


def test_two_writers_of_one_store_are_refused(tmp_path):
    with ZarrWriter(tmp_path / "a.zarr", Wavelengths(), 2, 3) as writer:
        with pytest.raises(ImageError, match="another process is writing"):
            ZarrWriter(tmp_path / "a.zarr", Wavelengths(), 2, 3)
        writer.write_pixels(0, np.ones((6, 7, 69)), np.zeros((6, 69)))


def test_the_first_component_is_written_last(tmp_path, monkeypatch):
    """Where it is, all is: a killed writer leaves no pixels that only look whole."""
    written = []
    put = zarr_writer.put
    monkeypatch.setattr(
        zarr_writer,
        "put",
        lambda array, *what: written.append((array.basename, what[0])) or put(array, *what),
    )
    with ZarrWriter(tmp_path / "a.zarr", Wavelengths(), 2, 3) as writer:
        writer.write_pixels(0, np.ones((6, 7, 69)), np.zeros((6, 69)))
    assert written[0] == ("standard_error", None)
    assert written[-1] == ("radiance", 0)
