"""The staged method on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import GOOD, CommandLine, ball
from test_interrupt import stop_at

from fluorspar import SpectralImage

PAINTED = ball('<bsdf type="fluorescent"> <string name="material" value="poster-red"/> </bsdf>')
STAGED = ("--method", "staged", "--patches", "4", "--repeats", "2")


def test_a_mesh_belongs_to_cornell_mesh(fluorspar: CommandLine) -> None:
    assert fluorspar.refuses(GOOD, "--mesh", "bunny.ply").says(
        "built-in scene cornell-mesh", "where: --mesh", "got: scene 'scene.xml'"
    )


def test_a_surface_that_cannot_be_cut_is_named(fluorspar: CommandLine) -> None:
    options = ("--method", "staged", "--emitter-mode", "decimated", "--patches", "1000000")
    assert fluorspar.refuses(PAINTED, *options).says("more emitters than the mesh has faces", "shape 'ball'")


def test_objects_are_excluded_by_id(fluorspar: CommandLine) -> None:
    for chosen in ("ball", "all"):
        assert fluorspar.render(PAINTED, *STAGED, "--exclude-emitter-geometry", chosen).code == 0
        with SpectralImage.open("old.nc") as image:
            assert image.attrs["excluded_emitter_geometry"] == ["ball"]
    refused = fluorspar.refuses(PAINTED, *STAGED, "--exclude-emitter-geometry", "bal")
    assert refused.says("'bal' is no fluorescent shape", "one of ball", "did you mean ball")
    both = fluorspar.refuses(
        PAINTED, *STAGED, "--exclude-emitter-geometry", "all", "--exclude-emitter-geometry", "ball"
    )
    assert both.says("all is given beside ids", "give all alone, or ids alone")


def test_too_few_samples_for_the_repeats(fluorspar: CommandLine) -> None:
    """Expected: as many repeats as samples, and no more work than that, with a notice."""
    done = fluorspar.render(PAINTED, "--spp", "1", "--method", "staged", "--patches", "4")
    assert done.code == 0
    assert done.says("1 instead of 4 repeats")
    with SpectralImage.open("old.nc") as image:
        assert image.attrs["spp"] == image.attrs["repeats"] == 1


def test_interrupted_after_a_repeat(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the first of two repeats is written, marked as partial, exit code 130."""
    stop_at(75, monkeypatch)
    done = fluorspar.render(PAINTED, *STAGED)
    assert done.code == 130
    assert done.says("interrupted: 1 of 2 repeats are finished")
    with SpectralImage.open(Path("old.nc")) as image:
        assert image.attrs["partial"] == 1
        assert image.attrs["repeats"] == 1
