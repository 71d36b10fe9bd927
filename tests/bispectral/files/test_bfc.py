"""Labsphere .bfc files, as they are and as they go wrong: line ends, blank lines, damage of every kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar.bispectral.files.bfc import read_bfc
from fluorspar.bispectral.library import material
from fluorspar.errors import MaterialError

EMISSION = np.arange(380.0, 421.0, 10.0)
EXCITATION = np.arange(360.0, 421.0, 10.0)


def cells() -> np.ndarray:
    """S = 0.5 on the diagonal, a little luminescence below, noise of both signs above."""
    shift = EMISSION[:, None] - EXCITATION[None, :]
    return np.where(shift == 0, 0.5, np.where(shift > 0, 0.02, -1.5e-3))


def text(
    table: np.ndarray | None = None, ranges: str = "380\t420\t10\t7\t360\t10", end: str = "EOD\n"
) -> str:
    """A file as the instrument writes it, LF line ends."""
    lines = ["VEC_01\t5167", "BFC-450 Matrix File", ";sheet.BFC", ";a fluorescent sheet", ";<none>", ranges]
    lines.append("r:c:\t" + "\t".join(f"{w:g}" for w in EXCITATION) + "\t")
    for w, row in zip(EMISSION, cells() if table is None else table, strict=True):
        lines.append(f"{w:g}\t" + "\t".join(f"{value:.9g}" for value in row) + "\t")
    return "\n".join(lines) + "\n" + end


def write(folder: Path, content: str | bytes) -> Path:
    file = folder / "sheet.BFC"
    file.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
    return file


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r", "\r\n\r\n", "\n \t\n"])
def test_any_line_ends_and_blank_lines(tmp_path, line_end):
    matrix = read_bfc(write(tmp_path, text().replace("\n", line_end)))
    assert np.array_equal(matrix.cells, cells())
    assert np.array_equal(matrix.emission, EMISSION)
    assert np.array_equal(matrix.excitation, EXCITATION)
    assert matrix.name == "sheet.BFC"


def test_free_text_may_hold_any_byte(tmp_path):
    content = text().replace("a fluorescent sheet", "papier fluoresc\xe9, 25 \xb0C").encode("latin-1")
    assert read_bfc(write(tmp_path, content)).step == 10


def test_ranges_line_is_not_needed(tmp_path):
    assert np.array_equal(read_bfc(write(tmp_path, text(ranges=";none"))).cells, cells())


def test_the_library_reads_it(tmp_path):
    sheet = material(write(tmp_path, text()))
    assert sheet.name == "sheet"
    assert sheet.fluorescent
    assert sheet.reflectance.at(400) == 0.5


def changed(old: str, new: str) -> str:
    content = text()
    assert old in content
    return content.replace(old, new, 1)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (text(end=""), ["no end", "truncated"]),
        (text()[:330], ["wrong number of cells", "line 12", "truncated"]),
        (changed("390\t0.02", "390\tabc"), ["line 9, cell 2", "'abc'"]),
        (changed("390\t0.02", "390\tNaN"), ["line 9, cell 2", "'NaN'"]),
        (changed("390\t0.02", "390\t1e999"), ["line 9, cell 2"]),
        (changed("\n390\t", "\n380\t"), ["emission", "line 9", "380 nm, then 380 nm"]),
        (changed("\n400\t", "\n370\t"), ["emission", "line 10", "390 nm, then 370 nm"]),
        (changed("\t380\t390", "\t390\t380"), ["excitation", "line 7", "390 nm, then 380 nm"]),
        (changed("r:c:", "r-c"), ["no header of excitation wavelengths", "r:c:"]),
        (changed("r:c:\t360\t", "r:c:\t"), ["wrong number of cells", "line 8"]),
        ("", ["no header", "an empty file"]),
        ("\r\n\r\n", ["no header", "an empty file"]),
        ("wavelength,reflectance\n400,0.5\n", ["no header", "2 lines"]),
        (
            text(ranges="380 420 5 7 360 5"),
            ["does not have the wavelengths that", "380 420 10", "line 6"],
        ),
        (
            text(ranges="380 480 10 7 360 10"),
            ["does not have the wavelengths that", "380 480 10"],
        ),
        (changed("\t390\t400", "\t391\t400"), ["evenly spaced"]),
    ],
)
def test_damaged_files_are_refused_with_line_and_cell(tmp_path, content, says):
    with pytest.raises(MaterialError) as error:
        read_bfc(write(tmp_path, content))
    assert "sheet.BFC" in str(error.value)
    for words in says:
        assert words in str(error.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(MaterialError, match="does not exist"):
        read_bfc(tmp_path / "none.bfc")


def test_a_huge_file_is_refused_before_it_is_read(tmp_path):
    """5 GB named by mistake: sparse here, but reading it would take its size in memory."""
    file = tmp_path / "render.bfc"
    with file.open("wb") as handle:
        handle.truncate(5 * 1024**3)
    with pytest.raises(MaterialError, match="too large") as error:
        read_bfc(file)
    assert "5,368,709,120 bytes" in str(error.value)


def test_a_corrupt_matrix_is_refused_with_the_reason(tmp_path):
    """A column whose cells add up to far more light than fell on the sample."""
    table = cells()
    table[3:, 2] = [4.0, 30.0]
    with pytest.raises(MaterialError, match="more photons than it gets") as error:
        read_bfc(write(tmp_path, text(table)))
    assert "excitation 380 nm" in str(error.value)
    assert "adds up to 34" in str(error.value)
    assert "corrupt" in str(error.value)


def test_a_transposed_matrix_is_refused(tmp_path):
    table = np.where(EMISSION[:, None] == EXCITATION[None, :], 0.5, 0.0)
    table += np.where(EMISSION[:, None] < EXCITATION[None, :], 0.03, 0.0)
    with pytest.raises(MaterialError, match="transpose"):
        read_bfc(write(tmp_path, text(table)))
