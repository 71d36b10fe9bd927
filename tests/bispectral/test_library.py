"""The materials library: names, files, mixtures, folders of the user's, and what each fault is called."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
import pytest

from fluorspar.bispectral.files.registry import read_material
from fluorspar.bispectral.lamp_colour import colour_under_lamp
from fluorspar.bispectral.library import ENVIRONMENT, material, materials
from fluorspar.errors import MaterialError, SpectrumError
from fluorspar.spectral.wavelengths import Wavelengths

GREY = "# fluorspar-material: 1\n# name: {name}\n# credit: nobody\nwavelength,reflectance\n300,{S}\n780,{S}\n"
DYE = """# fluorspar-material: 1
# assumed: everything
wavelength,reflectance,emission_1,excitation_1,emission_2,excitation_2
300,0.1,0,0,0,0
400,0.1,0,5,0,0
500,0.1,0.3,0,0,7
600,0.1,0,0,0.2,0
700,0.1,0,0,0,0
"""
SHEET = """# quantity: band
# step: 100
# credit: me
emission\\excitation,400,500,600
400,0.5,0,0
500,0.1,0.5,0
600,0.1,0.1,0.5
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.delenv(ENVIRONMENT, raising=False)
    for name, S in (("light-grey", 0.6), ("dark-grey", 0.2)):
        (tmp_path / f"{name}.csv").write_text(GREY.format(name=name, S=S))
    (tmp_path / "two-dyes.csv").write_text(DYE)
    (tmp_path / "sheet.csv").write_text(SHEET)
    (tmp_path / "notes.txt").write_text("not a material")
    return tmp_path


def test_by_name_path_and_case(folder: Path) -> None:
    file = folder / "light-grey.csv"
    for found in (
        material("light-grey", [folder]),
        material(file),
        material(str(file)),
        material("Light-Grey", [folder]),
    ):
        assert (found.name, found.reflectance.at(500), found.credit) == ("light-grey", 0.6, "nobody")


def test_fluorophores_of_a_file(folder: Path) -> None:
    found = material("two-dyes", [folder])
    assert (found.name, len(found.fluorophores), found.assumed) == ("two-dyes", 2, "everything")
    D = found.on(Wavelengths(300, 700, 100))
    assert D.emission.tolist() == [[0, 0, 0.3, 0, 0], [0, 0, 0, 0.2, 0]]
    # triangles of 200 nm base: scaled to integral 1 they are 0.01/nm high
    assert D.excitation == pytest.approx(np.array([[0, 0.01, 0, 0, 0], [0, 0, 0.01, 0, 0]]))


def test_a_donaldson_file(folder: Path) -> None:
    found = material("sheet", [folder])
    assert found.credit == "me"
    assert found.on(Wavelengths(400, 600, 100)).band().tolist() == [
        [0.5, 0, 0],
        [0.1, 0.5, 0],
        [0.1, 0.1, 0.5],
    ]


def test_mixtures_of_names_and_files(folder: Path) -> None:
    mixed = material("light-grey:0.25, dark-grey:0.75", [folder])
    assert mixed.reflectance.at(500) == pytest.approx(0.25 * 0.6 + 0.75 * 0.2)
    with_file = material(f"light-grey:0.5,{folder / 'sheet.csv'}:0.5", [folder])
    assert with_file.on(Wavelengths(400, 600, 100)).band()[1].tolist() == pytest.approx([0.05, 0.55, 0])


def test_folders_win_over_the_environment_and_it_over_the_library(
    folder: Path, tmp_path_factory, monkeypatch
) -> None:
    first, second = tmp_path_factory.mktemp("first"), tmp_path_factory.mktemp("second")
    (first / "light-grey.csv").write_text(GREY.format(name="mine", S=0.9))
    (second / "dark-grey.csv").write_text(GREY.format(name="theirs", S=0.1))
    monkeypatch.setenv(ENVIRONMENT, os.pathsep.join([str(second), str(folder)]))
    assert material("light-grey").name == "light-grey"
    assert material("light-grey", [first]).name == "mine"
    assert material("dark-grey").name == "theirs"
    assert {"light-grey", "dark-grey", "two-dyes", "sheet"} <= set(materials())
    assert "notes" not in materials()


class TestFaults:
    def test_an_unknown_name_offers_similar_ones(self, folder: Path) -> None:
        with pytest.raises(
            MaterialError, match=r"(?s)no such material.*'lihgt-grey'.*did you mean light-grey"
        ):
            material("lihgt-grey", [folder])

    def test_an_unknown_ingredient(self, folder: Path) -> None:
        with pytest.raises(MaterialError, match=r"(?s)no such material.*'grey-light'"):
            material("grey-light:0.5,dark-grey:0.5", [folder])

    @pytest.mark.parametrize("mixture", ["light-grey:0.5,dark-grey:0.6", "light-grey:2"])
    def test_weights(self, folder: Path, mixture: str) -> None:
        with pytest.raises(MaterialError, match="add up to 1"):
            material(mixture, [folder])

    def test_a_weight_that_is_no_number(self, folder: Path) -> None:
        with pytest.raises(MaterialError, match=r"(?s)not a number.*'0\.\.5'"):
            material("light-grey:0..5,dark-grey:0.5", [folder])

    @pytest.mark.parametrize("missing", ["no.csv", "no.bfc", Path("no.csv"), "folder/no.csv"])
    def test_missing_files(self, missing: str | Path) -> None:
        with pytest.raises(MaterialError, match="does not exist"):
            material(missing)

    def test_a_missing_folder(self, tmp_path: Path) -> None:
        with pytest.raises(MaterialError, match=f"(?s)folder.*does not exist.*{ENVIRONMENT}"):
            materials([tmp_path / "nowhere"])

    @pytest.mark.parametrize(
        ("old", "new", "complaint"),
        [
            ("# fluorspar-material: 1", "# something: else", "does not say what it holds"),
            ("material: 1", "material: 2", "unknown version"),
            ("emission_2,excitation_2", "emission_2,x", "unknown columns"),
            (
                "400,0.1,0,5,0,0",
                "400,1.1,0,5,0,0",
                "(?s)impossible spectrum.*greater than 1.*'two-dyes', 400 nm",
            ),
            ("400,0.1,0,5,0,0", "200,0.1,0,5,0,0", "do not ascend"),
            ("400,0.1,0,5,0,0", "400,nan,0,5,0,0", "not a finite number"),
            ("500,0.1,0.3,0,0,7", "500,0.1,0.3,0,0,0", "0 everywhere"),
        ],
    )
    def test_malformed_files(self, folder: Path, old: str, new: str, complaint: str) -> None:
        assert old in DYE
        (folder / "two-dyes.csv").write_text(DYE.replace(old, new))
        with pytest.raises(MaterialError, match=complaint):
            material("two-dyes", [folder])

    def test_unknown_suffix(self, folder: Path) -> None:
        with pytest.raises(MaterialError, match="suffix"):
            material(folder / "notes.txt")

    def test_a_donaldson_file_with_negative_reflectance(self, folder: Path) -> None:
        (folder / "sheet.csv").write_text(SHEET.replace("500,0.1,0.5,0", "500,0.1,-0.5,0"))
        with pytest.raises(SpectrumError, match=r"(?s)negative.*sheet\.csv, 500 nm"):
            material("sheet", [folder])


def test_shipped_materials_are_possible_and_reach_from_300_to_780_nm() -> None:
    """On both grids nothing warns: no extrapolation, no photon yield above 1."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in materials():
            for grid in (Wavelengths(), Wavelengths(300, 780, 5), Wavelengths(360, 700, 20)):
                material(name).on(grid)
            assert material(name).credit, name


def test_a_material_read_is_the_material_listed(folder: Path) -> None:
    assert read_material(folder / "two-dyes.csv").name in materials([folder])


def test_a_summary_shows_the_colour_that_colour_does() -> None:
    """A neon paint is brighter than sRGB can show: dimmed, it keeps its hue, here as there."""
    seen = colour_under_lamp(material("neon-yellow"), "D65")
    rgb = " ".join(str(round(255 * float(c))) for c in seen.srgb)
    assert f"sRGB {rgb}," in repr(material("neon-yellow"))


def test_files_of_a_mixture_are_looked_for_beside_the_scene(tmp_path) -> None:
    for name, value in (("a", 0.2), ("b", 0.6)):
        text = f"# fluorspar-material: 1\nwavelength,reflectance\n300,{value}\n780,{value}\n"
        (tmp_path / f"{name}.csv").write_text(text)
    assert material("a.csv:0.5,b.csv:0.5", base=tmp_path).reflectance.at(500) == pytest.approx(0.4)
    with pytest.raises(MaterialError, match="does not exist"):
        material("a.csv:0.5,b.csv:0.5")
