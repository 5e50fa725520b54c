# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the output of commands on consoles without UTF-8."""

from __future__ import annotations

import io
import sys

from sinew_addon.commands import console


def test_a_console_without_utf8_shows_what_it_can(monkeypatch):
    shown = {name: io.BytesIO() for name in ("stdout", "stderr")}
    for name, data in shown.items():
        monkeypatch.setattr(sys, name, io.TextIOWrapper(data, encoding="cp1252", newline="\n"))
    output = console.keep_output()
    output.say("Glied Ellenbogen \N{CJK UNIFIED IDEOGRAPH-8155} äöü")
    output.complain("no file \N{CJK UNIFIED IDEOGRAPH-8155}")
    texts = {name: data.getvalue().decode("cp1252") for name, data in shown.items()}
    assert texts == {"stdout": "Glied Ellenbogen ? äöü\n", "stderr": "sinew: no file ?\n"}
