"""Renders that are interrupted, however, and gone on with: the result is the one without interruption, bit for bit."""

from __future__ import annotations

import errno
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import fluorspar
from fluorspar.errors import FluorsparWarning, ImageError, OptionError
from fluorspar.files import run_journal
from fluorspar.files.beside import Temporary
from fluorspar.image.converted import converted
from fluorspar.image.formats import zarr_writer
from fluorspar.image.formats.netcdf_writer import NetcdfWriter
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.paths import chunks, paths_file
from fluorspar.paths.light_paths import LightPaths
from fluorspar.rendering import render_job
from fluorspar.spectral.wavelengths import Wavelengths

SIZE, SPP = (24, 20), 32
GRID = "400:700:50"


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    """Eight chunks, and a journal from the first pixel on."""
    monkeypatch.setitem(chunks.CHUNK, "llvm", SIZE[0] * SIZE[1] * SPP // 8)
    monkeypatch.setattr(run_journal, "SYNC_EVERY", 0.0)
    monkeypatch.setattr(paths_file, "SYNC_EVERY", 0.0)


def render(path: Path, **options: Any) -> SpectralImage:
    given = {"size": SIZE, "spp": SPP, "wavelengths": GRID, "variant": "llvm", "threads": 2}
    return fluorspar.render("cornell-box", output=path, **(given | options))


def trace(path: Path, **options: Any) -> LightPaths:
    return fluorspar.trace(
        "cornell-box", size=SIZE, spp=SPP, wavelengths=GRID, variant="llvm", threads=2, output=path, **options
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> xr.Dataset:
    path = tmp_path_factory.mktemp("whole") / "a.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(chunks.CHUNK, "llvm", SIZE[0] * SIZE[1] * SPP // 8)
        return render(path).dataset.load()


def after(chunk_count: int, what: Callable[[], object]) -> Callable[[int, int], None]:
    """A progress that does something when so many chunks are done."""
    calls = iter(range(1000))

    def progress(done: int, pixels: int) -> None:
        if next(calls) == chunk_count - 1:
            what()

    return progress


def interrupt() -> None:
    raise KeyboardInterrupt


def fail() -> None:
    raise ZeroDivisionError


def full_disk(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def leave_unfinished(path: Path, chunk_count: int = 3, **options: Any) -> None:
    """Render some chunks and die of something that nobody expects."""
    with pytest.raises(ZeroDivisionError):
        render(path, progress=after(chunk_count, fail), **options)


def check(path: Path, expected: xr.Dataset, *, but: tuple[str, ...] = ("timings",)) -> None:
    found = xr.load_dataset(path)
    xr.testing.assert_equal(found, expected)
    attrs = SpectralImage.open(path).attrs
    wanted = SpectralImage(expected).attrs
    assert {name: attrs[name] for name in attrs if name not in but} == {
        name: wanted[name] for name in wanted if name not in but
    }
    assert names(path.parent) == [path.name]


class TestImages:
    def test_after_ctrl_c(self, tmp_path, whole):
        path = tmp_path / "a.nc"
        with pytest.warns(FluorsparWarning, match="180 of 480 pixels"):
            render(path, progress=after(3, interrupt))
        assert names(tmp_path) == ["a.nc"]
        render(path, resume=True)
        check(path, whole)

    def test_after_an_unexpected_end(self, tmp_path, whole):
        path = tmp_path / "a.nc"
        path.write_bytes(b"precious")
        leave_unfinished(path)
        assert path.read_bytes() == b"precious"
        assert len(names(tmp_path)) == 3  # the pixels, and the journal
        traced: list[int] = []
        render(path, resume=True, progress=lambda done, pixels: traced.append(done))
        assert traced[0] == 240
        check(path, whole)

    def test_a_store_after_an_unexpected_end(self, tmp_path, whole):
        """Expected: a new store stays, with what is finished; a render that took no time leaves nothing."""
        pytest.importorskip("zarr")
        path = tmp_path / "a.zarr"
        leave_unfinished(path)
        with SpectralImage.open(path) as image:
            assert image.attrs["partial"] == 1
            assert np.isfinite(image.dataset.radiance.values[0, ..., 0]).sum() == 180
        traced: list[int] = []
        render(path, resume=True, progress=lambda done, pixels: traced.append(done))
        assert traced[0] == 240
        with SpectralImage.open(path) as image:
            xr.testing.assert_equal(image.dataset.load(), whole)
        assert names(tmp_path) == ["a.zarr"]

    @pytest.mark.parametrize("end", [fail, interrupt])
    def test_a_store_is_gone_on_with_in_its_place(self, tmp_path, whole, end):
        """Expected: nothing is copied, and another end keeps what was added."""
        pytest.importorskip("zarr")
        path = tmp_path / "a.zarr"
        leave_unfinished(path)
        (path / "radiance" / "c" / "0.0123abcd.partial").write_text("torn")
        folder = path.stat().st_ino
        error, told = (
            (ZeroDivisionError, nullcontext()) if end is fail else (None, pytest.warns(FluorsparWarning))
        )
        with told, pytest.raises(error) if error else nullcontext():
            render(path, resume=True, progress=after(2, end))
        assert names(tmp_path) == ["a.zarr"]
        with SpectralImage.open(path) as image:
            assert image.attrs["partial"] == 1
            assert np.isfinite(image.dataset.radiance.values[0, ..., 0]).sum() == 300
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(zarr_writer, "put", full_disk)
            with pytest.raises(ImageError, match=r"(?s)the disk is full.*go on with what is finished"):
                render(path, resume=True)
        traced: list[int] = []
        render(path, resume=True, progress=lambda done, pixels: traced.append(done))
        assert traced[0] == 360
        with SpectralImage.open(path) as image:
            xr.testing.assert_equal(image.dataset.load(), whole)
            assert "partial" not in image.attrs
        assert path.stat().st_ino == folder
        assert not list(path.rglob("*.partial"))

    def test_a_store_of_something_else_is_not_gone_on_with(self, tmp_path):
        pytest.importorskip("zarr")
        path = tmp_path / "a.zarr"
        leave_unfinished(path)
        with pytest.raises(OptionError, match=r"(?s)of another render.*seed"):
            render(path, resume=True, seed=7)
        leave = path.stat().st_ino
        with pytest.raises(ZeroDivisionError):
            render(path, seed=7, progress=after(1, fail))
        assert path.stat().st_ino == leave

    def test_after_a_full_disk(self, tmp_path, whole, monkeypatch):
        path, put, calls = tmp_path / "a.nc", NetcdfWriter._put, iter(range(1000))

        def full(writer, *what):
            if next(calls) > 30:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            put(writer, *what)

        monkeypatch.setattr(NetcdfWriter, "_put", full)
        with pytest.raises(ImageError, match=r"(?s)disk is full.*--resume"):
            render(path)
        monkeypatch.setattr(NetcdfWriter, "_put", put)
        render(path, resume=True)
        check(path, whole)

    def test_killed_while_the_file_was_closed(self, tmp_path, whole):
        """What HDF5 keeps for itself is in any state; the pixels are where the journal says."""
        path = tmp_path / "a.nc"
        leave_unfinished(path, 8)
        (left,) = tmp_path.glob(".a.nc.*.tmp")
        with left.open("r+b") as file:
            file.write(b"\0" * 600)
            file.seek(0, os.SEEK_END)
            file.write(b"attributes half written")
        render(path, resume=True)
        check(path, whole)

    def test_again_and_again(self, tmp_path, whole):
        path = tmp_path / "a.nc"
        for _ in range(3):
            leave_unfinished(path, 2, resume=True)
        render(path, resume=True)
        check(path, whole)

    def test_with_errors_of_components(self, tmp_path):
        path, once = tmp_path / "a" / "a.nc", tmp_path / "b" / "a.nc"
        path.parent.mkdir()
        once.parent.mkdir()
        render(once, component_errors=True)
        leave_unfinished(path, component_errors=True)
        render(path, component_errors=True, resume=True)
        check(path, xr.load_dataset(once))

    def test_what_is_whole_is_not_rendered_again(self, tmp_path, whole):
        path = tmp_path / "a.nc"
        render(path)
        before = path.stat().st_mtime_ns
        render(path, resume=True, progress=lambda done, pixels: pytest.fail("rendered"))
        assert path.stat().st_mtime_ns == before

    def test_nothing_to_go_on_with_is_a_beginning(self, tmp_path, whole):
        render(tmp_path / "a.nc", resume=True)
        check(tmp_path / "a.nc", whole)

    @pytest.mark.parametrize(
        ("options", "differs"),
        [
            ({"seed": 1}, "seed: 1, before 0"),
            ({"spp": 64}, "samples: 64, before 32"),
            ({"size": (20, 24)}, "size: 20 x 24, before 24 x 20"),
            ({"wavelengths": "400:700:10"}, "wavelengths: 400:700:10, before 400:700:50"),
            ({"materials": {"left-wall": "poster-orange"}}, r"material \d, poster-orange"),
            ({"component_errors": True}, "errors of components: yes, before no"),
        ],
    )
    @pytest.mark.parametrize("end", [fail, interrupt])
    @pytest.mark.filterwarnings("ignore:interrupted")
    def test_another_render_is_refused_and_says_what_differs(self, tmp_path, options, differs, end):
        path = tmp_path / "a.nc"
        if end is fail:
            leave_unfinished(path)
        else:
            render(path, progress=after(3, interrupt))
        before = {name: (tmp_path / name).read_bytes() for name in names(tmp_path)}
        with pytest.raises(OptionError, match=rf"(?s)of another render.*{differs}.*--resume"):
            render(path, resume=True, **options)
        assert {name: (tmp_path / name).read_bytes() for name in names(tmp_path)} == before

    def test_a_new_render_says_so_and_removes_what_was_left_when_it_is_whole(self, tmp_path, whole):
        path = tmp_path / "a.nc"
        leave_unfinished(path)
        left = names(tmp_path)
        with pytest.warns(FluorsparWarning, match=r"180 of 480 pixels: --resume"):
            leave_unfinished(path)
        assert set(names(tmp_path)) > set(left)
        with pytest.warns(FluorsparWarning, match=r"180 of 480 pixels: --resume"):
            render(path)
        check(path, whole)

    @pytest.mark.parametrize("name", ["a.nc", "a.zarr", "a.paths"])
    @pytest.mark.parametrize("end", [fail, interrupt])
    def test_it_is_said_once_of_each_kind_before_anything_is_lost(self, tmp_path, name, end):
        """Expected: how much there is; nothing is said when it is gone on with, or of what is whole."""
        make = trace if name == "a.paths" else render
        with suppress(ZeroDivisionError), warnings.catch_warnings():
            warnings.filterwarnings("ignore", "interrupted")
            make(tmp_path / name, progress=after(3, end))
        left = names(tmp_path)
        with pytest.warns(FluorsparWarning) as warned, pytest.raises(ZeroDivisionError):
            make(tmp_path / name, progress=after(1, fail))
        assert [str(each.message) for each in warned] == [
            f"an unfinished {name} is there, 180 of 480 pixels: --resume (resume=True) would go on with it; it is "
            "replaced when this one is finished"
        ]
        assert set(names(tmp_path)) >= set(left)
        done: list[int] = []
        make(tmp_path / name, resume=True, progress=lambda pixels, _: done.append(pixels))
        assert done[0] == 240
        make(tmp_path / name)

    def test_the_writer_may_live(self, tmp_path):
        living = Temporary(tmp_path / "a.nc")
        with pytest.raises(ImageError, match=r"(?s)another process is writing.*a\.nc"):
            render(tmp_path / "a.nc", resume=True)
        living.drop()

    def test_a_short_render_leaves_nothing(self, tmp_path, monkeypatch):
        monkeypatch.setattr(run_journal, "SYNC_EVERY", 1e9)
        leave_unfinished(tmp_path / "a.nc")
        assert names(tmp_path) == []

    def test_needs_a_file_and_the_right_method(self, tmp_path):
        with pytest.raises(OptionError, match="resume needs the file"):
            fluorspar.render("cornell-box", resume=True)
        with pytest.raises(OptionError, match="staged method has no resume"):
            render(tmp_path / "a.nc", method="staged", resume=True)

    @pytest.mark.parametrize("change", ["total", "grid", "denoised"])
    @pytest.mark.filterwarnings("ignore:interrupted", "ignore:an unfinished")
    def test_an_image_that_was_changed_is_refused(self, tmp_path, change):
        path, changed = tmp_path / "a.nc", tmp_path / "changed.nc"
        for progress in (after(3, interrupt), None):
            image = render(path, progress=progress)
            if change == "total":
                image = converted(image, "total")
            elif change == "grid":
                image = converted(image, wavelengths=Wavelengths(400, 700, 100))
            elif image.attrs.get("partial"):
                continue
            else:
                pytest.importorskip("mitsuba_oidn")
                image = image.denoised()
            assert "fingerprint" not in image.attrs
            image.save(changed)
            for options in ({}, {"spp": None, "more_samples": 4}):
                with pytest.raises(OptionError, match=r"no record of what|partial image|denoised image"):
                    render(changed, resume=True, **options)

    def test_other_samples_are_refused(self, tmp_path):
        path = tmp_path / "a.nc"
        render(path)
        render(path, spp=None, more_samples=SPP)
        with pytest.raises(OptionError, match=r"(?s)other samples.*64 samples per pixel in 2 passes.*32"):
            render(path, resume=True)

    def test_names_that_begin_alike_are_kept_apart(self, tmp_path, whole):
        """And `.a.nc.*` is none of `a.nc.paths`."""
        long = "of_the_study_with_a_long_name_lamp_D65_concentration_0."
        one, two = tmp_path / f"{long}1.nc", tmp_path / f"{long}2.nc"
        leave_unfinished(one)
        leave_unfinished(two, seed=1)
        living = Temporary(tmp_path / f"{long}1.nc.paths")
        render(one, resume=True)
        living.drop()
        assert len(names(tmp_path)) == 3
        render(two, resume=True, seed=1)
        assert names(tmp_path) == [one.name, two.name]
        xr.testing.assert_equal(xr.load_dataset(one), whole)


UNTIL = "error=12%"


@pytest.fixture(scope="module")
def reached(tmp_path_factory) -> xr.Dataset:
    path = tmp_path_factory.mktemp("until") / "a.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(chunks.CHUNK, "llvm", SIZE[0] * SIZE[1] * SPP // 8)
        image = render(path, until=UNTIL)
    assert len(image.attrs["until"]["passes"]) > 1
    return image.dataset.load()


class TestPasses:
    @pytest.mark.parametrize("chunk_count", [3, 8, 12])
    @pytest.mark.parametrize("end", [fail, interrupt])
    @pytest.mark.filterwarnings("ignore:interrupted", "ignore:.*was not reached")
    def test_end_as_without_interruption(self, tmp_path, reached, chunk_count, end):
        path = tmp_path / "a.nc"
        with suppress(ZeroDivisionError):
            render(path, until=UNTIL, progress=after(chunk_count, end))
        render(path, until=UNTIL, resume=True)
        check(path, reached)

    @pytest.mark.filterwarnings("ignore:.*was not reached")
    def test_that_are_made_anew_are_told_of(self, tmp_path):
        path = tmp_path / "a.nc"
        render(path, until=UNTIL, progress=after(12, interrupt))
        with pytest.warns(FluorsparWarning, match="is there, 32 samples per pixel: --resume"):
            render(path, until=UNTIL)

    def test_of_an_image_that_is_good_enough_there_are_none(self, tmp_path):
        path = tmp_path / "a.nc"
        render(path)
        image = render(path, until="error=90%", resume=True)
        assert image.attrs["until"]["stopped"] == "reached"
        assert SpectralImage.open(path).attrs["until"] == image.attrs["until"]
        assert image.attrs["spp"] == SPP


class TestMoreSamples:
    def test_are_weighed_with_those_before(self, tmp_path, whole):
        path, mine = tmp_path / "a.nc", tmp_path / "mine.nc"
        render(path)
        image = render(path, spp=None, more_samples=3 * SPP, seed=5)
        assert (image.attrs["spp"], image.attrs["passes"], image.attrs["seed"]) == (4 * SPP, [32, 96], 0)
        job = RenderJob.of("cornell-box", size=SIZE, spp=3 * SPP, wavelengths=GRID, variant="llvm", stream=1)
        second = render_job(job, output=mine).dataset
        mean = (whole.radiance + 3 * second.radiance) / 4
        np.testing.assert_allclose(image.dataset.radiance, mean, rtol=1e-5, atol=1e-9)
        error = np.hypot(whole.standard_error, 3 * second.standard_error) / 4
        np.testing.assert_allclose(image.dataset.standard_error, error, rtol=1e-5, atol=1e-9)
        assert np.abs(second.radiance - whole.radiance).max() > 0  # other random numbers

    def test_of_further_passes_are_new(self, tmp_path):
        path = tmp_path / "a.nc"
        render(path)
        for _ in range(2):
            image = render(path, spp=None, more_samples=SPP)
        assert image.attrs["passes"] == [SPP] * 3
        job = RenderJob.of("cornell-box", size=SIZE, spp=SPP, wavelengths=GRID, variant="llvm")
        passes = [render_job(replace(job, stream=stream)).dataset.radiance for stream in range(3)]
        np.testing.assert_allclose(image.dataset.radiance, sum(passes) / 3, rtol=1e-5, atol=1e-9)

    def test_are_gone_on_with(self, tmp_path):
        path, once = tmp_path / "a" / "a.nc", tmp_path / "b" / "a.nc"
        for each in (path, once):
            each.parent.mkdir()
            render(each)
        render(once, spp=None, more_samples=SPP)
        before = path.read_bytes()
        for end, raised in ((fail, ZeroDivisionError), (interrupt, KeyboardInterrupt)):
            with pytest.raises(raised):
                render(path, spp=None, more_samples=SPP, resume=True, progress=after(2, end))
            assert path.read_bytes() == before
        render(path, spp=None, more_samples=SPP, resume=True)
        check(path, xr.load_dataset(once))

    def test_are_gone_on_with_on_the_same_image_only(self, tmp_path):
        """What is left is combined with the image that was there."""
        path, other = tmp_path / "a" / "a.nc", tmp_path / "b" / "a.nc"
        for each in (path, other):
            each.parent.mkdir()
        render(path)
        with pytest.raises(ZeroDivisionError):
            render(path, spp=None, more_samples=SPP, progress=after(3, fail))
        render(other, spp=2 * SPP)
        shutil.copy(other, path)
        for each in (path, other):
            render(each, spp=None, more_samples=SPP, resume=True)
        check(path, xr.load_dataset(other))

    def test_unfinished_ones_stay_when_the_image_is_asked_for(self, tmp_path):
        path = tmp_path / "a.nc"
        render(path)
        with pytest.raises(ZeroDivisionError):
            render(path, spp=None, more_samples=SPP, progress=after(3, fail))
        before = names(tmp_path)
        assert len(before) == 3
        render(path, resume=True)
        assert names(tmp_path) == before

    def test_of_another_scene_are_refused(self, tmp_path):
        path = tmp_path / "a.nc"
        render(path)
        with pytest.raises(OptionError, match=r"(?s)another render.*material \d, poster-orange"):
            render(path, spp=None, more_samples=4, materials={"left-wall": "poster-orange"})
        with pytest.raises(OptionError, match="both spp and more_samples"):
            render(path, more_samples=4)
        with pytest.raises(ImageError, match="does not exist"):
            render(tmp_path / "b.nc", spp=None, more_samples=4)

    def test_of_an_image_that_a_killed_run_has_left_are_refused(self, tmp_path):
        """Expected: how to finish it is said, and it can be; while it is still being written, that."""
        path = tmp_path / "a.nc"
        living = Temporary(path)
        with pytest.raises(ImageError, match=r"another process is writing"):
            render(path, spp=None, more_samples=4)
        living.drop()
        leave_unfinished(path)
        with pytest.raises(OptionError, match=r"(?s)an unfinished image.*\.a\.nc\..*\.tmp, left.*--resume"):
            render(path, spp=None, more_samples=4)
        render(path, resume=True)
        assert render(path, spp=None, more_samples=4).attrs["spp"] == SPP + 4

    @pytest.mark.filterwarnings("ignore:interrupted")
    def test_of_a_partial_image_are_refused(self, tmp_path):
        path = tmp_path / "a.nc"
        render(path, progress=after(3, interrupt))
        with pytest.raises(OptionError, match=r"(?s)partial image.*--resume"):
            render(path, spp=None, more_samples=4)


@pytest.fixture(scope="module")
def traced(tmp_path_factory) -> LightPaths:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(chunks.CHUNK, "llvm", SIZE[0] * SIZE[1] * SPP // 8)
        return trace(tmp_path_factory.mktemp("whole") / "a.paths")


class TestLightPaths:
    @pytest.mark.parametrize("end", [fail, interrupt])
    @pytest.mark.filterwarnings("ignore:interrupted")
    def test_are_gone_on_with(self, tmp_path, traced, end):
        path = tmp_path / "a.paths"
        try:
            trace(path, progress=after(3, end))
        except ZeroDivisionError:
            assert len(names(tmp_path)) == 2
        done: list[int] = []
        found = trace(path, resume=True, progress=lambda pixels, _: done.append(pixels))
        assert done[0] == 240
        assert names(tmp_path) == ["a.paths"]
        assert len(found.chunks) == len(traced.chunks)
        for chunk, expected in zip(found.chunks, traced.chunks, strict=True):
            assert chunk.first_pixel == expected.first_pixel
            for name in paths_file.ARRAYS:
                np.testing.assert_array_equal(getattr(chunk, name), getattr(expected, name))

    @pytest.mark.parametrize("end", [None, fail, interrupt])
    @pytest.mark.filterwarnings("ignore:interrupted")
    def test_of_another_scene_are_refused(self, tmp_path, end):
        with suppress(ZeroDivisionError):
            trace(tmp_path / "a.paths", progress=end and after(3, end))
        before = names(tmp_path)
        with pytest.raises(OptionError, match=r"(?s)another render.*seed: 3, before 0"):
            trace(tmp_path / "a.paths", seed=3, resume=True)
        assert names(tmp_path) == before

    def test_an_early_end_after_hours_loses_nothing(self, tmp_path, monkeypatch):
        path = tmp_path / "a.paths"
        with pytest.raises(ZeroDivisionError):
            trace(path, progress=after(5, fail))
        monkeypatch.setattr(paths_file, "SYNC_EVERY", 5.0)
        with pytest.raises(ZeroDivisionError):
            trace(path, resume=True, progress=after(1, fail))
        done: list[int] = []
        trace(path, resume=True, progress=lambda pixels, _: done.append(pixels))
        assert done[0] == 420

    @pytest.mark.filterwarnings("ignore:interrupted")
    def test_what_is_longer_counts(self, tmp_path):
        path = tmp_path / "a.paths"
        trace(path, progress=after(6, interrupt))
        with pytest.raises(ZeroDivisionError):
            trace(path, resume=True, progress=after(1, fail))
        done: list[int] = []
        trace(path, resume=True, progress=lambda pixels, _: done.append(pixels))
        assert done[0] >= 420


_SCRIPT = """
import sys
import fluorspar
from fluorspar.files import run_journal
from fluorspar.job import RenderJob
from fluorspar.paths import chunks, paths_file
chunks.CHUNK["llvm"], run_journal.SYNC_EVERY, paths_file.SYNC_EVERY = 1 << 11, 0.0, 0.0
path = sys.argv[1]
made = fluorspar.trace if path.endswith(".paths") else fluorspar.render
print("begins", flush=True)
made("cornell-box", size=(32, 32), spp=32, wavelengths="400:700:50", variant="llvm", threads=1, output=path,
     resume=True)
"""


@pytest.mark.parametrize("suffix", [".nc", ".zarr", ".paths"])
def test_killed_at_any_moment(tmp_path, suffix):
    """kill -9 again and again, and at the end the file of a process that was left alone."""

    def begin(path: Path) -> subprocess.Popen[str]:
        process = subprocess.Popen([sys.executable, "-c", _SCRIPT, path], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        with process.stdout as said:
            said.readline()
        return process

    alone, path = tmp_path / "alone" / f"a{suffix}", tmp_path / "killed" / f"a{suffix}"
    alone.parent.mkdir()
    path.parent.mkdir()
    began = time.monotonic()
    assert begin(alone).wait() == 0
    took = time.monotonic() - began
    chance = random.Random(suffix)
    for _ in range(4):
        process = begin(path)
        time.sleep(chance.uniform(0, 0.9 * took))
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert begin(path).wait() == 0
    assert names(path.parent) == [path.name]
    if suffix != ".paths":
        xr.testing.assert_equal(
            SpectralImage.open(path).load().dataset, SpectralImage.open(alone).load().dataset
        )
    else:
        images = [fluorspar.load_paths(each).image().dataset for each in (path, alone)]
        xr.testing.assert_equal(*images)
