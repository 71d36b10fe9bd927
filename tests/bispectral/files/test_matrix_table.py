"""Matrices over emission and excitation in the layouts that people and instruments write.

The layouts of instruments are written here after what their makers and users say of them; the numbers are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fluorspar.bispectral.files.eem_file import read_eem
from fluorspar.bispectral.files.registry import read_matrix
from fluorspar.errors import ApproximationWarning, MaterialError

EM, EX = np.arange(400, 701, 10), np.arange(300, 601, 20)
CELLS = np.where(
    EM[:, None] > EX,
    np.round(900 * np.exp(-(((EM[:, None] - 560) / 40) ** 2) - ((EX - 460) / 60) ** 2), 3),
    0.0,
)


def wide(corner: str = "nm", mark: str = ",", cells: np.ndarray = CELLS, rows=EM, columns=EX) -> str:
    lines = [mark.join([corner, *map(str, columns)])]
    lines += [mark.join([str(w), *map(str, row)]) for w, row in zip(rows, cells.tolist(), strict=True)]
    return "\n".join(lines)


def descending() -> str:
    return wide(cells=CELLS[::-1, ::-1], rows=EM[::-1], columns=EX[::-1])


def transposed(corner: str = "excitation") -> str:
    return wide(corner, cells=CELLS.T, rows=EX, columns=EM)


def empty_above_the_diagonal() -> str:
    rows = [
        [str(v) if e >= x else "" for x, v in zip(EX, row, strict=True)]
        for e, row in zip(EM, CELLS, strict=True)
    ]
    lines = [f"{e},{','.join(row)}" for e, row in zip(EM, rows, strict=True)]
    return "\n".join([wide().partition("\n")[0], *lines])


def long(header: str = "ex,em,intensity") -> str:
    lines = [f"{x},{e},{CELLS[i, j]}" for j, x in enumerate(EX) for i, e in enumerate(EM) if e > x]
    return "\n".join([header, *lines, *(f"{x},{x},0" for x in EX if x >= 400)])


def horiba_aqualog() -> str:
    """Emission downwards, excitation from long to short, a tab between."""
    return wide("Sample - Blank", "\t", CELLS[:, ::-1], columns=EX[::-1])


def horiba_fluoressence() -> str:
    return "Paint 1, 27 Nov : Sc / Rc\n\n" + wide("Wavelength", ",")


def hitachi() -> str:
    head = ["Sample:\tpaint", "Measurement type:\t3-D Scan", "EX Start WL:\t300.0 nm", "Data points"]
    return "\n".join(head) + "\n" + wide("", "\t").replace(".0\t", ".000\t")


def shimadzu() -> str:
    return '"3D spectrum of paint"\n"Date","2025/11/27"\n' + wide("EM Wavelength\\EX Wavelength")


def cary_eclipse() -> str:
    """A spectrum for each excitation wavelength, with its wavelengths beside it, and settings below."""
    head = "".join(f"Paint_EX_{x:.2f},," for x in EX)
    units = "Wavelength (nm),Intensity (a.u.)," * len(EX)
    rows = ["".join(f"{e:.2f},{v}," for v in row) for e, row in zip(EM, CELLS.tolist(), strict=True)]
    return "\n".join([head, units, *rows, "", "Paint_EX_300.00", "Excitation slit (nm)  5.00"])


@pytest.mark.parametrize(
    "layout",
    [
        wide,
        descending,
        transposed,
        long,
        horiba_aqualog,
        horiba_fluoressence,
        hitachi,
        shimadzu,
        cary_eclipse,
        lambda: "# rows: excitation\n" + transposed("nm"),
        lambda: wide("emission\\excitation"),
        empty_above_the_diagonal,
        lambda: long("Emission (nm);Excitation (nm);I").replace(",", ";"),
    ],
)
def test_layouts(tmp_path: Path, layout: Callable[[], str]) -> None:
    file = tmp_path / "paint.csv"
    text = layout()
    if text.startswith("Emission"):  # the columns the other way round
        rows = [line.split(";") for line in text.splitlines()[1:]]
        text = "\n".join([text.splitlines()[0], *(f"{em};{ex};{v}" for ex, em, v in rows)])
    file.write_text(text)
    eem = read_eem(file)
    np.testing.assert_array_equal(eem.emission, EM)
    np.testing.assert_array_equal(eem.excitation, EX)
    np.testing.assert_array_equal(eem.cells, CELLS)


def test_rows_of_excitation_that_nothing_says(tmp_path: Path) -> None:
    (tmp_path / "paint.csv").write_text(transposed("nm"))
    with pytest.warns(ApproximationWarning, match="rows are taken for excitation .*'# rows: excitation'"):
        np.testing.assert_array_equal(read_eem(tmp_path / "paint.csv").cells, CELLS)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (long("a,b,c"), "(?s)columns of a long table are not named.*'excitation,emission,value'"),
        ("ex,em,D\n400,400,1\n400,410,2", "(?s)too few wavelengths.*2 of emission, 1 of excitation"),
        ("nm,400,410\n-400,1,0\n410,1,0", "wavelength is impossible"),
        ("nm,400,410\n400,1,0", "(?s)too few wavelengths.*1 of emission, 2 of excitation"),
        (long() + "\n300,400,5", "(?s)occurs twice.*emission 400 nm, excitation 300 nm"),
        (
            long().replace("300,400,", "300,1400,"),
            "(?s)cell of a matrix is empty.*emission 400 nm, excitation 300",
        ),
        (wide().replace("410,0.0", "410,"), "(?s)cell of a matrix is empty.*emission 410 nm, excitation 300"),
        ("400,1\n410,2", "(?s)does not name every column.*0 wavelengths for 1 columns"),
        ("# quantity: band\n" + wide(), "(?s)is a Donaldson matrix.*`fluorspar materials fit`"),
        ("# fluorspar-material: 1\n" + wide(), "the file is a material"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / "paint.csv").write_text(text)
    with pytest.raises(MaterialError, match=complaint):
        read_eem(tmp_path / "paint.csv")


class TestDonaldson:
    """What is read is the matrix: the same cells, whatever their order."""

    S = 0.3 * (EM[:, None] == EX)

    def matrix(self, folder: Path, text: str, quantity: str = "density") -> np.ndarray:
        (folder / "sheet.csv").write_text(f"# quantity: {quantity}\n# step: 20\n{text}")
        with pytest.warns(ApproximationWarning, match=r"emission \(by 10 nm\) and excitation \(by 20 nm\)"):
            measured = read_matrix(folder / "sheet.csv")
        assert (measured.step, measured.emission[0], measured.excitation[-1]) == (10, 400, 600)
        return measured.cells

    def test_layouts_and_quantities_agree(self, tmp_path: Path) -> None:
        density = CELLS / 1e5
        band = np.where(self.S > 0, self.S, 20 * density)
        expected = self.matrix(tmp_path, wide(cells=density + self.S))
        assert expected[10, 16] == pytest.approx(10 * density[10, 8], abs=1e-12)  # a cell that was measured
        assert self.matrix(tmp_path, wide(cells=band), "band") == pytest.approx(expected, abs=1e-12)
        turned = wide("ex", cells=(density + self.S).T, rows=EX, columns=EM)
        assert self.matrix(tmp_path, turned) == pytest.approx(expected, abs=1e-12)
        rows = ((x, e, density[i, j] + self.S[i, j]) for j, x in enumerate(EX) for i, e in enumerate(EM))
        listed = "\n".join(["ex,em,D", *(f"{x},{e},{v}" for x, e, v in rows)])
        assert self.matrix(tmp_path, listed) == pytest.approx(expected, abs=1e-12)

    def test_a_density_needs_no_step(self, tmp_path: Path) -> None:
        (tmp_path / "sheet.csv").write_text("# quantity: density\nnm,400,410\n400,0.5,0\n410,0.02,0.4")
        assert read_matrix(tmp_path / "sheet.csv").cells.tolist() == [[0.5, 0], [0.2, 0.4]]


def test_units_below_the_header_are_no_wavelengths(tmp_path: Path) -> None:
    """Fluorometers write what each column counts into a second line."""
    header, _, rows = wide("Wavelength", "\t").partition("\n")
    for names in (["CPS"] * len(EX), [f"S{k}" for k in range(len(EX))]):
        file = tmp_path / "scan.dat"
        file.write_text("\n".join([header, "\t".join(["nm", *names]), rows]))
        read = read_eem(file)
        assert np.array_equal(read.excitation, EX)
        assert np.array_equal(read.cells, CELLS)


def test_a_corner_that_names_both_says_nothing(tmp_path: Path) -> None:
    """The light does, then: it is shifted to longer wavelengths."""
    file = tmp_path / "scan.csv"
    for corner in ("Ex/Em", "Em/Ex"):
        file.write_text(wide(corner))
        assert np.array_equal(read_eem(file).cells, CELLS)
        file.write_text(transposed(corner))
        with pytest.warns(ApproximationWarning, match="taken for excitation"):
            assert np.array_equal(read_eem(file).cells, CELLS)


def test_scans_over_other_wavelengths_are_no_matrix(tmp_path: Path) -> None:
    file = tmp_path / "scans.csv"
    head = ["dye_EX_300.00,,dye_EX_320.00,", "Wavelength (nm),Intensity,Wavelength (nm),Intensity"]
    file.write_text("\n".join([*head, "400,1,420,2", "410,3,430,4"]))
    with pytest.raises(MaterialError, match=r"(?s)emission wavelengths of their own.*column 3"):
        read_eem(file)


def test_micrometres_are_named(tmp_path: Path) -> None:
    file = tmp_path / "micro.csv"
    file.write_text(wide(rows=EM / 1000, columns=EX / 1000))
    with pytest.raises(MaterialError, match=r"(?s)wavelength is impossible.*times 1000"):
        read_eem(file)
