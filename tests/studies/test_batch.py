"""`fluorspar.batch`: each image is the one that its row asks for, made once, whatever becomes of the others."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fluorspar
from fluorspar import SpectralImage, batch
from fluorspar.errors import FluorsparError, FluorsparWarning, OptionError
from fluorspar.paths.chunks import CHUNK
from fluorspar.studies.marks import MARK

GRID = "400:700:20"
QUICK = {"scene": "cornell-box", "size": "8x8", "spp": 4, "wavelengths": GRID, "variant": "llvm"}
SCENE = """<scene version="3.0.0">
  <default name="size" value="1"/>
  <sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <rfilter type="box"/> </film> </sensor>
  <emitter type="constant" id="sky"/>
  <shape type="sphere" id="ball"> <float name="radius" value="$size"/>
    <bsdf type="diffuse" id="paint"> <texture name="reflectance" type="checkerboard"/> </bsdf> </shape>
</scene>"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ball.xml").write_text(SCENE)
    return tmp_path


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How often something was traced and rendered."""
    counts = {"trace_job": 0, "render_job": 0, "whole_image": 0}

    def count(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def counting(*arguments: Any, **options: Any) -> Any:
            counts[name] += 1
            return call(*arguments, **options)

        return counting

    from fluorspar.studies import do_group

    for name in counts:
        monkeypatch.setattr(do_group, name, count(name, getattr(do_group, name)))
    return counts


def test_a_study_whose_folder_is_its_library_is_done_when_it_is(
    folder: Path, counted: dict[str, int]
) -> None:
    """The index and the images, which change, are no materials."""
    Path("s.toml").write_text(
        'output = "{seed}.nc"\n[render]\nscene = "furnace"\nsize = "8x8"\nspp = 4\nlibrary = "."\n'
        "[product]\nseed = [1, 2]\n"
    )
    for _ in range(3):
        batch("s.toml")
    assert counted["whole_image"] + counted["render_job"] == 2


def radiance(path: str | Path) -> np.ndarray:
    with SpectralImage.open(path) as image:
        return np.asarray(image.dataset.radiance.values)


def statuses(index: Any) -> list[str]:
    return [str(status) for status in index["status"].values]


class TestImages:
    def test_a_row_is_the_render_of_its_options(self) -> None:
        own = {
            "D.size": 0.5,
            "material.ball": "poster-red",
            "seed": 3,
            "max_depth": 3,
            "component_errors": True,
        }
        batch({"render": QUICK | {"scene": "ball.xml"} | own, "output": "a.nc"})
        scene = fluorspar.load_scene("ball.xml", parameters={"size": 0.5}, materials={"ball": "poster-red"})
        options = {"size": (8, 8), "spp": 4, "wavelengths": GRID, "variant": "llvm"}
        expected = fluorspar.render(scene, seed=3, max_depth=3, component_errors=True, **options)  # type: ignore[arg-type]
        with SpectralImage.open("a.nc") as image:
            for name in ("radiance", "standard_error", "component_standard_error"):
                np.testing.assert_array_equal(image.dataset[name].values, expected.dataset[name].values)
            for name in expected.attrs.keys() - {"timings", "scene"}:
                assert image.attrs[name] == expected.attrs[name]

    def test_rows_that_differ_in_spectra_are_traced_once(self, counted: dict[str, int]) -> None:
        changes = {
            "light.light": ["D65", "D50x0.5", 2],
            "concentration.left-wall": [0, 1],
            "material.right-wall": ["white-85"],
        }
        index = batch({"render": QUICK, "product": changes, "output": "{light}-{concentration:.0f}.nc"})
        assert statuses(index) == ["done"] * 6
        assert counted == {"trace_job": 1, "render_job": 0, "whole_image": 6}
        options = {"size": (8, 8), "spp": 4, "wavelengths": GRID, "variant": "llvm"}
        scene = fluorspar.load_scene("cornell-box", materials={"right-wall": "white-85"})
        paths = fluorspar.trace(scene, **options)  # type: ignore[arg-type]
        expected = paths.image(lights={"light": ("D50", 0.5)}, concentration={"left-wall": 0})
        np.testing.assert_array_equal(radiance("D50x0.5-0.nc"), expected.dataset.radiance.values)
        with SpectralImage.open("2-1.nc") as image:
            assert image.attrs["relit"] == {"lights": {"light": 2.0}, "concentration": {"left-wall": 1.0}}

    def test_lights_are_stated_in_one_way(self) -> None:
        """Expected: by images of light paths as by those that are rendered."""
        rows = [{}, {"until": "error=90%"}]
        batch({"render": QUICK | {"light.light": "D50x0.5"}, "rows": rows, "output": "{number}.nc"})
        for number, is_relit in ((1, True), (2, False)):
            with SpectralImage.open(f"{number}.nc") as image:
                assert image.attrs["lights"] == {"light": "D50 x 0.5"}
                assert ("relit" in image.attrs) is is_relit

    def test_nothing_changed_is_the_render_bit_for_bit(self) -> None:
        """Although its light paths serve another row too."""
        batch({"render": QUICK, "rows": [{}, {"light.light": "A"}], "output": "{number}.nc"})
        expected = fluorspar.render("cornell-box", size=(8, 8), spp=4, wavelengths=GRID, variant="llvm")
        np.testing.assert_array_equal(radiance("1.nc"), expected.dataset.radiance.values)

    def test_a_material_that_paths_cannot_be_given_is_rendered(self, counted: dict[str, int]) -> None:
        """The colour of the ball is a texture, which a material replaces only when the scene is loaded."""
        render = QUICK | {"scene": "ball.xml"}
        rows = [{"light.sky": "A"}, {"light.sky": "A", "material.ball": "poster-red"}, {"light.sky": "D65"}]
        index = batch({"render": render, "rows": rows, "output": "{number}.nc"})
        assert statuses(index) == ["done"] * 3, index["fault"].values
        assert counted["trace_job"] == 2
        with SpectralImage.open("2.nc") as image:
            assert "poster-red" in image.attrs["materials"]

    def test_grids_may_differ(self) -> None:
        grids = ["400:700:20", "380:730:10"]
        batch({"render": QUICK, "product": {"wavelengths": grids}, "output": "{number}.nc"})
        assert [radiance(f"{number}.nc").shape[-1] for number in (1, 2)] == [16, 36]

    def test_passes(self) -> None:
        until = {"until": "error=50%", "max_time": "5s"}
        assert statuses(batch({"render": QUICK | until, "output": "a.nc"})) == ["done"]
        with SpectralImage.open("a.nc") as image:
            assert "until" in image.attrs

    def test_denoised_rows(self) -> None:
        index = batch({"render": QUICK | {"denoise": True, "light.light": "A"}, "output": "a.nc"})
        assert statuses(index) == ["done"], index["fault"].values
        with SpectralImage.open("a.nc") as image:
            assert "denoised" in image.attrs

    def test_files_named_in_a_study_are_beside_it(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        (folder / "lamp.csv").write_text("wavelength,value\n300,1\n800,2\n")
        study = 'render = { scene = "ball.xml", size = "8x8", spp = 4, light.sky = "lamp.csvx2" }\noutput = "a/b.nc"'
        (folder / "warm.toml").write_text(study)
        (folder / "elsewhere").mkdir()
        monkeypatch.chdir(folder / "elsewhere")
        assert statuses(batch("../warm.toml")) == ["done"]
        assert (folder / "a" / "b.nc").exists()

    @pytest.mark.parametrize("denoise", [False, True])
    @pytest.mark.parametrize("traced", [True, False])
    def test_large_ones_are_kept_in_files(
        self, traced: bool, denoise: bool, monkeypatch: pytest.MonkeyPatch, folder: Path
    ) -> None:
        """Light paths in a file, which goes, and images streamed, if not to their own file; the same bit for bit."""
        rows = [{"light.light": "A"}, {"light.light": "D65"}] if traced else [{}]
        study = {"render": QUICK | {"denoise": denoise}, "rows": rows}
        batch(study, output="small-{number}.nc")
        monkeypatch.setattr("fluorspar.files.memory.available_memory", lambda: 1000)
        monkeypatch.setattr("fluorspar.image.pixels.PixelsInMemory.room", None)
        index = batch(study, output=["large-{number}.nc", "large-{number}.png"])
        assert statuses(index) == ["done"] * len(rows), index["fault"].values
        np.testing.assert_array_equal(radiance("small-1.nc"), radiance("large-1.nc"))
        assert not list(folder.glob(".*"))
        with SpectralImage.open("large-1.nc") as image:
            assert image.attrs[MARK] == index["study_row"].values[0]
        assert Path("large-1.png").exists()


SEEDS: dict[str, Any] = {
    "render": QUICK | {"scene": "ball.xml"},
    "product": {"seed": [1, 2]},
    "output": "{seed}.nc",
}


class TestAgain:
    def test_what_is_done_is_left_out(self, counted: dict[str, int]) -> None:
        first, second = batch(SEEDS), batch(SEEDS)
        assert counted["render_job"] == 2
        assert statuses(first) == statuses(second) == ["done", "done"]
        assert first["study_row"].equals(second["study_row"])

    @pytest.mark.parametrize("suffix", [".nc", ".zarr", ".png", ".exr", ".hdr"])
    def test_of_another_version_too_but_that_is_said(
        self, suffix: str, counted: dict[str, int], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        if suffix == ".zarr":
            pytest.importorskip("zarr")
        study = {"render": QUICK, "output": f"a{suffix}"}
        batch(study)
        monkeypatch.setattr("fluorspar.studies.batch.__version__", "99")
        with pytest.warns(FluorsparWarning, match=rf"by Fluorspar {fluorspar.__version__} and count as done"):
            assert batch(study)["status"].values.tolist() == ["done"]
        assert counted["render_job"] == 1

    @pytest.mark.parametrize("suffix", [".png", ".exr", ".hdr"])
    def test_of_all_formats(self, suffix: str, counted: dict[str, int], folder: Path) -> None:
        """Expected: the files themselves say which row made them, whatever has become of the index."""

        def render(*seeds: int, spp: int = 4) -> int:
            lines = [f"ball.xml,8x8,{spp if seed == 1 else 4},{seed}" for seed in seeds]
            (folder / "seeds.csv").write_text("\n".join(["scene,size,spp,seed", *lines]))
            before = counted["render_job"]
            assert statuses(batch("seeds.csv", output=f"{{seed}}{suffix}")) == ["done"] * len(seeds)
            return counted["render_job"] - before

        assert render(1, 2) == 2
        assert render(1, 2) == 0
        index = (folder / "seeds-index.csv").read_bytes()
        (folder / "seeds-index.csv").unlink()
        assert render(2, 1) == 0
        assert render(1, 2, spp=8) == 1
        (folder / "seeds-index.csv").write_bytes(
            index
        )  # as of a run that was killed before it could write its own
        assert render(1, 2) == 1
        (folder / "2").with_suffix(".img" if suffix == ".hdr" else suffix).unlink()
        assert render(1, 2) == 1

    @pytest.mark.parametrize(
        "change",
        [
            lambda: os.remove("1.nc"),
            lambda: Path("1.nc").write_bytes(Path("1.nc").read_bytes()[:5000]),
            lambda: fluorspar.render("ball.xml", size=(8, 8), spp=4, seed=1, wavelengths=GRID).save("1.nc"),
        ],
        ids=["gone", "damaged", "of something else"],
    )
    def test_what_is_not_whole_is_rendered_again(
        self, change: Callable[[], object], counted: dict[str, int]
    ) -> None:
        batch(SEEDS)
        expected = radiance("1.nc")
        change()
        batch(SEEDS)
        assert counted["render_job"] == 3
        np.testing.assert_array_equal(radiance("1.nc"), expected)

    def test_a_partial_image_is_rendered_again(self, counted: dict[str, int]) -> None:
        import h5py

        batch(SEEDS)
        with h5py.File("2.nc", "r+") as file:
            file.attrs["partial"] = 1
        batch(SEEDS)
        assert counted["render_job"] == 3

    def test_another_row_or_scene_is_rendered_again(self, counted: dict[str, int]) -> None:
        batch(SEEDS)
        os.utime("ball.xml", (1, 1))
        batch(SEEDS)
        assert counted["render_job"] == 2, "its content has not changed"
        Path("ball.xml").write_text(SCENE.replace('value="1"', 'value="0.5"'))
        batch(SEEDS)
        assert counted["render_job"] == 4
        batch(SEEDS | {"render": SEEDS["render"] | {"spp": 8}})
        assert counted["render_job"] == 6


class TestCameras:
    def test_each_row_has_its_own(self, counted: dict[str, int]) -> None:
        """Expected: the images of `render`, bit for bit, of rows that share light paths and of others; lamps too where
        none are kept."""
        cameras = ["fov=20", {"origin": (278, 273, -400)}]
        rows = [
            {"camera": "fov=20"},
            {"camera": "fov=20", "light.light": "A"},
            {"camera": "origin=278,273,-400"},
            {"camera": "fov=20", "light.light": "A", "method": "staged"},
        ]
        index = batch({"render": QUICK, "rows": rows, "output": "{number}.nc"})
        assert statuses(index) == ["done"] * 4
        assert counted == {"trace_job": 1, "render_job": 2, "whole_image": 2}
        options = {"size": (8, 8), "spp": 4, "wavelengths": GRID, "variant": "llvm"}
        for number, camera in ((1, cameras[0]), (3, cameras[1])):
            expected = fluorspar.render("cornell-box", camera=camera, **options)
            np.testing.assert_array_equal(radiance(f"{number}.nc"), expected.dataset.radiance)
        staged = fluorspar.render(
            "cornell-box", camera=cameras[0], lights={"light": "A"}, method="staged", **options
        )
        np.testing.assert_array_equal(radiance("4.nc"), staged.dataset.radiance)
        with SpectralImage.open("2.nc") as image:
            assert image.attrs["camera"] == "fov=20"

    def test_one_that_is_none_is_refused(self) -> None:
        with pytest.raises(OptionError, match="camera"):
            batch({"render": QUICK, "product": {"camera": ["fov=20", "place=1,2,3"]}})


class TestFaults:
    def test_one_bad_row_is_no_harm_to_the_others(self, counted: dict[str, int]) -> None:
        rows = [
            {"light.light": "A"},
            {"light.light": "no-lamp"},
            {"light.lamp": "A"},
            {"material.left-wall": "no-paint"},
            {"wavelengths": "700:400:20"},
            {"scene": "no-scene.xml"},
            {"until": "error=1%", "concentration.left-wall": 0.5},
            {"method": "staged", "concentration.left-wall": 0.5},
            {"light.light": "D65"},
        ]
        index = batch({"render": QUICK, "rows": rows, "output": "{number}.nc"})
        assert statuses(index) == ["done", *["failed"] * 7, "done"]
        for fault, part in zip(
            index["fault"].values[1:8],
            (
                "no-lamp",
                "'lamp'",
                "no-paint",
                "wavelength",
                "no-scene.xml",
                "changes kept light paths",
                "changes kept light paths",
            ),
            strict=True,
        ):
            assert part in fault
            assert "Traceback" not in fault
        assert sorted(path.name for path in Path().glob("*.nc")) == ["1.nc", "9.nc"]

    def test_what_failed_is_tried_twice_and_by_the_next_call(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from fluorspar.studies import do_group

        tries, render = [], do_group.render_job

        def weak(job: Any, **options: Any) -> Any:
            tries.append(job.seed)
            if tries.count(1) < needed and job.seed == 1:
                raise OSError("the network is away")
            return render(job, **options)

        monkeypatch.setattr(do_group, "render_job", weak)
        study = {"render": QUICK, "product": {"seed": [1, 2]}, "output": "{seed}.nc"}
        needed = 4
        index = batch(study)
        assert tries == [1, 2, 1]
        assert statuses(index) == ["failed", "done"]
        assert "the network is away" in index["fault"].values[0]
        assert statuses(batch(study)) == ["done", "done"]
        assert tries == [1, 2, 1, 1, 1]

    def test_a_full_disk_fails_the_row(self, monkeypatch: pytest.MonkeyPatch) -> None:
        import errno

        from fluorspar.files.writing import write_error

        def full(self: object, path: Path, **options: Any) -> None:
            raise write_error(path, OSError(errno.ENOSPC, "No space left on device"))

        monkeypatch.setattr(SpectralImage, "save", full)
        index = batch({"render": QUICK, "output": "a.nc"})
        assert statuses(index) == ["failed"]
        assert "the disk is full" in index["fault"].values[0]

    @pytest.mark.parametrize(
        ("name", "fault"),
        [
            ("a" * 300 + ".nc", "File name too long"),
            ("{material.left-wall}.png", "File name too long"),
            ("a" * 300 + "/a.nc", "File name too long"),
            ("ball.xml/a.nc", "does not exist"),
            ("folder.nc", "is a directory"),
        ],
    )
    @pytest.mark.parametrize("large", [False, True])
    def test_a_name_that_is_impossible_fails_its_row(
        self, name: str, fault: str, large: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        Path("folder.nc").mkdir()
        if large:
            monkeypatch.setattr("fluorspar.files.memory.available_memory", lambda: 1000)
        mixture = ",".join(["white-85:0.03125"] * 32)
        rows = [{"output": name, "material.left-wall": mixture}, {"light.light": "A", "output": "ok.nc"}]
        index = batch({"render": QUICK, "rows": rows})
        assert statuses(index) == ["failed", "done"]
        assert fault in index["fault"].values[0]
        assert "Traceback" not in index["fault"].values[0]

    def test_what_the_system_refuses_fails_the_row(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from fluorspar.studies import do_group

        render = do_group.render_job

        def refused(job: Any, **options: Any) -> Any:
            if job.seed == 1:
                raise PermissionError(13, "Permission denied", "a.obj")
            return render(job, **options)

        monkeypatch.setattr(do_group, "render_job", refused)
        index = batch(SEEDS)
        assert statuses(index) == ["failed", "done"]
        assert str(index["fault"].values[0]).splitlines() == [
            "the operating system refuses",
            "  where:    a.obj",
            "  got:      Permission denied",
        ]

    def test_two_names_of_one_file_are_refused(self, folder: Path) -> None:
        (folder / "real").mkdir()
        (folder / "linked").symlink_to("real")
        rows = [{"seed": seed, "output": f"{where}/a.nc"} for seed, where in enumerate(("real", "linked"))]
        with pytest.raises(
            OptionError, match=r"(?s)two images have the same file.*real/a\.nc and .*linked/a\.nc"
        ):
            batch({"render": QUICK, "rows": rows})

    def test_a_scene_is_not_overwritten(self) -> None:
        os.rename("ball.xml", "ball.nc")
        with pytest.raises(OptionError, match="is one that is read"):
            batch({"render": QUICK | {"scene": "ball.nc"}, "output": "ball.nc"})

    def test_warnings_are_told(self) -> None:
        with pytest.warns(FluorsparWarning, match="FL11"):
            batch({"render": QUICK | {"light.light": "FL11"}, "output": "a.nc"})


class TestInterrupted:
    @pytest.fixture
    def stop(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[int], Any]]:
        def after(parts: int) -> Any:
            def progress(done: int, whole: int) -> None:
                if done >= parts:
                    raise KeyboardInterrupt

            return progress

        return after  # type: ignore[return-value]

    @pytest.fixture(autouse=True)
    def small_chunks(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """16 of 64 pixels at a time."""
        monkeypatch.setitem(CHUNK, "llvm", 16 * 4)

    @pytest.mark.parametrize("rows", ["light.light", "seed"])
    def test_the_same_call_goes_on(
        self, rows: str, stop: Callable[[int], Any], folder: Path, counted: dict[str, int]
    ) -> None:
        """And the images are those of a batch that was not interrupted, bit for bit."""
        product = {rows: ["A", "D65", "D50"] if rows == "light.light" else [1, 2, 3]}
        study = {"render": QUICK, "product": product}
        batch(study, output="whole-{number}.nc")
        with pytest.warns(FluorsparWarning, match="1 of 3 renders are done; the same command goes on"):
            index = batch(study, output="{number}.nc", progress=stop(1500))
        assert statuses(index) == ["done", "open", "open"]
        assert not Path("2.nc").exists()
        before = dict(counted)
        assert statuses(batch(study, output="{number}.nc")) == ["done"] * 3
        name = "whole_image" if rows == "light.light" else "render_job"
        assert counted[name] - before[name] == 2
        for number in (1, 2, 3):
            np.testing.assert_array_equal(radiance(f"{number}.nc"), radiance(f"whole-{number}.nc"))
        assert not [path for path in folder.iterdir() if path.name.startswith(".")]

    @pytest.mark.parametrize("suffix", [".nc", ".zarr"])
    def test_a_large_image_is_gone_on_with(
        self, suffix: str, stop: Callable[[int], Any], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Expected: of four parts, two are rendered before and two after."""
        if suffix == ".zarr":
            pytest.importorskip("zarr")
        study = {"render": QUICK, "output": f"a{suffix}"}
        monkeypatch.setattr("fluorspar.files.memory.available_memory", lambda: 1000)
        with pytest.warns(FluorsparWarning, match="0 of 1 renders"):
            batch(study, progress=stop(500))
        done: list[int] = []
        batch(study, progress=lambda now, _: done.append(now))
        assert done[:2] == [750, 1000]
        batch(study, output=f"whole{suffix}")
        np.testing.assert_array_equal(radiance(f"a{suffix}"), radiance(f"whole{suffix}"))

    def test_while_light_paths_are_traced(self, stop: Callable[[int], Any]) -> None:
        study = {"render": QUICK, "product": {"light.light": ["A", "D65"]}, "output": "{number}.nc"}
        with pytest.warns(FluorsparWarning, match="0 of 2 renders"):
            index = batch(study, progress=stop(250))
        assert statuses(index) == ["open", "open"]
        assert not list(Path().glob("*.nc"))


@pytest.mark.parametrize("traced", [True, False])
def test_killed(traced: bool, folder: Path) -> None:
    """By kill -9, at any moment: the same call makes the images of a batch that was not, and leaves nothing else."""
    product: dict[str, Any] = {"light.light" if traced else "seed": [1, 2, 3, 4]}
    study = {"render": QUICK, "product": product, "output": "{number}.nc"}
    code = f"""
import os, fluorspar
from fluorspar.files import memory, writing
memory.available_memory = lambda: 1000 if {traced} else 2**40
replace, count = os.replace, 0
def deadly(*names):
    global count
    count += 1
    if count == 4:
        os.kill(os.getpid(), 9)
    replace(*names)
os.replace = deadly
fluorspar.batch({study!r})
"""
    killed = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert killed.returncode == -9, killed.stderr
    left = {path.name for path in folder.iterdir()} - {"ball.xml"}
    assert {"1.nc", "2.nc"} <= left
    assert any(name.startswith(".") for name in left), "something was being written"
    assert statuses(batch(study)) == ["done"] * 4
    assert {path.name for path in folder.iterdir()} == {
        "ball.xml",
        *(f"{number}.nc" for number in range(1, 5)),
    }
    batch(study, output="whole-{number}.nc")
    for number in range(1, 5):
        np.testing.assert_array_equal(radiance(f"{number}.nc"), radiance(f"whole-{number}.nc"))


def test_progress_counts_renders_and_never_goes_back() -> None:
    seen: list[tuple[int, int]] = []
    product = {"light.light": ["A", "D65"], "seed": [1, 2]}
    study = {"render": QUICK, "product": product, "output": "{number}.nc"}
    batch(study, progress=lambda done, whole: seen.append((done, whole)))
    assert seen == sorted(seen)
    assert {whole for _, whole in seen} == {4000}
    assert seen[-1][0] == 4000


def test_dask_is_named_where_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fluorspar.extras.find_spec", lambda name: None)
    with pytest.raises(FluorsparError, match=r'pip install "fluorspar\[cluster\]"'):
        batch({"render": QUICK}, client=object())


def test_zarr_stores_and_folders_named_like_lamps(tmp_path):
    """A folder `A` beside the study is not the lamp A; a store is done as a file is."""
    pytest.importorskip("zarr")
    (tmp_path / "study.toml").write_text(
        """output = "{light}/box-{number:03d}.zarr"
        [render]
        scene = "cornell-box"
        size = "8x8"
        spp = 4
        [product]
        light.light = ["A", "D65"]"""
    )
    for before in (0, 2):
        index = fluorspar.batch(tmp_path / "study.toml")
        assert index["status"].values.tolist() == ["done", "done"]
        assert int(np.isnan(index["seconds"].values).sum()) == before
    assert sorted(path.name for path in tmp_path.glob("*/*.zarr")) == ["box-001.zarr", "box-002.zarr"]


class TestTwoAtOnce:
    @pytest.mark.parametrize("key", ["seed", "light.light"])
    def test_what_another_has_done_meanwhile_is_left_out(
        self, key: str, counted: dict[str, int], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The first of three rows is made, and then all of them by another batch."""
        study = {"render": QUICK, "product": {key: [1, 2, 3]}, "output": "{number}.nc"}
        begun: list[int] = []

        def other(done: int, whole: int) -> None:
            if Path("1.nc").exists() and not begun:
                begun.append(done)
                assert statuses(batch(study)) == ["done"] * 3

        assert statuses(batch(study, progress=other)) == ["done"] * 3
        assert counted["render_job"] + counted["whole_image"] == 3
        assert counted["trace_job"] == (2 if key == "light.light" else 0)

    @pytest.mark.parametrize("key", ["seed", "light.light"])
    def test_two_commands_render_every_row_once(self, key: str, folder: Path) -> None:
        values = "1, 2, 3, 4"
        (folder / "study.toml").write_text(
            f'output = "{{number}}.nc"\nrender = {{ scene = "cornell-box", size = "16x16", spp = 16 }}\n'
            f"product.{key} = [{values}]"
        )
        code = """
import os, time, warnings, fluorspar
from pathlib import Path
from fluorspar.studies import do_group
def noted(name):
    call = getattr(do_group, name)
    def noting(*arguments, **options):
        with open("noted", "a") as file:
            file.write(name + "\\n")
        return call(*arguments, **options)
    setattr(do_group, name, noting)
for name in ("trace_job", "render_job", "whole_image"):
    noted(name)
Path(f"ready-{os.getpid()}").touch()
while len(list(Path().glob("ready-*"))) < 2:
    time.sleep(0.01)
assert fluorspar.batch("study.toml")["status"].values.tolist() == ["done"] * 4
"""
        both = [
            subprocess.Popen([sys.executable, "-W", "ignore", "-c", code], stderr=subprocess.PIPE)
            for _ in "ab"
        ]
        for process in both:
            _, said = process.communicate(timeout=120)
            assert process.returncode == 0, said.decode()
        noted = Path("noted").read_text().split()
        expected = ["render_job"] * 4 if key == "seed" else ["trace_job", *["whole_image"] * 4]
        assert sorted(noted) == expected
