"""One image on two workers is that of one process, bit for bit."""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from distributed import Client

import fluorspar
from fluorspar.cluster import dispatch
from fluorspar.errors import FluorsparWarning, OptionError
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.paths import chunks, paths_file, trace

OPTIONS: dict[str, Any] = {"size": (48, 32), "spp": 16, "seed": 5, "variant": "llvm"}


def assert_same(a: SpectralImage, b: SpectralImage) -> None:
    assert set(a.dataset.data_vars) == set(b.dataset.data_vars)
    for name, values in a.dataset.data_vars.items():
        np.testing.assert_array_equal(values.values, b.dataset[name].values)
    different = {key for key, value in a.attrs.items() if value != b.attrs[key]}
    assert different <= {"timings"}


@pytest.mark.usefixtures("small_runs")
@pytest.mark.parametrize("scene", ["cornell-box", "still-life"])
def test_two_workers_make_the_same_image(scene: str, client: Client, tmp_path: Path) -> None:
    """Expected: the same bits in memory and in a file, with errors of components, matte and with textures."""
    here = fluorspar.render(scene, **OPTIONS, component_errors=True)
    done: list[tuple[int, int]] = []
    file = tmp_path / "a.nc"
    there = fluorspar.render(
        scene,
        **OPTIONS,
        component_errors=True,
        client=client,
        output=file,
        progress=lambda a, b: done.append((a, b)),
    )
    assert_same(here, there)
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]
    assert len(done) == 6
    assert done == sorted(done)
    assert done[-1] == (48 * 32, 48 * 32)


def test_it_stays_in_memory_without_a_file(client: Client) -> None:
    assert_same(fluorspar.render("furnace", **OPTIONS), fluorspar.render("furnace", **OPTIONS, client=client))


def test_a_large_run_comes_in_parts(client: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the same image, of which the client holds only a part at a time."""
    here = fluorspar.render("cornell-box", **OPTIONS)
    monkeypatch.setattr(dispatch, "_TASK", 2208 * 500)
    done: list[int] = []
    there = fluorspar.render(
        "cornell-box",
        **OPTIONS,
        client=client,
        output=tmp_path / "a.nc",
        progress=lambda now, _: done.append(now),
    )
    assert done == [500, 1000, 1500, 1536]
    assert_same(here, there)


@pytest.mark.usefixtures("small_runs")
def test_of_large_results_a_worker_holds_one(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: no task is begun for which two workers would have to hold more."""
    monkeypatch.setattr(dispatch, "_TASK", 2208 * 100)
    begun: list[Any] = []

    def submit(do: Any, *given: Any, own: Any = client.submit, **options: Any) -> Any:
        begun.extend([given] if do is dispatch.do_runs else [])
        return own(do, *given, **options)

    monkeypatch.setattr(client, "submit", submit)
    held: list[int] = []
    fluorspar.render(
        "furnace", **OPTIONS, client=client, progress=lambda now, _: held.append(len(begun) - now // 256)
    )
    assert len(begun) == 6
    assert max(held) <= 2


def test_workers_forget_the_results(client: Client) -> None:
    fluorspar.render("furnace", **OPTIONS, client=client)
    until = time.monotonic() + 10
    while held := [key for keys in client.has_what().values() for key in keys]:
        assert time.monotonic() < until, held


def test_what_a_worker_warns_of_is_told_once(client: Client, tmp_path: Path, small_runs: None) -> None:
    """A small object far away: the rays to it begin and end inexactly, which is found when the scene is built."""
    path = tmp_path / "far.xml"
    path.write_text(
        """<scene version="3.0.0"> <sensor type="perspective"> <film type="hdrfilm"> <rfilter type="box"/> </film>
        <transform name="to_world"> <lookat origin="1000000, 0, 5" target="1000000, 0, 0" up="0, 1, 0"/> </transform>
        </sensor> <emitter type="constant"/> <shape type="sphere"> <point name="center" x="1000000" y="0" z="0"/>
        <bsdf type="diffuse"/> </shape> </scene>"""
    )
    with pytest.warns(FluorsparWarning) as here:
        fluorspar.render(str(path), **OPTIONS)
    with pytest.warns(FluorsparWarning) as there:
        fluorspar.render(str(path), **OPTIONS, client=client)
    assert [str(each.message) for each in there] == [str(each.message) for each in here]


def test_what_workers_do_not_do_is_refused(client: Client) -> None:
    with pytest.raises(OptionError, match="render without a scheduler"):
        fluorspar.render("furnace", **OPTIONS, method="staged", client=client)


@pytest.mark.usefixtures("small_runs")
def test_passes_and_samples_on_workers(client: Client, tmp_path: Path) -> None:
    """Expected: passes, an interruption, and more samples end with the bits that one process makes."""
    here, there = tmp_path / "here.nc", tmp_path / "there.nc"
    options = {**OPTIONS, "until": "error=20%"}
    fluorspar.render("cornell-box", **options, output=here)

    def interrupt(done: int, whole: int) -> None:
        raise KeyboardInterrupt

    with pytest.warns(FluorsparWarning, match="interrupted"):
        fluorspar.render("cornell-box", **options, output=there, client=client, progress=interrupt)
    fluorspar.render("cornell-box", **options, output=there, client=client, resume=True)
    assert_same(SpectralImage.open(here), SpectralImage.open(there))
    more = {**OPTIONS, "spp": None, "more_samples": 8}
    images = [
        fluorspar.render("cornell-box", **more, output=file, client=workers)
        for file, workers in ((here, None), (there, client))
    ]
    assert_same(*images)


@pytest.mark.usefixtures("small_runs")
def test_tasks_become_smaller_at_the_end(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: 64 runs, the last tasks of one run each, so that no worker waits long for another."""
    sizes: list[int] = []

    def submit(do: Any, *given: Any, own: Any = client.submit, **options: Any) -> Any:
        if do is dispatch.do_runs:
            sizes.append(len(given[1]))
        return own(do, *given, **options)

    monkeypatch.setattr(client, "submit", submit)
    fluorspar.render("furnace", **{**OPTIONS, "size": (128, 128)}, client=client)
    assert sum(sizes) == 64
    assert sizes == sorted(sizes, reverse=True)
    assert (sizes[0], sizes[-8:]) == (8, [1] * 8)


@pytest.mark.usefixtures("small_runs")
@pytest.mark.parametrize("scene", ["cornell-box", "still-life"])
def test_two_workers_trace_the_same_paths(scene: str, client: Client, tmp_path: Path) -> None:
    """Expected: a file with the same content, and the same paths in memory."""
    here, there = tmp_path / "here.paths", tmp_path / "there.paths"
    fluorspar.trace(scene, **OPTIONS, output=here)
    done: list[int] = []
    fluorspar.trace(scene, **OPTIONS, output=there, client=client, progress=lambda now, _: done.append(now))
    assert content_of(here) == content_of(there)
    assert len(done) == 6
    assert done[-1] == 48 * 32
    traced = fluorspar.trace(scene, **OPTIONS, client=client)
    assert [chunk.first_pixel for chunk in traced.chunks] == sorted({c.first_pixel for c in traced.chunks})
    assert_same(traced.image(), fluorspar.load_paths(here).image())


@pytest.mark.usefixtures("small_runs")
@pytest.mark.parametrize("end", [KeyboardInterrupt, ZeroDivisionError])
def test_paths_that_came_in_any_order_are_gone_on_with(
    end: type[BaseException], client: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: what came before the end, the last runs first, is not traced again; gaps are NaN in an image."""
    monkeypatch.setattr(paths_file, "SYNC_EVERY", 0.0)
    whole, path = tmp_path / "whole.paths", tmp_path / "a.paths"
    fluorspar.trace("cornell-box", **OPTIONS, output=whole)
    with monkeypatch.context() as patch:
        patch.setattr(trace, "runs_of", lambda job: chunks.runs_of(job)[::-1])

        def stop(done: int, pixels: int) -> None:
            if done == 768:
                raise end

        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "interrupted: the paths of 768 of 1536 pixels")
            try:
                partial = fluorspar.trace("cornell-box", **OPTIONS, output=path, progress=stop)
            except ZeroDivisionError:
                assert not path.exists()
            else:
                assert partial.pixels == 768
                radiance = partial.image().dataset["radiance"].values.reshape(7, 1536, 69)
                expected = fluorspar.load_paths(whole).image().dataset["radiance"].values.reshape(7, 1536, 69)
                there = ~np.isnan(radiance[0, :, 0])
                assert there.sum() == 768
                assert not there[:768].any()
                np.testing.assert_array_equal(radiance[:, there], expected[:, there])
    done: list[int] = []
    fluorspar.trace(
        "cornell-box",
        **OPTIONS,
        output=path,
        client=client,
        resume=True,
        progress=lambda now, _: done.append(now),
    )
    assert done == [1024, 1280, 1536]
    assert content_of(path) == content_of(whole)
    assert {each.name for each in tmp_path.iterdir()} == {"a.paths", "whole.paths"}


def content_of(path: Path) -> dict[str, Any]:
    """All arrays and attributes of a file of light paths, as bytes."""
    content: dict[str, Any] = {}

    def note(name: str, item: Any) -> None:
        content[name] = {key: np.asarray(value).tobytes() for key, value in item.attrs.items()}
        if isinstance(item, h5py.Dataset):
            content[name]["data"] = (item.dtype.str, item.shape, item[...].tobytes())

    with h5py.File(path) as file:
        note("/", file)
        file.visititems(note)
    return content
