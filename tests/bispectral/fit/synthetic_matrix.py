"""Measured matrices made up from known spectra: what an instrument would have given, noise included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.spectral.spectrum import trapezoid

Array = NDArray[np.float64]

EMISSION = np.arange(380.0, 721.0, 10.0)
EXCITATION = np.arange(330.0, 721.0, 10.0)
SHIFT = EMISSION[:, None] - EXCITATION[None, :]


@dataclass(frozen=True)
class Truth:
    """Spectra of a sample: S on EMISSION; alpha (K, M) on EMISSION; beta (K, P) on EXCITATION, integral 1."""

    reflectance: Array
    alpha: Array
    beta: Array

    @property
    def luminescent(self) -> Array:
        """h alpha beta^T without the Stokes limit, (M, P)."""
        return 10.0 * self.alpha.T @ self.beta

    def measured(self, seed: int, noise: float = 0.003, baseline: float = 0.0) -> MeasuredMatrix:
        """The matrix, half a cell of luminescence in its diagonal, with white noise and a baseline per column."""
        rng = np.random.default_rng(seed)
        reflected = np.interp(EXCITATION, EMISSION, self.reflectance)
        cells = np.where(SHIFT > 0, self.luminescent, np.where(SHIFT == 0, 0.5 * self.luminescent, 0.0))
        cells += np.where(SHIFT == 0, reflected[None, :], 0.0)
        cells += rng.normal(0, noise, cells.shape) + baseline * rng.normal(0, 1, len(EXCITATION))
        return MeasuredMatrix(EMISSION, EXCITATION, cells, "synthetic")


def random_sample(rank: int, seed: int) -> Truth:
    """A grey-to-white sample with `rank` dyes, weakened where more photons would leave than arrive.

    All emit beyond where any is excited: below the diagonal, two dyes of which one emits at shorter
    wavelengths than the other is excited are nearly one product alpha beta^T, and nobody could count them.
    """
    rng = np.random.default_rng(seed)
    peaks = {0: (), 1: ((470.0, 520.0),), 2: ((420.0, 530.0), (480.0, 600.0))}
    peaks[3] = ((390.0, 530.0), (440.0, 585.0), (490.0, 640.0))
    alpha, beta = np.zeros((rank, len(EMISSION))), np.zeros((rank, len(EXCITATION)))
    for k, (excited, emitted) in enumerate(peaks[rank]):
        alpha[k] = rng.uniform(0.3, 0.45) * bump(EMISSION, emitted + rng.uniform(-8, 8), rng.uniform(18, 28))
        beta[k] = bump(EXCITATION, excited + rng.uniform(-8, 8), rng.uniform(20, 30))
        beta[k] /= trapezoid(beta[k], EXCITATION)
    reflectance = 0.1 + 0.4 / (1 + np.exp(-(EMISSION - rng.uniform(480, 600)) / 20))
    photons = 10 * EMISSION @ (alpha.T @ beta * (SHIFT > 0)) / EXCITATION
    most = np.max(photons / (0.95 - np.interp(EXCITATION, EMISSION, reflectance)))
    return Truth(reflectance, alpha / max(1.0, most), beta)


def bump(w: Array, peak: float | Array, width: float) -> Array:
    """A Gaussian of height 1."""
    return np.exp(-0.5 * ((w - peak) / width) ** 2)
