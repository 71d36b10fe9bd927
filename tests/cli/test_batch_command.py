"""`fluorspar batch`: what it says, and its exit codes."""

from __future__ import annotations

import pytest
from command_line import GOOD, CommandLine, stop_at

from fluorspar.studies.study import read_study

STUDY = """
output = "out/{light}.nc"
render = { scene = "scene.xml", size = "8x8", spp = 4, wavelengths = "400:700:20" }
product = { light.sky = ["A", "D65"] }
"""


@pytest.fixture(autouse=True)
def study(fluorspar: CommandLine) -> None:
    fluorspar.write("scene.xml", GOOD)
    fluorspar.write("sky.toml", STUDY)


def test_all_is_done(fluorspar: CommandLine) -> None:
    done = fluorspar("batch", "sky.toml")
    assert done.code == 0, done.err
    assert "2 renders: 2 rendered" in done.out
    assert "sky-index.csv" in done.out
    assert {"out/A.nc", "out/D65.nc", "sky-index.csv", "sky-index.nc"} < fluorspar.files().keys()
    again = fluorspar("batch", "sky.toml")
    assert again.code == 0
    assert "2 renders: 2 done before" in again.out


def test_what_failed_is_listed(fluorspar: CommandLine) -> None:
    fluorspar.write("sky.toml", STUDY.replace('"D65"', '"D66"'))
    failed = fluorspar("batch", "sky.toml")
    assert failed.code == 1
    assert "2 renders: 1 rendered, 1 failed" in failed.out
    assert failed.says("error: not rendered: D66.nc", "no such illuminant", "D66")
    assert failed.err.count("error: ") == 1


def test_one_fault_of_many_rows_is_told_once(fluorspar: CommandLine) -> None:
    fluorspar.write("seeds.csv", "scene,seed\n" + "".join(f"no.xml,{seed}\n" for seed in range(1, 9)))
    failed = fluorspar("batch", "seeds.csv")
    assert failed.code == 1
    assert failed.says("error: not rendered: seeds-1.nc, seeds-2.nc", "and 3 more")
    assert failed.err.count("no.xml") == 1


def test_a_pattern_of_the_command_line(fluorspar: CommandLine) -> None:
    assert fluorspar("batch", "sky.toml", "-o", "{number}.nc", "-o", "{number}.png").code == 0
    assert {"1.nc", "1.png", "2.nc", "2.png"} < fluorspar.files().keys()


def test_a_study_that_is_none(fluorspar: CommandLine) -> None:
    fluorspar.write("sky.toml", STUDY.replace("spp", "ssp"))
    before = fluorspar.files()
    refused = fluorspar("batch", "sky.toml")
    assert refused.code == 2
    assert refused.says("no option 'ssp'", "did you mean spp?")
    assert fluorspar.files() == before


def test_interrupted(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    stop_at(500, monkeypatch)
    stopped = fluorspar("batch", "sky.toml")
    assert stopped.code == 130
    assert stopped.says("interrupted", "the same command goes on")
    assert "out/D65.nc" not in fluorspar.files()
    assert not [name for name in fluorspar.files() if name.endswith(".tmp")]


def test_the_example_of_the_help_can_be_read(fluorspar: CommandLine) -> None:
    """Line for line."""
    shown = fluorspar("batch", "--help").out
    lines = [line.strip() for line in shown.splitlines()]
    first = next(number for number, line in enumerate(lines) if line.startswith("output ="))
    last = next(number for number, line in enumerate(lines) if line.startswith("concentration.left-wall"))
    fluorspar.write("lamps.toml", "\n".join(lines[first : last + 1]))
    assert len(read_study("lamps.toml").rows) == 15
