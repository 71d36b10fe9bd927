"""Each equation with numbers computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged import equations

GRID = Wavelengths(400, 420, 10)
# D, band-weighted: S on the diagonal, what 400 nm excites at 410 and 420 nm, and 410 nm at 420 nm.
D = DonaldsonMatrix.from_band([[0.5, 0, 0], [0.2, 0.4, 0], [0.3, 0.1, 0.8]], GRID)


def test_indirect_is_all_bounces_less_direct():
    assert equations.indirect_reflection([3.0, 5.0], [1.0, 4.5]).tolist() == [2.0, 0.5]


def test_eq_11_undoes_the_reflection():
    E = np.array([2.0, 1.0, 4.0])
    assert equations.illumination(D.reflect(E), D.reflectance) == pytest.approx(E)


def test_eq_11_refuses_a_black_surface():
    with pytest.raises(ZeroDivisionError):
        equations.illumination([0.0, 0.1], [0.0, 0.5])


def test_eqs_7_and_9_sum_over_excitation():
    """By hand: 410 nm: 0.2 x 2; 420 nm: 0.3 x 2 + 0.1 x 1."""
    assert equations.luminescence(D, [2.0, 1.0, 4.0]) == pytest.approx([0.0, 0.4, 0.7])


def test_the_light_of_a_patch_is_the_mean_of_its_points():
    samples = [[1.0, 0.0], [5.0, 2.0], [3.0, 1.0]]
    assert equations.average_illumination(samples, [1, 0, 1], 2).tolist() == [[5.0, 2.0], [2.0, 0.5]]


def test_eq_10_adds_up_objects_and_eq_13_components():
    assert equations.luminescent_reflection([[1.0, 2.0], [0.5, 0.25]]).tolist() == [1.5, 2.25]
    assert equations.total([[1.0], [2.0], [0.5], [0.25], [0.125]]).tolist() == [3.875]


def test_eq_12_a_surface_without_luminescence_keeps_1_3_and_5():
    plain = DonaldsonMatrix(GRID, [0.5, 0.5, 0.5])
    assert not equations.luminescence(plain, [1.0, 2.0, 3.0]).any()
