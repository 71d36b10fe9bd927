"""What files get that cannot be written: the fault is told and the file of before is still there, whole."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import GOOD, OLD, QUICK, CommandLine

from fluorspar import SpectralImage, Wavelengths

resource = pytest.importorskip("resource", reason="limits on file sizes are set as POSIX has them")

LARGE = ("--size", "64x64", "--spp", "1")  # every file of it is larger than FULL
FULL = 2048  # bytes


@contextmanager
def full_disk() -> Iterator[None]:
    """Let no file grow beyond 2 KiB, which fails as a full disk does: in the middle of a write."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (FULL, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_folder_is_missing(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(GOOD, "-o", "no/such/box.nc")
    assert said.says(
        "the directory to write to does not exist",
        "where: no/such/box.nc",
        "fix: create it: mkdir -p no/such",
    )


@pytest.mark.parametrize("name", ["box.jpg", "box", "box.nc.bak"])
def test_suffix_is_unknown(fluorspar: CommandLine, name: str) -> None:
    said = fluorspar.refuses(GOOD, "-o", name)
    assert said.says(
        "this kind of file cannot be written",
        "where: --output",
        f"got: {name}",
        "expected: .nc, .exr, .hdr, .zarr, .png",
        "fix: rename the file",
    )


@pytest.mark.parametrize("again", ["old.nc", "./old.nc", "sub/../old.nc"])
def test_same_file_twice(fluorspar: CommandLine, again: str) -> None:
    (fluorspar.folder / "sub").mkdir()
    said = fluorspar.refuses(GOOD, "-o", again)
    assert said.says(
        "a file is to be written twice", "where: --output", "got: old.nc,", "fix: name each file once"
    )


def test_target_is_a_link_to_itself(fluorspar: CommandLine) -> None:
    (fluorspar.folder / "loop.nc").symlink_to("loop.nc")
    said = fluorspar.refuses(GOOD, "-o", "loop.nc")
    assert said.says("the file cannot be written", "where: loop.nc", "got: Too many levels of symbolic links")


def test_target_is_a_folder(fluorspar: CommandLine) -> None:
    (fluorspar.folder / "box.png").mkdir()
    said = fluorspar.refuses(GOOD, "-o", "box.png")
    assert said.says("the file to write is a directory", "where: box.png", "fix: name a file in it")


def test_pictures_are_a_file(fluorspar: CommandLine) -> None:
    said = fluorspar.refuses(GOOD, "--pictures", "old.png")
    assert said.says("the pictures need a folder", "where: --pictures", "got: old.png, a file")


def test_folder_is_closed(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    # root may write where it likes
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK or not Path(path).is_dir())
    said = fluorspar.refuses(GOOD)
    assert said.says("the directory cannot be written to", "where:", "fix: choose another directory")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="there is no folder in which nobody can write")
@pytest.mark.parametrize("suffix", [".nc", ".exr", ".png"])
def test_folder_in_which_nobody_can_write(fluorspar: CommandLine, suffix: str) -> None:
    fluorspar.write("scene.xml", GOOD)
    before = fluorspar.files()
    done = fluorspar("render", "scene.xml", *QUICK, "-o", f"/proc/box{suffix}")
    assert done.code == 2
    assert done.says("error: ", "where: /proc", "fix: ")
    assert "Traceback" not in done.err
    assert fluorspar.files() == before


class TestOutputIsInput:
    """A file that is read is never one that is written, by whatever name."""

    @pytest.fixture
    def files(self, fluorspar: CommandLine) -> CommandLine:
        image = SpectralImage.from_arrays(np.ones((7, 4, 6, 16)), Wavelengths(400, 700, 20))
        image.save("a.nc")
        fluorspar.write("points.csv", "point,x,y\n1,2,3\n")
        rows = ["# quantity: band", "# step: 100", "nm,400,500", "400,0.4,0", "500,0.3,0.6"]
        fluorspar.write("sheet.csv", "\n".join(rows))
        (fluorspar.folder / "lib").mkdir()
        material = "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,0.5\n"
        for name in ("mine.csv", "lib/other.csv"):
            fluorspar.write(name, material)
        fluorspar.write("lamp.csv", "wavelength,value\n300,1\n780,1\n")
        (fluorspar.folder / "link.csv").symlink_to("mine.csv")
        fluorspar.write("scene.nc", GOOD)
        return fluorspar

    @pytest.mark.parametrize(
        ("command", "target"),
        [
            (("measure", "a.nc", "points.csv", "--aperture", "1px"), "points.csv"),
            (("measure", "a.nc", "points.csv", "--aperture", "1px"), "lib/../points.csv"),
            (("materials", "fit", "sheet.csv"), "sheet.csv"),
            (("materials", "colour", "mine.csv"), "mine.csv"),
            (("materials", "colour", "mine.csv"), "link.csv"),
            (("materials", "colour", "gray-45:0.5,mine.csv:0.5"), "mine.csv"),
            (("materials", "colour", "other", "--library", "lib"), "lib/other.csv"),
            (("materials", "colour", "mine.csv", "--illuminant", "lamp.csv"), "lamp.csv"),
            (("render", "scene.nc", *QUICK), "scene.nc"),
        ],
    )
    def test_is_refused(self, files: CommandLine, command: tuple[str, ...], target: str) -> None:
        before = files.files()
        done = files(*command, "-o", target)
        assert done.code == 2
        assert done.says(
            "error: the file to write is one that is read", f"got: {target}", "fix: name another"
        )
        assert files.files() == before

    def test_another_file_is_written(self, files: CommandLine) -> None:
        """Over an older one too."""
        assert files("materials", "colour", "mine.csv", "-o", "lamp.csv").code == 0
        assert files("measure", "a.nc", "points.csv", "--aperture", "1px", "-o", "sheet.csv").code == 0


class TestFullDisk:
    def test_is_found_out_before_rendering(
        self, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The file that grows while the image is rendered has a known size."""
        monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=1000))
        assert fluorspar.refuses(GOOD).says(
            "the disk has too little space left",
            "where: old.nc",
            "got: 1.0 kB free",
            "expected: 32.8 kB",
            "fix:",
        )

    @pytest.mark.parametrize("suffix", [".nc", ".exr", ".png"])
    def test_in_the_middle(self, fluorspar: CommandLine, suffix: str) -> None:
        fluorspar.write("scene.xml", GOOD)
        command = ("render", "scene.xml", *QUICK, *LARGE, "-o", f"old{suffix}")
        assert fluorspar(*command, "-o", f"fits{suffix}").code == 0
        assert (fluorspar.folder / f"fits{suffix}").stat().st_size > FULL, "else it proves nothing"
        (fluorspar.folder / f"old{suffix}").write_bytes(OLD)
        before = fluorspar.files()
        with full_disk():
            done = fluorspar(*command)
        assert done.code == 2
        assert done.says(
            "error: the disk is full",
            f"where: old{suffix}",
            "got:",
            "fix: free some space or choose another directory; a file that was there before is unchanged",
        )
        assert "Traceback" not in done.err
        assert fluorspar.files() == before

    def test_among_the_pictures(self, fluorspar: CommandLine) -> None:
        """The image is whole by then and stays; of the picture that did not fit nothing is left."""
        fluorspar.write("scene.xml", GOOD)
        (fluorspar.folder / "old.png").unlink()
        with full_disk():
            done = fluorspar("render", "scene.xml", *QUICK, "-o", "old.png", "--pictures", "pictures")
        assert done.code == 2
        assert done.says("error: the disk is full", "where: pictures")
        assert (fluorspar.folder / "old.png").stat().st_size > 0
        assert not [name for name in fluorspar.files() if name.endswith(".tmp")]

    @pytest.mark.skipif(not shutil.which("unshare"), reason="a small disk of one's own needs unshare")
    def test_real_disk(self, fluorspar: CommandLine) -> None:
        """A disk of two pages, seen by one process only and gone with it."""
        fluorspar.write("scene.xml", GOOD)
        disk = fluorspar.folder / "disk"
        disk.mkdir()
        script = """
            mount -t tmpfs -o size=8k none "$1" 2>/dev/null || exit 99
            cp old.exr "$1"
            shift
            "$@" -o disk/old.exr
            echo code $?
            ls -A disk
            cmp old.exr disk/old.exr && echo intact"""
        command = [sys.executable, "-m", "fluorspar", "render", "scene.xml", *QUICK, *LARGE]
        done = subprocess.run(
            ["unshare", "-m", "sh", "-c", script, "sh", str(disk), *command],
            capture_output=True,
            text=True,
            cwd=fluorspar.folder,
            check=False,
        )
        if done.returncode == 99 or "unshare" in done.stderr:
            pytest.skip("this user may not mount anything")
        assert done.stdout.splitlines()[-3:] == ["code 2", "old.exr", "intact"], done.stderr
        assert "error: the disk is full" in done.stderr
        assert not any(disk.iterdir()), "the mount is not to be seen from here"
