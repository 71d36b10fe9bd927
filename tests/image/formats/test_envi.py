"""ENVI files, ours read by the `spectral` package, and its own read by us."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest

from fluorspar.errors import ApproximationWarning, ImageError
from fluorspar.image.components import TOTAL
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

envi = pytest.importorskip("spectral.io.envi")

CUBE = np.random.default_rng(7).random((4, 5, 6)).astype(np.float32)
AT = [400.0, 420.0, 440.0, 460.0, 480.0, 500.0]


def write(path, cube=CUBE, **metadata):
    given = {"wavelength": AT, "wavelength units": "Nanometers"} | metadata
    envi.save_image(
        str(path), cube, metadata={k: v for k, v in given.items() if v is not None}, force=True, ext=".img"
    )


class TestOurs:
    def test_the_spectral_package_reads_the_total(self, image, tmp_path):
        image.save(tmp_path / "a.hdr")
        read = envi.open(str(tmp_path / "a.hdr"))
        np.testing.assert_array_equal(np.asarray(read.load()), image.total())
        assert read.metadata["wavelength units"] == "Nanometers"
        np.testing.assert_array_equal(
            [float(at) for at in read.metadata["wavelength"]], image.wavelengths.values
        )
        assert "W m-2 sr-1 nm-1" in read.metadata["description"]
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a.hdr", "a.img"]

    def test_round_trip(self, image, tmp_path):
        image.save(tmp_path / "a.hdr")
        read = SpectralImage.open(tmp_path / "a.hdr")
        assert read.components == (TOTAL,)
        assert read.wavelengths == image.wavelengths
        np.testing.assert_array_equal(read.total(), image.total())

    def test_a_denoised_image_says_so(self, image, tmp_path):
        image.dataset.attrs["denoised"] = "Open Image Denoise, guided by colours and normals of surfaces"
        image.save(tmp_path / "a.hdr")
        assert SpectralImage.open(tmp_path / "a.hdr").attrs["denoised"] == image.attrs["denoised"]

    def test_the_bandwidth_is_the_fwhm_of_the_header(self, image, tmp_path):
        image.dataset.attrs["bandwidth_nm"] = 7.5
        image.save(tmp_path / "a.hdr")
        assert [float(width) for width in envi.open(str(tmp_path / "a.hdr")).metadata["fwhm"]] == [7.5] * 69
        assert SpectralImage.open(tmp_path / "a.hdr").attrs["bandwidth_nm"] == 7.5

    def test_a_file_that_is_no_part_of_it_is_not_replaced(self, image, tmp_path):
        (tmp_path / "keep.img").write_bytes(b"precious")
        with pytest.raises(ImageError, match=r"(?s)would replace.*keep\.hdr.*keep\.img"):
            image.save(tmp_path / "keep.hdr")
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"keep.img": b"precious"}

    def test_the_data_of_a_header_named_as_gdal_names_them_are_not_replaced(self, image, tmp_path):
        write(tmp_path / "scene.hdr")
        (tmp_path / "scene.hdr").rename(tmp_path / "scene.img.hdr")
        read = SpectralImage.open(tmp_path / "scene.img.hdr")
        with pytest.raises(ImageError, match="would replace"):
            read.save(tmp_path / "scene.hdr")
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "scene.img.hdr").total(), CUBE)

    def test_an_older_one_is_replaced(self, image, tmp_path):
        write(tmp_path / "a.hdr")
        image.save(tmp_path / "a.hdr")
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "a.hdr").total(), image.total())

    def test_a_stray_file_without_suffix_is_not_taken_for_the_data(self, image, tmp_path):
        image.save(tmp_path / "a.hdr")
        (tmp_path / "a").write_bytes(bytes(4 * image.total().size))
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "a.hdr").total(), image.total())

    # the spectral package leaves its file open then
    @pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
    def test_a_full_disk_leaves_older_files_intact(self, make_image, tmp_path, file_size_limit):
        for name in ("a.hdr", "a.img"):
            (tmp_path / name).write_bytes(b"precious")
        with file_size_limit(20_000), pytest.raises(ImageError, match=r"(?s)disk is full.*unchanged"):
            make_image(height=40, width=50).save(tmp_path / "a.hdr")
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
            "a.hdr": b"precious",
            "a.img": b"precious",
        }


class TestOthers:
    @pytest.mark.parametrize("interleave", ["bip", "bil", "bsq"])
    @pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint16])
    def test_order_and_type_of_the_numbers(self, tmp_path, interleave, dtype):
        cube = (1000 * CUBE).astype(dtype)
        envi.save_image(
            str(tmp_path / "a.hdr"),
            cube,
            dtype=dtype,
            interleave=interleave,
            byteorder=1,
            metadata={"wavelength": AT, "wavelength units": "nm"},
        )
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "a.hdr").total(), cube.astype(np.float32))

    def test_micrometres(self, tmp_path):
        write(
            tmp_path / "a.hdr", **{"wavelength": [at / 1000 for at in AT], "wavelength units": "Micrometers"}
        )
        np.testing.assert_allclose(SpectralImage.open(tmp_path / "a.hdr").wavelengths.values, AT)

    def test_descending_wavelengths(self, tmp_path):
        write(tmp_path / "a.hdr", wavelength=AT[::-1])
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "a.hdr").total(), CUBE[..., ::-1])

    def test_scale_factor_and_ignored_pixels(self, tmp_path):
        cube = np.array(1000 * CUBE, np.int16)
        cube[1, 2] = -999
        write(tmp_path / "a.hdr", cube, **{"reflectance scale factor": 1000, "data ignore value": -999})
        total = SpectralImage.open(tmp_path / "a.hdr").total().values
        assert np.isnan(total[1, 2]).all()
        np.testing.assert_allclose(total[0], cube[0] / 1000, rtol=1e-6)

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("data ignore value", "none"),
            ("reflectance scale factor", 0),
            ("reflectance scale factor", "nan"),
        ],
    )
    def test_numbers_that_are_none(self, tmp_path, name, value):
        write(tmp_path / "a.hdr")
        with (tmp_path / "a.hdr").open("a") as header:
            header.write(f"{name} = {value}\n")
        with pytest.raises(ImageError, match=f"(?s){name}.*{value}"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_uneven_wavelengths_are_kept_as_they_are(self, tmp_path):
        at = [400, 405, 440, 460, 480, 500]
        write(tmp_path / "a.hdr", wavelength=at)
        image = SpectralImage.open(tmp_path / "a.hdr")
        np.testing.assert_array_equal(image.wavelengths.values, at)
        np.testing.assert_array_equal(image.total(), CUBE)

    @pytest.mark.parametrize("suffix", ["", ".dat", ".IMG", ".bsq"])
    def test_data_of_any_usual_name(self, tmp_path, suffix):
        write(tmp_path / "a.hdr")
        (tmp_path / "a.img").rename(tmp_path / f"a{suffix}")
        np.testing.assert_array_equal(
            np.sort(SpectralImage.open(tmp_path / "a.hdr").total().values.ravel()), np.sort(CUBE.ravel())
        )

    def test_bad_bands_are_interpolated_and_cut_off_at_the_ends(self, tmp_path):
        cube = np.broadcast_to(np.array(AT, np.float32), (2, 3, 6)).copy()
        cube[..., [0, 2]] = -1e4
        write(tmp_path / "a.hdr", cube, bbl=[0, 1, 0, 1, 1, 1])
        with pytest.warns(ApproximationWarning, match=r"bad bands \(bbl\) at 400, 440 nm"):
            image = SpectralImage.open(tmp_path / "a.hdr")
        assert image.wavelengths == Wavelengths(420, 500, 20)
        np.testing.assert_allclose(image.total()[0, 0], AT[1:])

    def test_a_list_without_bad_bands_changes_nothing(self, tmp_path):
        write(tmp_path / "a.hdr", bbl=[1] * 6)
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "a.hdr").total(), CUBE)

    def test_widths_of_bands(self, tmp_path):
        write(tmp_path / "a.hdr", fwhm=[20.0] * 6)
        assert SpectralImage.open(tmp_path / "a.hdr").attrs["bandwidth_nm"] == 20
        micrometres = {"wavelength": [at / 1000 for at in AT], "wavelength units": "Micrometers"}
        write(tmp_path / "b.hdr", fwhm=[0.02] * 6, **micrometres)
        assert SpectralImage.open(tmp_path / "b.hdr").attrs["bandwidth_nm"] == pytest.approx(20)

    def test_widths_that_differ_are_averaged_and_said(self, tmp_path):
        write(tmp_path / "a.hdr", fwhm=[10, 10, 10, 20, 20, 20])
        with pytest.warns(ApproximationWarning, match="10 to 20 nm wide; their mean, 15 nm"):
            image = SpectralImage.open(tmp_path / "a.hdr")
        assert image.attrs["bandwidth_nm"] == 15

    def test_a_reflectance_scale_factor_says_that_it_is_reflectance(self, tmp_path):
        write(tmp_path / "a.hdr", **{"reflectance scale factor": 10000})
        assert SpectralImage.open(tmp_path / "a.hdr").attrs["quantity"] == "reflectance"

    def test_without_byte_order_it_is_little_endian_and_this_is_said(self, tmp_path):
        write(tmp_path / "a.hdr")
        without_line(tmp_path / "a.hdr", "byte order")
        with pytest.warns(ApproximationWarning, match="no byte order: little-endian"):
            image = SpectralImage.open(tmp_path / "a.hdr")
        np.testing.assert_array_equal(image.total(), CUBE)

    @pytest.mark.parametrize(("factor", "unit"), [(1, "nm"), (1e-3, "um")])
    def test_without_unit_wavelengths_are_what_they_must_be_and_this_is_said(self, tmp_path, factor, unit):
        write(tmp_path / "a.hdr", **{"wavelength": [at * factor for at in AT], "wavelength units": None})
        with pytest.warns(ApproximationWarning, match=f"not stated: .* are taken for {unit}"):
            image = SpectralImage.open(tmp_path / "a.hdr")
        np.testing.assert_allclose(image.wavelengths.values, AT)

    def test_two_bands(self, tmp_path):
        write(tmp_path / "a.hdr", CUBE[..., :2], wavelength=[450, 630])
        np.testing.assert_array_equal(SpectralImage.open(tmp_path / "a.hdr").total(), CUBE[..., :2])

    def test_what_is_not_used_is_said(self, tmp_path):
        write(tmp_path / "a.hdr", **{"data gain values": [2] * 6})
        with (tmp_path / "a.img").open("ab") as data:
            data.write(bytes(12))
        with pytest.warns(ApproximationWarning, match="not used: the last 12 bytes .*'data gain values'"):
            SpectralImage.open(tmp_path / "a.hdr")


def without_line(header, name):
    lines = header.read_text().splitlines(keepends=True)
    header.write_text("".join(line for line in lines if not line.startswith(name)))


class TestFaults:
    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("interleave", "tile"),
            ("interleave", "bsq2"),
            ("byte order", "2"),
            ("data type", "99"),
            ("lines", "four"),
            ("samples", "-5"),
            ("header offset", "-1"),
            ("file compression", "1"),
        ],
    )
    def test_a_layout_that_is_not_known(self, tmp_path, name, value):
        write(tmp_path / "a.hdr")
        without_line(tmp_path / "a.hdr", name)
        with (tmp_path / "a.hdr").open("a") as header:
            header.write(f"{name} = {value}\n")
        with pytest.raises(ImageError, match=rf"(?s)'{name}' of the ENVI header.*a\.hdr.*'{value}'"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_complex_numbers(self, tmp_path):
        metadata = {"wavelength": AT, "wavelength units": "nm"}
        envi.save_image(
            str(tmp_path / "a.hdr"), CUBE.astype(np.complex64), dtype=np.complex64, metadata=metadata
        )
        with pytest.raises(ImageError, match=r"(?s)complex numbers.*a\.hdr"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_one_band(self, tmp_path):
        write(tmp_path / "a.hdr", CUBE[..., :1], wavelength=[550])
        with pytest.raises(ImageError, match=r"(?s)only one wavelength.*a\.hdr.*550 nm.*at least two"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_one_wavelength_twice(self, tmp_path):
        write(tmp_path / "a.hdr", wavelength=[400, 420, 420, 460, 480, 500])
        with pytest.raises(ImageError, match="420 nm occurs twice"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_a_spectral_library(self, tmp_path):
        library = envi.SpectralLibrary(CUBE[0], {"wavelength": AT, "wavelength units": "nm"})
        library.save(str(tmp_path / "a"))
        with pytest.raises(ImageError, match=r"(?s)spectral library, not an image.*a\.hdr.*5 spectra"):
            SpectralImage.open(tmp_path / "a.hdr")

    @pytest.mark.parametrize(
        ("bbl", "said"),
        [
            ([1, 1, 0], "3 numbers in 'bbl'"),
            ([0, 0, 0, 0, 0, 1], "fewer than two"),
            (["x"] * 6, "not readable"),
        ],
    )
    def test_a_list_of_bad_bands_that_does_not_fit(self, tmp_path, bbl, said):
        write(tmp_path / "a.hdr", bbl=bbl)
        with pytest.raises(ImageError, match=said):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_missing(self, tmp_path):
        with pytest.raises(ImageError, match="does not exist"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_truncated(self, tmp_path):
        write(tmp_path / "a.hdr")
        content = (tmp_path / "a.img").read_bytes()
        (tmp_path / "a.img").write_bytes(content[:-4])
        with pytest.raises(ImageError, match=r"(?s)truncated.*476 bytes.*480 bytes"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_the_data_are_missing(self, tmp_path):
        write(tmp_path / "a.hdr")
        (tmp_path / "a.img").unlink()
        with pytest.raises(ImageError, match="not readable"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_not_envi(self, tmp_path):
        (tmp_path / "a.hdr").write_text("#?RADIANCE\n")
        with pytest.raises(ImageError, match="not readable"):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_no_wavelengths(self, tmp_path):
        write(tmp_path / "a.hdr", wavelength=None)
        with pytest.raises(ImageError, match=r"(?s)no wavelengths.*wavelength = "):
            SpectralImage.open(tmp_path / "a.hdr")

    def test_an_unknown_unit(self, tmp_path):
        write(tmp_path / "a.hdr", **{"wavelength units": "Wavenumber"})
        with pytest.raises(ImageError, match=r"(?s)unit of the wavelengths.*wavenumber"):
            SpectralImage.open(tmp_path / "a.hdr")


class TestLarge:
    @pytest.mark.parametrize("interleave", ["bip", "bil", "bsq"])
    def test_rows_are_read_when_they_are_used(self, interleave, tmp_path, monkeypatch):
        """Expected: the numbers of the whole, from unsorted bands of which one is bad and one ignored."""
        path = tmp_path / "a.hdr"
        given = {
            "wavelength": [*AT[3:], *AT[:3]],
            "bbl": [1, 0, 1, 1, 1, 1],
            "data ignore value": CUBE[1, 2, 3],
        }
        envi.save_image(
            str(path),
            CUBE,
            metadata=given | {"wavelength units": "Nanometers", "reflectance scale factor": 3},
            interleave=interleave,
            ext=".img",
        )
        with pytest.warns(ApproximationWarning, match="480 nm"):
            whole = SpectralImage.open(path).dataset["radiance"].values
        monkeypatch.setattr("fluorspar.image.computed._LARGEST_KEPT", 0)
        with pytest.warns(ApproximationWarning, match="480 nm"):
            image = SpectralImage.open(path)
        np.testing.assert_array_equal(image.dataset["radiance"].values, whole)
        np.testing.assert_array_equal(image.dataset["radiance"][0, ::-2, 1:3, 4], whole[0, ::-2, 1:3, 4])
        assert np.isnan(whole).sum() == 1
        path.with_suffix(".img").unlink()  # it is held open
        image.save(tmp_path / "b.nc")
        with SpectralImage.open(tmp_path / "b.nc") as other:
            np.testing.assert_array_equal(other.dataset["radiance"].values, whole)

    def test_one_larger_than_memory_is_measured(self, tmp_path):
        """Of 6.4 GB, by a process that may take 2.5 GB."""
        write(tmp_path / "a.hdr", np.zeros((1, 1, 6), np.float32))
        header = (tmp_path / "a.hdr").read_text()
        for name in ("lines", "samples"):
            header = re.sub(f"{name} = 1\\b", f"{name} = 16384", header)
        (tmp_path / "a.hdr").write_text(header)
        with (tmp_path / "a.img").open("r+b") as data:
            data.truncate(4 * 16384**2 * 6)
            data.seek(4 * 6 * (16384 * 9000 + 7))
            data.write(np.arange(6, dtype="<f4").tobytes())
        code = f"""
import resource
import fluorspar
resource.setrlimit(resource.RLIMIT_DATA, (5 * 2**29, 5 * 2**29))
print(*fluorspar.open({str(tmp_path / "a.hdr")!r}).spectrum_at(7, 9000)["total"].values)
"""
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.stdout.split() == ["0.0", "1.0", "2.0", "3.0", "4.0", "5.0"], done.stderr
