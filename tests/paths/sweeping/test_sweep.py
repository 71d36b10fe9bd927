"""The sweep against a slow one: invented light paths, spectra in plain double precision.

Rationale
    The compiled sweep reads an interleaved log, sums luminescence register by register, knows when nothing luminesced
    yet, and sums samples before it makes components of them. `reference` below does none of that: it follows the
    equations of docs/one-pass.md, one path after another, with full matrices.
Expected
    Equal to single precision for any paths, real ones or not; what the log leaves undefined is filled with nonsense
    here, so reading it shows.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import astuple, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fluorspar.bispectral.conversions import stokes_weights
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.image.pixels import Pixels
from fluorspar.paths.log import BLOCK, END, ENTRIES, Chunk, Log, lanes_per_pixel
from fluorspar.paths.sweeping.spectral_tables import SpectralTables, padded, spectral_tables
from fluorspar.paths.sweeping.sweep import sweep
from fluorspar.scene.sample_sets import batch_count
from fluorspar.spectral.wavelengths import Wavelengths

Array = NDArray[np.float64]

GRID = Wavelengths(400, 680, 20)  # 15 bands, so that one is padding
N = len(GRID)


@dataclass
class Vertex:
    """One vertex as the method sees it: E_D = w L_a + f h L_b."""

    row: int
    w: float
    a: int
    h: float
    b: int
    f: float


def dye(rng: np.random.Generator, lo: int, hi: int) -> Array:
    """A spectrum that is zero outside bands lo to hi."""
    values = np.zeros(N)
    values[lo:hi] = rng.uniform(0.1, 1, hi - lo)
    return values


def make_materials(stokes: str = "half", *, full: bool = True) -> list[DonaldsonMatrix]:
    """Plain, one dye with overlap, one without, two dyes, a full matrix (with noise above the diagonal)."""
    rng = np.random.default_rng(1)

    def factors(*bands: tuple[int, int, int, int]) -> DonaldsonMatrix:
        alpha = [0.3 * dye(rng, a, b) for a, b, _, _ in bands]
        beta = [0.003 * dye(rng, c, d) for _, _, c, d in bands]
        return DonaldsonMatrix(GRID, rng.uniform(0.1, 0.6, N), alpha, beta, stokes=stokes)  # type: ignore[arg-type]

    matrix = 0.001 * np.tril(rng.uniform(0, 1, (N, N)), -1) + 1e-5 * np.triu(rng.uniform(0, 1, (N, N)), 1)
    made = [
        DonaldsonMatrix(GRID, rng.uniform(0.2, 0.9, N), stokes=stokes),  # type: ignore[arg-type]
        factors((5, 12, 2, 9)),
        factors((9, 15, 0, 6)),
        factors((4, 15, 0, 10), (0, 15, 0, 15)),
    ]
    return [*made, replace(made[0], luminescent=matrix)] if full else made


class Paths:
    """Invented light paths, and the log that a tracer would have written of them."""

    def __init__(
        self, pixels: int, spp: int, *, lights: int, rows: int, longest: int = 40, seed: int = 0
    ) -> None:
        rng = np.random.default_rng(seed)
        self.pixels, self.spp, self.lights = pixels, spp, lights
        self.paths: list[tuple[float, int, list[Vertex]]] = []
        for _ in range(pixels * spp):
            n = int(rng.integers(0, rng.choice([0, 1, 2, 3, 8, longest]) + 1))
            vertices = [
                Vertex(
                    row=int(rng.integers(rows)),
                    w=rng.uniform(0, 1) * (rng.random() < 0.8),
                    a=int(rng.integers(lights)),
                    h=rng.uniform(0, 1) * (rng.random() < 0.3),
                    b=int(rng.integers(lights)),
                    f=rng.uniform(1.0, 1.5) if rng.random() < 0.5 else 1.0,
                )
                for _ in range(n)
            ]
            if n and rng.random() < 0.5:
                vertices[-1].f, vertices[-1].h = 0.0, 0.0  # roulette
            seen = rng.uniform(0, 1) * (rng.random() < 0.3)
            self.paths.append((seen, int(rng.integers(lights)), vertices))

    def chunk(self, height: int = 1000) -> Chunk:
        """The log, in strips of `height` entries or less; what has no meaning is nonsense."""
        log = log_of([list(self._entries(*lane)) for lane in self._lanes()], height)
        if self.lights == 1:
            log = log._replace(direct_light=log.direct_light[:0], sampled_light=log.sampled_light[:0])
        return Chunk(7, self.pixels, self.spp, log)

    def _lanes(self) -> Iterator[tuple[int, int]]:
        """First and last + 1 path of each lane."""
        parts = lanes_per_pixel(self.spp)
        for pixel in range(self.pixels):
            for part in range(parts):
                edges = [pixel * self.spp + (part + k) * self.spp // parts for k in (0, 1)]
                yield edges[0], edges[1]

    def _entries(self, first: int, stop: int) -> Iterator[tuple[float, int, int, float, int, float]]:
        """Sampled weight and its light, row, direct weight and its light, weight of the continuation."""
        for seen, lamp, vertices in self.paths[first:stop]:
            hit = seen, lamp
            for v in vertices:
                yield *hit, v.row, v.w, v.a, v.f
                hit = v.h, v.b
            if not vertices or vertices[-1].f:
                yield *hit, END, 1e6, 0, 1e6


def log_of(lanes: list[list[tuple[float, int, int, float, int, float]]], height: int) -> Log:
    """Write entries into strips as the tracer does: lanes whose strip is full go on, side by side, in the next ones."""
    rng = np.random.default_rng(len(lanes))
    names = ("sampled", "sampled_light", "row", "direct", "direct_light", "weight")
    fields: dict[str, list[Array]] = {name: [] for name in names}
    strips, goes_on, used, entry, slots = [], [], [], 0, 0
    while lanes:
        blocks = -(-len(lanes) // BLOCK)
        for name in names:
            whole = ENTRIES[name] is np.uint32
            fields[name].append(rng.uniform(0, 1 if whole else 1e6, (blocks * height, BLOCK)))
        follow = np.full(blocks * BLOCK, -1)
        rest = []
        for lane, entries in enumerate(lanes):
            for t, values in enumerate(entries[:height]):
                for name, value in zip(names, values, strict=True):
                    fields[name][-1][lane // BLOCK * height + t, lane % BLOCK] = value
            if entries[height:]:
                follow[lane] = slots + blocks * BLOCK + len(rest)
                rest.append(entries[height:])
        of_lanes = np.zeros(blocks * BLOCK, np.int32)
        of_lanes[: len(lanes)] = [min(len(lane), height) for lane in lanes]
        used.append(of_lanes)
        for block, most in enumerate(of_lanes.reshape(-1, BLOCK).max(axis=1)):
            strips.append((entry + block * height, entry + block * height + most))
        goes_on.append(follow)
        entry += blocks * height
        slots += blocks * BLOCK
        lanes = rest
    return Log(
        **{name: np.concatenate(parts).astype(ENTRIES[name]) for name, parts in fields.items()},
        strips=np.array(strips, dtype=np.int64),
        goes_on=np.concatenate(goes_on).astype(np.int32),
        used=np.concatenate(used),
    )


def reference(
    records: Paths, materials: list[DonaldsonMatrix], lights: list[Array]
) -> tuple[Array, Array, Array]:
    """Components (7, pixels, N), standard error of the total (pixels, N) and of the components (7, pixels, N)."""
    S = [made.reflectance for made in materials]
    Phi = [GRID.step * made.density() for made in materials]
    samples = np.zeros((len(records.paths), 7, N))
    for y, (seen, lamp, vertices) in zip(samples, records.paths, strict=True):
        y[0] = seen * lights[lamp]
        R = F = G = np.zeros(N)
        for k in reversed(range(len(vertices))):
            v = vertices[k]
            if k + 1 < len(vertices):
                s, phi = S[vertices[k + 1].row], Phi[vertices[k + 1].row]
                R, F, G = v.f * s * R, v.f * (s * F + phi @ R), v.f * (s * G + phi @ (F + G))
            indirect = R
            E_D = v.w * lights[v.a] + v.f * v.h * lights[v.b]
            R = R + E_D
        if vertices:
            s, phi = S[vertices[0].row], Phi[vertices[0].row]
            y[1:] = s * E_D, phi @ E_D, s * indirect, phi @ indirect, s * F, s * G + phi @ (F + G)
    samples = samples.reshape(records.pixels, records.spp, 7, N)
    batches = batch_count(records.spp)
    edges = np.arange(batches + 1) * records.spp // batches
    means = np.array([samples[:, a:b].mean(1) for a, b in pairwise(edges)])
    sizes = np.diff(edges).reshape(-1, 1, 1, 1)

    def error(of: Array) -> Array:
        weights = sizes.reshape((-1,) + (1,) * (of.ndim - 1))
        mean = (weights * of).sum(0) / records.spp
        with np.errstate(invalid="ignore"):
            return np.sqrt((weights * (of - mean) ** 2).sum(0) / (records.spp * np.float64(batches - 1)))

    return samples.mean(1).swapaxes(0, 1), error(means.sum(2)), error(means).swapaxes(0, 1)


@pytest.fixture(scope="module")
def pool() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(2) as executor:
        yield executor


def lamps(count: int) -> list[Array]:
    return list(np.random.default_rng(2).uniform(0.2, 2, (count, N)))


def swept(
    chunk: Chunk, tables: SpectralTables, pool: Executor, *, component_errors: bool = False, before: int = 0
) -> Pixels:
    """Sweep into an image with `before` pixels in front, and return those of the chunk."""
    out = Pixels.empty(before + chunk.pixels, N, component_errors)
    sweep(chunk, tables, pool, out, before)
    return out[before:]


def assert_same(pixels: Pixels, expected: tuple[Array, Array, Array]) -> None:
    radiance, error, component_error = expected
    np.testing.assert_allclose(pixels.radiance, radiance, rtol=5e-5, atol=2e-6 * radiance.max())
    np.testing.assert_allclose(pixels.standard_error, error, rtol=2e-3, atol=1e-5 * radiance.max())
    if pixels.component_standard_error is not None:
        np.testing.assert_allclose(
            pixels.component_standard_error, component_error, rtol=2e-3, atol=1e-5 * radiance.max()
        )


@pytest.mark.parametrize("lights", [1, 3])
@pytest.mark.parametrize("component_errors", [False, True])
@pytest.mark.parametrize("stokes", ["half", "strict"])
@pytest.mark.parametrize(
    ("pixels", "spp", "longest", "height"),
    [(50, 3, 40, 1000), (7, 20, 10, 30), (3, 130, 200, 7), (5, 64, 100, 1), (1, 1, 5, 2)],
)
def test_against_the_equations(
    pool: ThreadPoolExecutor,
    lights: int,
    component_errors: bool,
    stokes: str,
    pixels: int,
    spp: int,
    longest: int,
    height: int,
) -> None:
    materials = make_materials(stokes)
    paths = Paths(pixels, spp, lights=lights, rows=len(materials), longest=longest, seed=spp)
    tables = spectral_tables(materials, lamps(lights))
    found = swept(paths.chunk(height), tables, pool, component_errors=component_errors, before=3)
    assert_same(found, reference(paths, materials, lamps(lights)))


def test_the_reference_knows_what_it_computes() -> None:
    """The reference itself, on two vertices by hand: Phi = 0.5 from band 0 to band 1, S = 0.2."""
    matrix = np.zeros((N, N))
    matrix[1, 0] = 0.5 / GRID.step
    materials = [DonaldsonMatrix(GRID, np.full(N, 0.2), luminescent=matrix)]
    paths = Paths(1, 1, lights=1, rows=1)
    first, second = Vertex(0, 0.5, 0, 0.1, 0, 1.0), Vertex(0, 0.4, 0, 0.0, 0, 1.0)
    paths.paths = [(2.0, 0, [first, second])]
    y = reference(paths, materials, [np.ones(N)])[0][:, 0]
    # E_D = 0.6; behind it R = 0.2 x 0.4 = 0.08 and, in band 1, F = 0.5 x 0.4 = 0.2
    assert y[:, 0] == pytest.approx([2, 0.12, 0, 0.016, 0, 0, 0])
    assert y[:, 1] == pytest.approx([2, 0.12, 0.3, 0.016, 0.04, 0.04, 0])


@pytest.mark.parametrize("lights", [1, 3])
def test_nothing_is_lost_on_long_paths(pool: ThreadPoolExecutor, lights: int) -> None:
    """White surfaces: light of the five-hundredth vertex counts as much as that of the first."""
    materials = [DonaldsonMatrix(GRID, np.ones(N))]
    paths = Paths(30, 4, lights=lights, rows=1, longest=600, seed=5)
    assert max(len(vertices) for _, _, vertices in paths.paths) > 500
    for _, _, vertices in paths.paths:
        for vertex in vertices:
            vertex.f = min(vertex.f, 1.0)  # so that nothing grows without bounds
    found = swept(paths.chunk(50), spectral_tables(materials, lamps(lights)), pool)
    assert_same(found, reference(paths, materials, lamps(lights)))


def test_a_pixel_may_see_many_rows(pool: ThreadPoolExecutor) -> None:
    """More material rows in one pixel than there is room for at first."""
    rng = np.random.default_rng(4)
    materials = [DonaldsonMatrix(GRID, rng.uniform(0.1, 0.9, N)) for _ in range(50)]
    paths = Paths(3, 300, lights=1, rows=50)
    assert len({vertices[0].row for _, _, vertices in paths.paths[:300] if vertices}) > 40
    found = swept(paths.chunk(), spectral_tables(materials, lamps(1)), pool)
    assert_same(found, reference(paths, materials, lamps(1)))


@pytest.mark.parametrize("component_errors", [False, True])
def test_an_image_may_hold_the_last_bands_only(pool: ThreadPoolExecutor, component_errors: bool) -> None:
    """The first ones excite, and are not written."""
    materials = make_materials()
    chunk, tables = Paths(20, 20, lights=1, rows=len(materials)).chunk(), spectral_tables(materials, lamps(1))
    whole = swept(chunk, tables, pool, component_errors=component_errors)
    part = Pixels.empty(chunk.pixels, N - 4, component_errors)
    sweep(chunk, tables, pool, part)
    for one, all_of_it in zip(astuple(part), astuple(whole), strict=True):
        assert one is None or np.array_equal(one, all_of_it[..., 4:])


def test_one_light_and_many_lights_agree(pool: ThreadPoolExecutor) -> None:
    """The kernel for one light saves the light rows; given rows that are all 0, the other must say the same."""
    materials = make_materials()
    chunk = Paths(20, 20, lights=1, rows=len(materials)).chunk()
    nothing = np.zeros_like(chunk.log.row)
    many = replace(chunk, log=chunk.log._replace(direct_light=nothing, sampled_light=nothing))
    tables = spectral_tables(materials, lamps(1))
    one_kernel, other_kernel = (swept(c, tables, pool) for c in (chunk, many))
    np.testing.assert_allclose(one_kernel.radiance, other_kernel.radiance, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(one_kernel.standard_error, other_kernel.standard_error, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("stokes", ["half", "strict"])
def test_factors_and_full_matrices_agree(pool: ThreadPoolExecutor, stokes: str) -> None:
    """A material of K dyes and the full matrix of the same values are one material."""
    factored = make_materials(stokes, full=False)
    full = [DonaldsonMatrix(GRID, m.reflectance, luminescent=m.density(), stokes=m.stokes) for m in factored]
    chunk = Paths(20, 20, lights=1, rows=len(factored)).chunk()
    by_factors, by_matrix = (swept(chunk, spectral_tables(m, lamps(1)), pool) for m in (factored, full))
    np.testing.assert_allclose(by_factors.radiance, by_matrix.radiance, rtol=2e-5, atol=1e-6)


def assert_equal(one: Pixels, two: Pixels) -> None:
    assert np.array_equal(one.radiance, two.radiance)
    assert np.array_equal(one.standard_error, two.standard_error)


def test_threads_do_not_matter() -> None:
    materials = make_materials()
    chunk = Paths(40, 5, lights=3, rows=len(materials)).chunk()
    results = []
    for threads in (1, 2):
        with ThreadPoolExecutor(threads) as executor:
            results.append(swept(chunk, spectral_tables(materials, lamps(3)), executor))
    assert_equal(*results)


def test_a_compact_log_says_the_same_in_less_room(pool: ThreadPoolExecutor) -> None:
    materials = make_materials()
    chunk = Paths(40, 70, lights=3, rows=len(materials)).chunk(height=150)
    compact = chunk.compact()
    tables = spectral_tables(materials, lamps(3))
    assert_equal(swept(chunk, tables, pool), swept(compact, tables, pool))
    heights = np.diff(chunk.log.strips, axis=1).sum()
    assert len(compact.log.row) == len(compact.log.direct_light) == heights
    assert compact.log.nbytes < 0.9 * chunk.log.nbytes


class Interrupted(ThreadPoolExecutor):
    """Works slowly, and the user presses Ctrl-C while the first result is waited for."""

    def submit(self, call: Any, /, *arguments: Any, **options: Any) -> Any:
        def slowly() -> None:
            time.sleep(0.02)
            call(*arguments, **options)

        future = super().submit(slowly)
        future.result = self.interrupt  # type: ignore[method-assign, assignment]
        return future

    @staticmethod
    def interrupt(timeout: float | None = None) -> None:
        raise KeyboardInterrupt


def test_nothing_is_written_after_an_interrupt() -> None:
    """The caller fills what is not finished with NaN, which must stay."""
    materials = make_materials()
    chunk = Paths(64, 4, lights=1, rows=len(materials)).chunk()
    out = Pixels.empty(64, N, False)
    with Interrupted(1) as pool:
        with pytest.raises(KeyboardInterrupt):
            sweep(chunk, spectral_tables(materials, lamps(1)), pool, out)
        out.radiance[...] = np.nan
    assert np.isnan(out.radiance).all()


def test_a_single_sample_has_no_error(pool: ThreadPoolExecutor) -> None:
    materials = make_materials()
    chunk = Paths(10, 1, lights=1, rows=len(materials)).chunk()
    assert np.isnan(swept(chunk, spectral_tables(materials, lamps(1)), pool).standard_error).all()


def test_small_scatter_on_a_large_value(pool: ThreadPoolExecutor) -> None:
    """Batch means that differ by 1e-3 of their value: a difference of large sums in single precision would be noise."""
    materials = [DonaldsonMatrix(GRID, np.full(N, 0.5))]
    paths = Paths(1, 320, lights=1, rows=1)
    rng = np.random.default_rng(3)
    paths.paths = [
        (0.0, 0, [Vertex(0, 1 + 1e-3 * rng.standard_normal(), 0, 0.0, 0, 1.0)]) for _ in range(320)
    ]
    found = swept(paths.chunk(), spectral_tables(materials, [np.ones(N)]), pool)
    expected = reference(paths, materials, [np.ones(N)])[1]
    np.testing.assert_allclose(found.standard_error, expected, rtol=0.01)


class TestTables:
    def test_padding(self) -> None:
        assert [padded(n) for n in (1, 16, 17, 69, 97)] == [16, 16, 32, 80, 112]

    def test_what_does_not_fluoresce_has_no_rows(self) -> None:
        """A dye without emission, or whose excitation lies outside the grid, costs nothing."""
        zero = np.zeros(N)
        idle = DonaldsonMatrix(GRID, np.full(N, 0.5), [zero], [np.full(N, 0.01)])
        unexcited = DonaldsonMatrix(GRID, np.full(N, 0.5), [np.full(N, 0.5)], [zero])
        dark = DonaldsonMatrix(GRID, np.full(N, 0.5), luminescent=np.zeros((N, N)))
        tables = spectral_tables([idle, unexcited, dark], lamps(1))
        assert (tables.first == tables.last).all()
        assert (tables.full == -1).all()

    def test_two_stokes_rules_are_refused(self) -> None:
        a, b = make_materials("half")[1], make_materials("strict")[1]
        with pytest.raises(ValueError, match="Stokes"):
            spectral_tables([a, b], lamps(1))

    def test_padding_is_zero(self) -> None:
        tables = spectral_tables(make_materials(), lamps(2))
        assert not tables.reflectance[:, N:].any()
        assert not tables.lights[:, N:].any()

    def test_stokes_weights_agree_with_the_rule(self) -> None:
        assert np.diag(stokes_weights(3, "half")).tolist() == [0.5] * 3
        assert np.diag(stokes_weights(3, "strict")).tolist() == [0] * 3
