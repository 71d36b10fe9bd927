"""Ctrl-C and SIGTERM: what is finished is written and marked as partial, exit code 130 or 143."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import GOOD, OLD, QUICK, CommandLine, stop_at

from fluorspar import SpectralImage
from fluorspar.paths.chunks import CHUNK

PER_CHUNK = 16  # pixels, of 64


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Render 16 of the 64 pixels at a time."""
    monkeypatch.setitem(CHUNK, "llvm", PER_CHUNK * 4)


@pytest.mark.usefixtures("small_chunks")
class TestInTheMiddle:
    def test_all_formats(self, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
        assert fluorspar.render(GOOD, "-o", "whole.nc").code == 0
        stop_at(2 * PER_CHUNK, monkeypatch)
        done = fluorspar.render(GOOD, "--pictures", "pictures")
        assert done.code == 130
        assert done.says("interrupted: 32 of 64 pixels are finished", "NaN")
        assert not [name for name in fluorspar.files() if name.endswith(".tmp")]
        with SpectralImage.open("whole.nc") as whole:
            expected = whole.dataset.radiance.values
            assert "partial" not in whole.attrs
        for name in ("old.nc", "old.exr"):
            with SpectralImage.open(name) as image:
                assert image.attrs["partial"] == 1
                radiance = image.dataset.radiance.values
                np.testing.assert_array_equal(radiance[:, :4], expected[:, :4], "finished pixels are right")
                assert np.isnan(radiance[:, 4:]).all(), "the others are marked"
                assert np.isnan(image.dataset.standard_error.values[4:]).all()
        assert Path("old.png").read_bytes()[1:4] == b"PNG"
        assert Path("pictures/total.png").exists()

    def test_told_by_info(self, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
        stop_at(PER_CHUNK, monkeypatch)
        fluorspar.render(GOOD)
        assert "partial" in fluorspar("info", "old.nc").out

    @pytest.mark.parametrize("name", ["old.exr", "old.png"])
    def test_without_a_file_to_stream_to(
        self, name: str, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        stop_at(PER_CHUNK, monkeypatch)
        fluorspar.write("scene.xml", GOOD)
        assert fluorspar("render", "scene.xml", *QUICK, "-o", name).code == 130
        assert Path(name).read_bytes() != OLD


def test_in_a_later_pass(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    """With --until the passes that are finished are written, whole."""
    stop_at(64 * 9, monkeypatch)  # of 64 pixels, after passes of 4 and 4 samples
    done = fluorspar.render(GOOD, "--until", "error=0.1%")
    assert done.code == 130
    assert done.says("not reached (8 samples per pixel", "only finished passes are kept")
    for name in ("old.nc", "old.exr"):
        with SpectralImage.open(name) as image:
            assert "partial" not in image.attrs
            assert (image.attrs["spp"], image.attrs["until"]["passes"]) == (8, [4, 4])
            assert np.isfinite(image.dataset.radiance.values).all()


def test_before_anything_is_rendered(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("fluorspar.scene.loading.load_scene", interrupted)
    fluorspar.write("scene.xml", GOOD)
    before = fluorspar.files()
    assert fluorspar.render(None).code == 130
    assert fluorspar.files() == before


def test_after_the_end_is_no_partial_image(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while the last pixels are on their way to the file: nothing is missing."""
    stop_at(64, monkeypatch)
    fluorspar.render(GOOD)
    with SpectralImage.open("old.nc") as image:
        assert "partial" not in image.attrs
        assert np.isfinite(image.dataset.radiance.values).all()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal(number: signal.Signals, fluorspar: CommandLine) -> None:
    """As the terminal does it, or a batch system: a signal to a process that would render for hours."""
    # A process started in the background of a shell would ignore the signal.
    program = """if True:
        import signal
        signal.signal(signal.SIGINT, signal.default_int_handler)
        from fluorspar.cli.main import main
        from fluorspar.image.formats.netcdf_writer import NetcdfWriter

        write_pixels = NetcdfWriter.write_pixels

        def written(self, *arguments):
            write_pixels(self, *arguments)
            print("written", flush=True)

        NetcdfWriter.write_pixels = written
        main()"""
    command = [
        "render",
        "furnace",
        "--spp",
        "8192",
        "--max-depth",
        "3",
        "--wavelengths",
        "400:700:20",
        "-o",
        "old.nc",
    ]
    process = subprocess.Popen(
        [sys.executable, "-c", program, *command],
        cwd=fluorspar.folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "written\n", "the first pixels are finished"
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 128 + number, err
    assert "interrupted:" in err
    assert "Traceback" not in err
    assert sorted(fluorspar.files()) == ["old.exr", "old.nc", "old.png"]
    with SpectralImage.open(fluorspar.folder / "old.nc") as image:
        assert image.attrs["partial"] == 1
        assert np.isnan(image.dataset.radiance.values).any()
