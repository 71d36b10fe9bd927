"""The names of the components are an interface: files and scripts rely on them."""

from __future__ import annotations

import pytest

from fluorspar.errors import OptionError
from fluorspar.image.components import COMPONENTS, DEFINITIONS, LUMINESCENT, REFLECTED, SINGLE_BOUNCE, select


def test_the_names_and_their_order_are_those_of_the_data_format():
    assert COMPONENTS == (
        "source",
        "direct_reflection",
        "direct_luminescence",
        "indirect_reflection",
        "indirect_luminescence",
        "luminescent_reflection",
        "reexcitation",
    )
    assert [component.number for component in DEFINITIONS] == list(range(7))


def test_the_groups_are_the_sums_of_the_paper():
    numbers = {group: [COMPONENTS.index(name) for name in group] for group in (REFLECTED, LUMINESCENT)}
    assert numbers[REFLECTED] == [1, 3]
    assert numbers[LUMINESCENT] == [2, 4, 5]
    assert COMPONENTS[:6] == SINGLE_BOUNCE


def test_a_choice_comes_back_in_the_order_of_the_components_and_once():
    assert select(["reexcitation", "source", "source"]) == ("source", "reexcitation")


def test_a_group_leaves_out_what_the_image_does_not_hold():
    assert select("total", SINGLE_BOUNCE) == SINGLE_BOUNCE
    assert select(None, SINGLE_BOUNCE) == SINGLE_BOUNCE


@pytest.mark.parametrize("wrong", ["reflection", "", ["source", "reexitation"], []])
def test_an_unknown_name_is_an_error_that_lists_the_legal_ones(wrong):
    with pytest.raises(OptionError, match=r"(?s)no such component.*luminescent_reflection.*single_bounce"):
        select(wrong)


def test_a_component_the_image_does_not_hold_is_not_offered():
    with pytest.raises(OptionError) as caught:
        select("reexcitation", SINGLE_BOUNCE)
    assert "reexcitation" not in str(caught.value).split("expected")[1]


def test_sums_are_given_as_text() -> None:
    assert select("indirect_reflection + direct_luminescence") == (
        "direct_luminescence",
        "indirect_reflection",
    )
    assert select("reflected+luminescent", SINGLE_BOUNCE) == SINGLE_BOUNCE[1:]
    for text in ("reflected+glow", "reflected+", "+source"):
        with pytest.raises(OptionError, match="no such component"):
            select(text)
    for text in ("source+source", "reflected+direct_reflection"):
        with pytest.raises(OptionError, match="a sum holds a component twice"):
            select(text)
