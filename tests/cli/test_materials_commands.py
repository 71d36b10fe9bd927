"""`fluorspar materials`: what each command prints and writes, and what bad input gets.

Rationale
    A measured sheet is made up here from one dye of known peaks, so what comes out is known.
Expected
    Results on standard output; bad input gives one error that says what, where, got and expected, exit code 2,
    and leaves every file as it was.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import CommandLine, Outcome

from fluorspar.bispectral.files.registry import read_material
from fluorspar.bispectral.library import materials
from fluorspar.spectral.wavelengths import Wavelengths

W = np.arange(400, 701, 20)
OLD_FIT = "a fit from yesterday"


def cells() -> np.ndarray:
    """Band-weighted: S = 0.3, one dye excited at 460 and emitting at 580 nm, little noise."""
    dye = np.outer(np.exp(-(((W - 580) / 30) ** 2)), np.exp(-(((W - 460) / 40) ** 2)))
    noise = np.random.default_rng(3).normal(0, 0.0005, (16, 16))
    return 0.3 * np.eye(16) + 0.05 * np.tril(dye, -1) + noise


def sheet(values: np.ndarray | None = None, quantity: str = "band", step: int = 20) -> list[str]:
    """Lines of a Donaldson file: two comments, the header, a row for each emission wavelength."""
    rows = [
        f"{w}," + ",".join(f"{v:.5f}" for v in row)
        for w, row in zip(W, cells() if values is None else values, strict=True)
    ]
    return [f"# quantity: {quantity}", f"# step: {step}", "nm," + ",".join(map(str, W)), *rows]


def bfc(lines: list[str]) -> str:
    """The same as a BFC-450 would write it, with CR at the ends of lines."""
    rows = [line.replace(",", "\t") for line in lines[3:]]
    header = "r:c:\t" + "\t".join(map(str, W))
    return "\r".join(["a sheet", "400 700 20 16 400 20", header, *rows, "EOD", ""])


def with_cell(text: str) -> list[str]:
    lines = sheet()
    row = lines[7].split(",")
    row[4] = text
    lines[7] = ",".join(row)
    return lines


@pytest.fixture
def measured(fluorspar: CommandLine) -> Path:
    return fluorspar.write("sheet.csv", "\n".join(sheet()))


def good(outcome: Outcome) -> str:
    assert outcome.code == 0, outcome
    assert "error" not in outcome.err
    return outcome.out


# --- list


def test_list_shows_every_material_within_80_columns(fluorspar: CommandLine) -> None:
    out = good(fluorspar("materials", "list"))
    assert max(map(len, out.splitlines())) <= 80
    found = {line.split()[0] for line in out.splitlines() if line.strip()}
    assert set(materials()) <= found
    poster = next(line for line in out.splitlines() if "poster-red" in line)
    assert re.search(r"\d{3} → \d{3}", poster), "peaks of excitation and emission"
    assert "→" not in next(line for line in out.splitlines() if "cornell-red" in line)
    assert "RIT" not in out


def test_list_with_credit(fluorspar: CommandLine) -> None:
    assert "RIT" in good(fluorspar("materials", "list", "--credit"))


@pytest.mark.parametrize("how", ["option", "variable"])
def test_own_folder_of_materials(
    how: str, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "paints").mkdir()
    text = "# fluorspar-material: 1\n# description: half\nwavelength,reflectance\n300,0.5\n780,0.5"
    (tmp_path / "paints" / "my-grey.csv").write_text(text)
    options = ("--library", "paints") if how == "option" else ()
    if how == "variable":
        monkeypatch.setenv("FLUORSPAR_MATERIALS", str(tmp_path / "paints"))
    assert "my-grey" in good(fluorspar("materials", "list", *options))
    assert "0.5 everywhere" in good(fluorspar("materials", "show", "my-grey", *options))
    assert "L*a*b* 76.07 0.00 0.00" in good(fluorspar("materials", "colour", "my-grey", *options))
    assert fluorspar("materials", "show", "my-grey", "--library", "nowhere").code == 2


# --- show


@pytest.mark.parametrize("name", ["poster-red", "cornell-red", "poster-red:0.5,poster-yellow:0.5"])
@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_show_draws(name: str, suffix: str, fluorspar: CommandLine, tmp_path: Path) -> None:
    out = good(fluorspar("materials", "show", name, "--plot", f"figure{suffix}"))
    assert f"Material '{name}'" in out
    assert f"wrote figure{suffix}" in out
    content = (tmp_path / f"figure{suffix}").read_bytes()
    assert content.startswith({".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}[suffix])


def test_equal_figures_are_equal_files(fluorspar: CommandLine, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        good(fluorspar("materials", "show", "neon-orange", "--plot", name))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


# --- inspect


@pytest.mark.parametrize("kind", ["csv", "bfc"])
def test_inspect_a_measured_matrix(kind: str, fluorspar: CommandLine, tmp_path: Path) -> None:
    fluorspar.write("sheet.csv", "\n".join(sheet()))
    (tmp_path / "sheet.bfc").write_bytes(bfc(sheet()).encode())
    out = good(fluorspar("materials", "inspect", f"sheet.{kind}", "--plot", "sheet.png"))
    assert ("BFC-450" in out) == (kind == "bfc")
    assert "400-700 nm by 20, 16 rows" in out
    assert "1, as the data call for" in out
    assert re.search(r"^1 chosen .* %", out, re.MULTILINE), "quality of the chosen rank"
    assert re.search(r"^2 .* %", out, re.MULTILINE), "and of one more"
    energy = re.search(r"energy yield: +at most ([0-9.]+), at (\d+) nm", out)
    assert energy is not None
    columns = cells().sum(axis=0)
    assert float(energy[1]) == pytest.approx(columns.max(), abs=0.001)
    assert int(energy[2]) == W[columns.argmax()]
    assert max(map(len, out.splitlines())) <= 80
    assert (tmp_path / "sheet.png").read_bytes().startswith(b"\x89PNG")


def test_inspect_a_material_of_factors(fluorspar: CommandLine) -> None:
    out = good(fluorspar("materials", "inspect", "poster-red"))
    assert "fluorophore 1" in out
    assert "photon yield" in out
    assert "FL11" in out


def test_inspect_writes_yields_by_wavelength(fluorspar: CommandLine, measured: Path, tmp_path: Path) -> None:
    good(fluorspar("materials", "inspect", measured.name, "--yields", "yields.csv"))
    lines = (tmp_path / "yields.csv").read_text().splitlines()
    assert lines[1] == (
        "excitation,photon_yield_measured,photon_yield_fit,energy_yield_measured,energy_yield_fit"
    )
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[2:]])
    assert table[:, 0] == pytest.approx(W)
    assert table[:, 3] == pytest.approx(np.tril(cells()).sum(axis=0), abs=1e-4)
    assert table[:, 4] == pytest.approx(table[:, 3], abs=0.02)


def test_inspect_does_not_claim_what_cannot_be_told(fluorspar: CommandLine) -> None:
    """A plain white has no luminescence, so nothing says which way round it is; and there is nothing to fit."""
    rows = [",".join(["nm", *(f"{w:g}" for w in W)])]
    rows += [",".join([f"{w:g}", *("0.53" if w == v else "0" for v in W)]) for w in W]
    fluorspar.write("white.csv", "\n".join(["# quantity: band", "# step: 20", *rows]))
    out = good(fluorspar("materials", "inspect", "white.csv"))
    assert "not known without luminescence" in out
    assert "none: no luminescence beyond noise" in out


def test_yields_are_left_empty_where_reflectance_was_not_measured(
    fluorspar: CommandLine, tmp_path: Path
) -> None:
    """Excitation from 360 nm, emission from 400: what the fit assumes of S in between is not measured."""
    wide = np.hstack([np.full((16, 2), 0.002), cells()])
    lines = ["# quantity: band", "# step: 20", "nm," + ",".join(map(str, [360, 380, *W]))]
    lines += [f"{w}," + ",".join(f"{v:.5f}" for v in row) for w, row in zip(W, wide, strict=True)]
    fluorspar.write("wide.csv", "\n".join(lines))
    outcome = fluorspar("materials", "inspect", "wide.csv", "--yields", "yields.csv")
    assert outcome.code == 0, outcome.err
    rows = [line.split(",") for line in (tmp_path / "yields.csv").read_text().splitlines()[2:]]
    assert [row[0] for row in rows[:3]] == ["360", "380", "400"]
    assert [row[1] for row in rows[:2]] == ["", ""]
    assert [row[3] for row in rows[:2]] == ["", ""]
    assert float(rows[0][2]) > 0
    assert float(rows[2][1]) > 0


def test_no_command_writes_over_what_it_reads(fluorspar: CommandLine, measured: Path, tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    old = measured.read_bytes()
    kept = tmp_path / "lib" / "paint.csv"
    kept.write_bytes(old)
    fluorspar.write("ex.csv", "# units: photon\n400,0\n450,1\n500,0\n")
    fluorspar.write("em.csv", "# units: photon\n480,0\n530,1\n580,0\n")
    fluorspar.write("base.csv", "# fluorspar-material: 1\nwavelength,reflectance\n300,0.8\n780,0.8\n")
    options = ("--quantum-yield", "0.9", "--strength", "0.5", "--substrate", "base.csv", "-o", "base.csv")
    for arguments in (
        ("inspect", "paint", "--library", "lib", "--yields", "lib/paint.csv"),
        ("fit", measured.name, "-o", measured.name),
        ("dye", "ex.csv", "em.csv", *options),
    ):
        outcome = fluorspar("materials", *arguments)
        assert outcome.code == 2
        assert outcome.says("is one that is read")
    assert kept.read_bytes() == measured.read_bytes() == old
    assert "0.8" in (tmp_path / "base.csv").read_text()


def test_an_impossible_dyed_material_is_not_written(fluorspar: CommandLine, tmp_path: Path) -> None:
    fluorspar.write("ex.csv", "# units: energy\n400,0\n450,1\n500,0\n")
    fluorspar.write("em.csv", "# units: energy\n480,0\n530,1\n580,0\n")
    hot = "# fluorspar-material: 1\nwavelength,reflectance,emission,excitation\n300,0.9,0,1\n600,0.9,2,1\n780,0.9,2,0\n"
    fluorspar.write("hot.csv", hot)
    options = ("--quantum-yield", "0.9", "--strength", "0.1", "--substrate", "hot.csv", "-o", "made.csv")
    outcome = fluorspar("materials", "dye", "ex.csv", "em.csv", *options)
    assert outcome.code == 2
    assert outcome.says("more photons than it gets")
    assert not (tmp_path / "made.csv").exists()


def test_colour_follows_a_lamp_with_lines(fluorspar: CommandLine) -> None:
    w = np.arange(300, 781)
    lamp = "\n".join(f"{x},{501 if x == 546 else 1}" for x in w)
    fluorspar.write("tube.csv", lamp)
    fine = good(fluorspar("materials", "colour", "poster-red", "--illuminant", "tube.csv"))
    told = good(
        fluorspar(
            "materials", "colour", "poster-red", "--illuminant", "tube.csv", "--wavelengths", "300:780:1"
        )
    )
    assert fine == told


def test_a_range_that_cuts_the_luminescence_is_told(
    fluorspar: CommandLine, measured: Path, tmp_path: Path
) -> None:
    """Excitation at 460, emission at 580 nm: 400-500 nm keeps no emission, 500-700 hardly any excitation."""
    outcome = fluorspar("materials", "fit", measured.name, "-o", "blue.csv", "--wavelengths", "400:500:20")
    assert outcome.code == 0, outcome.err
    assert outcome.says("400-500 nm by 20 leaves out", "of the emission")
    difference = re.search(r"to the measurement: D65 ([0-9.]+)", (tmp_path / "blue.csv").read_text())
    assert difference is not None
    assert float(difference[1]) > 5
    outcome = fluorspar("materials", "fit", measured.name, "-o", "red.csv", "--wavelengths", "500:700:20")
    assert outcome.says("leaves out", "of the excitation")


def test_list_shows_the_fault_of_one_file_and_goes_on(fluorspar: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    fluorspar.write("lib/broken.csv", "a,b\n")
    hot = "# fluorspar-material: 1\nwavelength,reflectance,emission,excitation\n300,0.9,0,1\n600,0.9,9,1\n780,0.9,9,0\n"
    fluorspar.write("lib/hot.csv", hot)
    listed = fluorspar("materials", "list", "--library", "lib")
    assert listed.says("not listed: broken", "holds no rows of numbers", "broken.csv")
    assert "more photons" in listed.out + listed.err
    assert "poster-red" in good(listed)


def test_quality_is_that_of_the_file_written(fluorspar: CommandLine, measured: Path, tmp_path: Path) -> None:
    """A table by 100 nm cannot show the colour of the sheet; its quality says so, and a warning."""
    outcome = fluorspar("materials", "fit", measured.name, "-o", "coarse.csv", "--wavelengths", "400:700:100")
    assert outcome.code == 0, outcome.err
    assert "coarser than the measurement" in outcome.err
    difference = re.search(r"to the measurement: D65 ([0-9.]+)", (tmp_path / "coarse.csv").read_text())
    assert difference is not None
    assert float(difference[1]) > 1


def test_a_dye_from_two_spectra(fluorspar: CommandLine) -> None:
    fluorspar.write("ex.csv", "# units: photon\n400,0\n450,1\n500,0\n")
    fluorspar.write("em.csv", "480,0\n530,1\n580,0\n")
    options = ("--quantum-yield", "0.9", "--strength", "0.5", "-o", "dyed.csv")
    outcome = fluorspar("materials", "dye", "ex.csv", "em.csv", *options)
    assert outcome.code == 2
    assert outcome.says("needs the units", "em.csv", "--units")
    good(fluorspar("materials", "dye", "ex.csv", "em.csv", "--units", "photon", *options))
    out = good(fluorspar("materials", "show", "dyed.csv"))
    assert "excitation peak 450 nm" in out


def test_colour_as_others_print_it(fluorspar: CommandLine, measured: Path) -> None:
    """sRGB of XYZ as it is, another observer, a matrix without its cells above the diagonal."""
    plain = good(fluorspar("materials", "colour", "poster-yellow", "--plain-srgb"))
    assert re.search(r"sRGB: +#[0-9a-f]{6}, \d+ \d+ -\d+, of XYZ as it is, out of range", plain)
    assert "CIE 2015 10 Degree" in good(fluorspar("materials", "colour", "gray-18", "--observer", "10-2015"))
    every, below = (
        good(fluorspar("materials", "colour", measured.name, *option)) for option in ((), ("--stokes-side",))
    )
    assert every.splitlines()[3] != below.splitlines()[3]


def test_a_fit_that_misses_the_colour_is_warned_of(fluorspar: CommandLine, measured: Path) -> None:
    outcome = fluorspar("materials", "fit", measured.name, "-o", "a.csv", "--rank", "0")
    assert outcome.code == 0
    assert re.search(r"measured colour is missed by \d+\.\d+ of CIEDE2000", outcome.err)


# --- fit


def test_fit_writes_a_material_that_is_the_sheet(
    fluorspar: CommandLine, measured: Path, tmp_path: Path
) -> None:
    options = ("--wavelengths", "400:700:5", "--description", "a test sheet", "--credit", "nobody")
    out = good(fluorspar("materials", "fit", measured, "-o", "my-paint.csv", *options, "--plot", "fit.png"))
    assert "wrote my-paint.csv" in out
    made = read_material(tmp_path / "my-paint.csv")
    assert (made.name, made.description, made.credit) == ("my-paint", "a test sheet", "nobody")
    assert made.quality.startswith("rank 1; CIEDE2000 to the measurement: D65 0.0")
    assert len(made.reflectance.wavelengths) == 61
    # four of its noise, on the grid of the measurement
    D = made.on(Wavelengths(400, 700, 20)).band()
    below = np.tri(16, k=-1, dtype=bool)
    assert np.abs(D - cells())[below].max() < 4 * 0.0005
    assert (tmp_path / "fit.png").exists()
    # the new material can be used at once
    assert "my-paint" in good(fluorspar("materials", "list", "--library", "."))


@pytest.mark.parametrize("rank", [0, 1, 2])
def test_fit_with_a_rank(rank: int, fluorspar: CommandLine, measured: Path, tmp_path: Path) -> None:
    good(fluorspar("materials", "fit", measured, "-o", "a.csv", "--rank", rank))
    assert len(read_material(tmp_path / "a.csv").fluorophores) == rank


# --- colour


def numbers(out: str, label: str) -> list[float]:
    line = next(line for line in out.splitlines() if line.strip().startswith(label))
    return [float(text) for text in re.findall(r"-?\d+\.\d+", line)]


def test_colour_under_lamps(fluorspar: CommandLine) -> None:
    day = good(fluorspar("materials", "colour", "dye-stilbene"))
    assert numbers(day, "total")[:3] == pytest.approx(
        np.add(numbers(day, "reflected part")[:3], numbers(day, "luminescent part")[:3]), abs=0.011
    )
    cut = good(fluorspar("materials", "colour", "dye-stilbene", "--illuminant", "d65", "--uv-cut", 400))
    assert "without what is below 400 nm" in cut
    assert numbers(day, "CIE whiteness")[0] > numbers(cut, "CIE whiteness")[0] + 10
    b = [
        numbers(good(fluorspar("materials", "colour", "dye-stilbene", "--condition", m)), "total")[5]
        for m in ("M0", "M1", "M2")
    ]
    assert b[1] < b[0] < b[2]


def test_colour_without_fluorescence_written_out(fluorspar: CommandLine) -> None:
    """A grey of 0.45 has Y = 45, no hue, and no whiteness."""
    out = good(fluorspar("materials", "colour", "gray-45", "--observer", "10"))
    assert numbers(out, "total")[1] == pytest.approx(45)
    assert numbers(out, "total")[3:] == pytest.approx([72.89, 0, 0], abs=0.01)
    assert "1964" in out
    assert "not defined" in out


def test_colour_under_a_lamp_of_ones_own(fluorspar: CommandLine, tmp_path: Path) -> None:
    fluorspar.write("lamp.csv", "wavelength,value\n300,1\n780,1")
    mine = good(fluorspar("materials", "colour", "poster-red", "--illuminant", "lamp.csv", "-o", "rf.csv"))
    equal = good(fluorspar("materials", "colour", "poster-red", "--illuminant", "E", "--plot", "rf.png"))
    assert numbers(mine, "total") == numbers(equal, "total")
    table = np.genfromtxt(tmp_path / "rf.csv", delimiter=",", skip_header=2)
    assert table.shape == (97, 5)
    np.testing.assert_allclose(table[:, 2] + table[:, 3], table[:, 4], atol=1.5e-5)  # 6 digits


# --- bad input

TRUNCATED = "\n".join(sheet()).rsplit(",", 4)[0]
BAD_FILES = {
    "truncated.csv": (TRUNCATED, "wrong number of cells", "truncated.csv, line 19"),
    "truncated.bfc": (bfc(sheet())[:900], "wrong number of cells", "truncated.bfc, line 9"),
    "text.csv": ("\n".join(with_cell("oops")), "not a number", "text.csv, line 8"),
    "nan.csv": ("\n".join(with_cell("nan")), "finite number", "emission 480 nm, excitation 460 nm"),
    "text.bfc": (bfc(with_cell("oops")), "not a number", "line 8, cell 5"),
    "duplicate.csv": ("\n".join([*sheet()[:8], sheet()[7], *sheet()[9:]]), "do not ascend", "duplicate.csv"),
    "unsorted.csv": (
        "\n".join([*sheet()[:4], *sheet()[5:7], sheet()[4], *sheet()[7:]]),
        "do not ascend",
        "unsorted.csv",
    ),
    "no-header.csv": ("\n".join([*sheet()[:2], *sheet()[3:]]), "header", "no-header.csv"),
    "no-header.bfc": (bfc(sheet()).replace("r:c:", ""), "no header", "no-header.bfc"),
    "no-quantity.csv": ("\n".join(sheet()[2:]), "does not say what", "no-quantity.csv"),
    "empty.csv": ("", "no rows", "empty.csv"),
    "empty.bfc": ("", "an empty file", "empty.bfc"),
    "transposed.csv": ("\n".join(sheet(cells().T)), "shorter wavelengths", "transposed.csv"),
    "percent.csv": ("\n".join(sheet(100 * cells())), "more photons", "percent.csv"),
    "step.csv": ("\n".join(sheet(step=10)), "step", "step.csv"),
    "really-band.csv": ("\n".join(sheet(quantity="density")), "more photons", "really-band.csv"),
}


def refused(fluorspar: CommandLine, *arguments: object) -> Outcome:
    """Exit code 2, one message, every file as it was."""
    before = fluorspar.files()
    outcome = fluorspar("materials", *arguments)
    assert outcome.code == 2, outcome
    assert outcome.out == ""
    assert outcome.err.startswith("error: "), outcome.err
    assert outcome.err.count("error: ") == 1
    assert "Traceback" not in outcome.err
    assert fluorspar.files() == before
    return outcome


@pytest.mark.parametrize("command", ["fit", "inspect"])
@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files(name: str, command: str, fluorspar: CommandLine, tmp_path: Path) -> None:
    text, fault, where = BAD_FILES[name]
    (tmp_path / name).write_bytes(text.encode())
    fluorspar.write("old.csv", OLD_FIT)
    options = ("-o", "old.csv") if command == "fit" else ()
    outcome = refused(fluorspar, command, name, *options)
    assert outcome.says(fault), outcome.err
    assert outcome.says("where:", where), outcome.err


@pytest.mark.parametrize("suffix", [".csv", ".bfc"])
@pytest.mark.parametrize("command", ["fit", "inspect", "show", "colour"])
def test_huge_file_is_refused_before_it_is_read(
    command: str, suffix: str, fluorspar: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """5 GB of nothing: a file with a hole, which takes no disk."""
    path = tmp_path / f"film{suffix}"
    path.touch()
    os.truncate(path, 5 * 2**30)
    for reading in ("read_text", "read_bytes", "open"):
        monkeypatch.setattr(Path, reading, lambda *_, **__: pytest.fail("it was read"))
    options = ("-o", "out.csv") if command == "fit" else ()
    outcome = fluorspar("materials", command, path.name, *options)
    assert outcome.code == 2
    assert outcome.says("too large", "5,368,709,120 bytes"), outcome.err
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("show", "poster-rde"), "did you mean"),
        (("show", "nowhere.csv"), "does not exist"),
        (("inspect", "nowhere.bfc"), "does not exist"),
        (("show", "poster-red", "--plot", "a.jpeg"), r"cannot be written"),
        (("show", "poster-red", "--plot", "nowhere/a.png"), "directory"),
        (("fit", "sheet.csv", "-o", "paint.txt"), "expected: .csv"),
        (("fit", "sheet.csv", "-o", "nowhere/a.csv"), "directory"),
        (("fit", "sheet.csv", "-o", "a.csv", "--rank", "-1"), "rank is impossible"),
        (("fit", "sheet.csv", "-o", "a.csv", "--wavelengths", "700:400:5"), "must ascend"),
        (("fit", "old.csv", "-o", "a.csv"), "nothing to fit"),
        (("colour", "poster-red", "--illuminant", "D6"), "no such illuminant"),
        (("colour", "poster-red", "--illuminant", "lamp.csv"), "does not exist"),
        (("colour", "poster-red", "--uv-cut", "-5"), "cut is impossible"),
        (("colour", "poster-red", "--condition", "M3"), "use M2"),
        (("colour", "poster-red", "--condition", "M1", "--illuminant", "A"), "a lamp of its own"),
        (("colour", "poster-red", "--observer", "5"), "no such observer"),
        (("colour", "poster-red:0.9,poster-yellow:0.4"), "add up to 1"),
    ],
)
def test_bad_options(arguments: tuple[str, ...], fault: str, fluorspar: CommandLine, measured: Path) -> None:
    fluorspar.write("old.csv", "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,0.5")
    assert refused(fluorspar, *arguments).says(fault)


@pytest.mark.parametrize("command", ["list", "show", "inspect", "fit", "colour"])
def test_help_shows_an_example(command: str, fluorspar: CommandLine) -> None:
    assert f"Example:  fluorspar materials {command}" in good(fluorspar("materials", command, "--help"))


class TestExport:
    @pytest.mark.parametrize("density", [(), ("--density",)])
    def test_the_matrix_is_that_of_the_grid(self, fluorspar: CommandLine, density: tuple[str, ...]) -> None:
        """Expected: the cells of `band` or `density`, S on the diagonal of the latter; and read back as a material, the
        same reflection and luminescence off the diagonal."""
        from fluorspar.bispectral.library import material
        from fluorspar.spectral.wavelengths import Wavelengths

        grid = Wavelengths(380, 780, 20)
        arguments = ("materials", "export", "poster-red", "--matrix", "--wavelengths", "380:780:20")
        done = fluorspar(*arguments, *density, "--stokes", "strict", "-o", "m.csv", "--plot", "m.png")
        assert (done.code, done.err) == (0, "")
        assert Path("m.png").stat().st_size > 1000
        matrix = material("poster-red").on(grid, stokes="strict")
        table = np.loadtxt("m.csv", delimiter=",", skiprows=5)
        np.testing.assert_allclose(table[:, 0], grid.values)
        expected = matrix.density() + np.diag(matrix.reflectance) if density else matrix.band()
        np.testing.assert_allclose(table[:, 1:], expected, rtol=1e-8, atol=1e-12)
        again = material(Path("m.csv")).on(grid, stokes="strict")
        np.testing.assert_allclose(again.band(), matrix.band(), rtol=1e-6, atol=1e-9)

    def test_spectra_without_the_matrix(self, fluorspar: CommandLine) -> None:
        from fluorspar.bispectral.library import material

        assert fluorspar("materials", "export", "poster-red", "-o", "p.csv").code == 0
        assert material(Path("p.csv")).fluorescent

    def test_options_of_the_matrix_need_it(self, fluorspar: CommandLine) -> None:
        for option in (("--density",), ("--plot", "m.png")):
            done = fluorspar("materials", "export", "poster-red", "-o", "p.csv", *option)
            assert (done.code, done.says("is about the matrix", "add --matrix")) == (2, True)
        done = fluorspar("materials", "export", "poster-red", "--matrix", "-o", "p.csv", "--stokes", "none")
        assert (done.code, done.says("no such Stokes rule")) == (2, True)
