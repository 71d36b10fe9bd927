"""Files of instruments and data bases on the command line, and what unreadable ones get.

Rationale
    Each is written here in a layout people have; what is advised against a fault is tried, and must work.
Expected
    Known materials and colours; what was interpolated or passed over is said; one error with exit code 2 otherwise.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import CommandLine, Outcome

from fluorspar.bispectral.files.registry import read_material
from fluorspar.spectral.wavelengths import Wavelengths

DYE = ("--quantum-yield", 0.8, "--strength", 0.6, "--units", "photon")


def good(outcome: Outcome) -> Outcome:
    assert outcome.code == 0, outcome
    return outcome


def eem() -> str:
    """Tabs, a title, excitation from long to short wavelengths by 10 nm, emission by 5 nm, strong Rayleigh scatter."""
    em, ex = np.arange(400, 701, 5), np.arange(500, 299, -10)
    cells = 5e4 * np.outer(np.exp(-(((em - 560) / 25) ** 2)), np.exp(-(((ex - 430) / 25) ** 2)))
    cells[em[:, None] == ex] += 1e6
    rows = ["\t".join([str(w), *(f"{v:.6g}" for v in row)]) for w, row in zip(em, cells, strict=True)]
    return "\n".join(["Paint : Sc / Rc", "\t".join(["nm", *map(str, ex)]), *rows])


class TestFromEem:
    def test_the_quantum_yield_comes_back(self, fluorspar: CommandLine, tmp_path: Path) -> None:
        fluorspar.write("paint.dat", eem())
        done = good(fluorspar("materials", "from-eem", "paint.dat", *DYE, "-o", "paint.csv"))
        assert "within 15 nm of Rayleigh" in done.out
        assert "wrote paint.csv" in done.out
        yields = read_material(tmp_path / "paint.csv").on(Wavelengths(300, 780, 1)).luminescent_photon_yield()
        assert yields[430 - 300] == pytest.approx(0.8 * 0.6, rel=5e-3)

    def test_a_reflectance_in_percent(self, fluorspar: CommandLine, tmp_path: Path) -> None:
        fluorspar.write("paint.dat", "# units: photon\n" + eem())
        fluorspar.write("R.txt", "Sample 1\nWavelength (nm)\tR (%)\n800\t40\n300\t40\n")
        good(
            fluorspar(
                *("materials", "from-eem", "paint.dat", "--quantum-yield", 0.5, "--reflectance", "R.txt"),
                *("-o", "paint.csv"),
            )
        )
        D = read_material(tmp_path / "paint.csv").on(Wavelengths(300, 780, 1))
        assert D.reflectance[130] == pytest.approx(0.4)
        assert D.luminescent_photon_yield()[130] == pytest.approx(0.5 * 0.6, rel=5e-3)

    @pytest.mark.parametrize(
        ("options", "fault"),
        [
            (("--quantum-yield", 0.8, "--strength", 0.6), "an EEM needs the units"),
            (("--quantum-yield", 0.8, "--units", "photon"), "has to be given once"),
            (("--quantum-yield", 0.8, "--strength", 0.6, "--units", "counts"), "no such units"),
            ((*DYE, "--scatter", 400), "smaller width"),
        ],
    )
    def test_what_is_refused(self, fluorspar: CommandLine, options: tuple[object, ...], fault: str) -> None:
        fluorspar.write("paint.dat", eem())
        outcome = fluorspar("materials", "from-eem", "paint.dat", *options, "-o", "paint.csv")
        assert outcome.code == 2
        assert outcome.says(fault)

    def test_the_eem_is_not_overwritten(self, fluorspar: CommandLine) -> None:
        fluorspar.write("paint.csv", eem())
        assert fluorspar("materials", "from-eem", "paint.csv", *DYE, "-o", "paint.csv").code == 2


def test_a_dye_of_two_columns_of_one_file(fluorspar: CommandLine) -> None:
    rows = [f"{w},{np.exp(-(((w - 450) / 30) ** 2)):.4f}," for w in range(350, 500, 5)]
    rows += [f"{w},,{np.exp(-(((w - 560) / 30) ** 2)):.4f}" for w in range(500, 700, 5)]
    fluorspar.write("mine.csv", "\n".join(["wavelength,mine ex,mine em", *rows]))
    done = good(fluorspar("materials", "dye", "mine.csv", "mine.csv", *DYE, "-o", "dyed.csv"))
    assert "excitation peak 450 nm" in done.out
    named = ("mine.csv:mine ex", "mine.csv:mine em")
    assert fluorspar("materials", "dye", *named, *DYE, "-o", "mine.csv").says("one that is read")


def test_lamps_of_others(fluorspar: CommandLine) -> None:
    fluorspar.write("two.csv", "nm,warm,cold\n300,1,1\n780,1,2\n")
    several = fluorspar("materials", "colour", "gray-45", "--illuminant", "two.csv")
    assert several.code == 2
    assert several.says("several spectra", "'warm', 'cold'", "fix: name one, such as 'two.csv:warm'")
    good(fluorspar("materials", "colour", "gray-45", "--illuminant", "two.csv:warm"))
    fluorspar.write("noisy.txt", "300 -0.001\n400 0.5\n780 1\n")
    assert good(fluorspar("materials", "colour", "gray-45", "--illuminant", "noisy.txt")).says(
        "set to 0: noise"
    )


def test_the_list_shows_what_can_be_read_and_says_what_cannot(fluorspar: CommandLine) -> None:
    fluorspar.write("lamp.csv", "nm,value\n300,1\n780,1\n")
    fluorspar.write("paint.csv", "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,0.5\n")
    fluorspar.write("broken.csv", "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,1.5\n")
    listed = good(fluorspar("materials", "list", "--library", "."))
    names = {line.split()[0] for line in listed.out.splitlines() if line.strip()}
    assert "paint" in names
    assert not {"lamp", "broken"} & names
    told = [line for line in listed.err.splitlines() if line.startswith("not listed: ")]
    assert [line.split()[2] for line in told] == ["broken:", "lamp:"]
    assert "greater than 1" not in told[1]
    assert "does not say what it holds (lamp.csv)" in told[1]


@pytest.mark.parametrize("name", ["sheet.txt", "sheet.dat"])
def test_what_is_advised_against_a_name_and_a_file_without_its_lines_works(
    fluorspar: CommandLine, name: str, tmp_path: Path
) -> None:
    table = "wavelength,reflectance\n300,0.5\n780,0.5\n"
    fluorspar.write(name, table)
    refused = fluorspar("materials", "inspect", name)
    assert refused.says(
        "unknown suffix", "save a table as sheet.csv, with a line", "'# fluorspar-material: 1'"
    )
    fluorspar.write("sheet.csv", "# fluorspar-material: 1\n" + table)
    good(fluorspar("materials", "inspect", "sheet.csv"))
