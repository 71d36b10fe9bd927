"""Standard observers by degrees and by name."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.colour.observers import CIE_1931, CIE_1964, matching_functions, observer_named
from fluorspar.errors import OptionError
from fluorspar.spectral.colour_science import colour_science


def test_degrees_and_names() -> None:
    assert [observer_named(text) for text in ("2", "10", CIE_1964)] == [CIE_1931, CIE_1964, CIE_1964]
    rare = "Stockman & Sharpe 2 Degree Cone Fundamentals"
    assert observer_named(rare) == rare


@pytest.mark.parametrize("observer", [CIE_1931, CIE_1964])
def test_tables_are_those_of_colour_science(observer: str) -> None:
    theirs = colour_science().MSDS_CMFS[observer]
    wavelengths, values = matching_functions(observer)
    np.testing.assert_array_equal(wavelengths, theirs.wavelengths)
    np.testing.assert_allclose(values, theirs.values, rtol=1e-12)


def test_an_unknown_one_is_told_what_there_is() -> None:
    with pytest.raises(OptionError, match=r"(?s)--observer.*'5'.*2 or 10; or a name: .*CIE 1931 2 Degree"):
        observer_named("5", "--observer")
