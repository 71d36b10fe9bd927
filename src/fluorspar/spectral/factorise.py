"""Split the luminescent part of a measured Donaldson matrix into non-negative factors.

`cells = diag(S) + sum over k of a_k b_k^T on the Stokes side + baseline of each column + noise`. The factors are found by
scipy's L-BFGS-B with bounds; the baselines, which are linear, are eliminated in closed form, and S takes up what is left
on the diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluorspar.spectral.matrix_noise import MatrixNoise, baseline_shapes

__all__ = ["Factors", "Problem"]

Array = NDArray[np.float64]


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
        Sum over cells of squared residual / noise variance, baselines (and row sums, if asked for) included.
    curvature : float
        Weight of the curvature penalty.
    """

    emission: Array
    excitation: Array
    baseline: Array
    misfit: float
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
    noise
        What the cells are worth.
    row_tolerance
        How well every row of the luminescent part shall add up to what was measured, in radiance factor; that is what
        decides the colour. Not asked for by default.
    mirrored
        Look for luminescence above the diagonal, where there is none: what is found there is what noise yields.

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
        row_tolerance: float = np.inf,
        mirrored: bool = False,
    ) -> None:
        self.cells = cells
        self.lit = (shift < -0.5) if mirrored else (shift > 0.5)
        near = np.abs(shift) < 1.5
        self.weight = np.where(near, noise.near**-2, noise.white**-2) * (np.abs(shift) > 0.5)
        self.shapes = baseline_shapes(len(cells))
        self.stiffness = np.array([noise.offset**-2, noise.tilt**-2])
        normal = np.einsum("am,mp,bm->pab", self.shapes, self.weight, self.shapes) + np.diag(self.stiffness)
        self.inverse = np.linalg.inv(normal)
        self.row_weight = row_tolerance**-2
        self.row_sums = (cells * self.lit).sum(axis=1)

    def nothing(self) -> Factors:
        """Return the factors of a surface without luminescence."""
        m, p = self.cells.shape
        return self._factors(np.zeros((0, m)), np.zeros((0, p)), 0.0)

    def grow(self, factors: Factors, curvature: float = 0.0) -> Factors:
        """Return the best fit with one term more, started from `factors` and the strongest pattern they leave."""
        left = np.where(self.lit, self.cells - factors.baseline - factors.product, 0.0)
        u, s, vt = np.linalg.svd(np.maximum(left, 0.0))
        scale = np.sqrt(s[0])
        a, b = np.abs(u[:, 0]) * scale, np.abs(vt[0]) * scale
        a, b = (
            a + 1e-3 * a.max(),
            b + 1e-3 * b.max(),
        )  # a factor that starts at 0 with its partner never leaves it
        return self.fit(
            np.vstack([factors.emission, a]), np.vstack([factors.excitation, b]), curvature=curvature
        )

    def fit(self, emission: Array, excitation: Array, *, curvature: float = 0.0) -> Factors:
        """Return the best non-negative factors, started from `emission` (K, M) and `excitation` (K, P).

        The penalty is `curvature` times the squared second differences of both. It is blind to the scale that a and b
        can exchange, because the optimum balances it.
        """
        from scipy.optimize import minimize

        (k, m), p = emission.shape, excitation.shape[1]
        bend_m, bend_p = (np.diff(np.eye(n), 2, axis=0) for n in (m, p))

        def cost(x: Array) -> tuple[float, Array]:
            a, b = x[: k * m].reshape(k, m), x[k * m :].reshape(k, p)
            value, slope, _ = self._misfit(a.T @ b)
            bent_a, bent_b = a @ bend_m.T, b @ bend_p.T
            value += curvature * float(np.sum(bent_a**2) + np.sum(bent_b**2))
            slope_a = b @ slope.T + 2 * curvature * bent_a @ bend_m
            slope_b = a @ slope + 2 * curvature * bent_b @ bend_p
            return value, np.concatenate([slope_a.ravel(), slope_b.ravel()])

        start = np.concatenate([emission.ravel(), excitation.ravel()])
        found = minimize(
            cost,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=[(0, None)] * len(start),
            options={"maxiter": 3000, "maxfun": 4000, "maxcor": 30, "ftol": 1e-10, "gtol": 1e-6},
        )
        return self._factors(found.x[: k * m].reshape(k, m), found.x[k * m :].reshape(k, p), curvature)

    def smooth(self, factors: Factors, rounds: int = 9) -> Factors:
        """Return the smoothest factors the noise allows.

        The true factors miss the data by more than the best fit does, on average by one unit of misfit per free number.
        So the curvature is penalised until the misfit has grown by that much.
        """
        free = factors.rank * (len(self.cells) + self.cells.shape[1] - 1)
        allowed = factors.misfit + free * max(1.0, factors.misfit / np.count_nonzero(self.weight))
        low, high = -2.0, 8.0  # log10 of the weight of the penalty
        best = factors
        for _ in range(rounds):
            middle = (low + high) / 2
            tried = self.fit(best.emission, best.excitation, curvature=10.0**middle)
            if tried.misfit <= allowed:
                low, best = middle, tried
            else:
                high = middle
        return best

    def _factors(self, a: Array, b: Array, curvature: float) -> Factors:
        misfit, _, baseline = self._misfit(a.T @ b)
        return Factors(a, b, baseline, misfit, curvature)

    def _misfit(self, product: Array) -> tuple[float, Array, Array]:
        """Return the misfit of a product (M, P), its slope with respect to the product, and the baseline, both (M, P)."""
        model = np.where(self.lit, product, 0.0)
        left = self.cells - model
        strength = np.einsum("pab,bm,mp->pa", self.inverse, self.shapes, self.weight * left)
        baseline = (strength @ self.shapes).T
        left = left - baseline
        off = model.sum(axis=1) - self.row_sums
        misfit = (
            np.sum(self.weight * left**2)
            + np.sum(strength**2 * self.stiffness)
            + self.row_weight * np.sum(off**2)
        )
        slope = np.where(self.lit, 2 * self.row_weight * off[:, None] - 2 * self.weight * left, 0.0)
        return float(misfit), slope, baseline
