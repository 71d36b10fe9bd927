"""Material files: what is written is what is read back, and what ships can be used without a warning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar.bispectral.files.material_csv import write_material
from fluorspar.bispectral.files.registry import read_material
from fluorspar.bispectral.library import material, materials
from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(300, 780, 5)


def two_dyes() -> Material:
    """Every spectrum on wavelengths of its own; one emission ends at a value other than 0."""
    first = Fluorophore(Spectrum([500, 550, 600], [0, 0.6, 0.2]), Spectrum([380, 450, 520], [0, 1, 0]))
    second = Fluorophore(Spectrum([420, 440, 500], [0, 0.3, 0]), Spectrum([300, 360, 400], [0, 1, 0]))
    return Material(
        "two dyes",
        Spectrum([300, 400, 780], [0.1, 0.3, 0.8]),
        (first, second),
        description="made up",
        credit="nobody",
        quality="exact",
        assumed="all of it\nreally",
    )


def test_a_material_comes_back(tmp_path):
    before = two_dyes()
    after = read_material(write_material(tmp_path / "two.csv", before))
    assert after.on(GRID).band() == pytest.approx(before.on(GRID).band(), abs=2e-6)
    for key in ("name", "description", "credit", "quality", "assumed"):
        assert getattr(after, key) == getattr(before, key)


def test_writing_again_changes_nothing(tmp_path):
    """To the sixth digit, which is what the file holds."""
    first = write_material(tmp_path / "a.csv", two_dyes())
    second = write_material(tmp_path / "b.csv", read_material(first))
    tables = [np.loadtxt(file, delimiter=",", skiprows=8) for file in (first, second)]
    assert tables[0] == pytest.approx(tables[1], rel=1e-5)


def test_one_dye_has_plain_column_names(tmp_path):
    dye = two_dyes().fluorophores[0]
    file = write_material(tmp_path / "one.csv", Material("one", Spectrum.constant(0.2), (dye,)))
    assert "wavelength,reflectance,emission,excitation" in file.read_text().splitlines()
    assert read_material(file).reflectance.support == (300.0, 780.0)


def test_a_measured_matrix_has_no_factors_to_write(tmp_path):
    w = np.array([400.0, 410.0])
    sheet = Material.from_matrix("sheet", MeasuredMatrix(w, w, [[0.5, 0], [0.1, 0.5]]))
    with pytest.raises(MaterialError, match="fit it first"):
        write_material(tmp_path / "sheet.csv", sheet)
    assert list(tmp_path.iterdir()) == []


def test_a_reflectance_that_ends_before_the_others_is_said_to_be_held(tmp_path):
    """The table of the file reaches as far as the excitation; what it holds of S there is not data."""
    dye = Fluorophore(Spectrum([500, 600], [0.1, 0.0]), Spectrum([300, 400], [1.0, 1.0]))
    made = Material("short", Spectrum([400, 700], [0.3, 0.4]), (dye,))
    again = material(write_material(tmp_path / "short.csv", made))
    assert again.assumed == "reflectance below 400 nm not given, held at its value there"
    assert again.reflectance.at(300) == 0.3


def test_a_name_stays_on_its_line(tmp_path):
    made = Material("two\nlines", Spectrum([300, 780], [0.3, 0.4]))
    assert material(write_material(tmp_path / "named.csv", made)).name == "two lines"


def test_an_existing_file_survives_a_failed_write(tmp_path):
    folder = tmp_path / "taken.csv"
    folder.mkdir()
    with pytest.raises(MaterialError, match="cannot be written"):
        write_material(folder, two_dyes())
    assert [path.name for path in tmp_path.iterdir()] == ["taken.csv"]
    with pytest.raises(MaterialError, match="cannot be written"):
        write_material(Path(tmp_path, "none", "a.csv"), two_dyes())


@pytest.mark.parametrize("name", materials())
def test_the_library_is_fit_for_use(name):
    """From 300 to 780 nm without a warning (they are errors here), no photon yield above 1, origin and quality told."""
    found = material(name)
    assert found.name == name
    D = found.on(GRID)
    assert D.photon_yield().max() <= 1
    assert found.description
    assert found.quality
    if found.fluorescent:
        assert found.credit


def test_the_library_has_what_was_promised():
    fitted = [name for name in materials() if "CIEDE2000" in material(name).quality]
    assert len(fitted) >= 12
    assert {"poster-red", "poster-green", "white-85", "gray-45", "luminaire-78"} <= set(materials())
    assert sum(name.startswith("dye-") for name in materials()) >= 3
