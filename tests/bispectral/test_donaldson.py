"""Donaldson matrices on a grid: y = S E + integral D_L E, by hand and against explicit sums."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fluorspar.bispectral.conversions import to_unit_norm
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.errors import MaterialError, PhotonYieldWarning
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 450, 10)
N = len(GRID)
values = st.floats(0, 1)
spectra = arrays(np.float64, (N,), elements=values)
factors = arrays(np.float64, (2, N), elements=values)


def gaussian(grid: Wavelengths, peak: float, width: float) -> np.ndarray:
    return np.exp(-0.5 * ((grid.values - peak) / width) ** 2)


def dye(grid: Wavelengths, stokes: str = "half") -> DonaldsonMatrix:
    """Return a dye whose excitation (peak 520 nm, integral 1) and emission (560 nm) overlap widely."""
    beta = gaussian(grid, 520, 25) / (25 * np.sqrt(2 * np.pi))
    return DonaldsonMatrix(grid, np.full(len(grid), 0.1), 0.5 * gaussian(grid, 560, 20), beta, stokes=stokes)


@given(spectra, factors, factors, spectra)
@pytest.mark.parametrize(("stokes", "own"), [("half", 0.5), ("strict", 0.0)])
def test_apply_is_the_double_sum_of_the_definition(stokes, own, S, alpha, beta, E) -> None:
    """y(i) = S(i) E(i) + h sum over k, j of alpha_k(i) beta_k(j) E(j), weighted 1, own, 0 for j <, =, > i."""
    expected = S * E
    for i in range(N):
        for j in range(N):
            weight = 1.0 if j < i else own if j == i else 0.0
            expected[i] += 10 * weight * sum(alpha[k, i] * beta[k, j] for k in range(2)) * E[j]
    D = DonaldsonMatrix(GRID, S, alpha, beta, stokes=stokes)
    assert D.apply(E) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert D.band() @ E == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert D.reflect(E) + D.apply_luminescent(E) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_whole_images_at_once() -> None:
    D = dye(Wavelengths())
    E = np.random.default_rng(1).uniform(size=(3, 2, 69))
    assert D.apply(E).shape == (3, 2, 69)
    assert D.apply(E)[2, 1] == pytest.approx(D.apply(E[2, 1]))
    full = DonaldsonMatrix(D.wavelengths, D.reflectance, luminescent=D.density())
    assert full.apply(E) == pytest.approx(D.apply(E))


class TestGrids:
    """alpha means the same on every grid, because beta is a density."""

    @pytest.mark.parametrize("step", [1, 2.5, 5, 10])
    def test_beyond_the_excitation_flat_light_shows_alpha(self, step: float) -> None:
        # flat light of 1, all of beta below 650 nm: y(650) = S + alpha(650) x integral of beta
        grid = Wavelengths(400, 700, step)
        y = dye(grid).apply(np.ones(len(grid)))
        at = int(250 / step)
        assert y[at] == pytest.approx(0.1 + 0.5 * np.exp(-0.5 * (90 / 20) ** 2), rel=1e-6)

    @pytest.mark.parametrize(("stokes", "order"), [("half", 2), ("strict", 1)])
    def test_half_weight_is_second_order_and_strict_first(self, stokes: str, order: int) -> None:
        """Emitted energy in flat light, against 0.5 nm: halving the step divides the error by 2^order."""

        def emitted(step: float, rule: str) -> float:
            grid = Wavelengths(400, 700, step)
            return float(step * dye(grid, rule).apply_luminescent(np.ones(len(grid))).sum())

        truth = emitted(0.5, "half")
        error_10, error_5 = (emitted(step, stokes) / truth - 1 for step in (10, 5))
        assert error_10 / error_5 == pytest.approx(2**order, rel=0.1)
        assert abs(error_5) == pytest.approx({2: 0.0005, 1: 0.02}[order], rel=0.7)


class TestYields:
    def test_by_hand(self) -> None:
        # excitation 400 nm: S 0.1; 0.2 of the energy leaves at 500, 0.3 at 600 nm
        grid = Wavelengths(400, 600, 100)
        D = DonaldsonMatrix.from_band([[0.1, 0, 0], [0.2, 0.5, 0], [0.3, 0.4, 0.6]], grid)
        assert D.energy_yield() == pytest.approx([0.6, 0.9, 0.6])
        assert D.photon_yield() == pytest.approx([0.1 + 0.2 * 1.25 + 0.3 * 1.5, 0.5 + 0.4 * 1.2, 0.6])

    def test_half_a_cell_on_the_diagonal_counts(self) -> None:
        D = DonaldsonMatrix(GRID, np.zeros(N), np.ones(N), np.eye(N)[2] / 10)
        assert D.photon_yield()[2] == pytest.approx(0.5 + (430 + 440 + 450) / 420)


class TestFullMatrices:
    band = np.array([[0.5, 0.01, 0.0], [0.2, 0.6, -0.01], [0.3, 0.1, 0.7]])
    grid = Wavelengths(400, 420, 10)

    def test_used_as_given_noise_above_the_diagonal_included(self) -> None:
        D = DonaldsonMatrix.from_band(self.band, self.grid)
        assert D.band() == pytest.approx(self.band, rel=1e-15)
        assert D.apply([1, 1, 1]) == pytest.approx(self.band.sum(axis=1))
        assert D.rank == 3


@given(spectra, factors, factors)
@pytest.mark.parametrize("stokes", ["half", "strict"])
def test_factors_say_of_themselves_what_the_full_matrix_says(stokes, S, alpha, beta) -> None:
    factored = DonaldsonMatrix(GRID, S, alpha, beta, stokes=stokes)
    full = DonaldsonMatrix(GRID, S, luminescent=factored.density())
    close = {"rtol": 1e-12, "atol": 1e-12}
    np.testing.assert_allclose(factored.energy_yield(), full.energy_yield(), **close)
    np.testing.assert_allclose(factored.photon_yield(), full.photon_yield(), **close)
    w = GRID.values
    np.testing.assert_allclose(
        factored.energy_yield(), [S[j] + 10 * factored.density()[:, j].sum() for j in range(N)], **close
    )
    np.testing.assert_allclose(
        factored.luminescent_photon_yield(),
        [10 * sum(factored.density()[i, j] * w[i] / w[j] for i in range(N)) for j in range(N)],
        **close,
    )
    cells = np.any([np.outer(a != 0, b != 0) for a, b in zip(alpha, beta, strict=True)], axis=0)
    cells &= np.tri(N, k=0 if stokes == "half" else -1, dtype=bool)
    emits, excites = factored.luminescent_bands
    assert np.array_equal(emits, cells.any(axis=1))
    assert np.array_equal(excites, cells.any(axis=0))
    assert factored.is_fluorescent == cells.any()


def test_factors_never_become_a_full_matrix() -> None:
    """Of 20,001 bands it would take 3.2 GB; a spectrum takes 160 kB."""
    grid = Wavelengths(300, 800, 0.025)
    tracemalloc.start()
    try:
        D = dye(grid).check()
        assert D.is_fluorescent
        assert D.rank == 1
        assert D.energy_yield().shape == D.photon_yield().shape == D.apply(np.ones(20001)).shape
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()


def test_rank_and_fluorescence() -> None:
    plain = DonaldsonMatrix(GRID, np.full(N, 0.5))
    assert (plain.rank, plain.is_fluorescent, plain.emission.shape) == (0, False, (0, N))
    assert plain.apply(np.ones(N)).tolist() == [0.5] * N
    two = DonaldsonMatrix(GRID, np.zeros(N), np.ones((2, N)), np.ones((2, N)) / 100)
    assert (two.rank, two.is_fluorescent) == (2, True)
    # emits at 400, is excited at 450 nm
    dark = DonaldsonMatrix(GRID, np.zeros(N), np.eye(N)[0], np.eye(N)[5])
    assert not dark.is_fluorescent


class TestThePaper:
    """The matrix of Eq. 1 and the factors of Eq. 2, written out as the paper has them."""

    def test_eq_1(self) -> None:
        """61 x 69: S where em = ex, alpha' beta' where em > ex, else 0; |beta'| = 1."""
        D = dye(Wavelengths(), "strict")
        (alpha,), (beta,) = to_unit_norm(D.emission, D.excitation, D.wavelengths.step)
        assert np.sum(beta**2) == pytest.approx(1)
        matrix = D.band()[8:]  # emission from 400 nm on
        assert matrix.shape == (61, 69)
        for em, ex in [(400, 400), (560, 520), (560, 560), (520, 560), (700, 360), (400, 405), (405, 400)]:
            i, j = (em - 400) // 5, (ex - 360) // 5
            expected = 0.1 if em == ex else alpha[i + 8] * beta[j] if em > ex else 0.0
            assert matrix[i, j] == pytest.approx(expected, rel=1e-12)


class TestCheck:
    def test_a_dye_passes(self) -> None:
        D = dye(Wavelengths())
        assert D.check("dye") is D

    @pytest.mark.parametrize(("value", "word"), [(-0.1, "negative"), (1.1, "greater than 1")])
    def test_reflectance(self, value: float, word: str) -> None:
        with pytest.raises(MaterialError, match=f"(?s){word}.*'dye', 430 nm"):
            DonaldsonMatrix(GRID, np.where(np.arange(N) == 3, value, 0.5)).check("dye")

    def test_photon_yield(self) -> None:
        band = np.diag(np.full(N, 0.5))
        band[3, 0] = 0.55 * 400 / 430
        with pytest.warns(PhotonYieldWarning, match="400 nm: 1.05 photons"):
            DonaldsonMatrix.from_band(band, GRID).check("dye")
        band[3, 0] = 0.66 * 400 / 430
        with pytest.raises(MaterialError, match=r"(?s)more photons.*400 nm.*1.16"):
            DonaldsonMatrix.from_band(band, GRID).check("dye")

    def test_transposed(self) -> None:
        D = DonaldsonMatrix.from_band(dye(Wavelengths()).band().T, Wavelengths())
        with pytest.raises(MaterialError, match="transpose"):
            D.check()


@pytest.mark.parametrize(
    "parts",
    [
        {"reflectance": np.zeros(N - 1)},
        {"reflectance": np.zeros(N), "emission": np.ones(N)},
        {"reflectance": np.zeros(N), "emission": np.ones((2, N)), "excitation": np.ones(N)},
        {"reflectance": np.zeros(N), "emission": np.ones(N - 1), "excitation": np.ones(N - 1)},
        {"reflectance": np.zeros(N), "luminescent": np.zeros((N, N - 1))},
        {
            "reflectance": np.zeros(N),
            "emission": np.ones(N),
            "excitation": np.ones(N),
            "luminescent": np.zeros((N, N)),
        },
    ],
)
def test_parts_that_do_not_fit(parts: dict[str, np.ndarray]) -> None:
    with pytest.raises(MaterialError, match="do not fit"):
        DonaldsonMatrix(GRID, **parts)


def test_other_faults() -> None:
    with pytest.raises(MaterialError, match="finite"):
        DonaldsonMatrix(GRID, np.full(N, np.nan))
    with pytest.raises(MaterialError, match=r"(?s)Stokes rule.*'half' or 'strict'"):
        DonaldsonMatrix(GRID, np.zeros(N), stokes="full")
    with pytest.raises(MaterialError, match="not on the grid"):
        DonaldsonMatrix(GRID, np.zeros(N)).apply(np.ones(N + 1))
