"""Files of light paths: what was written is read, in parts, and what is damaged is refused."""

from __future__ import annotations

import pickle
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import fluorspar
from fluorspar import LightPaths, SpectralImage, load_paths, trace
from fluorspar.errors import FluorsparWarning, ImageError, PathsError, SceneError
from fluorspar.paths.chunks import CHUNK

OPTIONS: dict[str, Any] = {"size": (12, 8), "spp": 8, "wavelengths": "400:700:20", "seed": 5}
SCENES = ["cornell-box", "still-life"]
# The lines of the ultraviolet lamp on a coarse grid are told of.
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*its light lies between:fluorspar.errors.ApproximationWarning"
)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Written while tracing, in chunks of 16 pixels."""
    folder = tmp_path_factory.mktemp("paths")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(CHUNK, "llvm", 8 * 16)
        for name in SCENES:
            trace(name, **OPTIONS, output=folder / f"{name}.paths")
    return {name: folder / f"{name}.paths" for name in SCENES}


@pytest.fixture(scope="module")
def images() -> dict[str, SpectralImage]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(CHUNK, "llvm", 8 * 16)
        return {name: fluorspar.render(name, **OPTIONS, component_errors=True) for name in SCENES}


def assert_equal(a: SpectralImage, b: SpectralImage) -> None:
    for name in ("radiance", "standard_error", "component_standard_error"):
        assert np.array_equal(a.dataset[name].values, b.dataset[name].values), name


@pytest.mark.parametrize("name", SCENES)
class TestImagesOfAFile:
    def test_the_image_of_render(
        self, name: str, files: dict[str, Path], images: dict[str, SpectralImage]
    ) -> None:
        paths = load_paths(files[name])
        assert len(paths.chunks) == 6
        image = paths.image(component_errors=True)
        assert_equal(image, images[name])
        attrs = [{k: v for k, v in i.attrs.items() if k != "timings"} for i in (image, images[name])]
        assert attrs[0] == attrs[1]

    def test_saved_again(
        self, name: str, files: dict[str, Path], images: dict[str, SpectralImage], tmp_path: Path
    ) -> None:
        load_paths(files[name]).save(tmp_path / "again.paths")
        assert_equal(load_paths(tmp_path / "again.paths").image(component_errors=True), images[name])

    def test_another_process_and_folder(
        self,
        name: str,
        files: dict[str, Path],
        images: dict[str, SpectralImage],
        monkeypatch: Any,
        tmp_path: Path,
    ) -> None:
        monkeypatch.chdir(files[name].parent)
        paths = load_paths(files[name].name)
        monkeypatch.chdir(tmp_path)
        assert_equal(pickle.loads(pickle.dumps(paths)).image(component_errors=True), images[name])

    def test_what_can_be_exchanged_is_known(self, name: str, files: dict[str, Path]) -> None:
        known = trace(name, size=(2, 2), spp=1)
        paths = load_paths(files[name])
        assert [light.name for light in paths.lights] == [light.name for light in known.lights]
        shown = [
            {key: getattr(value, "name", value) for key, value in p.surfaces.items()} for p in (paths, known)
        ]
        assert shown[0] == shown[1]


def test_it_stays_open_when_it_is_replaced(
    files: dict[str, Path], images: dict[str, SpectralImage], tmp_path: Path
) -> None:
    file = tmp_path / "box.paths"
    shutil.copy(files["cornell-box"], file)
    paths = load_paths(file)
    trace("furnace", size=(2, 2), spp=1, output=file)
    assert_equal(paths.image(component_errors=True), images["cornell-box"])


def test_it_stays_open_when_it_is_deleted(
    files: dict[str, Path], images: dict[str, SpectralImage], tmp_path: Path
) -> None:
    file = tmp_path / "box.paths"
    shutil.copy(files["cornell-box"], file)
    paths, size = load_paths(file), file.stat().st_size
    file.unlink()
    assert paths.nbytes == size
    assert "12 x 8 pixels" in repr(paths)
    assert_equal(paths.image(component_errors=True), images["cornell-box"])


def test_no_geometry(files: dict[str, Path]) -> None:
    with pytest.raises(SceneError, match="hold no geometry"):
        load_paths(files["cornell-box"]).job.scene.nodes  # noqa: B018 (a property)


def test_it_says_what_it_is(files: dict[str, Path]) -> None:
    text = repr(load_paths(files["cornell-box"]))
    assert "12 x 8 pixels, 8 samples, seed 5" in text
    assert str(files["cornell-box"]) in text


def test_interrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is finished is kept, the rest of an image is NaN."""
    monkeypatch.setitem(CHUNK, "llvm", 8 * 16)

    def stop(done: int, _: int) -> None:
        if done >= 32:
            raise KeyboardInterrupt

    with pytest.warns(FluorsparWarning, match="the paths of 32 of 96 pixels are kept"):
        paths = trace("cornell-box", **OPTIONS, output=tmp_path / "part.paths", progress=stop)
    for part in (paths, load_paths(tmp_path / "part.paths")):
        assert part.pixels == 32
        assert "32 of 96 pixels traced" in repr(part)
        image = part.image()
        known = np.isfinite(image.total().values).all(axis=-1).ravel()
        assert known[:32].all()
        assert not known[32:].any()
        assert image.attrs["partial"]


def test_nothing_is_kept_of_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object, **__: object) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr("fluorspar.paths.trace.trace_chunks", stop)
    (tmp_path / "a.paths").write_bytes(b"older")
    with pytest.raises(KeyboardInterrupt):
        trace("cornell-box", **OPTIONS, output=tmp_path / "a.paths")
    assert [path.name for path in tmp_path.iterdir()] == ["a.paths"]
    assert (tmp_path / "a.paths").read_bytes() == b"older"


class TestDamage:
    def test_missing(self, tmp_path: Path) -> None:
        with pytest.raises(PathsError, match="no such file"):
            load_paths(tmp_path / "a.paths")

    @pytest.mark.parametrize("content", [b"", b"not HDF5 at all" * 100])
    def test_another_kind_of_file(self, content: bytes, tmp_path: Path) -> None:
        (tmp_path / "a.paths").write_bytes(content)
        with pytest.raises(PathsError, match="holds no light paths"):
            load_paths(tmp_path / "a.paths")

    def test_an_image(self, images: dict[str, SpectralImage], tmp_path: Path) -> None:
        images["cornell-box"].save(tmp_path / "a.nc")
        with pytest.raises(PathsError, match="holds no light paths"):
            load_paths(tmp_path / "a.nc")

    @pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
    def test_truncated(self, share: float, files: dict[str, Path], tmp_path: Path) -> None:
        content = files["cornell-box"].read_bytes()
        (tmp_path / "a.paths").write_bytes(content[: int(share * len(content))])
        with pytest.raises(PathsError, match="damaged"):
            load_paths(tmp_path / "a.paths").image()

    def test_another_version(self, files: dict[str, Path], tmp_path: Path) -> None:
        shutil.copy(files["cornell-box"], tmp_path / "a.paths")
        with h5py.File(tmp_path / "a.paths", "a") as file:
            file.attrs["format_version"] = 99
        with pytest.raises(PathsError, match=r"another version[\s\S]*version 99[\s\S]*version 2"):
            load_paths(tmp_path / "a.paths")

    @pytest.mark.parametrize("version", ["1", 1.5, np.array([1, 2])])
    def test_attributes_of_another_kind(self, version: Any, files: dict[str, Path], tmp_path: Path) -> None:
        """Text of any length, as an unreleased version wrote it, or what is no number."""
        shutil.copy(files["cornell-box"], tmp_path / "a.paths")
        with h5py.File(tmp_path / "a.paths", "a") as file:
            file.attrs.update({"format": "fluorspar light paths", "fluorspar": "0.0.9"})
            file.attrs["format_version"] = version
        with pytest.raises(PathsError, match=r"another version[\s\S]*written by Fluorspar 0\.0\.9"):
            load_paths(tmp_path / "a.paths")

    @pytest.mark.parametrize("name", ["rows", "says", "numbers", "used"])
    def test_another_number(self, name: str, files: dict[str, Path], tmp_path: Path) -> None:
        """A checksum tells, where nothing else would."""
        shutil.copy(files["cornell-box"], tmp_path / "a.paths")
        with h5py.File(tmp_path / "a.paths", "a") as file:
            array = file["chunks"][sorted(file["chunks"])[3]][name]
            array[...] = np.roll(array[...], 1)
        paths = load_paths(tmp_path / "a.paths")
        with pytest.raises(PathsError, match="a checksum is wrong, in part 4 of 6"):
            paths.image()

    @pytest.mark.parametrize("gone", ["record", "chunks", "chunks/2", "arrays", "chunks/1/numbers"])
    def test_a_part_is_gone(self, gone: str, files: dict[str, Path], tmp_path: Path) -> None:
        shutil.copy(files["cornell-box"], tmp_path / "a.paths")
        with h5py.File(tmp_path / "a.paths", "a") as file:
            group, _, rest = gone.partition("/")
            number, _, name = rest.partition("/")  # of a chunk
            chunk = sorted(file["chunks"])[int(number)] if number else ""
            del file["/".join(filter(None, (group, chunk, name)))]
        with pytest.raises(PathsError, match="damaged"):
            load_paths(tmp_path / "a.paths").image()

    def test_a_class_that_is_none_of_ours(self, files: dict[str, Path], tmp_path: Path) -> None:
        shutil.copy(files["cornell-box"], tmp_path / "a.paths")
        with h5py.File(tmp_path / "a.paths", "a") as file:
            text = bytes(file["record"][...]).replace(b'"class": "Spectrum"', b'"class": "Path"')
            del file["record"]
            file["record"] = np.frombuffer(text, np.uint8)
        with pytest.raises(PathsError, match="damaged"):
            load_paths(tmp_path / "a.paths")


def test_a_folder_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="directory"):
        trace("cornell-box", **OPTIONS, output=tmp_path / "none" / "a.paths")


def test_paths_in_memory_can_be_saved(tmp_path: Path, images: dict[str, SpectralImage]) -> None:
    paths = trace("cornell-box", **OPTIONS)
    assert isinstance(paths, LightPaths)
    paths.save(tmp_path / "a.paths")
    assert np.array_equal(
        load_paths(tmp_path / "a.paths").image().total().values, paths.image().total().values
    )
