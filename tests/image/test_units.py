"""What an image holds, as its source stated it: it survives every format, and nothing else is ever written."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest

from fluorspar.errors import ApproximationWarning
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.units import same_unit

FORMATS = (".nc", ".exr", ".hdr")
REFLECTANCE = {"unit": "1", "quantity": "reflectance"}


def source(path, kind="S0", units=None):
    """An EXR file of another program."""
    header = {} if units is None else {"emissiveUnits": units}
    channels = {f"{kind}.{at}nm": np.full((2, 3), at / 1000, np.float32) for at in (400, 500, 600)}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))
    return path


def stated(image):
    return {name: image.attrs[name] for name in ("unit", "quantity") if name in image.attrs}


def opened(path, kind="S0"):
    if kind == "S0":
        return SpectralImage.open(path)
    with pytest.warns(ApproximationWarning, match="holds reflectance"):
        return SpectralImage.open(path)


@pytest.mark.parametrize(
    ("kind", "units", "expected"),
    [
        ("S0", "W.m^-2.sr^-1", {}),
        ("S0", "mW.cm^-2.sr^-1", {"unit": "mW.cm^-2.sr^-1", "quantity": "radiance"}),
        ("S0", None, {"unit": "not stated", "quantity": "radiance"}),
        ("T", None, REFLECTANCE),
    ],
)
class TestOfAnExrFile:
    def test_survives_every_format(self, tmp_path, kind, units, expected):
        image = opened(source(tmp_path / "a.exr", kind, units), kind)
        assert stated(image) == expected
        for first in FORMATS:
            image.save(tmp_path / f"b{first}")
            for second in FORMATS:
                with SpectralImage.open(tmp_path / f"b{first}") as read:
                    assert stated(read) == expected
                    read.save(tmp_path / f"c{second}")
                with SpectralImage.open(tmp_path / f"c{second}") as read:
                    assert stated(read) == expected
                    np.testing.assert_array_equal(read.total(), image.total())

    def test_is_what_the_variable_says(self, tmp_path, kind, units, expected):
        opened(source(tmp_path / "a.exr", kind, units), kind).save(tmp_path / "b.nc")
        unit = expected.get("unit", "W m-2 sr-1 nm-1")
        with SpectralImage.open(tmp_path / "b.nc") as read:
            assert read.dataset.radiance.attrs.get("units", "not stated") == unit
            assert read.total().attrs.get("units", "not stated") == unit
            assert expected.get("quantity", "radiance") in read.total().attrs["long_name"]

    def test_is_what_exr_and_envi_files_say(self, tmp_path, kind, units, expected):
        image = opened(source(tmp_path / "a.exr", kind, units), kind)
        image.save(tmp_path / "b.exr")
        image.save(tmp_path / "b.hdr")
        (part,) = OpenEXR.File(str(tmp_path / "b.exr"), separate_channels=True).parts
        assert part.header.get("emissiveUnits") == units
        assert {name.split(".")[0] for name in part.channels} == {kind, "R", "G", "B"}
        text = (tmp_path / "b.hdr").read_text()
        quantity, unit = expected.get("quantity", "radiance"), expected.get("unit", "W m-2 sr-1 nm-1")
        assert f"data units = {unit}" in text
        assert f"spectral {quantity}, {unit}" in text


def test_luminance_of_reflectance_is_none_in_cd_m2(image):
    image.dataset.attrs.update(REFLECTANCE)
    assert image.luminance().attrs["units"] == image.xyz().attrs["units"] == "relative"
    assert "quantity:        reflectance, unit 1" in repr(image)
    assert "cd/m2" not in repr(image)


@pytest.mark.parametrize(
    "text",
    ["W.m^-2.sr^-1.nm^-1", "W m-2 nm-1 sr-1", "W m**-2 sr**-1 nm**-1", "W/(m² sr nm)", "W·m⁻²·sr⁻¹·nm⁻¹"],
)
def test_spellings_of_one_unit(text):
    assert same_unit(text, "W m-2 sr-1 nm-1")


@pytest.mark.parametrize(
    "text", ["W.m^-2.sr^-1", "mW m-2 sr-1 nm-1", "W m-2 sr-1 um-1", "W/m/m/sr/nm", "1", ""]
)
def test_other_units(text):
    assert not same_unit(text, "W m-2 sr-1 nm-1")
