"""Pictures: the right pixels, labels that tell the exposure, whole files or none."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from fluorspar.errors import ImageError
from fluorspar.image.components import COMPONENTS
from fluorspar.image.display import picture
from fluorspar.image.display.picture import (
    contact_sheet,
    thumbnail,
    write_pictures,
    write_png,
)


def pixels_of(path):
    with Image.open(path) as opened:
        return np.asarray(opened)


class TestPng:
    def test_it_shows_what_srgb_says(self, image, tmp_path):
        image.save(tmp_path / "a.png")
        np.testing.assert_allclose(pixels_of(tmp_path / "a.png"), image.srgb() * 255, atol=0.51)

    def test_of_a_component_at_a_given_exposure(self, image, tmp_path):
        write_png(image.dataset, tmp_path / "a.png", "luminescent", exposure=1e-4)
        expected = image.srgb("luminescent", exposure=1e-4) * 255
        np.testing.assert_allclose(pixels_of(tmp_path / "a.png"), expected, atol=0.51)

    def test_what_was_not_rendered_is_dark_grey(self, image, tmp_path):
        image.dataset["radiance"][:, 6:] = np.nan
        image.save(tmp_path / "a.png")
        assert (pixels_of(tmp_path / "a.png")[6:] == 51).all()

    def test_a_full_disk_leaves_an_older_file_intact(self, make_image, tmp_path, file_size_limit):
        (tmp_path / "old.png").write_bytes(b"precious")
        image = make_image(height=40, width=50)
        image.srgb()  # what is imported on the way may write to its own files
        with file_size_limit(100), pytest.raises(ImageError, match="disk is full"):
            image.save(tmp_path / "old.png")
        assert (tmp_path / "old.png").read_bytes() == b"precious"
        assert len(list(tmp_path.iterdir())) == 1


class TestCommonExposure:
    @pytest.mark.parametrize("exposure", ["same", 2e-4])
    def test_all_pictures_have_it(self, image, tmp_path, exposure):
        write_pictures(image.dataset, tmp_path, exposure)
        factor = image.srgb().attrs["exposure"] if exposure == "same" else exposure
        for name in ("total", *COMPONENTS):
            expected = image.srgb(name, exposure=factor) * 255
            np.testing.assert_allclose(pixels_of(tmp_path / f"{name}.png"), expected, atol=0.51)


class TestThumbnail:
    def test_a_small_image_keeps_its_pixels(self, image):
        assert thumbnail(image.dataset).shape == (12, 20, 3)

    def test_a_large_one_is_made_smaller(self, make_image):
        assert thumbnail(make_image(height=90, width=300).dataset, longest=100).shape == (30, 100, 3)


class TestContactSheet:
    def test_exposures_are_powers_of_two_of_that_of_the_total(self, make_image):
        """Component k + 1 is roughly a quarter of component k, so each needs about two stops more."""
        tiles = picture._tiles(make_image(height=30, width=30).dataset)
        factors = {
            tile.name: float(tile.note.split("×")[1].split(",")[0])
            for tile in tiles
            if "× 1/" not in tile.note and "×" in tile.note
        }
        assert list(factors) == list(COMPONENTS[1:])
        stops = np.log2(list(factors.values()))
        np.testing.assert_array_equal(stops, np.round(stops))
        assert (np.diff(stops) >= 1).all()

    def test_a_lamp_is_shown_darker_not_clipped(self, image):
        source = next(tile for tile in picture._tiles(image.dataset) if tile.name == "source")
        assert "exposure × 1/" in source.note
        assert source.picture.max() < 255

    def test_every_tile_is_well_exposed(self, make_image):
        """Between half of the end of the scale, which is 188 of 255 in sRGB, and the end."""
        for tile in picture._tiles(make_image(height=30, width=30).dataset):
            if tile.name not in ("total", "source"):
                assert 180 <= np.percentile(tile.picture.max(axis=-1), 99) <= 255

    def test_a_component_without_light_says_so(self, image):
        image.dataset["radiance"][6] = 0
        assert picture._tiles(image.dataset)[-1].note == "no light"

    @pytest.mark.parametrize("size", [(1, 1), (3, 40), (40, 3), (12, 600)])
    def test_images_of_any_shape_fit(self, make_image, size):
        sheet = contact_sheet(make_image(*size).dataset)
        assert sheet.dtype == np.uint8
        assert max(sheet.shape) < 3000 * max(size[0] / size[1], 1)

    def test_pictures_of_everything(self, image, tmp_path):
        paths = write_pictures(image.dataset, tmp_path / "new" / "pictures")
        assert [path.stem for path in paths] == ["total", *COMPONENTS, "components"]
        assert all(path.is_file() for path in paths)

    def test_a_directory_that_cannot_be_made_is_an_error(self, image, tmp_path):
        (tmp_path / "taken").write_text("a file")
        with pytest.raises(ImageError, match=r"(?s)cannot be made.*taken"):
            write_pictures(image.dataset, tmp_path / "taken")
