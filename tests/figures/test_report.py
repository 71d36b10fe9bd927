"""The report of a comparison: self-contained, harmless, complete, with the numbers of the JSON."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from report_parts import Report

from fluorspar.comparing.compare import compare
from fluorspar.errors import ImageError, OptionError
from fluorspar.figures.report import report, write_report
from fluorspar.figures.spectra import (
    comparison_figure,
    encode,
    maps_figure,
    signed_picture,
    spectra_figure,
    write_figure,
)
from fluorspar.figures.style import FORMATS
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.spectral.bands import Bands
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths


@pytest.fixture(scope="module")
def text(compared):
    return report(compared)


@pytest.fixture(scope="module")
def parsed(text):
    return Report(text)


class TestSelfContained:
    def test_nothing_is_loaded_from_anywhere(self, text, parsed):
        for tag, attrs in parsed.tags:
            assert tag not in ("script", "iframe", "object", "embed", "link", "base", "form", "svg")
            for name, value in attrs.items():
                assert not name.startswith("on")
                assert name not in ("href", "srcset", "action")
                assert name != "src" or value.startswith("data:image/png;base64,")
        assert not re.search(r"url\(|@import|https?:", text)

    def test_the_policy_allows_data_images_and_inline_style_only(self, parsed):
        rules = dict(rule.strip().split(" ", 1) for rule in parsed.policy.split(";"))
        assert rules == {
            "default-src": "'none'",
            "img-src": "data:",
            "style-src": "'unsafe-inline'",
            "base-uri": "'none'",
            "form-action": "'none'",
        }

    def test_what_users_name_is_text(self, text):
        assert "<script>" not in text
        assert "&lt;white&gt; &amp; wide" in text


class TestContents:
    def test_every_image_decodes_and_shows_something(self, parsed):
        assert len(parsed.images) == 6  # A, B, signed difference, maps, spectra, bands
        for image in parsed.images:
            assert np.asarray(image.convert("RGB")).std() > 1

    def test_pictures_have_the_pixels_of_the_images(self, parsed):
        assert [image.size for image in parsed.images[:3]] == [(64, 48)] * 3

    def test_tables_hold_the_numbers_of_the_json(self, compared, parsed):
        numbers = json.loads(compared.to_json())
        cells = {row[0]: row[1:] for row in parsed.rows}
        for label, key, factor in (
            ("RMSE, mean of that of each", "rmse", 1),
            ("RMSE, 95 % are below", "rmse_95", 1),
            ("RMSE, greatest", "rmse_max", 1),
            ("CIEDE2000, mean", "de00_mean", 1),
            ("CIEDE2000, 95 % are below", "de00_95", 1),
            ("CIEDE2000, greatest", "de00_max", 1),
            ("bias, mean of B − A over the mean of A", "bias", 100),
        ):
            assert [float(cell.removesuffix(" %")) for cell in cells[label]] == [
                pytest.approx(factor * numbers[part][key], rel=1e-3) for part in ("points", "images")
            ]
        share = cells["noise explains, of the squared difference"][1].removesuffix(" %").split(" ± ")
        noise = numbers["images"]["noise"]
        expected = [100 * noise["share"], 100 * noise["share_uncertainty"]]
        assert [float(number) for number in share] == pytest.approx(expected, abs=0.051)
        assert 0 < expected[0] < 50
        for point in numbers["points"]["points"]:
            found = [float(cell) for cell in cells[point["point"]]]
            expected = [point["rmse"], point["de00"], *point["lab_a"], *point["lab_b"]]
            np.testing.assert_allclose(found, expected, rtol=1e-3, atol=0.006)

    def test_equation_14_is_of_points_and_not_their_mean_rmse(self, compared, parsed):
        cells = {row[0]: row[1:] for row in parsed.rows}
        of_points, of_pixels = cells["RMSE, one root over all points (Eq. 14)"]
        assert float(of_points) == pytest.approx(compared.points.rmse_eq14, rel=1e-3)
        assert of_pixels == "of points only"
        assert compared.points.rmse_eq14 > 1.01 * compared.points.rmse.mean()
        text_of_points, text_of_pixels = compared.text().split(" pixels\n")
        assert f"RMSE, Eq. 14 {compared.points.rmse_eq14:.5g}" in text_of_points
        assert "Eq. 14" not in text_of_pixels
        assert "mean RMSE" in text_of_pixels

    def test_the_verdict_on_noise(self, parsed):
        cells = {row[0]: row[1:] for row in parsed.rows}
        assert cells["verdict"][1] == "more than noise"

    def test_what_was_done_is_listed(self, compared, text):
        assert text.count("<li>") == len(compared.notes)


class TestFigures:
    grid = Wavelengths(400, 700, 50)

    def image(self, total):
        total = np.asarray(total)
        return SpectralImage.from_arrays(total[np.newaxis], self.grid, components=("total",))

    def test_the_signed_difference_by_hand(self):
        """B is brighter on the left and darker on the right: brighter and darker than grey, by a factor that is
        a power of two; the middle is grey."""
        light = illuminant("D65").on(self.grid)
        a = [[light, light, light, 2 * light]]
        b = [[1.1 * light, light, 0.9 * light, 2 * light]]
        found = compare(self.image(a), self.image(b)).images
        picture, factor = signed_picture(found)
        assert picture[0, 0].min() > 150
        assert picture[0, 2].max() < 110
        assert (picture[0, 1] == 128).all()
        expected = 0.5 + factor * found.rgb_difference[0]
        np.testing.assert_allclose(picture[0] / 255, np.clip(expected, 0, 1), atol=0.003)

    @pytest.mark.parametrize("draw", [maps_figure, comparison_figure])
    def test_each_map_shows_what_its_title_says(self, compared, draw):
        only_images = replace(compared, points=None)
        panels = {panel.get_title(loc="left"): panel for panel in draw(only_images).axes}
        found = compared.images
        for title, values in (("CIEDE2000", found.de00), ("RMSE", found.rmse)):
            np.testing.assert_array_equal(panels[title].images[0].get_array(), values)
        if draw is maps_figure:
            drawn = panels["displayed R, B − A (0 to 1)"].images[0].get_array()
            np.testing.assert_array_equal(drawn, found.rgb_difference[..., 0])

    @pytest.mark.parametrize("draw", [maps_figure, comparison_figure])
    def test_the_rows_of_panels_are_in_line(self, compared, draw):
        figure = draw(replace(compared, points=None))
        encode(figure)
        left = np.array([panel.get_position().x0 for panel in figure.axes]).reshape(2, 3)
        np.testing.assert_allclose(left[0], left[1], atol=1e-3)

    def test_dollar_signs_are_no_formulas(self):
        tables = [
            PointSpectra(("$p_", "paint at $5, $6"), Bands(self.grid), np.ones((2, 7)), title="cost $_{5$")
            for _ in range(2)
        ]
        figure = comparison_figure(compare(*tables))
        encode(figure)
        assert figure.axes[0].get_title(loc="left").startswith("$p_\n")
        assert figure.legends[0].get_texts()[0].get_text() == "A: cost $_{5$"
        assert not figure.axes[0]._left_title.get_parse_math()
        encode(spectra_figure(tables[0]))

    def test_titles_fit_above_their_panels(self):
        """Five panels in a row, with a colour difference of two digits: no title reaches beyond the figure."""
        spectra = np.ones((5, 7))
        spectra[-1, :3] = 9.0
        names = tuple("12345")
        a, b = (PointSpectra(names, Bands(self.grid), values) for values in (np.ones((5, 7)), spectra))
        found = compare(a, b, white="1")
        assert found.points.de00[-1] > 10
        figure = comparison_figure(found)
        encode(figure, dpi=100)  # the extents below are those of this drawing
        width = figure.bbox.width
        assert max(panel._left_title.get_window_extent().x1 for panel in figure.axes) < width

    @pytest.mark.parametrize("size", [(2, 400), (400, 2)])
    def test_long_images_make_no_threads(self, size):
        image = self.image(np.random.default_rng(1).random((*size, 7)) + 0.1)
        figure = comparison_figure(compare(image, image))
        encode(figure)
        width, height = figure.get_size_inches()
        assert 1 / 4 < height / width < 4
        panels = [panel.get_window_extent() for panel in figure.axes]
        assert min(min(panel.width, panel.height) for panel in panels) > 20


class TestFiles:
    def test_equal_comparisons_are_equal_files(self, compared, text):
        assert report(compared) == text

    def test_a_figure_for_a_paper(self, compared, tmp_path):
        write_figure(comparison_figure(compared), tmp_path / "a.png")
        assert (tmp_path / "a.png").read_bytes() == encode(comparison_figure(compared))

    @pytest.mark.parametrize("suffix", FORMATS)
    def test_equal_figures_are_equal_files(self, compared, tmp_path, suffix):
        for name in ("a", "b"):
            write_figure(comparison_figure(replace(compared, images=None)), tmp_path / f"{name}{suffix}")
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
        assert (tmp_path / f"a{suffix}").read_bytes()[:5] in (b"\x89PNG\r", b"%PDF-", b"<?xml")

    def test_another_kind_of_figure_is_refused(self, compared, tmp_path):
        with pytest.raises(OptionError, match=r"(?s)a\.tiff.*\.png, \.pdf, \.svg"):
            write_figure(comparison_figure(compared), tmp_path / "a.tiff")

    def test_a_missing_directory_is_said(self, compared, tmp_path):
        with pytest.raises(ImageError, match="does not exist"):
            write_report(compared, tmp_path / "none" / "a.html")
