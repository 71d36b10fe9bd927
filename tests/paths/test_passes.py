"""Passes until the image is certain enough: what they add up to, when they end, and what is kept."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluorspar import Scene, SpectralImage, Wavelengths, load_scene, render
from fluorspar.colour.xyz import luminance
from fluorspar.errors import FluorsparWarning, ImageError
from fluorspar.image.combining import combine, pixels_of
from fluorspar.image.formats.netcdf import NetcdfWriter
from fluorspar.image.pixels import Pixels
from fluorspar.job import LARGEST_SEED, RenderJob
from fluorspar.paths.chunks import CHUNK
from fluorspar.paths.passes import render_passes
from fluorspar.rendering import render_job
from fluorspar.scene.settings import MOST_SAMPLES
from fluorspar.until import Until
from xml_scene import SKY, xml_scene

GRID = Wavelengths(400, 700, 50)
PIXELS = 64
VARIABLES = ("radiance", "standard_error")


def box(spp: int = 16, size: int = 8) -> Scene:
    return load_scene("cornell-box").with_settings(width=size, height=size, spp=spp)


def grey_corner(folder: Path) -> Path:
    """A grey floor before a grey wall: all bands of a path are the same number."""
    wall = '<shape type="cube"> <transform name="to_world"> <scale value="0.6"/> </transform> </shape>'
    return xml_scene(
        folder,
        '<shape type="rectangle"> <transform name="to_world"> <scale value="2"/> </transform> </shape>',
        wall,
    )


def told(image: SpectralImage) -> dict[str, Any]:
    return dict(image.attrs["until"])


def values(image: SpectralImage) -> list[np.ndarray]:
    return [image.dataset[name].values for name in VARIABLES]


def against_converged(image: SpectralImage, converged: SpectralImage) -> tuple[np.ndarray, np.ndarray]:
    """Differences of luminance in units of their standard error, and the relative error that the image states.

    Of the pixels that show light.
    """
    Y, error, true, rest = (
        luminance(spectra.values.astype(float), GRID)
        for each in (image, converged)
        for spectra in (each.total(), each.standard_error())
    )
    uncertain = np.hypot(error, rest)
    z = np.divide(Y - true, uncertain, out=np.zeros_like(Y), where=uncertain > 0)
    return z[Y > 0], (error / np.where(Y > 0, Y, 1))[Y > 0]


class Clock:
    """A clock that goes on only while a pass is rendered, by so many seconds a sample of each pixel."""

    def __init__(self, per_sample: float) -> None:
        self.now, self._per_sample, self._counted = 0.0, per_sample, 0

    def __call__(self) -> float:
        return self.now

    def progress(self, done: int, whole: int) -> None:
        self.now = done / PIXELS * self._per_sample


class TestPasses:
    def test_one_pass_is_the_render_itself(self) -> None:
        plain = render(box(), wavelengths=GRID, seed=3)
        image = render(box(), wavelengths=GRID, seed=3, until="error=99%")
        for ours, theirs in zip(values(image), values(plain), strict=True):
            np.testing.assert_array_equal(ours, theirs)
        assert told(image)["passes"] == [16]
        assert told(image)["stopped"] == "reached"
        apart = {"timings", "until"}
        assert {k: v for k, v in image.attrs.items() if k not in apart} == {
            k: v for k, v in plain.attrs.items() if k not in apart
        }

    @pytest.mark.parametrize("component_errors", [False, True])
    def test_passes_are_combined_by_samples(self, component_errors: bool) -> None:
        """The image is the mean of renders of the streams 0, 1, ..., each weighted by its samples."""
        job = RenderJob(box(), GRID, seed=5, component_errors=component_errors)
        image = render_job(replace(job, until=Until("error", 0.1)))
        sizes = told(image)["passes"]
        assert len(sizes) > 2
        assert sizes[0] == 16
        assert image.attrs["spp"] == sum(sizes)
        mean: Pixels | None = None
        for stream, spp in enumerate(sizes):
            one = render_job(replace(job, scene=job.scene.with_settings(spp=spp), stream=stream))
            pixels = pixels_of(one, 0, PIXELS)
            if mean is not None:
                combine(pixels, spp, mean, sum(sizes[:stream]))
            mean = pixels
        got = pixels_of(image, 0, PIXELS)
        assert mean is not None
        np.testing.assert_array_equal(got.radiance, mean.radiance)
        np.testing.assert_array_equal(got.standard_error, mean.standard_error)
        assert (got.component_standard_error is not None) == component_errors
        if got.component_standard_error is not None and mean.component_standard_error is not None:
            np.testing.assert_array_equal(got.component_standard_error, mean.component_standard_error)

    def test_same_again_whatever_the_threads_and_where_to(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """In memory and, chunk by chunk, in a file."""
        options: dict[str, Any] = {"wavelengths": GRID, "seed": LARGEST_SEED, "until": "p95=25%"}
        memory = render(box(), threads=1, **options)
        assert len(told(memory)["passes"]) > 2
        with render(box(), threads=2, output=tmp_path / "a.nc", **options) as file:
            for ours, theirs in zip(values(file), values(memory), strict=True):
                np.testing.assert_array_equal(ours, theirs)
            assert told(file) == told(memory)
        assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]

    def test_passes_are_independent(self) -> None:
        """Of each other, and of other seeds: no pixel is the same."""
        job = RenderJob(box(), GRID, seed=0)
        first, second, other = (
            render_job(each).total().values for each in (job, replace(job, stream=1), replace(job, seed=1))
        )
        lit = first.any(axis=-1) & ~render_job(job).component("source").values.any(axis=-1)
        for a, b in ((first, second), (second, other)):
            assert not (a[lit] == b[lit]).all(axis=-1).any()

    def test_general_scenes(self, tmp_path: Path) -> None:
        plate = '<shape type="rectangle"> <bsdf type="roughplastic"/> </shape>'
        image = render(xml_scene(tmp_path, plate), wavelengths=GRID, until="error=4%")
        assert told(image)["stopped"] == "reached"
        assert len(told(image)["passes"]) > 2


class TestReached:
    @pytest.mark.parametrize("target", ["error=4%", "p95=8%"])
    def test_what_is_reached_is_true(self, target: str, tmp_path: Path) -> None:
        """Errors against a converged image, in units of the stated ones, scatter by 1.

        The standard deviation of 1,200 numbers is uncertain by 2 %, and the target is reached within what one more
        pass would have gained. Where bands are one number their errors are fully correlated, so nothing is bounded.
        """
        scene = grey_corner(tmp_path)
        image = render(scene, size=(40, 30), wavelengths=GRID, until=target, seed=1)
        reached, aim = told(image), float(target.partition("=")[2][:-1]) / 100
        measure = {"error": "mean", "p95": "p95"}[target.partition("=")[0]]
        assert aim / 1.2 < reached[measure] <= aim
        z, stated = against_converged(image, render(scene, size=(40, 30), wavelengths=GRID, spp=1024))
        noisy = stated > 0.3 * aim  # the sky itself is certain
        assert noisy.sum() > 500
        assert np.std(z[noisy]) == pytest.approx(1, abs=0.12)
        assert abs(np.mean(z[noisy])) < 4.5 / np.sqrt(noisy.sum())
        assert reached["mean"] == pytest.approx(stated.mean(), rel=1e-3)

    def test_bands_that_are_not_fully_correlated_are_bounded(self) -> None:
        """Light from walls of other colours: the true error is smaller than the stated one, but not much."""
        scene = box(size=20)
        image = render(scene, wavelengths=GRID, until="error=8%", seed=1)
        z, stated = against_converged(image, render(scene, wavelengths=GRID, spp=2048))
        assert 0.75 < np.std(z[stated > 0]) < 1.08

    def test_a_single_sample_needs_another_pass(self) -> None:
        image = render(box(spp=1), wavelengths=GRID, until="error=99.9%")
        assert told(image)["passes"][:2] == [1, 2]
        assert np.isfinite(image.standard_error().values).all()

    def test_darkness(self, tmp_path: Path) -> None:
        black = xml_scene(tmp_path, '<shape type="rectangle"/>', light=SKY.replace('"1"', '"0"'))
        with pytest.warns(FluorsparWarning, match="0 everywhere") as said:
            image = render(black, wavelengths=GRID, until="error=1%")
        assert len(said) == 1
        assert (told(image)["passes"], told(image)["stopped"]) == ([4], "dark")

    def test_bands_that_nobody_sees(self) -> None:
        image = render(box(), wavelengths="300:350:10", until="error=50%")
        assert told(image)["of"] == "sum of the bands"

    def test_told_in_words(self) -> None:
        image = render(box(), wavelengths=GRID, until="error=30%")
        assert "error=30%, reached after" in str(image)


class TestLimits:
    def passes(
        self, per_sample: float, max_time: float, target: float = 0.01
    ) -> tuple[list[int], str, float]:
        clock = Clock(per_sample)
        with pytest.warns(FluorsparWarning, match=r"not reached \(.* samples per pixel, .*: the time is up"):
            image = render_passes(
                RenderJob(box(), GRID),
                Until("error", target, max_time),
                clock=clock,
                progress=clock.progress,
            )
        return told(image)["passes"], told(image)["stopped"], clock.now

    def test_the_time(self) -> None:
        """At one second a sample: 16 + 16 + 32 end after 64 s, and the 64 that would follow do not fit into 100 s."""
        assert self.passes(1.0, 100.0) == ([16, 16, 32, 32], "time", pytest.approx(96, abs=1))

    def test_the_first_pass_is_always_rendered(self) -> None:
        assert self.passes(1.0, 5.0)[:2] == ([16], "time")

    def test_more_samples_than_there_are(self, monkeypatch: pytest.MonkeyPatch) -> None:
        for module in ("paths.passes", "until"):
            monkeypatch.setattr(f"fluorspar.{module}.MOST_SAMPLES", 64)
        with pytest.warns(FluorsparWarning) as said:
            image = render(box(), wavelengths=GRID, until="error=0.1%")
        assert told(image)["stopped"] == "samples"
        assert told(image)["passes"] == [16, 16, 32]
        early, late = (str(warning.message) for warning in said)
        assert early.startswith("error=0.1% takes about ")
        assert late.startswith("error=0.1% was not reached (64 samples per pixel, ")
        assert MOST_SAMPLES > 64

    def test_progress_reaches_its_end_only_at_the_end(self) -> None:
        calls: list[tuple[int, int]] = []
        image = render(box(), wavelengths=GRID, until="error=10%", progress=lambda *call: calls.append(call))
        assert all(done < whole for done, whole in calls[:-1])
        assert calls[-1] == (PIXELS * image.attrs["spp"],) * 2
        assert [done for done, _ in calls] == sorted(done for done, _ in calls)


def test_a_full_disk_in_a_later_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error, and the file holds the passes that are finished."""
    write, passes = NetcdfWriter.write_pixels, iter(range(100))

    def full(*arguments: Any) -> None:
        if next(passes) == 2:
            raise ImageError("the disk is full")
        write(*arguments)

    monkeypatch.setattr(NetcdfWriter, "write_pixels", full)
    with pytest.raises(ImageError, match="disk is full"):
        render(box(), wavelengths=GRID, until="error=2%", output=tmp_path / "a.nc")
    with SpectralImage.open(tmp_path / "a.nc") as image:
        assert (told(image)["passes"], told(image)["stopped"]) == ([16, 16], "interrupted")
        assert np.isfinite(image.total().values).all()
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]


class TestInterrupted:
    @pytest.fixture(autouse=True)
    def small_chunks(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """16 of the 64 pixels at a time, in the first two passes."""
        monkeypatch.setitem(CHUNK, "llvm", 16 * 16)

    @staticmethod
    def stop(samples: int) -> Any:
        def progress(done: int, whole: int) -> None:
            if done >= samples:
                raise KeyboardInterrupt

        return progress

    @pytest.mark.parametrize("streamed", [True, False])
    def test_in_a_later_pass(self, streamed: bool, tmp_path: Path) -> None:
        """The passes that are finished are the image: 16 + 16 samples, not the 8 pixels of the third."""
        output = tmp_path / "a.nc" if streamed else None
        with pytest.warns(FluorsparWarning, match=r"not reached \(32 samples.*only finished passes are kept"):
            image = render(
                box(), wavelengths=GRID, until="error=2%", output=output, progress=self.stop(PIXELS * 40)
            )
        assert "partial" not in image.attrs
        assert (image.attrs["spp"], told(image)["passes"]) == (32, [16, 16])
        assert told(image)["stopped"] == "interrupted"
        with warnings.catch_warnings(action="ignore", category=FluorsparWarning):
            clock = Clock(1.0)
            until = Until("error", 0.02, 33.0)
            whole = render_passes(RenderJob(box(), GRID), until, clock=clock, progress=clock.progress)
        assert told(whole)["passes"] == [16, 16]
        for ours, theirs in zip(values(image), values(whole), strict=True):
            np.testing.assert_array_equal(ours, theirs)
        image.close()
        assert [path.name for path in tmp_path.iterdir()] == ["a.nc"] * streamed

    @pytest.mark.parametrize("streamed", [True, False])
    def test_in_the_first_pass(self, streamed: bool, tmp_path: Path) -> None:
        output = tmp_path / "a.nc" if streamed else None
        with pytest.warns(FluorsparWarning) as said:
            image = render(
                box(), wavelengths=GRID, until="error=2%", output=output, progress=self.stop(32 * 16)
            )
        assert "32 of 64 pixels are finished" in str(said[0].message)
        assert image.attrs["partial"] == 1
        assert told(image)["stopped"] == "interrupted"
        total = image.total().values.reshape(PIXELS, -1)
        assert np.isfinite(total[:32]).all()
        assert np.isnan(total[32:]).all()

    def test_before_any_pixel(self, tmp_path: Path) -> None:
        path = tmp_path / "a.nc"
        path.write_bytes(b"older")
        with pytest.raises(KeyboardInterrupt):
            render_passes(
                RenderJob(box(), GRID), Until("error", 0.02), output=path, clock=self.interrupted_at(1)
            )
        assert path.read_bytes() == b"older"

    @staticmethod
    def interrupted_at(call: int) -> Any:
        calls = iter(range(10**6))

        def clock() -> float:
            if next(calls) == call:
                raise KeyboardInterrupt
            return 0.0

        return clock

    @pytest.mark.parametrize("call", range(6, 12))
    def test_at_any_moment_between_passes(self, call: int, tmp_path: Path) -> None:
        """The file is whole, and says of itself what it holds."""
        with pytest.warns(FluorsparWarning, match="not reached"):
            image = render_passes(
                RenderJob(box(), GRID),
                Until("error", 0.02),
                output=tmp_path / "a.nc",
                clock=self.interrupted_at(call),
            )
        assert sum(told(image)["passes"]) == image.attrs["spp"]
        assert np.isfinite(image.total().values).all()
        image.close()

    def test_when_a_pass_has_just_been_written(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """The file holds it already, so it counts."""
        close, calls = NetcdfWriter.close, iter(range(100))

        def closed(writer: NetcdfWriter, **options: Any) -> None:
            close(writer, **options)
            if next(calls) == 2:
                raise KeyboardInterrupt

        monkeypatch.setattr(NetcdfWriter, "close", closed)
        with pytest.warns(FluorsparWarning, match="64 samples per pixel"):
            image = render(box(), wavelengths=GRID, until="error=2%", output=tmp_path / "a.nc")
        assert (told(image)["passes"], image.attrs["spp"]) == ([16, 16, 32], 64)
        image.close()
        assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]
