"""Points in other units, other axes or another place than was meant: nothing of that is measured in silence."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from fluorspar.errors import FluorsparWarning, OptionError
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.measure import measure
from fluorspar.measuring.points import Point, read_points
from fluorspar.spectral.wavelengths import Wavelengths

POINTS = read_points(Path(__file__).parents[2] / "examples" / "cornell-points.csv")


def image(width: int, height: int) -> SpectralImage:
    radiance = np.ones((1, height, width, 3), np.float32)
    attrs = {"scene": "cornell-box"}
    return SpectralImage.from_arrays(radiance, Wavelengths(500, 600, 50), attrs=attrs, components=["total"])


def moved(factor: float = 1.0, order: tuple[int, ...] = (0, 1, 2)) -> list[Point]:
    """The 13 points of the box in other units, or with other axes."""
    return [Point(p.name, tuple(factor * p.position[axis] for axis in order)) for p in POINTS]


def pixels(*places: tuple[float, float]) -> list[Point]:
    return [Point(str(number), place) for number, place in enumerate(places, start=1)]


class TestUnits:
    @pytest.mark.parametrize("size", [(64, 64), (1500, 1500)])
    def test_metres_in_a_scene_of_millimetres_are_in_one_corner(self, size):
        """The corner of the box is at 0, 0, 0, so all are on its surfaces; their greatest coordinate is 0.55926."""
        with pytest.warns(
            FluorsparWarning, match=r"all 3 points lie within 0\.555 units.*multiplied by 1000 all"
        ):
            measure(image(*size), moved(1e-3)[:3], aperture="1px")

    @pytest.mark.parametrize(("factor", "back"), [(0.1, "10"), (10, "0.1"), (100, "0.01"), (1000, "0.001")])
    def test_others_are_refused_and_the_factor_is_found(self, factor, back):
        with pytest.raises(
            OptionError, match=rf"and \d+ others(?s:.*)multiplied by {back} all are on surfaces"
        ):
            measure(image(64, 64), moved(factor))

    def test_one_point_is_enough(self):
        with pytest.raises(OptionError, match="multiplied by 10 all"):
            measure(image(64, 64), [Point("7", (18.6, 16.5, 16.8))])

    def test_where_no_factor_fits_none_is_proposed(self):
        with pytest.raises(OptionError) as caught:
            measure(image(64, 64), [*moved()[:5], Point("air", (278, 400, 100))])
        assert "point air" in str(caught.value)
        assert "fix" not in str(caught.value)


class TestAxes:
    def test_height_as_the_last_coordinate(self):
        with pytest.raises(OptionError, match="with x, z, y in place of x, y, z all"):
            measure(image(64, 64), moved(order=(0, 2, 1)))

    def test_a_row_and_a_column(self):
        with pytest.raises(OptionError, match=r"(?s)point 1 at 3, 40\n.*exchange x and y"):
            measure(image(64, 32), pixels((3, 40), (31, 2)), aperture="1px")

    def test_pixels_counted_from_one(self):
        with pytest.raises(OptionError, match=r"(?s)point 2 at 64, 3\n.*count from 0"):
            measure(image(64, 32), pixels((1, 1), (64, 3)), aperture="1px")

    def test_all_outside_are_counted(self):
        with pytest.raises(OptionError, match=r"(?s)outside.*point 1 at 100, 3, and 1 other\n"):
            measure(image(64, 32), pixels((100, 3), (3, 400)), aperture="1px")


class TestPlaces:
    def test_shares_of_the_image_are_no_pixels(self):
        with pytest.warns(FluorsparWarning, match="all 2 points lie within one pixel.*not shares"):
            measure(image(64, 32), pixels((0.1, 0.2), (0.9, 0.8)), aperture="1px")

    def test_two_points_at_one_place(self):
        points = pixels((3, 4), (9, 9), (3, 4))
        with pytest.warns(FluorsparWarning, match="^points 1, 3 are at the same place$"):
            measure(image(64, 32), points, aperture="1px")

    @pytest.mark.parametrize(
        "points",
        [pixels((3, 4)), pixels((3, 4), (5, 4)), moved()],
        ids=["one", "two pixels apart", "as they are"],
    )
    def test_nothing_is_said_of_points_that_are_right(self, points):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            measure(image(64, 64), points, aperture="1px")
