"""The sweep against a slow one: invented light paths, spectra in plain double precision.

Rationale
    The compiled sweep reads interleaved records, splits spectra at the Stokes limit, knows when nothing
    luminesced yet,
    and sums samples before it makes components of them. `reference` below does none of that: it follows the
    equations
    of section 2a of the design, one path after another, with full matrices.
Expected
    Equal to single precision for any paths, real ones or not; slots the records leave undefined are filled
    with
    nonsense here, so reading one shows.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fluorspar.bispectral.conversions import stokes_weights
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.paths.light_paths import KILLED, SLOTS, TILE, LightPaths, Segment
from fluorspar.paths.sweeping.spectral_tables import padded, spectral_tables
from fluorspar.paths.sweeping.sweep import Swept, batch_count, sweep
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


class Records:
    """Builds `LightPaths` and remembers what it put into them."""

    def __init__(
        self,
        pixels: int,
        spp: int,
        *,
        lights: int,
        rows: int,
        rr_depth: int,
        segments: int = 1,
        seed: int = 0,
    ) -> None:
        rng = np.random.default_rng(seed)
        self.pixels, self.spp, self.lights, self.rr_depth = pixels, spp, lights, rr_depth
        self.paths: list[tuple[float, int, list[Vertex]]] = []
        for _ in range(pixels * spp):
            longest = rng.choice([0, 1, 2, 3, 8, SLOTS * segments])
            n = int(rng.integers(0, longest + 1))
            if segments > 1 and rng.random() < 0.1:
                n = SLOTS  # ends, or goes on, exactly at the end of a record
            vertices = [
                Vertex(
                    row=int(rng.integers(rows)),
                    w=rng.uniform(0, 1) * (rng.random() < 0.8),
                    a=int(rng.integers(lights)),
                    h=rng.uniform(0, 1) * (rng.random() < 0.3),
                    b=int(rng.integers(lights)),
                    f=rng.uniform(1.0, 1.5) if k + 1 >= rr_depth else 1.0,
                )
                for k in range(n)
            ]
            if n and n >= rr_depth and rng.random() < 0.5:
                vertices[-1].f, vertices[-1].h = 0.0, 0.0
            seen = rng.uniform(0, 1) * (rng.random() < 0.3)
            self.paths.append((seen, int(rng.integers(lights)), vertices))

    def light_paths(self) -> LightPaths:
        segments: list[Segment] = []
        going: list[tuple[float, int, list[Vertex]]] = self.paths
        while True:
            segment, going = self._segment(going, len(segments))
            segments.append(segment)
            if not going:
                return LightPaths(7, self.pixels, self.spp, self.rr_depth, tuple(segments))

    def _segment(self, paths: list[tuple[float, int, list[Vertex]]], number: int) -> tuple[Segment, Any]:
        rng = np.random.default_rng(number)
        tiles = -(-len(paths) // TILE)
        shape = (tiles, SLOTS, TILE)
        number_like = [rng.uniform(10, 1e6, shape).astype(np.float32) for _ in range(3)]
        direct, sampled, survival = number_like
        row, direct_light, sampled_light = (rng.integers(0, 1, shape).astype(np.uint32) for _ in range(3))
        length = np.zeros(len(paths), dtype=np.uint8)
        child = np.full(len(paths), -1, dtype=np.int32)
        later = []
        for i, (seen, lamp, vertices) in enumerate(paths):
            tile, lane = divmod(i, TILE)
            here = vertices[:SLOTS]
            length[i] = len(here)
            sampled[tile, 0, lane], sampled_light[tile, 0, lane] = seen, lamp
            for k, vertex in enumerate(here):
                row[tile, k, lane] = vertex.row
                direct[tile, k, lane] = vertex.w
                direct_light[tile, k, lane] = vertex.a
                if number * SLOTS + k + 1 >= self.rr_depth:
                    survival[tile, k, lane] = vertex.f if vertex.f else KILLED
                if k + 1 < SLOTS and vertex.f:
                    sampled[tile, k + 1, lane], sampled_light[tile, k + 1, lane] = vertex.h, vertex.b
            if len(here) == SLOTS and vertices[SLOTS - 1].f:
                child[i] = len(later)
                later.append((vertices[SLOTS - 1].h, vertices[SLOTS - 1].b, vertices[SLOTS:]))
        if self.lights == 1:
            direct_light = sampled_light = np.zeros((1, 1, 1), dtype=np.uint32)
        return Segment(length, child, row, direct, direct_light, sampled, sampled_light, survival), later


def reference(
    records: Records, materials: list[DonaldsonMatrix], lights: list[Array]
) -> tuple[Array, Array, Array]:
    """Components (pixels, 7, N), standard error of the total (pixels, N) and of the components (pixels, 7,
    N)."""
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

    return samples.mean(1), error(means.sum(2)), error(means)


@pytest.fixture(scope="module")
def pool() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(2) as executor:
        yield executor


def lamps(count: int) -> list[Array]:
    return list(np.random.default_rng(2).uniform(0.2, 2, (count, N)))


def assert_same(swept: Swept, expected: tuple[Array, Array, Array]) -> None:
    radiance, error, component_error = expected
    np.testing.assert_allclose(swept.radiance, radiance, rtol=5e-5, atol=2e-6 * radiance.max())
    np.testing.assert_allclose(swept.standard_error, error, rtol=2e-3, atol=1e-5 * radiance.max())
    if len(swept.component_standard_error):
        np.testing.assert_allclose(
            swept.component_standard_error, component_error, rtol=2e-3, atol=1e-5 * radiance.max()
        )


@pytest.mark.parametrize("lights", [1, 3])
@pytest.mark.parametrize("component_errors", [False, True])
@pytest.mark.parametrize("stokes", ["half", "strict"])
@pytest.mark.parametrize(
    ("pixels", "spp", "rr_depth", "segments"),
    [(50, 3, 5, 1), (7, 20, 1, 1), (3, 33, 10, 3), (5, 64, 10**6, 2), (1, 1, 2, 1)],
)
def test_against_the_equations(
    pool: ThreadPoolExecutor,
    lights: int,
    component_errors: bool,
    stokes: str,
    pixels: int,
    spp: int,
    rr_depth: int,
    segments: int,
) -> None:
    materials = make_materials(stokes)
    records = Records(
        pixels, spp, lights=lights, rows=len(materials), rr_depth=rr_depth, segments=segments, seed=spp
    )
    tables = spectral_tables(materials, lamps(lights))
    swept = sweep(records.light_paths(), tables, N, pool, component_errors=component_errors)
    assert_same(swept, reference(records, materials, lamps(lights)))


def test_the_reference_knows_what_it_computes() -> None:
    """The reference itself, on two vertices by hand: Phi = 0.5 from band 0 to band 1, S = 0.2."""
    matrix = np.zeros((N, N))
    matrix[1, 0] = 0.5 / GRID.step
    materials = [DonaldsonMatrix(GRID, np.full(N, 0.2), luminescent=matrix)]
    records = Records(1, 1, lights=1, rows=1, rr_depth=99)
    first, second = Vertex(0, 0.5, 0, 0.1, 0, 1.0), Vertex(0, 0.4, 0, 0.0, 0, 1.0)
    records.paths = [(2.0, 0, [first, second])]
    y = reference(records, materials, [np.ones(N)])[0][0]
    # E_D = 0.6; behind it R = 0.2 x 0.4 = 0.08 and, in band 1, F = 0.5 x 0.4 = 0.2
    assert y[:, 0] == pytest.approx([2, 0.12, 0, 0.016, 0, 0, 0])
    assert y[:, 1] == pytest.approx([2, 0.12, 0.3, 0.016, 0.04, 0.04, 0])


@pytest.mark.parametrize("lights", [1, 3])
def test_nothing_is_lost_between_records(pool: ThreadPoolExecutor, lights: int) -> None:
    """White surfaces: light of the hundredth vertex counts as much as that of the first."""
    materials = [DonaldsonMatrix(GRID, np.ones(N))]
    records = Records(30, 4, lights=lights, rows=1, rr_depth=10**6, segments=4, seed=5)
    swept = sweep(records.light_paths(), spectral_tables(materials, lamps(lights)), N, pool)
    assert_same(swept, reference(records, materials, lamps(lights)))


def test_one_light_and_many_lights_agree(pool: ThreadPoolExecutor) -> None:
    """The kernel for one light saves the light rows; given rows that are all 0, the other must say the
    same."""
    materials = make_materials()
    records = Records(20, 20, lights=1, rows=len(materials), rr_depth=5)
    paths = records.light_paths()
    (segment,) = paths.segments
    nothing = np.zeros(segment.row.shape, dtype=np.uint32)
    many = replace(paths, segments=(replace(segment, direct_light=nothing, sampled_light=nothing),))
    one_kernel, other_kernel = (
        sweep(p, spectral_tables(materials, lamps(1)), N, pool) for p in (paths, many)
    )
    np.testing.assert_allclose(one_kernel.radiance, other_kernel.radiance, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(one_kernel.standard_error, other_kernel.standard_error, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("stokes", ["half", "strict"])
def test_factors_and_full_matrices_agree(pool: ThreadPoolExecutor, stokes: str) -> None:
    """A material of K dyes and the full matrix of the same values are one material."""
    factored = make_materials(stokes, full=False)
    full = [DonaldsonMatrix(GRID, m.reflectance, luminescent=m.density(), stokes=m.stokes) for m in factored]
    paths = Records(20, 20, lights=1, rows=len(factored), rr_depth=5).light_paths()
    by_factors, by_matrix = (sweep(paths, spectral_tables(m, lamps(1)), N, pool) for m in (factored, full))
    np.testing.assert_allclose(by_factors.radiance, by_matrix.radiance, rtol=2e-5, atol=1e-6)


def test_threads_do_not_matter() -> None:
    materials = make_materials()
    paths = Records(40, 5, lights=3, rows=len(materials), rr_depth=5).light_paths()
    results = []
    for threads in (1, 2):
        with ThreadPoolExecutor(threads) as executor:
            results.append(sweep(paths, spectral_tables(materials, lamps(3)), N, executor))
    for one, two in zip(*results, strict=True):
        assert np.array_equal(one, two)


def test_a_single_sample_has_no_error(pool: ThreadPoolExecutor) -> None:
    materials = make_materials()
    paths = Records(10, 1, lights=1, rows=len(materials), rr_depth=5).light_paths()
    assert np.isnan(sweep(paths, spectral_tables(materials, lamps(1)), N, pool).standard_error).all()


def test_small_scatter_on_a_large_value(pool: ThreadPoolExecutor) -> None:
    """Batch means that differ by 1e-3 of their value: a difference of large sums in single precision would
    be noise."""
    materials = [DonaldsonMatrix(GRID, np.full(N, 0.5))]
    records = Records(1, 320, lights=1, rows=1, rr_depth=99)
    rng = np.random.default_rng(3)
    records.paths = [
        (0.0, 0, [Vertex(0, 1 + 1e-3 * rng.standard_normal(), 0, 0.0, 0, 1.0)]) for _ in range(320)
    ]
    swept = sweep(records.light_paths(), spectral_tables(materials, [np.ones(N)]), N, pool)
    expected = reference(records, materials, [np.ones(N)])[1]
    np.testing.assert_allclose(swept.standard_error, expected, rtol=0.01)


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
