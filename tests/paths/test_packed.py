"""Light paths packed: unpacked they are what they were, bit for bit, to who sweeps them; damage is found."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fluorspar.job import RenderJob
from fluorspar.paths.chunks import trace_chunks
from fluorspar.paths.log import BLOCK, END, ENTRIES, OF_TERMS, Chunk, Log
from fluorspar.paths.numbering import count_rows
from fluorspar.paths.packed import ARRAYS, PackedChunk, pack, unpack
from fluorspar.paths.tracing import tracer

UNCHANGED = np.zeros(0, np.uint32)


@pytest.fixture(scope="module")
def pool() -> Iterator[Executor]:
    with ThreadPoolExecutor(2) as executor:
        yield executor


def random_log(terms: int, lights: int, rows: int, heights: tuple[int, ...] = (5, 9, 0, 3)) -> Log:
    """Blocks of several heights, with room between them; what lanes have not used is nonsense."""
    rng = np.random.default_rng(terms)
    room = max(heights) + 2
    entries = room * len(heights)
    values: dict[str, Any] = {}
    for name, kind in ENTRIES.items():
        shape = (terms, entries, BLOCK) if terms > 1 and name in OF_TERMS else (entries, BLOCK)
        values[name] = (
            rng.uniform(0.1, 2, shape).astype(kind)
            if kind is np.float32
            else rng.integers(lights if name.endswith("light") else rows, size=shape).astype(kind)
        )
    for name in ("sampled", "direct", "weight"):
        kept = rng.random(values[name].shape)
        values[name][kept < 0.4] = 0
        if name == "weight":
            values[name][kept > 0.7] = 1
    values["row"][rng.random(values["row"].shape) < 0.2] = END
    begin = room * np.arange(len(heights))
    used = np.stack([rng.integers(0, height + 1, BLOCK) for height in heights]).astype(np.int32)
    used[:, 0] = heights
    for name in values:
        if lights == 1 and name.endswith("light"):
            values[name] = values[name][:0]
    return Log(
        **values,
        strips=np.stack([begin, begin + heights], axis=1),
        goes_on=rng.integers(-1, 4 * BLOCK, len(heights) * BLOCK).astype(np.int32),
        used=used.ravel(),
    )


def chunk_of(log: Log) -> Chunk:
    return Chunk(7, len(log.used), 1, log)


@pytest.mark.parametrize("terms", [1, 3])
@pytest.mark.parametrize("lights", [1, 5])
@pytest.mark.parametrize("rows", [3, 255, 256, 70_000])
def test_unpacked_it_is_what_it_was(terms: int, lights: int, rows: int, pool: Executor) -> None:
    log = random_log(terms, lights, rows)
    packed = pack(chunk_of(log), rows, pool)
    assert not packed.fault(rows, lights)
    found, expected = unpack(packed, UNCHANGED, 0, pool).log, log.compact()
    assert np.array_equal(found.strips, expected.strips)
    assert np.array_equal(found.goes_on, log.goes_on)
    heights = np.diff(expected.strips)[:, 0]
    of_block = np.repeat(np.arange(len(heights)), heights)
    within = np.arange(len(of_block)) - np.repeat(expected.strips[:, 0], heights)
    used = within[:, np.newaxis] < log.used.reshape(-1, BLOCK)[of_block]
    lit = (expected.direct.reshape(terms, -1, BLOCK) != 0).any(axis=0)
    for name in ENTRIES:
        there = used
        if name.endswith("light"):  # the light of nothing has no meaning
            there = used & (expected.sampled != 0 if name == "sampled_light" else lit)
            if lights == 1:
                assert not getattr(found, name).size
                continue
        assert np.array_equal(getattr(found, name)[..., there], getattr(expected, name)[..., there]), name


@pytest.mark.parametrize("scene", ["cornell-box", "still-life"])
def test_strips_of_any_length_make_the_same(
    scene: str, pool: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: a file does not depend on what was traced before, by which the tracer judges how long strips shall be.

    In short ones all lanes go on elsewhere, some of them several times.
    """
    job = RenderJob.of(scene, size=(10, 9), spp=70, variant="llvm")
    rows = count_rows(job.scene)[0]
    packed = []
    for room in (1.0, 30.0):
        monkeypatch.setattr(tracer, "_ROOM", room)
        (chunk,) = trace_chunks(job, kept=True)
        packed.append(pack(chunk, rows, pool))
        assert (chunk.log.goes_on >= 0).any() == (room == 1)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(packed[0], name), getattr(packed[1], name))


def test_rows_are_exchanged(pool: Executor) -> None:
    log = random_log(2, 2, 40)
    packed = pack(chunk_of(log), 40, pool)
    row_of = np.array([END, *range(100, 129)], dtype=np.uint32)
    before, after = unpack(packed, UNCHANGED, 0, pool).log.row, unpack(packed, row_of, 1000, pool).log.row
    expected = np.where(
        before < 30, row_of[np.minimum(before, 29)], np.where(before == END, END, before + 1000)
    )
    assert np.array_equal(after, expected)


def test_size_in_the_cornell_box(pool: Executor) -> None:
    """A third of the log, and less than 60 bytes a sample."""
    job = RenderJob.of("cornell-box", size=(64, 64), spp=16)
    for chunk in trace_chunks(job, kept=True):
        packed = pack(chunk, count_rows(job.scene)[0], pool)
        assert packed.nbytes < 30 * 64 * 64 * 16
        assert packed.nbytes < chunk.log.compact().nbytes / 3


def damaged(packed: PackedChunk, name: str) -> PackedChunk:
    array = getattr(packed, name).copy()
    if name == "strips":
        array[1] += 1
    elif name in ("used", "goes_on"):
        array[-1] = 30_000
    elif name == "starts":
        array[-1] += 1
    elif name == "rows":
        array[0, 0, 0] = 50
    elif name == "says":
        array[0, 0, 0] ^= 1
    elif name == "lights":
        array[0] = 9
    else:
        array = array[:-1]
    return replace(packed, **{name: array})


@pytest.mark.parametrize("name", ["rows", "says", "numbers", "lights", "strips", "goes_on", "used", "starts"])
def test_damage_is_found(name: str, pool: Executor) -> None:
    packed = pack(chunk_of(random_log(1, 3, 40)), 40, pool)
    assert damaged(packed, name).fault(40, 3)
