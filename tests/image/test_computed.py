"""Images that are computed when they are used hold what they would if they were computed at once."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fluorspar.image import computed as module
from fluorspar.image.converted import converted
from fluorspar.image.dataset import values_of
from fluorspar.image.formats import exr
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths


@pytest.fixture
def nothing_kept(monkeypatch):
    monkeypatch.setattr(module, "_LARGEST_KEPT", 0)


@pytest.fixture
def large(monkeypatch, nothing_kept):
    """Blocks of 2 rows."""
    from fluorspar.image import dataset

    monkeypatch.setattr(dataset, "_BLOCK_BYTES", 2 * 4 * 20 * 69)


@pytest.mark.parametrize(
    "options",
    [
        {"component": "total"},
        {"component": "luminescent"},
        {"component": "reexcitation"},
        {"wavelengths": Wavelengths(400, 700, 10)},
        {"bandwidth": 12.0},
    ],
    ids=lambda options: next(iter(options)),
)
@pytest.mark.parametrize("name", ["b.nc", "b.exr", "b.hdr"])
def test_what_is_converted_rows_by_rows_is_the_same(make_image, tmp_path, monkeypatch, options, name):
    image = make_image(component_errors=True)
    image.save(tmp_path / "a.nc")
    converted(image, **options).save(tmp_path / name)
    at_once = SpectralImage.open(tmp_path / name).load()
    monkeypatch.setattr(module, "_LARGEST_KEPT", 0)
    with SpectralImage.open(tmp_path / "a.nc") as read:
        result = converted(read, **options)
        assert not result.dataset.radiance.variable._in_memory
        result.save(tmp_path / name)
    with SpectralImage.open(tmp_path / name) as again:
        xr.testing.assert_identical(again.dataset.load(), at_once.dataset)


def test_parts_of_any_kind(image, nothing_kept):
    lazy = converted(image, "reflected").dataset
    assert not lazy.radiance.variable._in_memory
    whole = np.stack([image.reflected().values])
    for index in (
        {"y": 3},
        {"y": -1, "x": -2},
        {"y": slice(None, None, 3), "x": slice(2, None, 2)},
        {"y": slice(None, None, -1), "wavelength": 5},
        {"y": [7, 2, 2], "component": 0},
        {"y": slice(4, 4)},
    ):
        np.testing.assert_array_equal(
            lazy.radiance.isel(index), xr.DataArray(whole, dims=lazy.radiance.dims).isel(index)
        )


def test_rows_are_computed_once_for_all_components(image, nothing_kept, tmp_path):
    asked = []

    def rows(some):
        asked.append(some)
        return image.dataset.radiance.values[:, some]

    lazy = module.computed({"radiance": rows}, image.size, image.wavelengths, {}, image.components)
    for name in image.components:
        np.testing.assert_array_equal(
            values_of(lazy, "radiance", slice(2, 5), name), image.component(name)[2:5]
        )
    assert asked == [slice(2, 5)]


def test_planes_of_a_large_exr_file_are_gathered_in_a_file_that_goes(image, tmp_path, monkeypatch, large):
    image.save(tmp_path / "a.exr")
    monkeypatch.setattr(exr, "_LARGEST_KEPT", 0)
    image.save(tmp_path / "b.exr")
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "b.exr"]


@pytest.mark.parametrize("name", ["a.hdr", "a.zarr", "a.nc", "a.png"])
def test_blocks_of_rows_make_the_same_file(image, tmp_path, monkeypatch, name):
    if name == "a.zarr":
        pytest.importorskip("zarr")
    from fluorspar.image import dataset
    from fluorspar.image.display import appearance

    image.save(tmp_path / name)
    (tmp_path / "b").mkdir()
    monkeypatch.setattr(dataset, "_BLOCK_BYTES", 2 * 4 * 20 * 69)
    monkeypatch.setattr(appearance, "_AT_ONCE", 100)
    image.save(tmp_path / "b" / name)
    if name == "a.png":
        assert (tmp_path / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    else:
        with SpectralImage.open(tmp_path / name) as one, SpectralImage.open(tmp_path / "b" / name) as other:
            xr.testing.assert_identical(one.dataset.load(), other.dataset.load())
