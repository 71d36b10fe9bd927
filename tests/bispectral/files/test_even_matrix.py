"""Matrices brought to a common step: exact for what is linear, near for what is smooth."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.bispectral.files.even_matrix import on_common_step
from fluorspar.errors import ApproximationWarning, MaterialError

FINE, COARSE = np.arange(400.0, 701.0, 2.0), np.arange(300.0, 601.0, 10.0)
UNEVEN = np.concatenate([np.arange(400.0, 500.0, 5.0), np.arange(500.0, 701.0, 10.0)])


def plane(emission: np.ndarray, excitation: np.ndarray) -> np.ndarray:
    """One plane below the diagonal, another above, S between them."""
    em, ex = np.meshgrid(emission, excitation, indexing="ij")
    below, above = 1e-3 + 2e-6 * (em - 500) - 1e-6 * (ex - 400), -1e-4 + 1e-6 * (ex - 400)
    return np.where(em > ex, below, np.where(em < ex, above, 0.2 + 1e-3 * (em - 400)))


@pytest.mark.parametrize(
    ("emission", "excitation", "step", "said"),
    [
        (FINE, COARSE, 5, r"emission \(by 2 nm\) and excitation \(by 10 nm\) .* to steps of 5 nm"),
        (
            COARSE[10:],
            COARSE[::2],
            10,
            r"emission \(by 10 nm\) and excitation \(by 20 nm\) .* to steps of 10 nm",
        ),
        (UNEVEN, UNEVEN[:-5], 5, r"by 5 to 10 nm"),
        (np.arange(400.0, 700.0, 1.0), np.arange(300.0, 600.0, 3.0), 5, "to steps of 5 nm"),
    ],
)
def test_a_plane_stays_a_plane_on_either_side(
    emission: np.ndarray, excitation: np.ndarray, step: float, said: str
) -> None:
    with pytest.warns(ApproximationWarning, match=said):
        em, ex, matrix = on_common_step(emission, excitation, plane(emission, excitation), "sheet.csv")
    assert np.unique(np.diff(em)).tolist() == np.unique(np.diff(ex)).tolist() == [step]
    known = (em[:, None] >= ex) | (
        em[:, None] < excitation[-2]
    )  # above the diagonal by two wavelengths or more
    np.testing.assert_allclose(matrix[known], plane(em, ex)[known], atol=1e-12)


def test_a_matrix_of_one_step_is_left_alone() -> None:
    matrix = plane(COARSE, COARSE)
    assert on_common_step(COARSE, COARSE, matrix, "sheet.csv")[2] is matrix


def test_a_dye_keeps_its_light() -> None:
    """Columns measured every 10 nm in emission every 2 nm: the sum over emission is the integral of the emission."""
    spectrum = np.exp(-(((FINE - 640) / 20) ** 2))
    matrix = np.outer(spectrum, np.exp(-(((COARSE - 450) / 40) ** 2))) * (FINE[:, None] > COARSE)
    with pytest.warns(ApproximationWarning):
        _, ex, even = on_common_step(FINE, COARSE, matrix, "sheet.csv")
    column = even[:, ex == 450][:, 0]
    assert 5 * column.sum() == pytest.approx(20 * np.sqrt(np.pi), rel=2e-3)


def test_without_a_reflectance_it_is_no_donaldson_matrix() -> None:
    """Whatever the steps are; that is not called uneven."""
    with pytest.raises(MaterialError, match=r"(?s)fewer than two cells of equal .*from-eem"):
        on_common_step(FINE + 1, COARSE, plane(FINE + 1, COARSE), "sheet.csv")
