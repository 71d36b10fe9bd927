"""Tables of a material on other wavelengths: the Donaldson matrix on those wavelengths stays what it was."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.bispectral.resampling import resampled
from fluorspar.errors import ExtrapolationWarning, MaterialError
from fluorspar.spectral.wavelengths import Wavelengths


@pytest.mark.parametrize("grid", ["300:780:5", "360:700:5", "480:640:10", "301:779:2"])
@pytest.mark.parametrize("name", ["poster-red", "poster-red:0.5,poster-yellow:0.5"])
def test_the_matrix_stays(name: str, grid: str) -> None:
    """Also on a range that cuts excitation off: what is left of beta weighs what it did."""
    wavelengths = Wavelengths.parse(grid)
    before = material(name)
    after = resampled(before, wavelengths)
    assert after.fluorescent
    np.testing.assert_allclose(
        after.on(wavelengths).band(), before.on(wavelengths).band(), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_array_equal(after.reflectance.wavelengths, wavelengths.values)
    for dye in after.fluorophores:
        assert dye.excitation.integral() == pytest.approx(1)


def test_fluorophore_that_is_not_excited_is_left_out() -> None:
    red = material("poster-red")
    assert not resampled(red, Wavelengths(700, 780, 10)).fluorescent


def test_beyond_the_data_is_said() -> None:
    with pytest.warns(ExtrapolationWarning, match="reflectance"):
        resampled(material("poster-red"), Wavelengths(290, 780, 10))


def test_measured_matrix_has_no_factors() -> None:
    w = np.array([400.0, 410.0])
    raw = Material.from_matrix("sheet", MeasuredMatrix(w, w, [[0.5, 0], [0.1, 0.4]]))
    with pytest.raises(MaterialError, match="fit it first"):
        resampled(raw, Wavelengths(400, 410, 5))
