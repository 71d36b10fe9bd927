"""Images are written in every format that the table has, and read in those that hold spectra."""

from __future__ import annotations

import pytest

from fluorspar.errors import ImageError
from fluorspar.image.formats.registry import SUFFIXES, SUFFIXES_WRITTEN, read_image, write_image


@pytest.mark.parametrize("suffix", SUFFIXES_WRITTEN)
def test_files_are_those_that_an_image_saves(image, tmp_path, suffix):
    if suffix == ".zarr":
        pytest.importorskip("zarr")
    image.save(tmp_path / f"saved{suffix}")
    write_image(image.dataset, tmp_path / f"written{suffix}")
    saved = [file for file in tmp_path.iterdir() if file.stem == "saved" and file.suffix != ".hdr"]
    for file in saved:  # a header names its data file
        if suffix not in (".exr", ".nc", ".zarr"):
            assert file.read_bytes() == file.with_stem("written").read_bytes()
    assert saved
    if suffix in SUFFIXES:
        with read_image(tmp_path / f"written{suffix}") as dataset:
            assert dataset.sizes["wavelength"] == len(image.wavelengths)


def test_a_picture_is_not_read(image, tmp_path):
    image.save(tmp_path / "a.png")
    with pytest.raises(ImageError, match=r"(?s)cannot be read from.*\.nc, \.exr, \.hdr"):
        read_image(tmp_path / "a.png")
