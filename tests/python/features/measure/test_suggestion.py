# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects which methods are best by which criterion, and which are torn."""

import math

import pytest
from sinew_addon.features.measure.suggestion import CRITERIA, LONGEST, Suggestion

BY_NAME = {criterion.name: criterion for criterion in CRITERIA}


def suggestion(**values):
    """Results for methods a, b and c over frames 1, 2, ...; values by criterion: those of each method."""
    made = Suggestion({"a": "Method A", "b": "Method B", "c": "Method C"}, [1.0, 2.0], diagonal=2.0)
    for criterion, of_methods in values.items():
        for method, of_frames in zip("abc", of_methods, strict=False):
            for frame, value in enumerate(of_frames, start=1):
                made.add(method, criterion, value, float(frame))
    return made


def test_the_worst_frame_counts_and_its_sign_does_not():
    made = suggestion(volume=[[-0.3, 0.1], [0.2, -0.1]])
    assert (made.worst["a", "volume"].value, made.worst["a", "volume"].frame) == (-0.3, 1.0)
    assert made.best(BY_NAME["volume"]) == ["b"]


def test_equal_methods_are_all_best_or_none():
    assert suggestion(stretch=[[0.100], [0.101], [0.2]]).best(BY_NAME["stretch"]) == ["a", "b"]
    assert suggestion(stretch=[[0.1], [0.1], [0.1]]).best(BY_NAME["stretch"]) == []
    # A method that is far off does not make the others count as equal.
    assert suggestion(stretch=[[0.1], [0.15], [50.0]]).best(BY_NAME["stretch"]) == ["a"]


@pytest.mark.parametrize("measure", [LONGEST, "bulge"])
@pytest.mark.parametrize("value", [50.0, math.inf])
def test_what_is_torn_is_best_at_nothing(measure, value):
    made = suggestion(
        **{measure: [[3.0], [3.1], [value]]}, volume=[[0.3], [0.2], [0.01]], flips=[[0.1], [0.1], [0.0]]
    )
    assert list(made.torn) == ["c"]
    assert ("finite" in made.torn["c"]) == math.isinf(value)
    assert made.best(BY_NAME["volume"]) == ["b"]
    assert made.order(BY_NAME["volume"]) == ["b", "a", "c"]


def test_short_edges_and_two_methods_are_not_torn():
    assert suggestion(**{LONGEST: [[1.01], [1.01], [1.9]]}).torn == {}
    assert suggestion(**{LONGEST: [[3.0], [90.0]]}).torn == {}


def test_rounding_is_no_bulge():
    assert suggestion(bulge=[[0.0], [0.0], [1e-6]]).torn == {}
    assert suggestion(bulge=[[0.0], [0.0], [0.1]]).torn == {"c": "it bulges 10 times as far"}


def test_what_is_not_chosen_has_a_reason():
    """What it does worst against what was chosen; what is hardly anything in it does not count."""
    made = suggestion(
        stretch=[[0.1], [0.12]], volume=[[-0.3], [0.1]], bulge=[[0.0], [0.0]], crossings=[[0.0], [0.0]]
    )
    assert made.why_not("a", "b") == "Method A changes volume 3 times as much"
    assert made.why_not("b", "a") == "Method B stretches 1.2 times as much"
    assert suggestion(flips=[[0.1], [0.2]]).why_not("a", "b") == "Method A is as good by these measures"
    assert suggestion(crossings=[[100.0], [4.0]]).why_not("a", "b").endswith("itself 22 times as often")


def test_the_text_says_what_each_is_best_at():
    made = suggestion(
        stretch=[[0.1], [0.2], [0.2]], volume=[[0.2], [0.02], [0.04]], bulge=[[0.3], [0.1], [0.2]]
    )
    assert made.text == "Method A stretches least; Method B keeps volume best and bulges least"


@pytest.mark.parametrize(("difference", "best"), [(1e-4, []), (1e-3, ["a"])])
def test_lengths_are_relative_to_the_diagonal(difference, best):
    made = suggestion(bulge=[[0.0], [difference], [difference]])
    assert made.best(BY_NAME["bulge"]) == best


def test_criteria_that_are_not_measured_have_no_best():
    made = suggestion(volume=[[math.nan], [math.nan], [math.nan]])
    assert made.worst == {}
    assert made.best(BY_NAME["volume"]) == made.best(BY_NAME["crossings"]) == []
    assert made.text == "All methods are equally good here"


def test_methods_are_sorted_with_unmeasured_ones_last():
    made = suggestion(volume=[[0.2], [math.nan], [-0.1]], stretch=[[0.2], [0.1], [0.3]])
    assert made.order(BY_NAME["volume"]) == ["c", "a", "b"]
    assert made.order(BY_NAME["stretch"]) == ["b", "a", "c"]
    assert made.order(BY_NAME["crossings"]) == ["a", "b", "c"]
