"""The report of a comparison: self-contained, harmless, complete, with the numbers of the JSON."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from report_parts import Report

from fluorspar.errors import ImageError
from fluorspar.measure.figures import comparison_figure, encode, write_figure
from fluorspar.measure.report import report, write_report


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
        for label, key in (
            ("E{RMSE}, Eq. 14", "rmse"),
            ("CIEDE2000, mean", "de00_mean"),
            ("CIEDE2000, greatest", "de00_max"),
        ):
            assert [float(cell) for cell in cells[label]] == [
                pytest.approx(numbers[part][key], rel=1e-3) for part in ("points", "images")
            ]
        for point in numbers["points"]["points"]:
            found = [float(cell) for cell in cells[point["point"]]]
            expected = [point["rmse"], point["de00"], *point["lab_a"], *point["lab_b"]]
            np.testing.assert_allclose(found, expected, rtol=1e-3, atol=0.006)

    def test_the_verdict_on_noise(self, parsed):
        cells = {row[0]: row[1:] for row in parsed.rows}
        assert cells["verdict"][1] == "more than noise"

    def test_what_was_done_is_listed(self, compared, text):
        assert text.count("<li>") == len(compared.notes)


class TestFiles:
    def test_equal_comparisons_are_equal_files(self, compared, text):
        assert report(compared) == text

    def test_a_figure_for_a_paper(self, compared, tmp_path):
        write_figure(comparison_figure(compared), tmp_path / "a.png")
        assert (tmp_path / "a.png").read_bytes() == encode(comparison_figure(compared))

    def test_a_missing_directory_is_said(self, compared, tmp_path):
        with pytest.raises(ImageError, match="does not exist"):
            write_report(compared, tmp_path / "none" / "a.html")
