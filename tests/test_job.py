"""A render as it was asked for: checked once, and the same in another process."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest

from fluorspar import Material, SpectralImage, Spectrum, Wavelengths, load_scene
from fluorspar.errors import OptionError, SpectrumError
from fluorspar.job import RenderJob, read_grid
from fluorspar.rendering import render_job
from fluorspar.staged.options import StagedOptions

GRID = Wavelengths(400, 700, 50)


def job(**options: object) -> RenderJob:
    return RenderJob.of("cornell-box", **{"size": (12, 10), "spp": 4, "wavelengths": GRID, **options})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options",
    [
        {"seed": 5, "component_errors": True, "threads": 1},
        {"stokes": "strict", "materials": {"left-wall": Material("grey", Spectrum.constant(0.4))}},
        {"method": "staged", "options": StagedOptions(emitters=1, repeats=1, patch_samples=8)},
    ],
)
def test_another_process_renders_the_same_image(options: dict[str, object], tmp_path: Path) -> None:
    mine = job(**options)
    (tmp_path / "job.pickle").write_bytes(pickle.dumps(mine))
    code = """
import pickle
from pathlib import Path
from fluorspar.rendering import render_job
render_job(pickle.loads(Path("job.pickle").read_bytes()), output="image.nc").close()
"""
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    expected = render_job(mine)
    with SpectralImage.open(tmp_path / "image.nc") as image:
        assert set(image.dataset.data_vars) == set(expected.dataset.data_vars)
        for name, values in expected.dataset.data_vars.items():
            assert np.array_equal(image.dataset[name].values, values.values), name
        told = {k: v for k, v in image.attrs.items() if k != "timings"}
        assert told == {k: v for k, v in expected.attrs.items() if k != "timings"}


def test_a_job_is_checked_when_it_is_made_and_when_it_is_changed() -> None:
    good = job()
    with pytest.raises(OptionError, match="Stokes"):
        replace(good, stokes="loose")  # type: ignore[arg-type]
    with pytest.raises(OptionError, match="seed is negative"):
        replace(good, seed=-1)
    with pytest.raises(OptionError, match="no such option"):
        replace(good, method="staged", component_errors=True)
    with pytest.raises(FrozenInstanceError):
        good.seed = 2  # type: ignore[misc]


def test_what_the_image_says_is_what_the_job_says() -> None:
    mine = job(seed=3)
    attrs = render_job(mine).attrs
    said = {name: value for name, value in mine.attrs.items() if value is not None}
    assert {name: attrs[name] for name in said} == said


def test_materials_come_with_the_scene() -> None:
    with pytest.raises(OptionError, match="already loaded"):
        RenderJob.of(load_scene("furnace"), materials={"cavity": "poster-red"})


@pytest.mark.parametrize("grid", [None, "360:700:5", np.arange(360, 701, 5), Wavelengths(360, 700, 5)])
def test_a_grid_in_all_its_forms(grid: object) -> None:
    assert read_grid(grid) == Wavelengths()  # type: ignore[arg-type]


@pytest.mark.parametrize("grid", [5, True, [[400, 500]], ["a"], [], {}])
def test_what_is_no_grid(grid: object) -> None:
    with pytest.raises(SpectrumError, match=r"(?s)wavelengths are not.*expected"):
        read_grid(grid)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options",
    [{"max_depth": "2"}, {"spp": True}, {"threads": "2"}, {"size": ("a", 2)}, {"component_errors": "yes"}],
)
def test_options_of_another_type(options: dict[str, object]) -> None:
    with pytest.raises(OptionError, match="expected"):
        job(**options)


@pytest.mark.parametrize("fastest", ["cuda", "llvm"])
def test_a_job_says_which_variant_auto_is(fastest: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is chosen when the job is made: another process, with another machine, must trace the same paths."""
    monkeypatch.setattr("fluorspar.job.fastest_variant", lambda: fastest)
    mine = job(variant="auto")
    monkeypatch.setattr("fluorspar.job.fastest_variant", lambda: "another")
    for each in (mine, pickle.loads(pickle.dumps(mine)), replace(mine, seed=2)):
        assert each.variant == each.attrs["variant"] == fastest
    assert job(method="staged", variant="auto").variant == "llvm"
