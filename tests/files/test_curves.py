"""Curves in tables: which column, which unit, what instruments write around them.

The layouts of instruments are written here after what their makers and users say of them; the numbers are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fluorspar.errors import ApproximationWarning, SpectrumError
from fluorspar.files.curves import read_curve

W = np.arange(450, 601, 10)
V = np.round(800 * np.exp(-(((W - 520) / 30) ** 2)), 3)


def cary_eclipse(mark: str = ",") -> str:
    """Names of the samples above pairs of columns, a cell too many in each line, and the settings below."""
    rows = [f"{w:.2f},{v},{w:.2f},{2 * v}," for w, v in zip(W, V, strict=True)]
    below = ["", "Paint", "Collection Time   11/27/2025 10:12:01 AM", "Excitation Wavelength (nm)  450.00"]
    below += ["Start (nm)  450.00", "PMT Voltage (V)  600", "", "Blank"]
    head = ["Paint,,Blank,,", "Wavelength (nm),Intensity (a.u.),Wavelength (nm),Intensity (a.u.),"]
    return "\n".join([*head, *rows, *below])


def cary_eclipse_alone() -> str:
    rows = [f"{w:.2f},{v}," for w, v in zip(W[::-1], V[::-1], strict=True)]
    return "\n".join(
        ["Paint,,", "Wavelength (nm),Intensity (a.u.),", *rows, "", "Paint", "Scan rate  600.00"]
    )


def horiba_fluoressence() -> str:
    """Long names, units and comments of the columns of a worksheet."""
    rows = [f"{w}\t{v}" for w, v in zip(W, V, strict=True)]
    return "\n".join(["Wavelength\tS1c / R1c", "nm\tCPS / MicroAmps", *rows])


def horiba_title() -> str:
    rows = [f"{w},{v}" for w, v in zip(W, V, strict=True)]
    return "\n".join(["Emission scan of paint, 1: S1c", "", "Wavelength,S1c", *rows])


def hitachi() -> str:
    head = ["Sample:\tpaint", "Run Date:\t10:12:01, 11/27/2025", "Model:\tF-7000 FL Spectrophotometer", ""]
    head += [
        "Instrument Parameters",
        "Measurement type:\tWavelength scan",
        "EX WL:\t450.0 nm",
        "Scan speed:\t240 nm/min",
    ]
    rows = [f"{w:.1f}\t{v:.3f}" for w, v in zip(W, V, strict=True)]
    return "\r\n".join([*head, "Data points", "nm\tData", *rows, ""])


def hitachi_decimal_commas() -> str:
    return hitachi().replace(".", ",")


def shimadzu() -> str:
    rows = [f"{w:.1f},{v:.3f}" for w, v in zip(W, V, strict=True)]
    return "\n".join(['"paint - RawData"', '"Wavelength nm.","Intensity"', *rows])


def shimadzu_text() -> str:
    head = ["[Header]", "Instrument\tRF-6000", "Data points\t16", "", "[Data]", "Wavelength(nm)\tIntensity"]
    return "\n".join([*head, *(f"{w:.2f}\t{v}" for w, v in zip(W, V, strict=True))])


def ocean_optics() -> str:
    head = ["Data from paint.txt Node", "", "Date: Thu Nov 27 10:12:01 UTC 2025", "Spectrometer: USB4C00001"]
    head += ["Integration Time (sec): 1.000000E-1", "Number of Pixels in Spectrum: 16"]
    head += [">>>>>Begin Spectral Data<<<<<"]
    return "\n".join(
        [*head, *(f"{w}\t{v}" for w, v in zip(W, V, strict=True)), ">>>>>End Spectral Data<<<<<"]
    )


@pytest.mark.parametrize(
    "layout",
    [
        cary_eclipse_alone,
        horiba_fluoressence,
        horiba_title,
        hitachi,
        hitachi_decimal_commas,
        shimadzu,
        shimadzu_text,
        ocean_optics,
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1"])
def test_exports_of_instruments(tmp_path: Path, layout: Callable[[], str], encoding: str) -> None:
    file = tmp_path / "scan.txt"
    file.write_text("Temperature 20 °C, slit 5 µm\n" + layout(), encoding=encoding)
    curve = read_curve(file)
    np.testing.assert_array_equal(curve.wavelengths, W)
    np.testing.assert_array_equal(curve.values, V)


@pytest.mark.parametrize(("column", "factor"), [("Paint Intensity (a.u.)", 1), ("paint", 1), ("blank", 2)])
def test_pairs_of_columns(tmp_path: Path, column: str, factor: int) -> None:
    file = tmp_path / "scan.csv"
    file.write_text(cary_eclipse())
    np.testing.assert_array_equal(read_curve(f"{file}:{column}").values, factor * V)


FPBASE = "wavelength,mine ex,mine em\n350,0.1,\n400,1,\n450,0.4,0.1\n500,,1\n550,,0.2\n"


@pytest.fixture
def fpbase(tmp_path: Path) -> Path:
    (tmp_path / "mine.csv").write_text(FPBASE)
    return tmp_path / "mine.csv"


class TestSeveralColumns:
    def test_the_role_chooses_and_blanks_end_a_spectrum(self, fpbase: Path) -> None:
        excitation, emission = read_curve(fpbase, "excitation"), read_curve(fpbase, "emission")
        assert (excitation.wavelengths.tolist(), excitation.values.tolist()) == (
            [350, 400, 450],
            [0.1, 1, 0.4],
        )
        assert (emission.wavelengths.tolist(), emission.values.tolist()) == ([450, 500, 550], [0.1, 1, 0.2])

    def test_absorption_stands_for_excitation(self, fpbase: Path) -> None:
        fpbase.write_text(FPBASE.replace("mine ex", "absorption"))
        curve = read_curve(fpbase, "excitation")
        assert curve.is_absorption
        assert curve.values.max() == 1
        fpbase.write_text("nm,abs,ex,em\n400,1,2,3\n500,1,2,3\n")
        assert read_curve(fpbase, "excitation").values.tolist() == [2, 2]

    def test_without_a_choice_the_columns_are_named_and_the_advice_works(self, fpbase: Path) -> None:
        with pytest.raises(
            SpectrumError, match=r"(?s)several spectra.*3 columns: 'mine ex', 'mine em'"
        ) as error:
            read_curve(fpbase)
        advised = str(error.value).partition("such as '")[2].removesuffix("'")
        assert read_curve(advised).name == "mine ex"

    def test_columns_without_headings(self, tmp_path: Path) -> None:
        (tmp_path / "two.txt").write_text("400 1 2\n500 3 4\n")
        with pytest.raises(SpectrumError, match="3 columns: 'column 2', 'column 3'"):
            read_curve(tmp_path / "two.txt")
        assert read_curve(f"{tmp_path}/two.txt:column 3").values.tolist() == [2, 4]

    @pytest.mark.parametrize(
        ("column", "complaint"), [("green", "no column 'green'"), ("mine", "more than one column 'mine'")]
    )
    def test_a_column_that_is_none(self, fpbase: Path, column: str, complaint: str) -> None:
        with pytest.raises(SpectrumError, match=complaint):
            read_curve(f"{fpbase}:{column}")

    def test_a_file_of_the_other_spectrum(self, fpbase: Path) -> None:
        fpbase.write_text("wavelength,mine ex\n350,0\n400,1\n")
        with pytest.raises(SpectrumError, match=r"(?s)no column .* emission.*'mine ex'"):
            read_curve(fpbase, "emission")

    def test_two_dyes_in_one_file(self, fpbase: Path) -> None:
        fpbase.write_text("wavelength,a ex,a em,b ex,b em\n400,1,2,3,4\n500,1,2,3,4\n")
        with pytest.raises(SpectrumError, match="several spectra"):
            read_curve(fpbase, "emission")
        assert read_curve(f"{fpbase}:b em", "emission").values.tolist() == [4, 4]

    def test_the_wavelength_need_not_come_first(self, fpbase: Path) -> None:
        fpbase.write_text("pixel,wavelength (nm),counts\n1,400,7\n2,500,8\n")
        assert read_curve(f"{fpbase}:counts").wavelengths.tolist() == [400, 500]

    def test_an_empty_column(self, fpbase: Path) -> None:
        fpbase.write_text("nm,a,b,c\n400,,1,1\n500,,2,1\n")
        with pytest.raises(SpectrumError, match=r"(?s)column is empty.*'a'"):
            read_curve(f"{fpbase}:a")


def test_an_empty_cell_between_others_is_said(tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_text("nm,value\n400,1\n410,\n420,3\n")
    with pytest.warns(ApproximationWarning, match=r"gap\.csv: empty cells .* at 410 nm, are interpolated"):
        curve = read_curve(tmp_path / "gap.csv")
    assert curve.wavelengths.tolist() == [400, 420]


class TestUnits:
    def test_micrometres_that_a_heading_says(self, tmp_path: Path) -> None:
        (tmp_path / "a.csv").write_text("Wavelength (µm),value\n0.4,1\n0.5,2\n", encoding="utf-8")
        np.testing.assert_allclose(read_curve(tmp_path / "a.csv").wavelengths, [400, 500])

    def test_micrometres_that_nothing_says(self, tmp_path: Path) -> None:
        (tmp_path / "a.csv").write_text("0.4,1\n0.5,2\n")
        with pytest.warns(
            ApproximationWarning, match=r"wavelengths of 0\.4 to 0\.5 are taken for micrometres"
        ):
            curve = read_curve(tmp_path / "a.csv")
        np.testing.assert_allclose(curve.wavelengths, [400, 500])

    @pytest.mark.parametrize("heading", ["Reflectance (%)", "%R", "R in percent"])
    def test_percent(self, tmp_path: Path, heading: str) -> None:
        (tmp_path / "a.csv").write_text(f"nm,{heading}\n400,50\n500,80\n")
        np.testing.assert_allclose(read_curve(tmp_path / "a.csv").values, [0.5, 0.8])


def test_units_below_the_names(tmp_path: Path) -> None:
    file = tmp_path / "scans.dat"
    file.write_text("Wavelength\tex scan\tem scan\nnm\tCPS\tV\n450\t1\t4\n451\t2\t5")
    assert np.array_equal(read_curve(file, "emission").values, [4, 5])


def test_numbers_of_rows_are_no_curve(tmp_path: Path) -> None:
    file = tmp_path / "frame.csv"
    file.write_text(",wavelength,value\n0,400,0.1\n1,410,0.2")
    assert np.array_equal(read_curve(file).values, [0.1, 0.2])


def test_another_table_above_is_said_to_be_left_out(tmp_path: Path) -> None:
    file = tmp_path / "scan.txt"
    file.write_text("Peaks\nno\tstart\tapex\n1\t450\t451\n\nnm\tData\n450\t1\n451\t2\n452\t1")
    with pytest.warns(ApproximationWarning, match=r"above the table, line 3"):
        assert np.array_equal(read_curve(file).values, [1, 2, 1])
