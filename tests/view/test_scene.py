"""A scene that is traced while it is looked at."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import fluorspar
from fluorspar.errors import OptionError
from fluorspar.job import RenderJob
from fluorspar.view.paths_source import NotTraced
from fluorspar.view.questions import View
from fluorspar.view.scene_source import SceneSource, level_sizes
from fluorspar.view.supplies import Supplies
from fluorspar.view.turns import Turns
from fluorspar.view.workspace import Workspace

VIEW = View(source="0")


def source(spp: int = 8) -> SceneSource:
    supplies = Supplies()
    job = RenderJob.of("cornell-box", size=(16, 16), spp=spp, wavelengths="400:700:20", seed=3)
    return SceneSource("cornell-box", job, supplies)


def wait_until(condition: Callable[[], Any]) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_it_is_refined_until_it_is_the_image_of_render() -> None:
    """Bit for bit; before, there are fewer samples, and before these nothing."""
    scene = source()
    workspace = Workspace([scene])
    with pytest.raises(NotTraced):
        workspace.image(VIEW)
    assert workspace.progress()[0]["progress"]["doing"] == "tracing"
    workspace.start()
    wait_until(lambda: scene.progress()["progress"] is None)
    assert workspace.progress() == [{"id": "0", "generation": 2, "progress": None, "error": None}]
    expected = fluorspar.render("cornell-box", size=(16, 16), spp=8, wavelengths="400:700:20", seed=3)
    shown = workspace.image(VIEW).image
    for name in ("radiance", "standard_error"):
        assert np.array_equal(shown.dataset[name], expected.dataset[name])
    assert shown.attrs["spp"] == 8


def test_a_picture_is_made_again_when_there_is_a_better_one() -> None:
    scene = source()
    workspace = Workspace([scene])
    workspace.start()
    wait_until(lambda: scene.progress()["progress"] is None)
    assert scene.paths is not None
    scene.paths = fluorspar.trace(scene.job.scene, spp=4, wavelengths=scene.job.grid)
    first = workspace.image(VIEW)
    assert workspace.image(VIEW) is first
    scene.generation += 1
    scene.paths = fluorspar.trace(scene.job.scene, spp=8, wavelengths=scene.job.grid)
    second = workspace.image(VIEW)
    assert second.generation == first.generation + 1
    assert (first.image.attrs["spp"], second.image.attrs["spp"]) == (4, 8)


def test_errors_of_tracing_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise OptionError("the sky has fallen")

    monkeypatch.setattr("fluorspar.view.scene_source.trace_job", fails)
    scene = source()
    workspace = Workspace([scene])
    workspace.start()
    wait_until(lambda: scene.progress()["progress"] is None)
    assert scene.progress()["error"] == "the sky has fallen"
    with pytest.raises(OptionError, match="the sky has fallen"):
        workspace.image(VIEW)


@pytest.mark.parametrize("traced", [0, 1])
def test_it_ends_where_the_memory_does(monkeypatch: pytest.MonkeyPatch, traced: int) -> None:
    """What is traced stays; what could never fit is not begun."""
    scene = source()
    available = "fluorspar.view.scene_source.available_memory"
    monkeypatch.setattr(available, lambda: 1000 if scene.generation == traced else 2**40)
    scene.start(Turns())
    wait_until(lambda: scene.progress()["progress"] is None)
    assert f"{4 * traced} of 8 samples" in str(scene.progress()["error"])
    assert scene.generation == traced


def test_it_stops_when_the_window_is_closed() -> None:
    scene = source(spp=65536)
    scene.start(Turns())
    wait_until(lambda: scene.generation)
    scene.stop()
    assert scene.progress()["error"] is None
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("tracing")]


def test_levels() -> None:
    """Each has at least twice the samples of the one before; the last one has all."""
    for spp in range(1, 300):
        sizes = level_sizes(spp)
        assert sizes[-1] == spp
        assert all(2 * a <= b for a, b in pairwise(sizes))


def test_those_who_look_come_first() -> None:
    turns = Turns()
    traced = threading.Event()

    def trace() -> None:
        turns.give_way(60)
        traced.set()

    with turns.looking(None):
        thread = threading.Thread(target=trace)
        thread.start()
        assert not traced.wait(0.1)
    thread.join()
    assert traced.is_set()


def test_who_always_looks_does_not_stop_tracing() -> None:
    turns = Turns()
    with turns.looking(None):
        turns.give_way(0.01)
