"""Images that would fill the memory go to a file while they are made, whatever is asked of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import GOOD, QUICK, CommandLine

import fluorspar as package
from fluorspar.files.temporary import temporary_folder
from fluorspar.image.pixels import PixelsInMemory
from fluorspar.image.spectral_image import SpectralImage


@pytest.fixture
def little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every image is large, and none must be held in memory while it is rendered."""

    def refuse(*_: object) -> None:
        raise AssertionError("the image is held in memory")

    monkeypatch.setattr("fluorspar.files.memory.available_memory", lambda: 1000)
    monkeypatch.setattr(PixelsInMemory, "__init__", refuse)


def same(a: str, b: str) -> bool:
    with SpectralImage.open(a) as one, SpectralImage.open(b) as other:
        return one.dataset.drop_attrs().identical(other.dataset.drop_attrs())


@pytest.mark.parametrize("command", ["render", "relight"])
@pytest.mark.parametrize("options", [("--pictures", "shown"), ("--denoise",)])
def test_what_is_not_streamed_to_an_output(
    command: str, options: tuple[str, ...], fluorspar: CommandLine, request: pytest.FixtureRequest
) -> None:
    """Expected: the same files as of an image in memory, and no other is left."""
    before = set(temporary_folder().iterdir())
    package.trace("cornell-box", size=(8, 8), spp=4, wavelengths="400:700:20", output="box.paths")
    asked = ("render", "cornell-box", *QUICK) if command == "render" else ("relight", "box.paths")
    written = ("-o", "a.exr", *options)
    assert fluorspar(*asked, *written).code == 0
    for path in [Path("a.exr"), *Path().glob("shown/*")]:
        path.rename(path.with_stem(f"small-{path.stem}"))
    request.getfixturevalue("little_memory")
    assert (done := fluorspar(*asked, *written)).code == 0, done.err
    assert same("a.exr", "small-a.exr")
    for path in Path().glob("shown/small-*"):
        assert path.read_bytes() == path.with_stem(path.stem.removeprefix("small-")).read_bytes()
    assert not [path for path in temporary_folder().iterdir() if path.is_dir() and path not in before]


def test_resume_still_needs_its_file(fluorspar: CommandLine, little_memory: None) -> None:
    done = fluorspar("render", "cornell-box", *QUICK, "-o", "a.exr", "--resume")
    assert done.code == 2
    assert done.says("resume needs the file to continue")


def test_a_staged_image_is_not_written_for_nothing(
    fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is made in memory: a file that holds it meanwhile saves nothing."""
    monkeypatch.setattr("fluorspar.files.memory.available_memory", lambda: 1000)
    monkeypatch.setattr("fluorspar.image.formats.netcdf.write_netcdf", None)
    Path("ball.xml").write_text(GOOD)
    done = fluorspar("render", "ball.xml", *QUICK, "--method", "staged", "-o", "a.png")
    assert done.code == 0, done.err
    assert Path("a.png").exists()
