"""How good an image is to become: reading the target, and how large the next pass is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fluorspar import load_scene, render
from fluorspar.errors import OptionError
from fluorspar.job import LARGEST_SEED, RenderJob
from fluorspar.scene.settings import MOST_SAMPLES
from fluorspar.until import Until, next_samples


@pytest.mark.parametrize(
    ("text", "measure", "target"),
    [
        ("error=1%", "error", 0.01),
        ("error=0.01", "error", 0.01),
        ("p95=2.5%", "p95", 0.025),
        ("p95 = 1e-3", "p95", 0.001),
        ("error=.5 %", "error", 0.005),
    ],
)
def test_targets(text: str, measure: str, target: float) -> None:
    read = Until.parse(text)
    assert read is not None
    assert (read.measure, read.seconds) == (measure, math.inf)
    assert read.target == pytest.approx(target, rel=1e-12)
    assert Until.parse(str(read)) == read


@pytest.mark.parametrize(
    ("text", "seconds"), [("90", 90), ("90s", 90), ("10m", 600), ("1.5h", 5400), (2.5, 2.5), (3, 3)]
)
def test_times(text: str | float, seconds: float) -> None:
    read = Until.parse("error=1%", text)
    assert read is not None
    assert read.seconds == seconds


def test_nothing_asked_for() -> None:
    assert Until.parse(None) is None


@pytest.mark.parametrize(
    "text",
    ["1%", "error", "error=", "error=0", "error=-1%", "error=1", "error=100%", "error=1..2%", "p90=1%",
     "error=nan", "error=1%%", 0.01, True],
)  # fmt: skip
def test_what_is_no_target(text: Any) -> None:
    with pytest.raises(OptionError, match=r"(?s)target.*not readable.*got:.*expected: error=FRACTION.*p95="):
        render("furnace", until=text)


@pytest.mark.parametrize("text", ["", "0", "-5s", "soon", "10 minutes", "1h30m", 0, math.inf, math.nan])
def test_what_is_no_time(text: Any) -> None:
    with pytest.raises(OptionError, match=r"(?s)longest time.*not readable.*got:.*expected: a time above 0"):
        render("furnace", until="error=1%", max_time=text)


def test_a_time_without_a_target() -> None:
    with pytest.raises(OptionError, match="time is given without a target"):
        render("furnace", max_time="10m")


def test_the_staged_method_renders_no_passes() -> None:
    with pytest.raises(
        OptionError, match=r"(?s)staged method cannot render until an error.*until error=1%.*paths"
    ):
        render("furnace", until="error=1%", method="staged")


class TestNextPass:
    """Few passes, hardly more samples than it takes, never more than there may be."""

    @pytest.mark.parametrize("first", [1, 3, 16, 64, 1000])
    @pytest.mark.parametrize("wanted", [10, 65, 1000, 3000, 60_000])
    def test_all_passes(self, first: int, wanted: int) -> None:
        sizes = [first]
        while sum(sizes) < wanted:
            sizes.append(next_samples(first, sum(sizes), wanted))
            assert math.log2(sizes[-1] / first).is_integer()
            assert sizes[-1] <= max(first, sum(sizes[:-1]))
        assert sum(sizes) <= max(first, 1.1 * wanted, wanted + first)
        assert len(sizes) <= 2 + 2 * math.log2(max(wanted / first, 1))

    def test_a_single_sample_says_nothing_of_errors(self) -> None:
        assert next_samples(1, 1, math.inf) == 2
        assert next_samples(1, 1, math.nan) == 2

    @pytest.mark.parametrize(
        ("affordable", "size"), [(0, 0), (-1, 0), (15, 0), (16, 16), (70, 64), (1e9, 512)]
    )
    def test_what_is_affordable(self, affordable: float, size: int) -> None:
        assert next_samples(16, 512, 1e6, affordable) == size

    def test_there_are_no_more_samples(self) -> None:
        assert next_samples(1, MOST_SAMPLES - 1, 1e9) == 1
        assert next_samples(2, MOST_SAMPLES - 1, 1e9) == 0
        assert next_samples(MOST_SAMPLES, MOST_SAMPLES, math.inf) == 0


def test_streams_of_random_numbers_are_those_of_no_other_seed() -> None:
    """The words that numbers are made of differ for any two of seed, stream, chunk and use, where streams are > 0."""
    scene = load_scene("furnace")
    seeds = [0, 1, 2, 2**32 - 1, 2**32, 2**32 + 1, 3 * 2**32, 2**62, LARGEST_SEED]
    states = [
        tuple(
            np.random.SeedSequence(
                (RenderJob(scene, seed=seed, stream=stream).seed_of_stream, chunk, use)
            ).pool
        )
        for seed in seeds
        for stream in (1, 2, 3)
        for chunk in (0, 1, 2)
        for use in (0, 1)
    ]
    plain = {
        tuple(np.random.SeedSequence((seed, chunk, use)).pool)
        for seed in seeds
        for chunk in (0, 1, 2)
        for use in (0, 1)
    }
    assert len(set(states)) == len(states)
    assert not plain & set(states)
    assert RenderJob(scene, seed=7).seed_of_stream == 7
