"""Which light next-event estimation goes to: probabilities, and their densities."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from fluorspar.scene.settings import Settings
from fluorspar.scene.variants import TRACE_VARIANTS, use_variant

COUNT = 1 << 14


@pytest.fixture(autouse=True)
def variant() -> Iterator[None]:
    with use_variant(TRACE_VARIANTS["llvm"]):
        yield


def panels(count: int) -> Any:
    """Squares that shine down on a floor, 4 apart."""
    import mitsuba as mi

    T = mi.ScalarTransform4f
    lamps = {
        f"panel-{number}": {
            "type": "rectangle",
            "to_world": T().translate([4 * number, 0, 2]).rotate([1, 0, 0], 180),
            "emitter": {"type": "area", "radiance": 1.0},
        }
        for number in range(count)
    }
    floor = {"type": "rectangle", "to_world": T().translate([0, 0, -1]).scale(50)}
    return mi.load_dict({"type": "scene", **lamps, "floor": floor})


def points(*place: float) -> Any:
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, COUNT)
    si.p = mi.Point3f(*place)
    return si


def numbers() -> Any:
    """Random numbers of as many pixels."""
    import drjit as dr
    import mitsuba as mi

    from fluorspar.paths.tracing.numbers import PathNumbers

    of_paths = PathNumbers(Settings(COUNT, 1, 1), 0)
    return of_paths.at(dr.arange(mi.UInt32, COUNT), mi.UInt32(0), mi.UInt32(1))


def test_lights_are_drawn_as_often_as_their_densities_say() -> None:
    import drjit as dr
    import mitsuba as mi

    from fluorspar.paths.tracing.light_choice import light_choice

    scene, si = panels(9), points(9.0, 1.0, 0.0)
    choice = light_choice(scene, np.array([1.0, 1, 1, 1, 0, 5, 1, 1, 1]))
    ds, _ = choice.sample(si, numbers(), mi.Bool(True))
    alone = ds.emitter.pdf_direction(si, ds)
    drawn = np.array(dr.reinterpret_array(mi.UInt32, ds.emitter))
    probable = np.array(ds.pdf / alone)
    np.testing.assert_allclose(np.array(choice.pdf(si, ds, mi.Bool(True))), np.array(ds.pdf), rtol=1e-5)
    emitters, often = np.unique(drawn, return_counts=True)
    expected = COUNT * np.array([probable[drawn == emitter].mean() for emitter in emitters])
    assert len(emitters) == 9  # also the dark one
    assert expected.sum() == pytest.approx(COUNT, rel=1e-5)
    assert (np.abs(often - expected) < 4.5 * np.sqrt(expected)).all()


def test_near_and_bright_lights_are_more_probable() -> None:
    import drjit as dr
    import mitsuba as mi

    from fluorspar.paths.tracing.light_choice import light_choice

    def share(place: int, power: dict[int, float]) -> float:
        """How often the panel above a place of the floor is drawn there."""
        si = points(4.0 * place, 0.0, -1.0)
        panel = [int(emitter.get_shape().id()[-1]) for emitter in scene.emitters()]
        choice = light_choice(scene, np.array([power.get(number, 1.0) for number in panel]))
        ds, _ = choice.sample(si, numbers(), mi.Bool(True))
        return float(np.mean(np.array(dr.abs(ds.p.x - 4 * place) <= 1.01)))

    scene = panels(9)
    assert share(4, {}) > 0.4
    assert share(4, {4: 10.0}) > 0.75
    assert 0.05 < share(4, {4: 0.0}) < 0.3


def test_few_lights_are_drawn_as_mitsuba_does() -> None:
    import mitsuba as mi

    from fluorspar.paths.tracing.light_choice import light_choice

    scene, si = panels(4), points(5.0, 1.0, 0.0)
    ds, _ = light_choice(scene, np.arange(4.0)).sample(si, numbers(), mi.Bool(True))
    stock, _ = scene.sample_emitter_direction(si, numbers().two(0), False, True)
    assert (np.array(ds.d) == np.array(stock.d)).all()


@pytest.mark.parametrize(
    "lights",
    [
        {f"sun-{n}": {"type": "directional", "direction": [n, 0, -1]} for n in range(6)},
        {f"point-{n}": {"type": "point", "position": [0, 0, 1]} for n in range(6)},
        {f"point-{n}": {"type": "point", "position": [1e6 * n, 0, 1]} for n in range(5)}
        | {"sky": {"type": "constant"}},
    ],
)
@pytest.mark.parametrize("floor", [{}, {"floor": {"type": "rectangle"}}])
def test_probabilities_are_finite_wherever_lights_are(lights: dict[str, Any], floor: dict[str, Any]) -> None:
    import mitsuba as mi

    from fluorspar.paths.tracing.light_choice import light_choice

    choice = light_choice(mi.load_dict({"type": "scene", **lights, **floor}), np.zeros(6))
    for place in ((0.0, 0.0, 0.0), (1e9, -1e9, 3.0)):
        pdf = np.array(choice.sample(points(*place), numbers(), mi.Bool(True))[0].pdf)
        assert np.isfinite(pdf).all()
        assert (pdf > 0).all()
