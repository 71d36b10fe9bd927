"""Density and band-weighted cells, Eq. 2 of the paper, the Stokes limit: numbers by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fluorspar.bispectral.conversions import (
    density_from_band,
    stokes_weights,
    to_unit_norm,
)
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.errors import MaterialError
from fluorspar.spectral.wavelengths import Wavelengths

matrices = arrays(np.float64, (4, 4), elements=st.floats(-0.01, 1))
positive = st.floats(0.01, 1)


def test_the_diagonal_is_never_scaled() -> None:
    band = np.array([[0.5, 0.0, 0.0], [0.2, 0.6, 0.0], [0.4, 0.1, 0.7]])
    S, at_10 = density_from_band(band, step=10)
    assert S.tolist() == [0.5, 0.6, 0.7]
    assert at_10[2, 0] == pytest.approx(0.04)
    # from 10 to 5 nm the other cells halve
    assert DonaldsonMatrix(Wavelengths(400, 410, 5), S, luminescent=at_10).band() == pytest.approx(
        np.array([[0.5, 0.0, 0.0], [0.1, 0.6, 0.0], [0.2, 0.05, 0.7]])
    )


@given(matrices, st.sampled_from([1.0, 2.5, 5.0, 10.0, 20.0]))
def test_band_to_density_and_back(band: np.ndarray, step: float) -> None:
    S, density = density_from_band(band, step)
    back = DonaldsonMatrix(Wavelengths(400, 400 + 3 * step, step), S, luminescent=density).band()
    assert np.array_equal(np.diag(back), np.diag(band))
    assert back == pytest.approx(band, rel=1e-15, abs=1e-300)


def test_stokes_weights() -> None:
    assert stokes_weights(3, "half").tolist() == [[0.5, 0, 0], [1, 0.5, 0], [1, 1, 0.5]]
    assert stokes_weights(3, "strict").tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]


def test_eq_2_by_hand() -> None:
    # beta = (0.06, 0.08)/nm has norm 0.1; h = 5: alpha' = alpha x 0.1 x 5
    alpha, beta = to_unit_norm([0.4, 0.8], [0.06, 0.08], step=5)
    assert beta == pytest.approx([0.6, 0.8])
    assert alpha == pytest.approx([0.2, 0.4])


@given(arrays(np.float64, (2, 5), elements=positive), arrays(np.float64, (2, 5), elements=positive))
def test_eq_2(alpha: np.ndarray, beta: np.ndarray) -> None:
    """The norm is 1, the band-weighted product the same."""
    alpha_2, beta_2 = to_unit_norm(alpha, beta, step=10)
    assert np.linalg.norm(beta_2, axis=-1) == pytest.approx(1)
    assert alpha_2.T @ beta_2 == pytest.approx(10 * alpha.T @ beta)


def test_a_beta_of_0_has_no_norm() -> None:
    with pytest.raises(MaterialError, match="0 everywhere"):
        to_unit_norm(np.ones(2), np.zeros(2), 5)
