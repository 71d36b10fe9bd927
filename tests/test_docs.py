"""The Python of README and of the pages in docs runs as it stands there, with fewer pixels and samples.

Tutorials and gallery are run by `make docs`.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

import fluorspar
from fluorspar.measuring.point_spectra import write_point_spectra

ROOT = Path(__file__).parents[1]
PYTHON = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
PAGES = [
    page
    for page in (ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")))
    if PYTHON.search(page.read_text("utf-8"))
]
SEEN: dict[str, Any] = {"size": (129, 257), "spp": 2}  # README looks at the pixel (128, 256)
SMALL: dict[str, Any] = {"size": (8, 8), "spp": 2}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that the pages read."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    render, trace = fluorspar.render, fluorspar.trace
    monkeypatch.setattr(fluorspar, "render", lambda scene, **options: render(scene, **options | SEEN))
    monkeypatch.setattr(fluorspar, "trace", lambda scene, **options: trace(scene, **options | SMALL))
    shutil.copy(ROOT / "examples" / "cornell-points.csv", "points.csv")
    shutil.copy(ROOT / "examples" / "lamps.toml", "lamps.toml")
    box = render("cornell-box", size=(32, 32), spp=2)
    box.save("box.nc")
    write_point_spectra(fluorspar.measure(box, "points.csv"), "measured.csv")
    return tmp_path


@pytest.mark.filterwarnings("ignore:the aperture is 0.125 degrees")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_it_runs(page: Path, folder: Path) -> None:
    names: dict[str, Any] = {"fluorspar": fluorspar}
    text = page.read_text("utf-8")
    for block in PYTHON.finditer(text):
        above = "\n" * text.count("\n", 0, block.start(1))  # so that a traceback shows the line of the page
        exec(compile(above + block[1], str(page), "exec"), names)


def test_the_reference_has_every_public_name() -> None:
    listed = re.findall(r"^   (\w+)$", (ROOT / "docs" / "api.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(fluorspar.__all__)
