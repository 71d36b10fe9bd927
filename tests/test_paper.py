"""The script that makes the paper's figures again, and the page that says what they are, name the same ones."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "examples" / "paper.py"
PAGE = (ROOT / "docs" / "paper.md").read_text("utf-8")


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, SCRIPT, *arguments], capture_output=True, encoding="utf-8", check=False
    )


@pytest.fixture(scope="module")
def steps() -> set[str]:
    return {line.split()[0] for line in run("--list").stdout.splitlines()}


def test_each_figure_of_the_page_is_in_the_script_and_the_other_way_round(steps: set[str]) -> None:
    assert set(re.findall(r"`--only ([\w-]+)`", PAGE)) == steps
    figures = set(re.findall(r"^\| Figure (\d+) .*`--only \1`", PAGE, re.MULTILINE))
    assert figures == {key for key in steps if key.isdigit()}


def test_figures_that_are_not_made_are_no_steps(steps: set[str]) -> None:
    named = {int(each) for each in re.findall(r"^\| Figure (\d+)", PAGE, re.MULTILINE)}
    assert named == set(range(1, 30))
    without = {int(each) for each in re.findall(r"^\| Figure (\d+) (?!.*`--only)", PAGE, re.MULTILINE)}
    assert without.isdisjoint(int(key) for key in steps if key.isdigit())


def test_two_figures_and_their_page(tmp_path: Path) -> None:
    """Rationale: a step that fails must cost no other. Expected: two cheap figures, in the index with their numbers; a
    mesh that is missing makes its figure fail, and the run say so, and what was made stays."""
    done = run("--tiny", "--only", "2,12", "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    made = json.loads((tmp_path / "step-12.json").read_text("utf-8"))
    assert made["pictures"] == ["figure-12.png"]
    assert "luminescent share of mean luminance" in made["numbers"]
    done = run("--tiny", "--only", "23,8", "--bunny", tmp_path / "no.ply", "-o", tmp_path)
    assert done.returncode == 1
    assert "failed: 23" in done.stderr
    page = (tmp_path / "index.html").read_text("utf-8")
    shown = re.findall(r'<img src="([^"]+)"', page)
    assert shown == ["figure-2.png", "figure-8.png", "figure-12.png"]
    assert all((tmp_path / name).exists() for name in shown)


def test_what_is_no_step_is_refused() -> None:
    done = run("--only", "3")
    assert done.returncode == 2
    assert "there is no step 3; there are 1, 2, 4, " in done.stderr
