"""Colour: against published tristimulus values, CIELAB and sRGB, and against colour-science."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fluorspar.colour.xyz import (
    K_M,
    lab_from_xyz,
    luminance,
    observer_weights,
    srgb_encode,
    srgb_from_xyz,
    white_xyz,
    xyz_from_radiance,
)
from fluorspar.errors import OptionError
from fluorspar.spectral.colour_science import colour_science
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths

VISIBLE = Wavelengths(360, 780, 5)


@pytest.mark.parametrize(
    ("name", "observer", "x", "y"),
    [
        ("D65", "CIE 1931 2 Degree Standard Observer", 0.31272, 0.32903),
        ("D65", "CIE 1964 10 Degree Standard Observer", 0.31382, 0.33100),
        ("A", "CIE 1931 2 Degree Standard Observer", 0.44758, 0.40745),
        ("D50", "CIE 1931 2 Degree Standard Observer", 0.34567, 0.35851),
        ("E", "CIE 1931 2 Degree Standard Observer", 1 / 3, 1 / 3),
    ],
)
def test_chromaticities_of_cie_15(name: str, observer: str, x: float, y: float) -> None:
    xyz = white_xyz(illuminant(name).on(VISIBLE, outside="zero"), VISIBLE, observer)
    assert xyz[:2] / xyz.sum() == pytest.approx([x, y], abs=1e-4)


def test_one_watt_at_555_nm_is_683_lumen() -> None:
    for step in (1, 5):
        grid = Wavelengths(555 - 5 * step, 555 + 5 * step, step)
        radiance = np.zeros(11)
        radiance[5] = 1 / step
        assert luminance(radiance, grid) == pytest.approx(683)


@pytest.mark.parametrize("step", [1, 2.5, 5, 10, 20])
def test_the_step_does_not_matter(step: float) -> None:
    grid = Wavelengths(360, 780, step)
    assert xyz_from_radiance(np.full(len(grid), 0.01), grid) == pytest.approx(
        [1.0 * K_M * 1.0686] * 3, rel=4e-3
    )


def test_the_range_of_the_sum() -> None:
    """Bands outside 360-830 nm count as 0, whatever they hold; a default grid misses 0.05 % of Y."""
    grid = Wavelengths(300, 900, 5)
    weights = observer_weights(grid)
    outside = (grid.values < 360) | (grid.values > 830)
    assert not weights[outside].any()
    assert weights[~outside].any(axis=1).all()
    lost = 1 - observer_weights(Wavelengths())[:, 1].sum() / weights[:, 1].sum()
    assert lost == pytest.approx(0.0005, abs=1e-4)


def test_images_keep_their_shape() -> None:
    radiance = np.random.default_rng(0).uniform(size=(2, 3, len(VISIBLE)))
    assert xyz_from_radiance(radiance, VISIBLE).shape == (2, 3, 3)
    assert xyz_from_radiance(radiance.astype("f4"), VISIBLE) == pytest.approx(
        xyz_from_radiance(radiance, VISIBLE), rel=2e-6
    )
    assert luminance(radiance, VISIBLE) == pytest.approx(xyz_from_radiance(radiance, VISIBLE)[..., 1])


def test_an_unknown_observer_lists_the_known() -> None:
    with pytest.raises(OptionError, match=r"(?s)no such observer.*CIE 1931 2 Degree"):
        observer_weights(VISIBLE, "me")


def test_weights_cannot_be_changed_by_a_caller() -> None:
    with pytest.raises(ValueError, match="read-only"):
        observer_weights(VISIBLE)[0, 0] = 1


class TestLab:
    white = np.array([0.9504, 1.0, 1.0888])

    def test_white_grey_and_black(self) -> None:
        assert lab_from_xyz(self.white, self.white) == pytest.approx([100, 0, 0])
        # L* = 116 x 0.5 - 16 where Y = 0.125; below (6/29)^3, L* = (29/3)^3 Y
        assert lab_from_xyz(0.125 * self.white, self.white) == pytest.approx([42, 0, 0], abs=1e-12)
        assert lab_from_xyz(0.005 * self.white, self.white) == pytest.approx(
            [(29 / 3) ** 3 * 0.005, 0, 0], abs=1e-12
        )
        assert lab_from_xyz([0, 0, 0], self.white) == pytest.approx([0, 0, 0], abs=1e-12)

    def test_a_and_b_by_hand(self) -> None:
        # X/Xn = 0.216, Y/Yn = 0.125, Z/Zn = 0.027: cube roots 0.6, 0.5, 0.3
        xyz = self.white * [0.216, 0.125, 0.027]
        assert lab_from_xyz(xyz, self.white) == pytest.approx([42, 50, 40])

    @given(arrays(np.float64, (4, 3), elements=st.floats(0, 2)))
    def test_colour_science_agrees(self, xyz: np.ndarray) -> None:
        xy = self.white[:2] / self.white.sum()
        theirs = colour_science().XYZ_to_Lab(xyz, xy)
        assert lab_from_xyz(xyz, self.white) == pytest.approx(theirs, abs=1e-4)


class TestSrgb:
    d65 = np.array([0.9505, 1.0, 1.0890])

    def test_white_grey_and_black(self) -> None:
        """IEC 61966-2-1: linear 0.2140 is 0.5 encoded, 0.0031308 is where the straight part ends."""
        rgb, changed = srgb_from_xyz([1.0 * self.d65, 0.2140 * self.d65, 0.0 * self.d65])
        assert rgb == pytest.approx(np.array([[1.0] * 3, [0.5] * 3, [0.0] * 3]), abs=2e-4)
        assert changed == 0
        assert srgb_encode([0.0031308, 0.001]) == pytest.approx([0.0404499, 0.01292], rel=1e-5)

    def test_primaries(self) -> None:
        xyz = [[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]]
        rgb, _ = srgb_from_xyz(xyz)
        assert rgb == pytest.approx(np.eye(3), abs=5e-3)

    def test_exposure_multiplies(self) -> None:
        xyz = 20 * self.d65
        assert srgb_from_xyz(xyz, exposure=0.01)[0] == pytest.approx(srgb_from_xyz(0.2 * self.d65)[0])

    def test_out_of_gamut_keeps_its_luminance_and_is_counted(self) -> None:
        """A saturated green and an orange, neither of which sRGB has, among two colours it has."""
        xyz = np.array([[0.1, 0.5, 0.1], [0.5, 0.3, 0.0], [0.2, 0.2, 0.2], [0.0, 0.0, 0.0]])
        rgb, changed = srgb_from_xyz(xyz)
        assert changed == 0.5
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        assert linear @ [0.2126, 0.7152, 0.0722] == pytest.approx(xyz[:, 1], abs=2e-4)
        assert rgb[0].argmax() == 1
        assert rgb[1].argmax() == 0

    def test_brighter_than_white_is_white(self) -> None:
        rgb, changed = srgb_from_xyz([7 * self.d65, [2.0, 3.0, 0.5]])
        assert rgb == pytest.approx(np.ones((2, 3)), abs=1e-12)
        assert changed == 1

    @given(arrays(np.float64, (5, 3), elements=st.floats(0, 5)))
    def test_always_within_the_cube(self, xyz: np.ndarray) -> None:
        rgb, _ = srgb_from_xyz(xyz)
        assert (rgb >= 0).all()
        assert (rgb <= 1).all()

    @given(arrays(np.float64, (4, 3), elements=st.floats(0, 1)))
    def test_colour_science_agrees_within_the_gamut(self, linear: np.ndarray) -> None:
        xyz = (
            linear
            @ np.linalg.inv(
                [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
            ).T
        )
        rgb, changed = srgb_from_xyz(xyz)
        assert changed == 0
        assert rgb == pytest.approx(colour_science().cctf_encoding(linear, "sRGB"), abs=1e-6)

    @pytest.mark.parametrize("exposure", [0, -1, np.nan, np.inf])
    def test_impossible_exposures(self, exposure: float) -> None:
        with pytest.raises(OptionError, match="exposure"):
            srgb_from_xyz([0, 0, 0], exposure)
