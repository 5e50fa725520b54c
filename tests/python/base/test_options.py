# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects options that stand once for an operator and a command: their defaults, names and limits."""

from __future__ import annotations

import argparse

import pytest
from sinew_addon.base.options import options_of, read_options
from sinew_addon.commands.arguments import add_options
from sinew_addon.features.bake.helper_bones import HelperOptions
from sinew_addon.features.bake.vat import VatOptions
from sinew_addon.features.blend.motion import METHODS, Settings
from sinew_addon.features.gltf.export_check import ExportOptions
from sinew_addon.features.inbetween.interpolation import InbetweenOptions

ALL = (HelperOptions, VatOptions, Settings, ExportOptions, InbetweenOptions)


def read(options, *words):
    parser = argparse.ArgumentParser()
    add_options(parser, options)
    return read_options(options, parser.parse_args(words))


@pytest.mark.parametrize("options", ALL)
def test_a_command_has_the_defaults_of_the_operator(options):
    assert read(options) == options()


@pytest.mark.parametrize("options", ALL)
def test_defaults_are_among_the_choices(options):
    for default, shown in options_of(options).values():
        assert not shown.choices or default in shown.names


def test_values_are_read():
    given = read(HelperOptions, "--motion", "pose", "--helpers", "0", "--error", "2.5", "--influences", "8")
    assert given == HelperOptions("pose", 0, 2.5, 8)
    assert read(Settings, "--no-align", "--root-motion", "in-place", "--root", "Hips").root == "Hips"
    assert {read(Settings, "--method", name).method for name in METHODS} == set(METHODS)
    assert read(ExportOptions, "--verify").verify


@pytest.mark.parametrize(
    "words",
    [
        ("--helpers", "-1"),
        ("--influences", "0"),
        ("--error", "101"),
        ("--motion", "other"),
        ("--helpers", "x"),
    ],
)
def test_wrong_values_are_refused(words, capsys):
    with pytest.raises(SystemExit):
        read(HelperOptions, *words)
    assert words[0] in capsys.readouterr().err
