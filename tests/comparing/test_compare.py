"""Comparing images and tables, on arrays small enough to be computed by hand."""

from __future__ import annotations

import html
import json

import numpy as np
import pytest
from by_hand import GRID, image_of, table_of

from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import CIE_1931, lab_from_xyz, white_xyz, xyz_from_radiance
from fluorspar.comparing.compare import compare
from fluorspar.comparing.comparison import Detail
from fluorspar.comparing.sides import ImageSide
from fluorspar.errors import ImageError, OptionError, SpectrumError
from fluorspar.figures.report import report
from fluorspar.figures.spectra import comparison_figure, encode
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.points import Point
from fluorspar.spectral.bands import Bands
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths


@pytest.fixture
def random_image():
    return image_of(np.random.default_rng(1).random((12, 9, 7)) + 0.1)


class TestIdentity:
    def test_an_image_and_itself_differ_by_exactly_nothing(self, random_image):
        found = compare(random_image, random_image).images
        for values in (found.rmse, found.de00, found.rgb_difference, found.band_error, found.band_bias):
            assert not values.any()

    def test_a_table_and_itself(self):
        table = table_of(np.random.default_rng(2).random((2, 7)))
        found = compare(table, table, match="a").points
        assert not found.rmse.any()
        assert not found.de00.any()

    @pytest.mark.parametrize("factor", [2.0, 0.37, 1e4])
    def test_a_scaled_copy_after_matching_by_luminance(self, random_image, factor):
        scaled = SpectralImage(
            random_image.dataset.assign(radiance=random_image.dataset.radiance * np.float32(factor))
        )
        found = compare(random_image, scaled, match="luminance")
        assert found.scale == pytest.approx(1 / factor, rel=1e-6)
        assert found.images.rmse.max() < 1e-6
        assert found.images.de00.max() < 2e-4

    def test_a_scaled_copy_after_matching_at_a_point(self, random_image):
        scaled = SpectralImage(
            random_image.dataset.assign(radiance=random_image.dataset.radiance * np.float32(3))
        )
        points = (Point("white", (3, 4)), Point("other", (5, 6)))
        found = compare(random_image, scaled, points=points, aperture=Aperture(1, "px"), match="white")
        assert found.points.rmse.max() < 1e-6


class TestPointsByHand:
    a = np.array([[2.0, 2, 2, 2, 2, 2, 2], [1, 1, 1, 5, 1, 1, 1]])
    b = np.array([[4.0, 4, 4, 4, 4, 4, 4], [2, 2, 2, 2, 2, 2, 2]])

    def test_equation_14_normalised_at_a_point(self):
        """One root over all points, and the mean of the roots of each.

        Point b: (0.5, ..., 2.5, ...) - (0.5, ...) is 2 in one band of seven; point a: nothing.
        Expected: sqrt(4 / 14), and 2 / sqrt(7) / 2.
        """
        found = compare(table_of(self.a), table_of(self.b), match="a")
        np.testing.assert_allclose(found.points.rmse, [0, 2 / np.sqrt(7)], atol=1e-15)
        assert found.value("rmse_eq14") == pytest.approx(np.sqrt(4 / 14))
        assert found.value("rmse") == pytest.approx(1 / np.sqrt(7))
        points = json.loads(found.to_json())["points"]
        assert points["rmse_eq14"] == pytest.approx(np.sqrt(4 / 14))
        assert points["rmse"] == pytest.approx(1 / np.sqrt(7))
        assert "RMSE, Eq. 14 0.53452   (one root over all points)" in found.text()
        assert "mean RMSE    0.37796" in found.text()
        assert (found.mean_a, found.mean_b, found.scale) == (2, 4, 0.5)

    def test_as_they_are(self):
        """Both are divided by the mean of A, 25 / 14."""
        found = compare(table_of(self.a), table_of(self.b))
        np.testing.assert_allclose(found.points.rmse[0], 2 / (25 / 14))
        np.testing.assert_allclose(found.points.band_bias, [3 / 3, 3 / 3, 3 / 3, -1 / 7, 1, 1, 1])
        np.testing.assert_allclose(found.points.band_error[3], (2 + 3) / 7)
        assert found.points.bias == pytest.approx((42 - 25) / 25)

    def test_only_400_to_700_nm_counts_for_rmse(self):
        grid = Wavelengths(350, 750, 50)
        a, b = np.ones((1, 9)), np.ones((1, 9))
        b[0, [0, -1]] = 9.0
        found = compare(table_of(a, grid, names="a"), table_of(b, grid, names="a"), match="a")
        assert found.value("rmse") == 0
        assert found.rmse_bands == (400, 700)

    def test_ciede2000_with_a_point_as_white(self):
        found = compare(table_of(self.a), table_of(self.b), match="a")
        white = xyz_from_radiance(self.a[0], GRID)
        labs = [lab_from_xyz(xyz_from_radiance(values, GRID), white) for values in (self.a[1], self.b[1] / 2)]
        assert found.points.de00[1] == pytest.approx(ciede2000(*labs), rel=1e-12)
        np.testing.assert_allclose(found.points.lab_a[0], [100, 0, 0], atol=1e-9)
        assert any("White of CIELAB, for both sides: point a of A" in note for note in found.notes)

    def test_ciede2000_with_an_illuminant_and_the_10_degree_observer(self):
        observer = "CIE 1964 10 Degree Standard Observer"
        found = compare(table_of(self.a), table_of(self.b), white="A", observer=observer)
        relative = white_xyz(illuminant("A").on(GRID), GRID, observer)
        level = table_of(self.a).luminance(observer).max()
        np.testing.assert_allclose(found.white, relative * level / relative[1])
        assert observer != CIE_1931

    def test_measured_bands_and_a_render_of_samples(self):
        """Rationale: a 10 nm instrument sees the render through triangles, and not only every second sample."""
        fine, coarse = Wavelengths(400, 700, 5), Wavelengths(400, 700, 10)
        line = np.zeros((1, 61))
        line[0, 31] = 1.0  # 555 nm, which the 10 nm grid does not have
        seen = np.zeros((1, 31))
        seen[0, [15, 16]] = 0.25  # 550 and 560 nm, 5 nm away: half of the height, 5 nm of an area of 10
        found = compare(table_of(seen, coarse, None, "a"), table_of(line, fine, 0.0, "a"))
        assert found.value("rmse") < 1e-12
        samples = compare(table_of(seen, coarse, 0.0, "a"), table_of(line, fine, 0.0, "a"))
        assert not samples.points.b.any()
        assert "triangles of 10 nm" in " ".join(found.notes)


class TestMapsByHand:
    def test_rmse_map(self):
        a, b = np.full((2, 2, 7), 2.0), np.full((2, 2, 7), 2.0)
        b[0, 1, :] = 3.0
        b[1, 0, 2] = 9.0
        found = compare(image_of(a), image_of(b)).images
        np.testing.assert_allclose(found.rmse, [[0, 0.5], [3.5 / np.sqrt(7), 0]], rtol=1e-6)

    def test_rmse_map_counts_400_to_700_nm_only(self):
        a, b = np.ones((1, 2, 9)), np.ones((1, 2, 9))
        b[..., [0, -1]] = 9.0
        grid = Wavelengths(350, 750, 50)
        found = compare(image_of(a, grid), image_of(b, grid)).images
        assert not found.rmse.any()
        assert found.band_error[0] == pytest.approx(8)

    def test_errors_of_bands(self):
        """A is 1 and 3, B 2 and 0: the mean of A is 2, |B - A| is 1 and 3, B - A is 1 and -3."""
        a = np.stack([[np.full(7, 1.0), np.full(7, 3.0)]])
        b = np.stack([[np.full(7, 2.0), np.full(7, 0.0)]])
        found = compare(image_of(a), image_of(b)).images
        np.testing.assert_allclose(found.band_error, (1 + 3) / 2 / 2)
        np.testing.assert_allclose(found.band_bias, (1 - 3) / 2 / 2)
        assert found.bias == pytest.approx(-0.5)
        np.testing.assert_allclose((found.mean_a, found.mean_b), [[2.0] * 7, [1.0] * 7])

    @pytest.mark.parametrize("level", [1e-24, 1.0, 1e20, 1e30])
    def test_radiance_of_any_size(self, level):
        """Rationale: squares of 1e20 or 1e-24 are beyond float32. B is 10 % brighter in one of two pixels."""
        random = np.random.default_rng(4).random((16, 16, 1)) + 0.5
        a = level * random * np.ones(7)
        b = a.copy()
        b[0, 0] *= 1.1
        found = compare(image_of(a, error=0.01 * a), image_of(b, error=0.01 * b)).images
        assert found.rmse[0, 0] == pytest.approx(0.1 * random[0, 0, 0] / random.mean(), rel=1e-4)
        assert found.bias == pytest.approx(0.1 * random[0, 0, 0] / random.sum(), rel=1e-3)
        # the pixel of 10 %, in variances of 1 %, twice, of the 64 pixels of its block
        z = np.sqrt(0.1**2 / (0.01**2 * (1 + 1.1**2))) * random[0, 0, 0]
        expected = z / np.sqrt(np.sum(random[:8, :8] ** 2 * 2 / 2.21))
        assert found.noise.block_z == pytest.approx(expected, rel=0.02)

    def test_ciede2000_map_and_pictures(self):
        """White and half of it, under D65 as the white of the pictures."""
        light = illuminant("D65").on(GRID)
        a = np.stack([[light, light]])
        b = np.stack([[light, light / 2]])
        done = compare(image_of(a), image_of(b))
        found = done.images
        white = xyz_from_radiance(light, GRID)
        lab = [lab_from_xyz(values, done.white) for values in (white, white / 2)]
        np.testing.assert_allclose(found.de00, [[0, ciede2000(*lab)]], rtol=1e-4)
        np.testing.assert_allclose(found.rgb_difference[0, 1], -(1 - 0.7354), atol=0.02)
        assert not found.rgb_difference[0, 0].any()
        np.testing.assert_array_equal(found.rgb_a[0, 0], found.rgb_b[0, 0])

    def test_pictures_adapted_to_a_white_of_the_users(self):
        """Light of illuminant A is orange in sRGB, and grey once A is what is taken as white."""
        light = np.stack([[illuminant("A").on(GRID)] * 2])
        plain = compare(image_of(light), image_of(light), white="A").images.rgb_a[0, 0].astype(int)
        adapted = (
            compare(image_of(light), image_of(light), white="A", adapt=True).images.rgb_a[0, 0].astype(int)
        )
        assert plain[0] - plain[2] > 60
        assert np.ptp(adapted) <= 2

    def test_pixels_that_were_not_rendered_are_left_out(self, random_image):
        part = SpectralImage(random_image.dataset.copy(deep=True))
        part.dataset["radiance"][:, 6:] = np.nan
        found = compare(random_image, part)
        assert found.images.as_dict()["pixels_compared"] == 6 * 9
        assert found.value("rmse_max") == 0

    def test_many_blocks_of_rows_give_what_one_gives(self, random_image, monkeypatch):
        other = image_of(np.random.default_rng(9).random((12, 9, 7)))
        whole = compare(random_image, other, match="luminance").to_json()
        monkeypatch.setattr("fluorspar.image.dataset._BLOCK_BYTES", 4 * 9 * 7 * 5)
        monkeypatch.setattr("fluorspar.comparing.sides._KEEP_BYTES", 0)
        part = json.loads(compare(random_image, other, match="luminance").to_json())
        for key in ("rmse", "de00_mean", "bias"):
            assert part["images"][key] == pytest.approx(json.loads(whole)["images"][key], rel=1e-6)


class TestColour:
    def test_the_10_degree_observer_is_for_cielab_only(self):
        """Luminance, and with it the scale, the exposure and the pictures, is CIE 1931 by definition."""
        random = np.random.default_rng(12)
        a, b = (image_of(random.random((12, 9, 7)) + 0.1) for _ in range(2))
        two, ten = (
            compare(a, b, match="luminance", observer=observer)
            for observer in (CIE_1931, "CIE 1964 10 Degree Standard Observer")
        )
        assert ten.scale == two.scale
        luminances = [float(image.luminance().mean()) for image in (a, b)]
        assert two.scale == pytest.approx(luminances[0] / luminances[1], rel=1e-6)
        assert ten.images.exposure == two.images.exposure
        np.testing.assert_array_equal(ten.images.rgb_b, two.images.rgb_b)
        assert abs(ten.value("de00") - two.value("de00")) > 0.01
        white = white_xyz(illuminant("D65").on(GRID), GRID)
        white_10 = white_xyz(illuminant("D65").on(GRID), GRID, ten.observer)
        np.testing.assert_allclose(ten.white, white_10 / white[1] / ten.images.exposure)

    def test_the_luminance_that_is_said_is_cie_1931(self):
        table = table_of(np.random.default_rng(13).random((2, 7)))
        found = compare(table, table, match="a", observer="CIE 1964 10 Degree Standard Observer")
        assert any(f"{table.luminance()[0]:.6g} cd/m2" in note for note in found.notes)

    @pytest.mark.parametrize(
        ("short", "name"), [("2", CIE_1931), (10, "CIE 1964 10 Degree Standard Observer")]
    )
    def test_an_observer_by_its_degrees_is_the_one_of_that_name(self, short, name):
        a, b = (image_of(np.random.default_rng(seed).random((4, 5, 7))) for seed in (1, 2))
        assert compare(a, b, observer=short).to_json() == compare(a, b, observer=name).to_json()
        assert compare(a, b, observer=short).observer == name
        assert a.xyz(observer=short).attrs == a.xyz(observer=name).attrs

    def test_bands_without_blue_have_no_ciede2000(self):
        grid = Wavelengths(680, 700, 5)
        a, b = image_of(np.ones((3, 4, 5)), grid), image_of(np.full((3, 4, 5), 1.1), grid)
        found = compare(a, b)
        assert found.value("rmse") == pytest.approx(0.1)
        assert json.loads(found.to_json())["images"]["de00_mean"] is None
        assert "CIEDE2000 cannot be computed: in these bands the white has no Z." in found.notes
        assert "CIEDE2000    cannot be computed" in found.text()
        with pytest.raises(OptionError, match="de00 cannot be computed"):
            found.value("de00")
        assert "cannot be computed" in report(found)
        encode(comparison_figure(found))

    def test_the_range_of_the_sums_is_that_of_the_bands(self):
        grid = Wavelengths(353, 703, 10)
        found = compare(
            table_of(np.ones((1, 36)), grid, names="a"), table_of(np.ones((1, 36)), grid, names="a")
        )
        assert any("XYZ: sums over 363-703 nm" in note for note in found.notes)

    def test_equation_14_is_named_with_a_point_only(self):
        table = table_of(np.ones((2, 7)))
        assert "Eq. 14" in compare(table, table, match="a").text()
        for match in ("none", "luminance"):
            found = compare(table, table, match=match)
            assert "Eq. 14" not in found.text()
            assert "Eq. 14" not in report(found)
            with pytest.raises(OptionError, match=r"(?s)rmse_eq14 needs points.*one to match at"):
                found.value("rmse_eq14")


class TestSides:
    def test_errors_of_fully_correlated_bands_add_up_also_where_weights_are_negative(self):
        """As at the ends, where spectra are continued by point reflection: weights 2, -1, ..., errors of 1."""
        side = ImageSide(
            image_of(np.ones((1, 1, 7)), error=np.ones((1, 1, 7))), Bands(GRID), np.eye(1, 7) * 3 - 1
        )
        assert side.errors(slice(0, 1))[0, 0, 0] == 2 + 6
        assert side.radiance(slice(0, 1))[0, 0, 0] == 2 - 6

    def test_an_image_and_a_table_by_the_names_of_the_points(self, random_image):
        points = (Point("p", (3, 4)), Point("q", (5, 6)))
        total = random_image.total().values
        table = table_of([total[6, 5], total[4, 3]], names="qp")
        found = compare(table, random_image, points=points, aperture=Aperture(1, "px"))
        assert found.points.names == ("q", "p")
        assert found.value("rmse_max") < 1e-6

    def test_images_of_two_grids(self, random_image):
        fine = image_of(np.ones((12, 9, 61)), Wavelengths(400, 700, 5))
        assert compare(random_image, fine).grid == GRID

    def test_sizes_that_differ(self, random_image):
        with pytest.raises(ImageError, match=r"(?s)differ in size.*9 x 12 and 9 x 11"):
            compare(random_image, image_of(np.ones((11, 9, 7))))

    def test_no_common_wavelengths(self, random_image):
        with pytest.raises(SpectrumError, match="no wavelengths in common"):
            compare(random_image, image_of(np.ones((12, 9, 3)), Wavelengths(800, 900, 50)))

    def test_a_table_needs_places(self, random_image):
        with pytest.raises(OptionError, match=r"(?s)places in the image are not given.*a, b.*--points"):
            compare(random_image, table_of(np.ones((2, 7))))

    def test_a_point_to_match_at_needs_points(self, random_image):
        with pytest.raises(OptionError, match=r"(?s)no points are given.*--points"):
            compare(random_image, random_image, match="12")

    def test_tables_without_a_common_point(self):
        with pytest.raises(OptionError, match=r"(?s)no point in common.*a, b.*c, d"):
            compare(table_of(np.ones((2, 7))), table_of(np.ones((2, 7)), names="cd"))

    def test_a_component_of_images(self, random_image):
        found = compare(random_image, random_image, component="single_bounce")
        assert found.images.noise is None


class TestJson:
    def test_numbers_are_finite_or_null(self, random_image):
        dark = image_of(np.zeros((12, 9, 7)))
        text = compare(random_image, dark).to_json()
        assert json.loads(text)["images"]["rmse"] > 0

    def test_what_was_done_is_said(self, random_image):
        notes = " ".join(json.loads(compare(random_image, random_image).to_json())["notes"])
        for said in (
            "A: 400-700 nm by 50",
            "RMSE is taken over 7 bands",
            "Scale:",
            "White of CIELAB",
            "XYZ: sums over",
        ):
            assert said in notes

    def test_what_is_for_the_report_only_is_not_on_the_terminal(self, random_image):
        found = compare(random_image, random_image)
        details = [note for note in found.notes if isinstance(note, Detail)]
        assert [note.split(":")[0].split()[0] for note in details] == ["RMSE", "XYZ", "Pictures"]
        for note in found.notes:
            assert (note in found.text()) == (note not in details)
            assert note in html.unescape(report(found))
