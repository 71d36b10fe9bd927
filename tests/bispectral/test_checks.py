"""Photon yield and the Stokes side: hand-computed numbers and the limits of what passes."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from fluorspar.bispectral.checks import check_photon_yield, check_stokes_side, photon_yield
from fluorspar.errors import MaterialError, PhotonYieldWarning

W = np.arange(400.0, 701.0, 10.0)


def test_photon_yield_counts_photons_not_energy() -> None:
    # of the energy from 400 nm, 0.4 leaves at 500 and 0.3 at 600 nm: 0.4 x 1.25 + 0.3 x 1.5 photons
    # of the energy from 480 nm, 0.2 leaves at 600 nm: 0.2 x 1.25
    band = np.array([[0.4, 0.0], [0.3, 0.2]])
    found = photon_yield(band, np.array([500.0, 600.0]), np.array([400.0, 480.0]))
    assert found == pytest.approx([0.95, 0.25])


@pytest.mark.parametrize("total", [0.3, 1.0])
def test_up_to_one_nothing_is_said(total: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_photon_yield(np.array([0.1, total]), np.array([400.0, 410.0]), "dye")


def test_one_by_rounding_is_one() -> None:
    check_photon_yield(np.array([0.5, 1.0009]), np.array([400.0, 500.0]), "a sheet")


def test_slightly_above_one_is_said_and_used() -> None:
    with pytest.warns(PhotonYieldWarning, match=r"dye, excitation 410 nm: 1.14 photons"):
        check_photon_yield(np.array([0.1, 1.14]), np.array([400.0, 410.0]), "dye")


def test_far_above_one_is_refused() -> None:
    with pytest.raises(MaterialError, match=r"(?s)more photons.*dye, excitation 400 nm.*1.16 photons"):
        check_photon_yield(np.array([1.16, 0.1]), np.array([400.0, 410.0]), "dye")


def dye(strength: float, sigma: float, seed: int = 0) -> np.ndarray:
    """Return a band-weighted luminescent part; its columns add up to `strength`, every cell has noise."""
    emission = np.exp(-(((W - 600) / 25) ** 2))
    excitation = np.exp(-(((W - 480) / 30) ** 2))
    clean = np.tril(np.outer(strength * emission / emission.sum(), excitation), -1)
    noise = np.random.default_rng(seed).normal(0, sigma, clean.shape)
    return clean + noise - np.diag(np.diag(noise))


@pytest.mark.parametrize("strength", [0.1, 0.5])
@pytest.mark.parametrize("sigma", [0.0, 0.002])
def test_a_transposed_matrix_is_refused_and_the_right_one_is_not(strength: float, sigma: float) -> None:
    matrix = dye(strength, sigma)
    check_stokes_side(matrix, W, W, "dye")
    with pytest.raises(MaterialError, match="transpose"):
        check_stokes_side(matrix.T, W, W, "dye")


@pytest.mark.parametrize("seed", range(20))
def test_noise_alone_is_never_taken_for_a_transposed_matrix(seed: int) -> None:
    """Instruments have 0.001-0.006 per cell, also above the diagonal; often more there."""
    check_stokes_side(dye(0.0, 0.004, seed), W, W, "grey tile")


def test_a_transposed_matrix_need_not_be_square() -> None:
    matrix = dye(0.5, 0.0)[3:]
    check_stokes_side(matrix, W[3:], W, "dye")
    with pytest.raises(MaterialError, match="transpose"):
        check_stokes_side(matrix.T, W, W[3:], "dye")
