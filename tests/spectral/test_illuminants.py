"""Illuminants by name, against published figures."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from fluorspar.errors import SpectrumError
from fluorspar.spectral.illuminants import illuminant, illuminants
from fluorspar.spectral.wavelengths import Wavelengths


def test_d65_is_the_cie_table() -> None:
    """CIE 15: 300-830 nm by 5 nm, 100 at 560 nm."""
    d65 = illuminant("D65")
    assert np.array_equal(d65.wavelengths, np.arange(300, 831, 5))
    assert [d65.at(w) for w in (300, 400, 460, 560, 700, 780, 825, 830)] == [
        0.0341, 82.7549, 117.812, 100, 71.6091, 63.3828, 58.8765, 60.3125,
    ]  # fmt: skip


def test_d65_is_that_of_colour_science_where_both_have_data() -> None:
    from fluorspar.spectral.colour_science import colour_science

    theirs = colour_science().SDS_ILLUMINANTS["D65"]
    assert np.allclose(illuminant("D65").on(Wavelengths(300, 780, 5)), theirs.values, rtol=1e-5)


def test_a_is_planckian() -> None:
    """CIE 15: A is 100 (560/λ)^5 (exp(c2/(2848 x 560)) - 1) / (exp(c2/(2848 λ)) - 1), c2 = 1.435e7 nm K."""
    w = np.arange(380.0, 781.0, 50.0)
    planck = 100 * (560 / w) ** 5 * np.expm1(1.435e7 / (2848 * 560)) / np.expm1(1.435e7 / (2848 * w))
    a = illuminant("A")
    assert [a.at(x) for x in w] == pytest.approx(planck, rel=1e-4)


def test_e_is_flat_at_any_wavelength() -> None:
    assert illuminant("E").on(Wavelengths(200, 1000, 100)).tolist() == [100] * 9


@pytest.mark.parametrize("name", ["d50", "fl2", "FL11", " led-b1 "])
def test_names_in_any_case(name: str) -> None:
    assert illuminant(name).values.max() > 0


def test_every_listed_name_works() -> None:
    names = illuminants()
    assert len(names) > 50
    assert all(illuminant(name).values.max() > 0 for name in names)


def test_an_unknown_name_lists_the_legal_ones() -> None:
    with pytest.raises(SpectrumError, match=r"(?s)'D66'.*D50, D55, D60, D65.*did you mean D6"):
        illuminant("D66")


def test_d65_needs_no_slow_import_and_colour_science_leaves_numpy_alone() -> None:
    code = (
        "import sys, numpy as np\n"
        "from fluorspar.spectral.illuminants import illuminant\n"
        "illuminant('D65'); assert 'colour' not in sys.modules\n"
        "before = np.get_printoptions(); illuminant('D50'); assert 'colour' in sys.modules\n"
        "assert np.get_printoptions() == before\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
