"""The index of a study, and all its images as one data set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from fluorspar import SpectralImage, batch, open_study
from fluorspar.errors import FluorsparError, FluorsparWarning, ImageError, OptionError
from fluorspar.studies.do_group import Result
from fluorspar.studies.index import index_of
from fluorspar.studies.study import read_study

STUDY = """
output = ["out/{light}-{concentration:.1f}.nc", "out/{number}.png"]
render = { scene = "cornell-box", size = "8x8", spp = 4, wavelengths = "400:700:20", variant = "llvm" }
[product]
light.light = ["D65", "A"]
concentration.left-wall = { start = 0, stop = 1, number = 3 }
"""
KEYS = ["light.light", "concentration.left-wall"]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study") / "lamps.toml"
    path.write_text(STUDY)
    batch(path)
    return path


def test_pandas_reads_the_csv(study: Path) -> None:
    table = pd.read_csv(study.with_name("lamps-index.csv"))
    assert table["concentration.left-wall"].tolist() == [0, 0.5, 1] * 2
    assert table["light.light"].tolist() == ["D65"] * 3 + ["A"] * 3
    assert table["status"].unique().tolist() == ["done"]
    assert table["spp"].unique().tolist() == [4]
    for name in (*table["output"], *table["output_2"]):
        assert (study.parent / name).is_file()


def test_xarray_reads_the_netcdf(study: Path) -> None:
    index = xr.load_dataset(study.with_name("lamps-index.nc"))
    assert index["concentration.left-wall"].dims == index["output"].dims == ("render",)
    assert index["concentration.left-wall"].dtype == np.float64
    assert index.set_index(render=KEYS).unstack("render").sizes["light.light"] == 2
    assert index.equals(batch(study).assign(seconds=index["seconds"])), "and a batch returns it"


@pytest.mark.parametrize("name", ["lamps.toml", "lamps-index.nc", "lamps-index.csv"])
def test_all_images_are_one_data_set(study: Path, name: str) -> None:
    with open_study(study.with_name(name)) as images:
        assert images["radiance"].dims == ("render", "component", "y", "x", "wavelength")
        assert images["radiance"].chunks is not None, "nothing is read yet"
        table = images.set_index(render=KEYS).unstack("render")
        chosen = table["radiance"].sel({"light.light": "A", "concentration.left-wall": 0.5})
        with SpectralImage.open(study.parent / "out" / "A-0.5.nc") as image:
            np.testing.assert_array_equal(chosen.values, image.dataset["radiance"].values)
        assert images["radiance"].attrs["units"] == "W m-2 sr-1 nm-1"


def test_two_lines_of_xarray_do_it_too(study: Path) -> None:
    """As the documentation says."""
    index = xr.open_dataset(study.with_name("lamps-index.nc"))
    files = [study.parent / name for name in index["output"].values]
    images = xr.open_mfdataset(files, combine="nested", concat_dim="render").assign_coords(index.coords)
    with open_study(study) as expected:
        xr.testing.assert_equal(
            images["radiance"].compute(), expected["radiance"].drop_vars("output").compute()
        )
    images.close()
    index.close()


def test_images_of_two_shapes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "sizes.csv"
    path.write_text("scene,size,spp,variant\ncornell-box,8x8,4,llvm\ncornell-box,8x6,4,llvm\n")
    batch(path)
    with pytest.raises(OptionError, match="differ in size or wavelengths"):
        open_study(path)


def test_what_is_not_done_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "lamps.csv"
    path.write_text("scene,size,spp,light.light\ncornell-box,8x8,4,A\ncornell-box,8x8,4,none\n")
    assert batch(path)["status"].values.tolist() == ["done", "failed"]
    with open_study(path) as images:
        assert images["light.light"].values.tolist() == ["A"]


def test_without_an_image(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="there is no index"):
        open_study(tmp_path / "lamps.toml")
    (tmp_path / "lamps.toml").write_text('render.scene = "nothing.xml"')
    batch(tmp_path / "lamps.toml")
    with pytest.raises(ImageError, match="no image of the study is done"):
        open_study(tmp_path / "lamps.toml")


def test_dask_is_named_where_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fluorspar.extras.find_spec", lambda name: None)
    with pytest.raises(FluorsparError, match=r'pip install "fluorspar\[cluster\]"'):
        open_study("lamps.toml")


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([1, 2], [1, 2]),
        ([1, None], [1, np.nan]),
        ([1, 0.5], [1, 0.5]),
        (["A", 0.5], ["A", "0.5"]),
        (["A", None], ["A", ""]),
    ],
)
def test_settings_are_numbers_where_all_are(values: list[Any], expected: list[Any]) -> None:
    rows = [{} if value is None else {"D.a": value} for value in values]
    study = read_study({"render": {"scene": "furnace"}, "rows": rows})
    found = index_of(study, [Result(1, "open"), Result(2, "open")])["D.a"].values
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("suffix", [".csv", ".nc"])
def test_an_index_that_is_none_is_named(suffix: str, tmp_path: Path) -> None:
    """Expected: nobody is told to delete a file of his own, and nothing is rendered."""
    path = tmp_path / "lamps.csv"
    path.write_text("scene,size,spp\ncornell-box,8x8,4\n")
    (tmp_path / f"lamps-index{suffix}").write_text("notes of mine\n")
    with pytest.raises(OptionError, match=r"(?s)no index has the name of the index.*rename it, or the study"):
        batch(path)
    (tmp_path / f"lamps-index{suffix}").unlink()
    (tmp_path / f"lamps-index{suffix}").mkdir()
    with pytest.raises(ImageError, match="is a directory"):
        batch(path)
    assert not (tmp_path / "lamps-1.nc").exists()


def test_two_studies_do_not_share_an_index(tmp_path: Path) -> None:
    for name, text in (("lamps.csv", "scene\nno.xml\n"), ("lamps.toml", 'render.scene = "no.xml"')):
        (tmp_path / name).write_text(text)
    batch(tmp_path / "lamps.csv")
    batch(tmp_path / "lamps.csv")
    with pytest.raises(OptionError, match=r"(?s)same index.*lamps\.toml and lamps\.csv"):
        batch(tmp_path / "lamps.toml")
    (tmp_path / "lamps.csv").unlink()
    batch(tmp_path / "lamps.toml")


@pytest.mark.parametrize("setting", ['light."a/b" = "A"', "D.a = 1000000000000000000000"])
def test_it_holds_all_that_a_study_can_say(setting: str, tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(f'render.scene = "no.xml"\nrender.{setting}')
    batch(tmp_path / "odd.toml")
    index = xr.load_dataset(tmp_path / "odd-index.nc")
    name, _, value = setting.replace('"', "").replace("/", "|").partition(" = ")
    assert index[name].values.tolist() == [value]


def test_rows_that_have_a_spectral_image_are_opened(tmp_path: Path) -> None:
    """Expected: those in Zarr too, in whichever column; a picture is left out, and so is a file that has gone."""
    pytest.importorskip("zarr")
    names = ["a.png", "a.nc", "b.png", "a.zarr", "c.nc", "b.nc"]
    rows = [{"seed": 1 + number // 2, "output": name} for number, name in enumerate(names)]
    lines = [", ".join(f"{key} = {value!r}" for key, value in row.items()) for row in rows]
    (tmp_path / "mixed.toml").write_text(
        'render = { scene = "cornell-box", size = "8x8", spp = 4, wavelengths = "400:700:20", variant = "llvm" }\n'
        f"rows = [{', '.join(f'{{ {line} }}' for line in lines)}, {{ output = ['d.png', 'd.zarr'] }}]"
    )
    batch(tmp_path / "mixed.toml")
    (tmp_path / "c.nc").unlink()
    with pytest.warns(FluorsparWarning, match="left out.*: rows 1, 3, 5 of the study"):
        images = open_study(tmp_path / "mixed.toml")
    with images:
        assert images["output"].values.tolist() == ["a.nc", "a.zarr", "b.nc", "d.zarr"]
        assert images["seed"].values[:3].tolist() == [1, 2, 3]
        for place, name in enumerate(images["output"].values):
            with SpectralImage.open(tmp_path / name) as image:
                np.testing.assert_array_equal(
                    images["radiance"][place].values, image.dataset["radiance"].values
                )


def test_why_no_image_can_be_opened(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(
        'output = "a.png"\nrender = { scene = "cornell-box", size = "8x8", spp = 4, variant = "llvm" }'
    )
    batch(tmp_path / "a.toml")
    with pytest.raises(ImageError, match="no image of the study is in NetCDF or Zarr"):
        open_study(tmp_path / "a.toml")
