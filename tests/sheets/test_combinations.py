"""Which combinations a sheet has, what they are called, and in which order they are computed."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from fluorspar import Material, Spectrum
from fluorspar.errors import OptionError
from fluorspar.sheets.combinations import axes_of, count_combinations, in_order


def test_dimensions_have_the_names_of_the_ids() -> None:
    axes = axes_of({"lamp": ["D65"]}, {"wall": ["poster-red"]}, {"ball": [1]})
    assert [axis.name for axis in axes] == ["lamp", "wall", "ball"]


def test_names_that_would_be_taken_twice_say_what_is_varied() -> None:
    axes = axes_of({"lamp": ["D65"], "x": ["A"]}, {"lamp": ["poster-red"]}, {"lamp": [1], "wall": [0]})
    names = [axis.name for axis in axes]
    assert names == ["lamp light", "x light", "lamp material", "lamp concentration", "wall"]


def test_settings_in_words() -> None:
    grey = Material("grey", Spectrum.constant(0.5))
    lights = ["D65", 0.5, ("A", 2), Spectrum.constant(1.0, "even"), Spectrum.constant(2.0, "even"), 0.5]
    axes = axes_of({"lamp": lights}, {"wall": [grey, "a:0.3,b:0.7"]}, {"wall": [0, 0.5]})
    assert axes[0].labels == ("D65", "x 0.5", "A x 2", "even", "even (2)", "x 0.5 (2)")
    assert axes[1].labels == ("grey", "a:0.3,b:0.7")
    assert axes[2].labels == (0.0, 0.5)


def test_all_are_there_and_those_that_differ_in_lights_follow_one_another() -> None:
    axes = axes_of({"lamp": ["D65", "A"], "sky": [0, 1, 2]}, {"wall": ["red", "green"]}, {"wall": [0, 1]})
    order = list(in_order(axes))
    assert len(order) == len({numbers for numbers, _ in order}) == count_combinations(axes) == 24
    surfaces = [numbers[2:] for numbers, _ in order]
    assert sum(one != other for one, other in pairwise(surfaces)) == 3
    numbers, changes = order[-1]
    assert numbers == (1, 2, 1, 1)
    assert changes == {
        "lights": {"lamp": "A", "sky": 2},
        "materials": {"wall": "green"},
        "concentration": {"wall": 1},
    }


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((None, None, None), "nothing to combine"),
        (({}, {}, {}), "nothing to combine"),
        (({"lamp": []}, None, None), "list of settings is empty"),
        (({"lamp": "D65"}, None, None), r"(?s)not a list.*lights lamp.*\['D65'\]"),
        (({"lamp": ("D65", 0.5)}, None, None), "not a list"),
        ((None, None, {"wall": 0.5}), r"(?s)not a list.*concentration=\{'wall': \[0.5\]\}"),
        ((["D65", "A"], None, None), r"(?s)lights are not readable.*a dict"),
    ],
)
def test_no_combinations_are_an_error(given: tuple[Any, ...], says: str) -> None:
    with pytest.raises(OptionError, match=says):
        axes_of(*given)
