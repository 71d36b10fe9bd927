"""Damaged files of every format end in a clear error or in an image; files that claim too much are not read."""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import h5py
import numpy as np
import pytest

from fluorspar.errors import FluorsparError, ImageError
from fluorspar.files.patient_file import PatientFile
from fluorspar.image.components import COMPONENTS
from fluorspar.image.dataset import row_blocks
from fluorspar.image.formats.netcdf_layout import create
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

MUTATIONS = 120


def damaged(content: bytes, seed: int) -> bytes:
    """The file cut off, or with some bytes changed; most of them where the structure lies."""
    chance = random.Random(seed)
    if seed % 4 == 0:
        return content[: chance.randrange(len(content))]
    changed = bytearray(content)
    reach = len(content) if seed % 4 == 1 else min(12_000, len(content))
    for _ in range(chance.choice([1, 3, 20])):
        changed[chance.randrange(reach)] = chance.randrange(256)
    return bytes(changed)


# a second traceback, from an object that is closed half-opened, would be an error here
@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::fluorspar.errors.FluorsparWarning", "ignore::RuntimeWarning")
@pytest.mark.filterwarnings("ignore:Parameters with non-lowercase names")
@pytest.mark.parametrize("suffix", [".nc", ".exr", ".hdr"])
def test_damage_ends_in_a_clear_error_or_an_image(tmp_path: Path, suffix: str) -> None:
    chance = np.random.default_rng(0)
    grid = Wavelengths(400, 700, 50)
    image = SpectralImage.from_arrays(
        chance.random((7, 6, 5, 7)), grid, chance.random((6, 5, 7)), {"spp": 16, "timings": {"trace": 1.0}}
    )
    path = tmp_path / f"a{suffix}"
    image.save(path)
    content = path.read_bytes()
    errors = []
    for seed in range(MUTATIONS):
        path.write_bytes(damaged(content, seed))
        try:
            with SpectralImage.open(path) as read:
                repr(read)
                read.load()
        except FluorsparError as err:
            errors.append(str(err))
    assert all("\n  where:" in text for text in errors)
    assert MUTATIONS / 4 < len(errors) < MUTATIONS


@pytest.mark.parametrize("content", [b"text", np.array([b"x"]), h5py.Empty("f4"), np.arange(3), "W"])
@pytest.mark.parametrize("name", ["spp", "partial", "unit", "quantity", "components", "timings", "scene"])
def test_attributes_of_any_type(tmp_path: Path, image: SpectralImage, name: str, content: object) -> None:
    image.save(tmp_path / "a.nc")
    with h5py.File(tmp_path / "a.nc", "a") as file:
        file.attrs[name] = content
    with contextlib.suppress(ImageError), SpectralImage.open(tmp_path / "a.nc") as read:
        assert "components:" in repr(read)
        read.luminance()


def test_an_error_that_is_text(tmp_path: Path, image: SpectralImage) -> None:
    image.save(tmp_path / "a.nc")
    with h5py.File(tmp_path / "a.nc", "a") as file:
        shape, scales = file["standard_error"].shape, [dim[0] for dim in file["standard_error"].dims]
        del file["standard_error"]
        file["standard_error"] = np.full(shape, b"text")
        for dim, scale in zip(file["standard_error"].dims, scales, strict=True):
            dim.attach_scale(scale)
    with pytest.raises(ImageError, match="standard_error holds no real numbers"):
        SpectralImage.open(tmp_path / "a.nc")


def test_a_file_that_is_interrupted_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: by the one who made it, not by HDF5 when Python has ended."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("fluorspar.image.formats.netcdf_layout.variable_attrs", interrupted)
    h5f = h5py.h5f
    before = h5f.get_obj_count(h5f.OBJ_ALL, h5f.OBJ_FILE)
    with PatientFile(tmp_path / "a.nc") as stream, pytest.raises(KeyboardInterrupt) as caught:
        create(stream, Wavelengths(400, 700, 10), COMPONENTS, 4, 4, ["radiance"], {})
    assert caught.tb is not None  # which holds what is still open
    assert h5f.get_obj_count(h5f.OBJ_ALL, h5f.OBJ_FILE) == before


class TestClaims:
    """Files of a few kilobytes that say they hold 2^20 x 2^20 pixels."""

    SIDE = 2**20

    @pytest.fixture
    def huge(self, tmp_path: Path) -> Path:
        with PatientFile(tmp_path / "a.nc") as stream:
            create(
                stream, Wavelengths(400, 700, 10), COMPONENTS, self.SIDE, self.SIDE, ["radiance"], {}
            ).close()
        return tmp_path / "a.nc"

    def test_a_netcdf_file_is_described(self, huge: Path) -> None:
        with SpectralImage.open(huge) as image:
            assert "1048576 x 1048576 pixels, 9.54e+05 GB in memory" in repr(image)
            assert "not taken: the image is too large" in repr(image)

    @pytest.mark.parametrize(
        "use",
        [
            SpectralImage.load,
            SpectralImage.total,
            SpectralImage.xyz,
            SpectralImage.srgb,
            lambda image: image.save("picture.png"),
            lambda image: image.save("copy.exr"),
            lambda image: list(row_blocks(image.dataset)),
        ],
    )
    def test_it_is_not_read(self, huge: Path, use, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(huge.parent)
        with (
            SpectralImage.open(huge) as image,
            pytest.raises(ImageError, match=r"(?s)does not fit into memory.*a\.nc.*1048576 x 1048576 .* GB"),
        ):
            use(image)

    def test_an_exr_file(self, tmp_path: Path, image: SpectralImage) -> None:
        image.save(tmp_path / "a.exr")
        content = bytearray((tmp_path / "a.exr").read_bytes())
        mark = b"dataWindow\0box2i\0"
        at = content.find(mark)
        while at >= 0:
            start = at + len(mark) + 4
            corners = np.array([0, 0, self.SIDE - 1, self.SIDE - 1], "<i4")
            content[start : start + 16] = corners.tobytes()
            at = content.find(mark, start)
        (tmp_path / "a.exr").write_bytes(content)
        with pytest.raises(ImageError, match=r"(?s)does not fit into memory.*1048576 x 1048576"):
            SpectralImage.open(tmp_path / "a.exr")

    def test_a_sparse_envi_file(self, tmp_path: Path) -> None:
        side, bands = 10**5, 16
        at = ", ".join(str(400 + 10 * band) for band in range(bands))
        (tmp_path / "a.hdr").write_text(
            f"ENVI\nsamples = {side}\nlines = {side}\nbands = {bands}\ndata type = 4\ninterleave = bip\n"
            f"byte order = 0\nwavelength units = nm\nwavelength = {{{at}}}\n"
        )
        with (tmp_path / "a.img").open("wb") as data:
            try:
                data.truncate(4 * bands * side**2)
            except OSError:
                pytest.skip("the file system holds no sparse file of 640 GB")
        image = SpectralImage.open(tmp_path / "a.hdr")  # rows are read when they are used
        assert not image.spectrum_at(0, side - 1)["total"].any()
        with pytest.raises(ImageError, match=r"(?s)does not fit into memory.*100000 x 100000.*640 GB"):
            image.total()
