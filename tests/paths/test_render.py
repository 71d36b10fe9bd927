"""From scene to image with the one-pass method: depths, overflow, chunks, interruption."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluorspar import (
    COMPONENTS,
    Fluorophore,
    Material,
    Scene,
    SpectralImage,
    Spectrum,
    Wavelengths,
    load_scene,
    render,
    trace,
)
from fluorspar.errors import FluorsparWarning, OptionError
from fluorspar.paths.chunks import CHUNK
from fluorspar.paths.log import BLOCK, END, Chunk, lanes_per_pixel
from fluorspar.rendering import render_job
from fluorspar.scene.variants import TRACE_VARIANTS, use_variant

GRID = Wavelengths(400, 700, 20)
DYE = Material(
    "dye",
    Spectrum.constant(0.5),
    (Fluorophore(Spectrum([460, 540, 640], [0, 0.4, 0]), Spectrum([400, 480, 560], [0, 1, 0])),),
)


def furnace(
    folder: Path, *, width: int = 9, height: int = 7, spp: int = 16, max_depth: int = -1, rr_depth: int = 5
) -> Scene:
    """A closed cube that emits 1 everywhere; seen from inside."""
    (folder / "scene.xml").write_text(
        f"""<scene version="3.0.0"> <integrator type="path"> <integer name="max_depth" value="{max_depth}"/>
        <integer name="rr_depth" value="{rr_depth}"/> </integrator>
        <sensor type="perspective"> <film type="hdrfilm"> <integer name="width" value="{width}"/>
        <integer name="height" value="{height}"/> <rfilter type="box"/> </film>
        <sampler type="independent"> <integer name="sample_count" value="{spp}"/> </sampler> </sensor>
        <shape type="cube" id="cavity"> <boolean name="flip_normals" value="true"/>
        <emitter type="area"> <spectrum name="radiance" value="1"/> </emitter> </shape> </scene>"""
    )
    return load_scene(folder / "scene.xml", materials={"cavity": DYE})


def traced(scene: Scene, seed: int = 0) -> Chunk:
    with use_variant(TRACE_VARIANTS["llvm"]):
        from fluorspar.paths.tracing.trace_scene import build_trace_scene
        from fluorspar.paths.tracing.tracer import Tracer

        tracer = Tracer(build_trace_scene(scene), scene.settings, np.full(len(scene.materials), 0.5), seed)
        pixels = scene.settings.width * scene.settings.height
        return tracer.finish(tracer.start(0, pixels))


def vertices_of(chunk: Chunk) -> list[int]:
    """Number of vertices of each path in the log, pixel after pixel."""
    log, parts = chunk.log, lanes_per_pixel(chunk.spp)
    numbers = []
    for lane in range(chunk.pixels * parts):
        part = lane % parts
        slot, entry = lane, log.strips[lane // BLOCK, 0]
        for _ in range((part + 1) * chunk.spp // parts - part * chunk.spp // parts):
            vertices, weight = 0, 1.0
            while weight:
                if entry == log.strips[slot // BLOCK, 1]:
                    slot = log.goes_on[slot]
                    entry = log.strips[slot // BLOCK, 0]
                surface = log.row[entry, slot % BLOCK] != END
                vertices += surface
                weight = log.weight[entry, slot % BLOCK] if surface else 0.0
                entry += 1
            numbers.append(int(vertices))
        assert log.goes_on[slot] == -1
    return numbers


class TestDepth:
    @pytest.mark.parametrize(
        ("max_depth", "present"),
        [
            (1, {"source"}),
            (2, {"source", "direct_reflection", "direct_luminescence"}),
            (3, set(COMPONENTS)),
        ],
    )
    def test_what_a_depth_holds(self, max_depth: int, present: set[str], tmp_path: Path) -> None:
        """As in Mitsuba: 1 is lamps seen directly, 2 adds direct light, 3 is one bounce more."""
        image = render(furnace(tmp_path, max_depth=max_depth, rr_depth=100), wavelengths=GRID)
        assert {name for name in COMPONENTS if image.component(name).values.any()} == present

    @pytest.mark.parametrize("spp", [5, 70])
    @pytest.mark.parametrize("max_depth", [1, 2, 3, 10, 11, 23, 24, 25, 49, 100])
    def test_number_of_vertices(self, max_depth: int, spp: int, tmp_path: Path) -> None:
        """Without roulette every path in a closed room has max_depth - 1 vertices, over as many strips as it takes."""
        chunk = traced(furnace(tmp_path, width=3, height=3, spp=spp, max_depth=max_depth, rr_depth=1000))
        assert vertices_of(chunk) == [max_depth - 1] * 9 * spp

    def test_roulette_begins_at_its_depth(self, tmp_path: Path) -> None:
        """With 0.5 per vertex half of the paths end each time, from vertex rr_depth - 1 on."""
        length = np.array(vertices_of(traced(furnace(tmp_path, width=32, height=32, spp=16, rr_depth=4))))
        assert length.min() == 4
        assert (length == 4).mean() == pytest.approx(1 - 0.5**4, abs=0.01)
        assert (length[length > 4] == 5).mean() == pytest.approx(0.5, abs=0.05)

    @pytest.mark.parametrize("rr_depth", [1, 2, 6, 1000])
    def test_roulette_does_not_change_the_mean(self, rr_depth: int, tmp_path: Path) -> None:
        """R of 20 scatterings is 1 + 0.5 + ... = 2 within 1e-6; here in the bands where the dye does
        nothing."""
        image = render(
            furnace(tmp_path, width=32, height=32, spp=64, max_depth=21, rr_depth=rr_depth), wavelengths=GRID
        )
        values = image.total().values[..., 0].astype(float)
        assert abs(values.mean() - 2) < 4.5 * values.std() / 32
        assert values.std() / 32 < 0.01

    @pytest.mark.parametrize("S", [0.02, 0.99])
    def test_roulette_of_dark_and_bright_surfaces(self, S: float, tmp_path: Path) -> None:
        """Beyond 0.05 to 0.95 the chance of survival is not the reflectance, and what survives gains accordingly."""
        furnace(tmp_path, width=32, height=32, spp=256, max_depth=6, rr_depth=1)
        paint = Material("paint", Spectrum.constant(S))
        image = render(load_scene(tmp_path / "scene.xml", materials={"cavity": paint}), wavelengths=GRID)
        values = image.total().values[..., 0].astype(float)
        error = values.std() / 32
        assert error < 0.01
        assert abs(values.mean() - sum(S**k for k in range(6))) < 4.5 * error


class TestPixels:
    """Which pixel is where, and that it does not matter how the work is divided."""

    @staticmethod
    def checks(folder: Path, spp: int = 8) -> Scene:
        """An orthographic view of 5 x 4 lamps, one for each pixel, of radiance 1 (top left) to 20, in
        reading order."""
        lamps = "".join(
            f"""<shape type="rectangle"> <transform name="to_world"> <scale x="0.5" y="0.5"/>
            <translate x="{x - 2}" y="{1.5 - y}"/> </transform> <emitter type="area">
            <spectrum name="radiance" value="{1 + 5 * y + x}"/> </emitter> </shape>"""
            for y in range(4)
            for x in range(5)
        )
        (folder / "scene.xml").write_text(
            f"""<scene version="3.0.0"> <sensor type="orthographic"> <transform name="to_world">
                <scale x="2.5" y="2.5"/>
            <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/> </transform>
            <film type="hdrfilm"> <integer name="width" value="5"/> <integer name="height" value="4"/>
            <rfilter type="box"/> </film>
            <sampler type="independent"> <integer name="sample_count" value="{spp}"/> </sampler>
            </sensor> {lamps} </scene>"""
        )
        return load_scene(folder / "scene.xml")

    @pytest.mark.parametrize("chunk", [8, 24, 56, 2**20])
    def test_reading_order_whatever_the_chunks(
        self, chunk: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """y = 0 is the top row, x goes to the right; chunks of up to 1, 3, 7 or all pixels; 20 lights, each its
        own row."""
        monkeypatch.setitem(CHUNK, "llvm", chunk)
        calls: list[tuple[int, int]] = []
        image = render(self.checks(tmp_path), wavelengths=GRID, progress=lambda *done: calls.append(done))
        expected = np.arange(1, 21, dtype=np.float32).reshape(4, 5)
        assert np.array_equal(image.total().values, np.broadcast_to(expected[..., None], (4, 5, len(GRID))))
        runs = -(-20 // max(1, chunk // 8))
        assert calls == [(20 * n // runs, 20) for n in range(1, runs + 1)]

    def test_more_samples_than_a_chunk_holds(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 4)
        assert render(self.checks(tmp_path, spp=8), wavelengths=GRID).total().values[3, 4, 0] == 20

    def test_chunks_are_independent_samples(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """A floor under an even sky looks the same in each pixel: the same random numbers would give the same noise."""
        (tmp_path / "scene.xml").write_text(
            """<scene version="3.0.0"> <sensor type="orthographic"> <transform name="to_world">
            <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/> </transform> <film type="hdrfilm">
            <integer name="width" value="6"/> <integer name="height" value="6"/> <rfilter type="box"/> </film>
            </sensor> <emitter type="constant"> <spectrum name="radiance" value="1"/> </emitter>
            <shape type="rectangle"> <transform name="to_world">
            <scale x="9" y="9"/> </transform> </shape> </scene>"""
        )
        monkeypatch.setitem(CHUNK, "llvm", 16 * 18)
        values = render(tmp_path / "scene.xml", spp=16, wavelengths=GRID).total().values[..., 0]
        assert values.std() > 0.01
        # 18 pairs: a correlation of 0.8 is beyond chance (p < 1e-4), and the same noise has 1
        assert abs(np.corrcoef(values[:3].ravel(), values[3:].ravel())[0, 1]) < 0.8


class TestLanes:
    """Lanes trace sample after sample, in strips of a height that must not matter."""

    @pytest.mark.parametrize("spp", [1, 2, 16, 25, 100])
    @pytest.mark.parametrize("room", [0.2, 1.0, 3.0])
    def test_the_height_of_strips_does_not_matter(
        self, room: float, spp: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        furnace(tmp_path, spp=spp)
        scene = load_scene(tmp_path / "scene.xml", materials={"cavity": DYE})
        whole = render(scene, wavelengths=GRID)
        tracer = "fluorspar.paths.tracing.tracer."
        monkeypatch.setattr(tracer + "_ROOM", room)
        monkeypatch.setattr(tracer + "_MOST_ROOM", room)
        assert np.array_equal(whole.total().values, render(scene, wavelengths=GRID).total().values)

    @pytest.mark.parametrize("spp", [16, 64])
    def test_the_rays_of_a_pixel_are_spread(self, spp: int, tmp_path: Path) -> None:
        """A black and white edge through the middle of a pixel: half of the samples see it, exactly."""
        (tmp_path / "scene.xml").write_text(
            """<scene version="3.0.0"> <sensor type="orthographic"> <transform name="to_world">
            <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/> </transform> <film type="hdrfilm">
            <integer name="width" value="1"/> <integer name="height" value="1"/> <rfilter type="box"/> </film>
            <sampler type="independent"/> </sensor>
            <shape type="rectangle"> <transform name="to_world"> <translate x="1"/> </transform>
            <emitter type="area"> <spectrum name="radiance" value="1"/> </emitter> </shape> </scene>"""
        )
        for seed in range(5):
            image = render(tmp_path / "scene.xml", wavelengths=GRID, seed=seed, spp=spp, size=(5, 5))
            assert (image.total().values[:, 2] == 0.5).all()


class TestLightPaths:
    """Light paths that are kept give the images of `render` and others."""

    def test_the_image_of_render(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 16 * 10)
        options: dict[str, Any] = {"spp": 20, "seed": 4, "wavelengths": GRID}
        calls: list[tuple[int, int]] = []
        paths = trace(furnace(tmp_path), **options, progress=lambda *done: calls.append(done))
        assert [done for done, _ in calls] == [63 * n // 8 for n in range(1, 9)]
        image = paths.image(component_errors=True)
        expected = render(furnace(tmp_path), **options, component_errors=True)
        for name in ("radiance", "standard_error", "component_standard_error"):
            assert np.array_equal(image.dataset[name].values, expected.dataset[name].values), name
        without = {"timings"}
        assert {k: v for k, v in image.attrs.items() if k not in without} == {
            k: v for k, v in expected.attrs.items() if k not in without
        }

    def test_another_grid(self, tmp_path: Path) -> None:
        """The paths hold no wavelength: bands that both grids have reflect alike."""
        paths = trace(furnace(tmp_path), wavelengths=GRID)
        coarse, fine = paths.image(wavelengths="400:700:100"), paths.image()
        assert coarse.dataset.sizes["wavelength"] == 4
        reflected = fine.component("indirect_reflection").values[..., ::5]
        np.testing.assert_allclose(reflected, coarse.component("indirect_reflection").values, rtol=1e-5)

    def test_options_of_the_image(self, tmp_path: Path) -> None:
        paths = trace(furnace(tmp_path), wavelengths=GRID)
        with paths.image(stokes="strict", output=tmp_path / "a.nc") as image:
            assert image.attrs["stokes"] == "strict"
            assert np.array_equal(
                image.total().values,
                render(furnace(tmp_path), wavelengths=GRID, stokes="strict").total().values,
            )
        with pytest.raises(OptionError, match="Stokes"):
            paths.image(stokes="loose")  # type: ignore[arg-type]

    def test_images_do_not_need_the_scene_file(self, tmp_path: Path) -> None:
        paths = trace(furnace(tmp_path), wavelengths=GRID)
        (tmp_path / "paths.pickle").write_bytes(pickle.dumps(paths))
        (tmp_path / "scene.xml").unlink()
        code = """
import pickle
from pathlib import Path
pickle.loads(Path("paths.pickle").read_bytes()).image(output="image.nc").close()
"""
        subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
        with SpectralImage.open(tmp_path / "image.nc") as image:
            assert np.array_equal(image.total().values, paths.image().total().values)

    def test_a_file_of_another_kind_stays_as_it_is(self, tmp_path: Path) -> None:
        (tmp_path / "a.exr").write_bytes(b"precious")
        paths = trace(furnace(tmp_path), wavelengths=GRID)
        with pytest.raises(OptionError, match="NetCDF or Zarr only"):
            paths.image(output=tmp_path / "a.exr")
        with pytest.raises(OptionError, match="NetCDF or Zarr only"):
            render_job(paths.job, output=tmp_path / "a.exr")
        assert (tmp_path / "a.exr").read_bytes() == b"precious"

    def test_it_says_what_it_is(self, tmp_path: Path) -> None:
        paths = trace(furnace(tmp_path), wavelengths=GRID, seed=3)
        assert "9 x 7 pixels, 16 samples, seed 3" in repr(paths)
        assert paths.nbytes > 63 * 16 * 16


class TestErrors:
    def test_errors_of_components_on_request(self, tmp_path: Path) -> None:
        scene = furnace(tmp_path)
        without, with_them = (
            render(scene, wavelengths=GRID, component_errors=wanted) for wanted in (False, True)
        )
        assert "component_standard_error" not in without.dataset
        assert np.array_equal(without.dataset["radiance"].values, with_them.dataset["radiance"].values)
        np.testing.assert_allclose(
            without.standard_error().values, with_them.standard_error().values, rtol=1e-3
        )
        errors = with_them.dataset["component_standard_error"].values
        assert not errors[0].any(), "a lamp that fills the view has no noise"
        assert (errors[1] > 0).all()

    def test_error_goes_down_with_samples(self, tmp_path: Path) -> None:
        few, many = (
            render(furnace(tmp_path, width=16, height=16), spp=n, wavelengths=GRID)
            .standard_error()
            .values.mean()
            for n in (64, 1024)
        )
        assert 4 < few / many < 4**1.5, "faster than that of independent samples"

    def test_one_sample(self, tmp_path: Path) -> None:
        image = render(furnace(tmp_path), spp=1, wavelengths=GRID)
        assert np.isnan(image.standard_error().values).all()
        assert np.isfinite(image.total().values).all()


class TestOptions:
    @pytest.mark.parametrize(
        ("option", "told"),
        [
            ({"method": "magic"}, "no such method"),
            ({"variant": "metal"}, "no such variant"),
            ({"output": "picture.png"}, "NetCDF or Zarr only"),
            ({"wavelengths": "700:400:5"}, "ascend"),
        ],
    )
    def test_bad_options(self, option: dict[str, Any], told: str, tmp_path: Path) -> None:
        with pytest.raises(Exception, match=told):
            render(furnace(tmp_path), **option)

    @pytest.mark.parametrize("threads", [0, -1])
    def test_bad_threads(self, threads: int, tmp_path: Path) -> None:
        with pytest.raises(OptionError, match="threads"):
            render(furnace(tmp_path), wavelengths=GRID, threads=threads)

    def test_bad_stokes(self, tmp_path: Path) -> None:
        with pytest.raises(Exception, match="Stokes"):
            render(furnace(tmp_path), wavelengths=GRID, stokes="loose")  # type: ignore[arg-type]

    def test_attributes(self, tmp_path: Path) -> None:
        attrs = render(furnace(tmp_path), wavelengths=GRID, seed=5, stokes="strict").attrs
        assert {key: attrs[key] for key in ("method", "spp", "seed", "max_depth", "rr_depth", "stokes")} == {
            "method": "paths",
            "spp": 16,
            "seed": 5,
            "max_depth": -1,
            "rr_depth": 5,
            "stokes": "strict",
        }
        assert "dye" in attrs["materials"]
        assert "partial" not in attrs
        assert attrs["timings"]["render"] > 0


class TestInterrupted:
    """Ctrl-C keeps what was finished and says that it is not all."""

    @staticmethod
    def stop(done: int, pixels: int) -> None:
        if done >= 30:
            raise KeyboardInterrupt

    def check(self, image: SpectralImage) -> None:
        assert image.dataset.attrs["partial"] == 1
        total = image.total().values.reshape(63, -1)
        assert np.isfinite(total[:36]).all()
        assert np.isnan(total[36:]).all()
        error = image.standard_error().values.reshape(63, -1)
        assert np.isfinite(error[:36]).all()
        assert np.isnan(error[36:]).all()

    def test_in_memory(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 16 * 10)
        whole = render(furnace(tmp_path), wavelengths=GRID, seed=3).total().values
        with pytest.warns(FluorsparWarning, match="36 of 63 pixels"):
            image = render(furnace(tmp_path), wavelengths=GRID, seed=3, progress=self.stop)
        self.check(image)
        assert np.array_equal(image.total().values.reshape(63, -1)[:36], whole.reshape(63, -1)[:36])

    def test_streamed(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 16 * 10)
        with pytest.warns(FluorsparWarning, match="36 of 63 pixels"):
            render(furnace(tmp_path), wavelengths=GRID, progress=self.stop, output=tmp_path / "a.nc").close()
        with SpectralImage.open(tmp_path / "a.nc") as image:
            self.check(image)

    def test_rendering_goes_on_after_it(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 16 * 10)
        with pytest.warns(FluorsparWarning):
            render(furnace(tmp_path), wavelengths=GRID, progress=self.stop)
        assert np.isfinite(render(furnace(tmp_path), wavelengths=GRID).total().values).all()


class TestStreaming:
    def test_file_and_memory_are_the_same(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(CHUNK, "llvm", 16 * 10)
        memory = render(furnace(tmp_path), wavelengths=GRID, component_errors=True)
        with render(
            furnace(tmp_path), wavelengths=GRID, component_errors=True, output=tmp_path / "a.nc"
        ) as file:
            for name in ("radiance", "standard_error", "component_standard_error"):
                assert np.array_equal(memory.dataset[name].values, file.dataset[name].values), name

    def test_a_failure_leaves_an_older_file_alone(self, tmp_path: Path) -> None:
        target = tmp_path / "a.nc"
        render(furnace(tmp_path), wavelengths=GRID, output=target).close()
        before = target.read_bytes()

        def fail(done: int, pixels: int) -> None:
            raise RuntimeError("disk on fire")

        with pytest.raises(RuntimeError, match="disk on fire"):
            render(furnace(tmp_path), wavelengths=GRID, output=target, progress=fail)
        assert target.read_bytes() == before
        assert sorted(p.name for p in tmp_path.iterdir()) == ["a.nc", "scene.xml"]
