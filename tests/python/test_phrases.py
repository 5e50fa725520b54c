# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects sentences that keep the values they were made from."""

import copy
import json
import pickle

import pytest
from sinew_addon.core.phrases import Phrase, phrase

MADE = phrase("{missing} for the mix", missing=phrase("no vertex group {name}", name="a {b}"))


def test_a_phrase_is_its_text():
    assert MADE == "no vertex group a {b} for the mix"
    assert json.dumps([MADE]) == '["no vertex group a {b} for the mix"]'


@pytest.mark.parametrize("again", [copy.deepcopy, lambda made: pickle.loads(pickle.dumps(made))])
def test_copies_keep_what_it_was_made_of(again):
    other = again(MADE)
    assert (other, other.template) == (MADE, "{missing} for the mix")
    inner = other.values["missing"]
    assert isinstance(inner, Phrase)
    assert (inner.template, inner.values) == ("no vertex group {name}", {"name": "a {b}"})


def test_a_missing_value_is_an_error():
    with pytest.raises(KeyError):
        phrase("{name} is in front")
