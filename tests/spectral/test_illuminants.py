"""Illuminants by name, against published figures."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fluorspar.errors import ApproximationWarning, SpectrumError
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


class TestFiles:
    """A lamp that was measured: dark noise around 0 is no negative light, and a fault is called by its name."""

    W = np.arange(350, 801)

    def write(self, folder: Path, dark: float) -> str:
        light = np.where(self.W % 2, dark, 0.001) + np.exp(-(((self.W - 550) / 20) ** 2))
        rows = [f"{w}\t{v:.6g}" for w, v in zip(self.W, light, strict=True)]
        (folder / "led.dat").write_text("\n".join(["Date: today", ">>>>>Begin Spectral Data<<<<<", *rows]))
        return str(folder / "led.dat")

    def test_small_negative_noise_is_set_to_0_and_said(self, tmp_path: Path) -> None:
        file = self.write(tmp_path, dark=-0.004)
        with pytest.warns(
            ApproximationWarning, match=r"led\.dat: \d+ negative values, down to -0\.004 \(0\.4 %"
        ):
            lamp = illuminant(file)
        assert lamp.values.min() == 0
        assert lamp.at(550) == pytest.approx(1.001, abs=1e-5)

    def test_light_without_noise_is_as_it_stands(self, tmp_path: Path) -> None:
        assert illuminant(self.write(tmp_path, dark=0.0)).at(351) == pytest.approx(0)

    def test_large_negative_values_are_refused(self, tmp_path: Path) -> None:
        with pytest.raises(
            SpectrumError, match=r"(?s)light is negative.*led\.dat, \d+ nm.*-0\.05.*dark signal"
        ):
            illuminant(self.write(tmp_path, dark=-0.05))

    def test_a_column(self, tmp_path: Path) -> None:
        (tmp_path / "lamps.csv").write_text("nm,warm,cold\n400,1,2\n700,1,2\n")
        assert illuminant(f"{tmp_path}/lamps.csv:cold").at(500) == 2

    @pytest.mark.parametrize(
        ("name", "text", "complaint"),
        [
            ("lamps.csv", "nm,warm,cold\n400,1,2\n700,1,2\n", "several spectra"),
            ("lamp.sp", 'SPECT\n\nORIGINATOR "me"\nSPECTRAL_BANDS "3"\n', "no rows of numbers"),
            ("lamp", "400 1\n500 x\n600 1\n", "line 2"),
        ],
    )
    def test_a_file_that_is_none_is_refused_for_its_own_fault(
        self, tmp_path: Path, name: str, text: str, complaint: str
    ) -> None:
        (tmp_path / name).write_text(text)
        with pytest.raises(SpectrumError, match=complaint):
            illuminant(str(tmp_path / name))

    @pytest.mark.parametrize("name", ["no.csv", "no.spdx", "folder/no"])
    def test_a_file_that_is_not_there(self, name: str) -> None:
        with pytest.raises(SpectrumError, match="does not exist"):
            illuminant(name)
