# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects texts of commands: on consoles without UTF-8, phrases that keep their values, NAME=VALUE."""

from __future__ import annotations

import copy
import io
import json
import pickle
import sys

import pytest
from sinew_addon.base.errors import WrongUse
from sinew_addon.base.phrases import Phrase, phrase
from sinew_addon.commands import console
from sinew_addon.skinning.parameters import as_texts, by_full_name, parse


def test_a_console_without_utf8_shows_what_it_can(monkeypatch):
    shown = {name: io.BytesIO() for name in ("stdout", "stderr")}
    for name, data in shown.items():
        monkeypatch.setattr(sys, name, io.TextIOWrapper(data, encoding="cp1252", newline="\n"))
    output = console.keep_output()
    output.say("Glied Ellenbogen \N{CJK UNIFIED IDEOGRAPH-8155} äöü")
    output.complain("no file \N{CJK UNIFIED IDEOGRAPH-8155}")
    texts = {name: data.getvalue().decode("cp1252") for name, data in shown.items()}
    assert texts == {"stdout": "Glied Ellenbogen ? äöü\n", "stderr": "sinew: no file ?\n"}


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
