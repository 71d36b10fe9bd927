"""Standard observers by degrees and by name."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.colour.observers import CIE_1931, CIE_1964, OBSERVERS, matching_functions, observer_named
from fluorspar.errors import OptionError
from fluorspar.spectral.colour_science import colour_science


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ("2", CIE_1931),
        ("10", CIE_1964),
        (2, CIE_1931),
        (10, CIE_1964),
        ("2-2015", "CIE 2015 2 Degree Standard Observer"),
        ("10-2015", "CIE 2015 10 Degree Standard Observer"),
    ],
)
def test_degrees(given: str | int, name: str) -> None:
    assert observer_named(given) == name


@pytest.mark.parametrize("name", OBSERVERS)
def test_names_in_any_case(name: str) -> None:
    assert observer_named(name) == observer_named(name.lower()) == observer_named(name.upper()) == name


@pytest.mark.parametrize("observer", OBSERVERS)
def test_tables_are_those_of_colour_science(observer: str) -> None:
    theirs = colour_science().MSDS_CMFS[observer]
    assert theirs.labels == ["x_bar", "y_bar", "z_bar"]
    wavelengths, values = matching_functions(observer)
    np.testing.assert_array_equal(wavelengths, theirs.wavelengths)
    np.testing.assert_allclose(values, theirs.values, rtol=1e-12)


@pytest.mark.parametrize(
    "observer",
    ["5", "", "Stockman & Sharpe 2 Degree Cone Fundamentals", "Wright & Guild 1931 2 Degree RGB CMFs"],
)
def test_others_are_told_what_there_is(observer: str) -> None:
    """Cone fundamentals and RGB functions are in colour-science, but are not XYZ."""
    with pytest.raises(
        OptionError, match=r"(?s)--observer.*2 or 10 .*: CIE 1931 2 Degree.*CIE 2015 10"
    ) as told:
        observer_named(observer, "--observer")
    assert "Cone" not in str(told.value).partition("expected:")[2]
