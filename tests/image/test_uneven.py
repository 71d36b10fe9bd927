"""Images of uneven bands: kept, in every format, and their colours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar.colour.observers import CIE_1931
from fluorspar.colour.xyz import matching_functions, xyz_from_radiance
from fluorspar.comparing.compare import compare
from fluorspar.errors import SpectrumError
from fluorspar.image.converted import converted
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.uneven import UnevenWavelengths, grid_through
from fluorspar.spectral.wavelengths import Wavelengths

AT = [365.0, 405.0, 450.0, 525.0, 630.0]
GRID = UnevenWavelengths(AT)


@pytest.fixture
def uneven() -> SpectralImage:
    return SpectralImage.from_arrays(np.random.default_rng(1).random((7, 3, 4, 5)), GRID)


def test_a_linear_spectrum_has_the_tristimulus_values_of_its_integral() -> None:
    """1 + lambda / 100 from 365 to 630 nm, integrated over the observer's table in steps of 1 nm."""
    at, functions = matching_functions(CIE_1931)
    inside = (at >= AT[0]) & (at <= AT[-1])
    weighted = (1 + at[inside] / 100)[:, np.newaxis] * functions[inside]
    expected = 683 * (weighted.sum(axis=0) - (weighted[0] + weighted[-1]) / 2)
    np.testing.assert_allclose(xyz_from_radiance(1 + np.array(AT) / 100, GRID), expected, rtol=1e-12)


@pytest.mark.parametrize("suffix", [".nc", ".exr"])
def test_every_format_keeps_them(uneven: SpectralImage, tmp_path: Path, suffix: str) -> None:
    uneven.save(tmp_path / f"a{suffix}")
    with SpectralImage.open(tmp_path / f"a{suffix}") as read:
        assert read.wavelengths == GRID
        np.testing.assert_array_equal(read.dataset.radiance, uneven.dataset.radiance)
        assert "365-630 nm, 5 uneven bands" in repr(read)


def test_even_ones_are_even() -> None:
    assert grid_through([400, 410, 420]) == Wavelengths(400, 420, 10)
    assert grid_through([400, 410, 425]) == UnevenWavelengths([400, 410, 425])
    assert len({GRID, UnevenWavelengths(AT), UnevenWavelengths(AT[1:])}) == 2


def test_what_needs_a_step_refuses_them() -> None:
    with pytest.raises(SpectrumError, match=r"(?s)not evenly spaced.*convert IN OUT --wavelengths 365:630:5"):
        _ = GRID.step


def test_they_are_brought_to_even_ones(uneven: SpectralImage) -> None:
    even = converted(uneven, wavelengths=Wavelengths(365, 630, 5))
    expected = [np.interp(even.wavelengths.values, AT, spectrum) for spectrum in uneven.total()[0].values]
    np.testing.assert_allclose(even.total()[0], expected, rtol=1e-5)
    assert "linear interpolation" in even.attrs["converted"]


def test_they_can_be_compared(uneven: SpectralImage) -> None:
    assert compare(uneven, uneven).grid == Wavelengths(365, 630, 66.25)
    assert "linear interpolation" in str(compare(uneven, uneven))


def test_the_grid_that_is_proposed_lies_within_the_bands():
    with pytest.raises(SpectrumError, match="--wavelengths 401:404:1"):
        _ = UnevenWavelengths([401, 402, 404]).step
