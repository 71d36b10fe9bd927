"""The report in a real browser: it opens from disk, and no part of it stays blank (make test-browser)."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest
from PIL import Image
from report_parts import Report

from devtools import chromium
from fluorspar.figures.report import write_report

pytestmark = pytest.mark.browser

WIDTH, HEIGHT = 1200, 3000


@pytest.fixture(scope="module")
def browser():
    return chromium()


def run(browser, folder, *options):
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    command += [
        "--hide-scrollbars",
        f"--user-data-dir={folder / 'profile'}",
        f"--window-size={WIDTH},{HEIGHT}",
    ]
    address = (folder / "report.html").as_uri()
    return subprocess.run(
        [*command, *options, address], capture_output=True, text=True, timeout=120, check=True
    )


@pytest.fixture(scope="module")
def opened(browser, compared, tmp_path_factory):
    """The screenshot, ndarray of shape (HEIGHT, WIDTH, 3), the document as the browser has it, its messages."""
    folder = tmp_path_factory.mktemp("report")
    write_report(compared, folder / "report.html")
    said = run(browser, folder, f"--screenshot={folder / 'shot.png'}", "--enable-logging=stderr").stderr
    document = run(browser, folder, "--dump-dom").stdout
    with Image.open(folder / "shot.png") as shot:
        return np.asarray(shot.convert("RGB")).astype(int), document, said


def test_nothing_is_refused_and_nothing_fails(opened):
    for trouble in ("Refused to", "Content Security Policy", "ERR_", "Uncaught"):
        assert trouble not in opened[2]


def test_the_document_arrives_whole(opened):
    parsed = Report(opened[1])
    assert len(parsed.images) == 6
    assert opened[1].rstrip().endswith("</html>")
    assert "Written by Fluorspar" in opened[1]


def test_the_page_begins_with_text_and_has_a_white_ground(opened):
    shot = opened[0]
    assert (shot[60:400].min(axis=2) < 90).sum() > 500
    assert (shot[:20] == 255).all()


def test_pictures_maps_and_curves_are_drawn(opened):
    """Rationale: colour can only come from the six images. The pictures stand beside each other, so three
    columns of the page hold colour in the same rows; and the page has colour in its upper and lower part."""
    shot = opened[0]
    coloured = np.ptp(shot, axis=2) > 40
    rows = coloured.sum(axis=1)
    assert (rows > 0).sum() > 600
    drawn = np.flatnonzero(rows > 0)
    first = slice(drawn[0], drawn[0] + 100)
    left, middle = coloured[first, : WIDTH // 3].mean(), coloured[first, WIDTH // 3 : 2 * WIDTH // 3].mean()
    assert min(left, middle) > 0.3
    grey = np.abs(shot[first, 2 * WIDTH // 3 :] - 128).max(axis=2) < 40
    assert grey.mean() > 0.3  # the signed difference
    for colour in ((0, 114, 178), (213, 94, 0)):  # the curves of A and B
        assert (np.abs(shot - np.array(colour)).max(axis=2) < 40).sum() > 300


def test_no_stretch_of_the_page_is_blank(opened):
    """Between the first and the last ink there is no gap higher than 250 pixels."""
    ink = np.flatnonzero((opened[0] < 200).any(axis=(1, 2)))
    assert np.diff(ink).max() < 250
