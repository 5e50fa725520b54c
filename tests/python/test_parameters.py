# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects NAME=VALUE, as in --set and in job files."""

from __future__ import annotations

import pytest
from sinew_addon.core.errors import WrongUse
from sinew_addon.core.parameters import as_texts, by_full_name, parse


def test_a_stages_name_is_its_first_parameter():
    assert parse(["mix=dq", "mix.group=Left = Right"]) == {"mix.method": "dq", "mix.group": "Left = Right"}
    assert parse(["mix=dq", "mix.method=qv"]) == {"mix.method": "qv"}
    assert parse(["mix=off"]) == {"mix.method": "off"}


def test_every_parameter_has_a_name_that_parses_back():
    parameters = by_full_name()
    assert set(parameters) >= {"mix.method", "mix.group"}
    examples = {"method": "dq", "vertex_group": "Arms", "bool": True}
    values = {name: examples.get(each.kind, each.default) for name, each in parameters.items()}
    assert parse(as_texts(values)) == values


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("mix", "expected NAME=VALUE, got 'mix'"),
        ("bulge=1", "expected one of mix, .*got 'bulge'"),
        ("mix=dqs", "mix: expected one of off, lbs, .*got 'dqs'"),
        ("mix.group", "expected NAME=VALUE"),
    ],
)
def test_wrong_ones_get_a_sentence(text, sentence):
    with pytest.raises(WrongUse, match=sentence):
        parse([text])
