"""NetCDF files of the same layout that another program wrote: xarray, and plain h5py."""

from __future__ import annotations

import itertools

import h5py
import numpy as np
import pytest
import xarray as xr

from fluorspar.errors import ApproximationWarning, ImageError
from fluorspar.image.components import COMPONENTS, TOTAL
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

RADIANCE = np.random.default_rng(3).random((1, 3, 4, 5))
AT = np.array([400.0, 450.0, 500.0, 550.0, 600.0])
DIMS = ("component", "y", "x", "wavelength")


def write(path, values=RADIANCE, at=AT, at_unit="nm", unit="W m-2 sr-1 nm-1", encoding=None):
    """A data set made and written by xarray; None leaves a unit out."""
    units = [{} if said is None else {"units": said} for said in (unit, at_unit)]
    dataset = xr.Dataset(
        {"radiance": (DIMS, values, units[0])},
        {"component": [TOTAL], "wavelength": ("wavelength", at, units[1])},
    )
    dataset.to_netcdf(path, engine="h5netcdf", encoding={"radiance": encoding or {}})


def write_by_h5py(path, values, attrs):
    """The same with nothing but HDF5, names as text of fixed length."""
    with h5py.File(path, "w") as file:
        file["component"] = np.array([b"total"])
        file["wavelength"] = AT.astype(np.float32)
        file["wavelength"].attrs["units"] = "nm"
        for name, size in (("y", 3), ("x", 4)):
            file[name] = np.arange(size)
        file["radiance"] = values
        file["radiance"].attrs.update({"units": "W m-2 sr-1 nm-1"} | attrs)
        for axis, name in enumerate(DIMS):
            file[name].make_scale(name)
            file["radiance"].dims[axis].attach_scale(file[name])


class TestLayouts:
    """An image without components, its dimensions in any order and of any usual name."""

    @pytest.mark.parametrize("order", list(itertools.permutations(("y", "x", "wavelength"))))
    @pytest.mark.parametrize(
        "names",
        [
            {},
            {"y": "lines", "x": "samples", "wavelength": "bands"},
            {"y": "row", "x": "column"},
            {"y": "lat", "x": "lon", "wavelength": "wl"},
        ],
    )
    def test_any_order(self, tmp_path, order, names):
        cube = xr.DataArray(RADIANCE[0], dims=("y", "x", "wavelength"), name="radiance")
        cube = cube.transpose(*order).rename(names)
        bands = names.get("wavelength", "wavelength")
        at = "wl" if bands == "wl" else "wavelength"
        dataset = cube.to_dataset().assign_coords({at: (bands, AT, {"units": "nm"})})
        dataset["radiance"].attrs["units"] = "W m-2 sr-1 nm-1"
        dataset.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert image.components == (TOTAL,)
            assert image.wavelengths == Wavelengths(400, 600, 50)
            assert image.luminance().attrs["units"] == "cd m-2"
            np.testing.assert_array_equal(image.total(), RADIANCE[0].astype(np.float32))

    def test_components_in_another_order(self, tmp_path):
        values = np.random.default_rng(1).random((7, 3, 4, 5)).astype(np.float32)
        coords = {"component": list(COMPONENTS), "wavelength": ("wavelength", AT, {"units": "nm"})}
        dataset = xr.Dataset({"radiance": (DIMS, values)}, coords)
        dataset.transpose("wavelength", "y", "x", "component").to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with SpectralImage.open(tmp_path / "a.nc") as image:
            np.testing.assert_array_equal(image.component("reexcitation"), values[6])

    @pytest.mark.parametrize(
        ("name", "quantity"), [("reflectance", "reflectance"), ("__xarray_dataarray_variable__", "radiance")]
    )
    def test_another_name(self, tmp_path, name, quantity):
        coords = {"wavelength": ("wavelength", AT, {"units": "nm"})}
        xr.Dataset({name: (DIMS[1:], RADIANCE[0])}, coords).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert image.attrs["quantity"] == quantity

    def test_dimensions_of_unknown_names_are_said(self, tmp_path):
        coords = {"wavelength": ("wavelength", AT, {"units": "nm"})}
        dataset = xr.Dataset({"radiance": (("p", "q", "wavelength"), RADIANCE[0])}, coords)
        dataset.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with (
            pytest.warns(ApproximationWarning, match="p is taken for the rows and q for the columns"),
            SpectralImage.open(tmp_path / "a.nc") as image,
        ):
            assert image.size == (4, 3)

    def test_other_variables_are_said(self, tmp_path):
        coords = {"component": [TOTAL], "wavelength": ("wavelength", AT, {"units": "nm"})}
        variables = {"radiance": (DIMS, RADIANCE), "depth": (("y", "x"), RADIANCE[0, ..., 0])}
        xr.Dataset(variables, coords).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        with pytest.warns(ApproximationWarning, match="not read: depth"):
            SpectralImage.open(tmp_path / "a.nc").close()


class TestNumbers:
    @pytest.mark.parametrize("dtype", ["float32", "float64"])
    def test_plain(self, tmp_path, dtype):
        write(tmp_path / "a.nc", encoding={"dtype": dtype})
        with SpectralImage.open(tmp_path / "a.nc") as image:
            np.testing.assert_array_equal(image.total(), RADIANCE[0].astype(np.float32))
            assert image.wavelengths == Wavelengths(400, 600, 50)
            assert image.attrs == {}

    def test_packed(self, tmp_path):
        """Steps of 1/30000 and an offset: read to half a step."""
        values = RADIANCE.copy()
        values[0, 1, 2] = np.nan
        encoding = {"dtype": "int16", "scale_factor": 1 / 30000, "add_offset": 0.5, "_FillValue": -32768}
        write(tmp_path / "a.nc", values, encoding=encoding)
        with SpectralImage.open(tmp_path / "a.nc") as image:
            np.testing.assert_allclose(image.total(), values[0], rtol=0, atol=0.51 / 30000)
            assert not image.dataset.radiance.variable._in_memory

    def test_plain_by_h5py(self, tmp_path):
        write_by_h5py(tmp_path / "a.nc", RADIANCE.astype(np.float32), {})
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert image.components == (TOTAL,)
            np.testing.assert_array_equal(image.total(), RADIANCE[0].astype(np.float32))

    def test_packed_by_h5py(self, tmp_path):
        packed = np.round(1e4 * RADIANCE).astype(np.int16)
        write_by_h5py(tmp_path / "a.nc", packed, {"scale_factor": 1e-4})
        with SpectralImage.open(tmp_path / "a.nc") as image:
            np.testing.assert_allclose(image.total(), packed[0] / 1e4, rtol=1e-6)


class TestWavelengths:
    @pytest.mark.parametrize(("unit", "factor"), [("um", 1e-3), ("micrometer", 1e-3)])
    def test_of_other_units_become_nm(self, tmp_path, unit, factor):
        write(tmp_path / "a.nc", at=AT * factor, at_unit=unit)
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert image.wavelengths == Wavelengths(400, 600, 50)
            assert image.total().wavelength.attrs["units"] == "nm"

    @pytest.mark.parametrize(("factor", "unit"), [(1.0, "nm"), (1e-3, "um")])
    def test_of_no_unit_are_taken_for_what_they_must_be_and_this_is_said(self, tmp_path, factor, unit):
        write(tmp_path / "a.nc", at=AT * factor, at_unit=None)
        with (
            pytest.warns(ApproximationWarning, match=f"not stated: .* are taken for {unit}"),
            SpectralImage.open(tmp_path / "a.nc") as image,
        ):
            assert image.wavelengths == Wavelengths(400, 600, 50)

    @pytest.mark.parametrize(("unit", "at"), [("cm-1", AT), (None, AT / 1e6), (None, np.arange(1.0, 6))])
    def test_of_an_unknown_unit_are_refused(self, tmp_path, unit, at):
        write(tmp_path / "a.nc", at=at, at_unit=unit)
        with pytest.raises(ImageError, match=r"(?s)unit of the wavelengths is not known.*a\.nc.*'units'"):
            SpectralImage.open(tmp_path / "a.nc")

    def test_rounded(self, tmp_path):
        write(tmp_path / "a.nc", at=np.float32([400, 402.501, 405, 407.5, 410]))
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert image.wavelengths == Wavelengths(400, 410, 2.5)

    def test_uneven(self, tmp_path):
        write(tmp_path / "a.nc", at=[400, 460, 500, 550, 600])
        with SpectralImage.open(tmp_path / "a.nc") as image:
            np.testing.assert_array_equal(image.wavelengths.values, [400, 460, 500, 550, 600])
            np.testing.assert_array_equal(image.total(), RADIANCE[0].astype(np.float32))


class TestUnits:
    @pytest.mark.parametrize("unit", ["W m-2 sr-1 nm-1", "W.m^-2.sr^-1.nm^-1", "W m**-2 nm**-1 sr**-1"])
    def test_spectral_radiance_in_any_spelling(self, tmp_path, unit):
        write(tmp_path / "a.nc", unit=unit)
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert "unit" not in image.attrs
            assert image.luminance().attrs["units"] == "cd m-2"

    @pytest.mark.parametrize(("unit", "kept"), [("mW cm-2 sr-1 um-1", None), (None, "not stated")])
    def test_another_one_is_kept(self, tmp_path, unit, kept):
        write(tmp_path / "a.nc", unit=unit)
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert image.attrs["unit"] == (kept or unit)
            assert image.luminance().attrs["units"] == "relative"
            assert "cd/m2" not in repr(image)


def test_a_directory_is_called_one(tmp_path):
    for suffix in (".nc", ".exr", ".hdr"):
        path = tmp_path / f"folder{suffix}"
        path.mkdir()
        with pytest.raises(ImageError, match=r"is a directory"):
            SpectralImage.open(path)


class TestAttributes:
    @pytest.mark.parametrize("width", [8, "8", np.array([8.0])])
    def test_a_bandwidth_is_a_number(self, tmp_path, width):
        write(tmp_path / "a.nc")
        with h5py.File(tmp_path / "a.nc", "a") as file:
            file.attrs["bandwidth_nm"] = width
        with SpectralImage.open(tmp_path / "a.nc") as image:
            assert image.attrs["bandwidth_nm"] == 8.0

    @pytest.mark.parametrize("width", ["10 nm", -1.0, np.nan, np.array([8.0, 9.0])])
    def test_another_one_is_refused(self, tmp_path, width):
        write(tmp_path / "a.nc")
        with h5py.File(tmp_path / "a.nc", "a") as file:
            file.attrs["bandwidth_nm"] = width
        with pytest.raises(ImageError, match=r"(?s)bandwidth of the image is not readable.*bandwidth_nm"):
            SpectralImage.open(tmp_path / "a.nc")


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_descending_wavelengths_and_the_classic_format(engine, tmp_path):
    path = tmp_path / "image.nc"
    cube = xr.Dataset(
        {"radiance": (("y", "x", "wavelength"), RADIANCE[0])},
        {"wavelength": ("wavelength", AT[::-1], {"units": "nm"})},
    )
    cube.to_netcdf(path, engine=engine)
    image = SpectralImage.open(path)
    assert np.array_equal(image.wavelengths.values, AT)
    assert np.array_equal(image.total().values, RADIANCE[0][..., ::-1].astype(np.float32))
