"""Split the luminescent part of a measured Donaldson matrix into non-negative factors.

`cells = diag(S) + sum over k of a_k b_k^T on the Stokes side + baseline of each column + noise`. With b
held the model is linear in a, and the other way round, so each half is a non-negative least-squares problem
that scipy solves; the two take turns until nothing changes. The baselines are linear too and are eliminated
in closed form; S takes up what is left on the diagonal.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.matrix_noise import MatrixNoise, baseline_shapes

__all__ = ["Factors", "Problem"]

Array = NDArray[np.float64]

_TURNS = 200
_SETTLED = 1e-5  # relative change of the misfit
_RIDGE = 1e-3  # of the weight the best-known number has: what no cell says anything about becomes 0
_DEEP = 0.15  # of the highest value: a minimum that separates two lobes
_FAINT = 0.05  # of the brightest row: a dye hardly emits there
_ROUNDS = 10  # of the search for the weight of the curvature: a factor of 10 / 2**10 decades


@dataclass(frozen=True, eq=False)
class Factors:
    """Non-negative factors of the luminescent cells, band-weighted: below the diagonal, cells = emission^T excitation.

    Attributes
    ----------
    emission : ndarray of shape (K, M)
    excitation : ndarray of shape (K, P)
    baseline : ndarray of shape (M, P)
        What was taken for the instrument's baseline.
    misfit : float
        Sum over cells of squared residual / noise variance, baselines (and sums, if asked for) included.
    open_emission : ndarray of bool, shape (K, M)
    open_excitation : ndarray of bool, shape (K, P)
        Where the factors may differ from 0.
    curvature : float
        Weight of the curvature penalty.
    """

    emission: Array
    excitation: Array
    baseline: Array
    misfit: float
    open_emission: NDArray[np.bool_]
    open_excitation: NDArray[np.bool_]
    curvature: float = 0.0

    @property
    def rank(self) -> int:
        """Number of terms."""
        return len(self.emission)

    @property
    def product(self) -> Array:
        """The sum of all a b^T, ndarray of shape (M, P), without the Stokes limit."""
        return np.asarray(self.emission.T @ self.excitation)


class Problem:
    """Non-negative factorisation of the cells on one side of the diagonal.

    Parameters
    ----------
    cells : ndarray of shape (M, P)
        Band-weighted.
    shift : ndarray of shape (M, P)
        Emission minus excitation wavelength in steps.
    noise : MatrixNoise
        What the cells are worth.
    sums : ndarray of shape (C, M, P), optional
        Weights of C sums over the luminescent cells that shall be what was measured, such as tristimulus
        values: many small errors of one sign would show as a colour.
    tolerance : float
        How well, in the unit of these sums.
    mirrored : bool
        Look for luminescence above the diagonal, where there is none: what is found there is what noise
        yields.

    Examples
    --------
    >>> w = np.arange(400.0, 701.0, 10.0)
    >>> shift = (w[:, None] - w[None, :]) / 10
    >>> cells = np.where(shift > 0, np.outer(np.exp(-(((w - 560) / 30) ** 2)), np.exp(-(((w - 490) / 40) ** 2))), 0.0)
    >>> problem = Problem(0.05 * cells, shift, MatrixNoise(0.001, 0.001, 0.001, 0.001, 0.0))
    >>> factors = problem.grow(problem.nothing())
    >>> bool(np.abs(np.where(shift > 0, factors.product, 0) - 0.05 * cells).max() < 1e-4)
    True
    """

    def __init__(
        self,
        cells: Array,
        shift: Array,
        noise: MatrixNoise,
        *,
        sums: Array | None = None,
        tolerance: float = np.inf,
        mirrored: bool = False,
    ) -> None:
        self.cells, self.shift = cells, shift
        self.lit = (shift < -0.5) if mirrored else (shift > 0.5)
        self._sums = (np.zeros((0, *cells.shape)) if sums is None else sums) * self.lit / tolerance
        self._targets = np.einsum("cmp,mp->c", self._sums, cells)
        near = np.abs(shift) < 1.5
        self.weight = np.where(near, noise.near**-2, noise.white**-2) * (np.abs(shift) > 0.5)
        self._shapes = baseline_shapes(len(cells))
        self._stiffness = np.array([noise.offset**-2, noise.tilt**-2])
        self._bend_emission = _bend(len(cells), zero_before=True)
        self._bend_excitation = _bend(cells.shape[1], zero_before=False)
        self._set_precision()

    def _set_precision(self) -> None:
        """Inverse covariance of each column's cells (P, M, M), white noise and baseline together (Woodbury)."""
        shapes, weight = self._shapes, self.weight
        normal = np.einsum("am,mp,bm->pab", shapes, weight, shapes) + np.diag(self._stiffness)
        self._solver = np.linalg.inv(normal)
        weighted = shapes[:, :, None] * weight
        precision = np.einsum("mp,mn->pmn", weight, np.eye(len(shapes.T)))
        precision -= np.einsum("amp,pab,bnp->pmn", weighted, self._solver, weighted, optimize=True)
        self._pull = np.einsum("pmn,np->mp", precision, self.cells) * self.lit
        self._precision = precision * (self.lit.T[:, :, None] & self.lit.T[:, None, :])

    def nothing(self) -> Factors:
        """Return the factors of a surface without luminescence."""
        m, p = self.cells.shape
        zero, everywhere = (
            (np.zeros((0, m)), np.zeros((0, p))),
            (np.ones((0, m), bool), np.ones((0, p), bool)),
        )
        misfit, baseline = self._misfit(np.zeros((m, p)))
        return Factors(*zero, baseline, misfit, *everywhere)

    def grow(self, factors: Factors, rows: NDArray[np.bool_] | None = None) -> Factors:
        """Return the best fit with one term more, started from `factors` and the strongest pattern they leave.

        The new term emits only in `rows`, of shape (M,), if they are given.
        """
        rows = np.ones(len(self.cells), bool) if rows is None else rows
        left = np.where(self.lit, self.cells - factors.baseline - factors.product, 0.0) * rows[:, np.newaxis]
        u, s, vt = np.linalg.svd(np.maximum(left, 0.0))
        a, b = np.abs(u[:, 0]) * np.sqrt(s[0]), np.abs(vt[0]) * np.sqrt(s[0])
        return self.fit(
            replace(
                factors,
                emission=np.vstack([factors.emission, a]),
                excitation=np.vstack([factors.excitation, b]),
                open_emission=np.vstack([factors.open_emission, rows]),
                open_excitation=np.vstack([factors.open_excitation, np.ones((1, len(b)), bool)]),
            )
        )

    def fit(self, start: Factors) -> Factors:
        """Return the best non-negative factors of this problem, started from others of their rank.

        What the start has closed stays 0, and its curvature is kept: the penalty is `curvature` times the
        squared second differences of both factors, which are taken to be 0 beyond the red end, emission
        also before the blue end; the scale that a and b can exchange is set so that both bend as much.
        """
        a, b, curvature = start.emission, start.excitation, start.curvature
        bend_a, bend_b = self._bend_emission, self._bend_excitation
        penalty_a, penalty_b = (curvature * bend.T @ bend for bend in (bend_a, bend_b))
        cost = np.inf
        for _ in range(_TURNS):
            a = _solve(*self._for_emission(b), penalty_a, start.open_emission)
            b = _solve(*self._for_excitation(a), penalty_b, start.open_excitation)
            bent_a, bent_b = (np.linalg.norm(x @ bend.T, axis=1) for x, bend in ((a, bend_a), (b, bend_b)))
            balance = np.sqrt((bent_b + 1e-12) / (bent_a + 1e-12))[:, None]
            a, b = a * balance, b / balance
            before = cost
            misfit, baseline = self._misfit(a.T @ b)
            cost = misfit + curvature * 2 * float(bent_a @ bent_b)
            if before - cost <= _SETTLED * cost:
                break
        return replace(start, emission=a, excitation=b, baseline=baseline, misfit=misfit)

    def bluer_rows(self, factors: Factors) -> NDArray[np.bool_]:
        """Return which rows lie at shorter wavelengths than all that factors emit, shape (M,)."""
        brightest = np.max(factors.product * self.lit, axis=1)
        return np.asarray(np.cumsum(brightest > _FAINT * brightest.max(initial=0.0)) == 0)

    def prune(self, factors: Factors, least: float) -> Factors:
        """Close side lobes of the spectra that are noise of single rows or columns, the weakest first.

        A lobe lies between two deep minima. The strongest one of every spectrum stays. Others go if they
        explain less than `least` of misfit; excitation also if it lies on the red side of the emission peak,
        where no dye is excited.
        """
        for term in range(factors.rank):
            for lobe in _side_lobes(factors.emission[term]):
                still_open = factors.open_emission.copy()
                still_open[term, lobe] = False
                without = self.fit(replace(factors, open_emission=still_open))
                if without.misfit - factors.misfit < least:
                    factors = without
            peak = int(np.argmax(factors.emission[term]))
            red = self.shift[peak] < 0
            for lobe in _side_lobes(factors.excitation[term]):
                still_open = factors.open_excitation.copy()
                still_open[term] &= ~red | (factors.excitation[term] > 0)
                still_open[term, lobe] = False
                without = self.fit(replace(factors, open_excitation=still_open))
                if red[lobe].all() or without.misfit - factors.misfit < least:
                    factors = without
        return factors

    def smooth(self, factors: Factors, *, cautious: bool = False) -> Factors:
        """Return the smoothest factors the noise allows.

        The true factors miss the data by more than the best fit does, on average by one unit of misfit per
        free number (one that is not 0). So the curvature is penalised until the misfit has grown by that
        much; if `cautious`, times the mean misfit of a cell, from 1 to 4, as if all of it were noise.
        """
        per_number = np.clip(factors.misfit / np.count_nonzero(self.weight), 1.0, 4.0) if cautious else 1.0
        free = np.count_nonzero(factors.emission) + np.count_nonzero(factors.excitation) - factors.rank
        allowed = factors.misfit + per_number * free
        low, high = -2.0, 8.0  # log10 of the weight of the penalty
        best = factors
        for _ in range(_ROUNDS):
            middle = (low + high) / 2
            tried = self.fit(replace(best, curvature=10.0**middle))
            if tried.misfit <= allowed:
                low, best = middle, tried
            else:
                high = middle
        return best

    def _for_emission(self, b: Array) -> tuple[Array, Array]:
        """Normal equations of the emission factors: matrix (K, M, K, M) and right side (K, M)."""
        normal = np.einsum("kp,lp,pmn->kmln", b, b, self._precision, optimize=True)
        right = np.einsum("kp,mp->km", b, self._pull)
        sums = np.einsum("cmp,kp->ckm", self._sums, b)
        normal += np.einsum("ckm,cln->kmln", sums, sums)
        return normal, right + np.einsum("ckm,c->km", sums, self._targets)

    def _for_excitation(self, a: Array) -> tuple[Array, Array]:
        """Normal equations of the excitation factors: matrix (K, P, K, P) and right side (K, P)."""
        sums = np.einsum("cmp,km->ckp", self._sums, a)
        normal = np.einsum("ckp,clq->kplq", sums, sums)
        each = np.arange(sums.shape[2])
        normal[:, each, :, each] += np.einsum("km,pmn,ln->pkl", a, self._precision, a, optimize=True)
        right = np.einsum("km,mp->kp", a, self._pull)
        return normal, right + np.einsum("ckp,c->kp", sums, self._targets)

    def misfit_of_columns(self, factors: Factors) -> Array:
        """Return the misfit of every excitation wavelength, ndarray of shape (P,), without the sums."""
        return self._columns(factors.product)[0]

    def _misfit(self, product: Array) -> tuple[float, Array]:
        """Return the misfit of a product (M, P) and the baseline (M, P) that goes with it."""
        columns, baseline = self._columns(product)
        model = np.where(self.lit, product, 0.0)
        sums = np.sum((np.einsum("cmp,mp->c", self._sums, model) - self._targets) ** 2)
        return float(columns.sum() + sums), baseline

    def _columns(self, product: Array) -> tuple[Array, Array]:
        left = self.cells - np.where(self.lit, product, 0.0)
        strength = np.einsum("pab,bm,mp->pa", self._solver, self._shapes, self.weight * left)
        baseline = (strength @ self._shapes).T
        misfit = np.sum(self.weight * (left - baseline) ** 2, axis=0) + strength**2 @ self._stiffness
        return misfit, baseline


def _solve(normal: Array, right: Array, penalty: Array, is_open: NDArray[np.bool_]) -> Array:
    """Solve normal equations (K, N, K, N) for non-negative factors of shape (K, N), with a penalty (N, N) on each.

    Numbers that are not open, `is_open` of shape (K, N), are 0.
    """
    from scipy.linalg import cholesky, solve_triangular
    from scipy.optimize import nnls

    k, n = right.shape
    for term in range(k):
        ridge = _RIDGE * np.einsum("nn->n", normal[term, :, term, :]).max()
        normal[term, :, term, :] += penalty + ridge * np.eye(n)
    free = is_open.ravel()
    matrix = normal.reshape(k * n, k * n)[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-9 * np.diag(matrix).max(initial=0.0) + 1e-300))
    matrix = matrix / np.outer(scale, scale)
    upper = cholesky(matrix + 1e-9 * np.eye(len(matrix)))
    target = solve_triangular(upper, right.ravel()[free] / scale, trans="T")
    factors = np.zeros(k * n)
    factors[free] = nnls(upper, target, maxiter=20 * k * n)[0] / scale
    return factors.reshape(k, n)


def _bend(count: int, *, zero_before: bool) -> Array:
    """Second differences of a spectrum of `count` values: 0 beyond its red end, before its blue end or not."""
    full = np.diff(np.eye(count + 4), 2, axis=0)
    return full[:, 2:-2] if zero_before else full[2:, 2:-2]


def _side_lobes(spectrum: Array) -> Iterator[slice]:
    """Yield all lobes of a spectrum but the one of largest area, the weakest first; they meet at its deep minima."""
    before, here, after = spectrum[:-2], spectrum[1:-1], spectrum[2:]
    minima = np.flatnonzero((here <= before) & (here <= after) & (here < _DEEP * spectrum.max())) + 1
    edges = [0, *minima, len(spectrum)]
    lobes = [slice(a, b) for a, b in pairwise(edges) if spectrum[a:b].any()]
    yield from sorted(lobes, key=lambda lobe: float(spectrum[lobe].sum()))[:-1]
