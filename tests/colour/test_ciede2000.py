"""CIEDE2000 against the pairs of colours published for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fluorspar.colour.difference import ciede2000

PAIRS = Path(__file__).with_name("sharma2005.csv")


def test_ciede2000_of_the_34_published_pairs():
    rows = [line for line in PAIRS.read_text().splitlines() if not line.startswith(("#", "pair"))]
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    assert len(table) == 34
    np.testing.assert_allclose(ciede2000(table[:, 1:4], table[:, 4:7]), table[:, 7], atol=1e-4)


def test_equal_colours_differ_by_exactly_nothing():
    lab = np.random.default_rng(1).uniform(-80, 100, (200, 3))
    assert not ciede2000(lab, lab).any()
