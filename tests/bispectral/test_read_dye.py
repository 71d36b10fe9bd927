"""Dyes from files: the units are what a file or the user says, and one dye is one whatever is counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar.bispectral.dye import dye, read_dye
from fluorspar.errors import MaterialError
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

W = np.arange(400.0, 701.0, 10.0)
ABSORBS, EMITS = (np.exp(-(((W - peak) / 30) ** 2)) for peak in (480, 560))
GRID = Wavelengths(400, 700, 10)


def written(path: Path, values: np.ndarray, units: str = "") -> Path:
    head = f"# units: {units}\n" if units else ""
    path.write_text(head + "".join(f"{w:g},{value:.12g}\n" for w, value in zip(W, values, strict=True)))
    return path


def test_one_dye_is_one_whatever_is_counted(tmp_path):
    """Excitation per energy is that per photon times wavelength; emission in energy is photons over wavelength."""
    expected = dye(Spectrum(W, ABSORBS), Spectrum(W, EMITS), 0.9, 0.5, units="photon").on(GRID).band()
    photons = written(tmp_path / "ex.csv", ABSORBS, "photon"), written(tmp_path / "em.csv", EMITS, "Photon")
    energy = written(tmp_path / "ex2.csv", ABSORBS * W), written(tmp_path / "em2.csv", EMITS / W)
    mixed = photons[0], written(tmp_path / "em3.csv", EMITS / W, "energy")
    for files, units in ((photons, None), (energy, "energy"), (mixed, None)):
        assert read_dye(*files, 0.9, 0.5, units=units).on(GRID).band() == pytest.approx(
            expected, rel=1e-9, abs=1e-12
        )


def test_units_are_not_guessed(tmp_path):
    files = written(tmp_path / "ex.csv", ABSORBS), written(tmp_path / "em.csv", EMITS)
    with pytest.raises(MaterialError, match=r"(?s)needs the units.*ex\.csv.*# units: photon.*--units"):
        read_dye(*files, 0.9, 0.5)


def test_a_contradiction_is_refused(tmp_path):
    files = written(tmp_path / "ex.csv", ABSORBS, "photon"), written(tmp_path / "em.csv", EMITS, "photon")
    with pytest.raises(MaterialError, match=r"(?s)disagree.*'photon' in the file, 'energy' as option"):
        read_dye(*files, 0.9, 0.5, units="energy")


def test_swapped_files_are_noticed(tmp_path):
    files = written(tmp_path / "ex.csv", ABSORBS), written(tmp_path / "em.csv", EMITS)
    with pytest.raises(MaterialError, match=r"(?s)shorter wavelengths.*560 nm.*480 nm.*swapped"):
        read_dye(*reversed(files), 0.9, 0.5, units="photon")


@pytest.mark.parametrize("quantum_yield", [1.2, "0.9"])
def test_an_impossible_quantum_yield(tmp_path, quantum_yield):
    files = written(tmp_path / "ex.csv", ABSORBS), written(tmp_path / "em.csv", EMITS)
    with pytest.raises(MaterialError, match="quantum yield"):
        read_dye(*files, quantum_yield, 0.5, units="photon")


def test_both_spectra_in_one_file_with_blanks(tmp_path):
    """As data bases of fluorescent proteins export them: a column each, empty where a spectrum was not measured."""
    rows = [
        f"{w:g},{a:.12g},{b if w >= 470 else ''}"
        for w, a, b in zip(W[::-1], ABSORBS[::-1], EMITS[::-1], strict=True)
    ]
    file = tmp_path / "both.csv"
    file.write_text("\n".join(["wavelength,mine ex,mine em", *rows]))
    measured = W >= 470
    expected = dye(Spectrum(W, ABSORBS), Spectrum(W[measured], EMITS[measured]), 0.9, 0.5, units="photon")
    read = read_dye(file, file, 0.9, 0.5, units="photon")
    assert read.name == "both"
    assert read.on(GRID).band() == pytest.approx(expected.on(GRID).band(), rel=1e-9, abs=1e-12)
    named = read_dye(f"{file}:mine ex", f"{file}:mine em", 0.9, 0.5, units="photon")
    assert named.on(GRID).band() == pytest.approx(read.on(GRID).band())


def test_an_absorption_is_a_share_whatever_is_counted(tmp_path):
    emission = written(tmp_path / "em.csv", EMITS / W, "energy")
    absorption = tmp_path / "ab.csv"
    absorption.write_text("nm,absorption\n" + written(tmp_path / "ex.csv", ABSORBS).read_text())
    expected = dye(Spectrum(W, ABSORBS), Spectrum(W, EMITS), 0.9, 0.5, units="photon").on(GRID).band()
    absorption.write_text(
        "nm,absorption,other\n" + written(tmp_path / "ex.csv", ABSORBS).read_text().replace("\n", ",0\n")
    )
    assert read_dye(absorption, emission, 0.9, 0.5, units="energy").on(GRID).band() == pytest.approx(
        expected, rel=1e-9, abs=1e-12
    )
