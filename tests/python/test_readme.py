# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the documents' first Python program, which runs, and README's table of methods."""

import re
from pathlib import Path

import numpy as np
import sinew

ROOT = Path(__file__).resolve().parents[2]


def test_the_python_program_deforms(capsys):
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    program = re.search(r"```python\n(.*?)```", page, re.DOTALL).group(1)
    names = {}
    exec(program, names)
    points = names["deformer"].deform(names["bones"])
    # The middle vertex rotates by 90 degrees, half of the second bone's 180.
    np.testing.assert_allclose(points, [[0, 1, 0], [1, 0, 1], [2, -1, 0]], atol=1e-6)
    assert capsys.readouterr().out.startswith("[[")


def test_the_table_names_every_method_and_no_other():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \| (.*) \|$", readme, re.MULTILINE)
    methods = {method.name for method in sinew.methods()}
    # A build may lack it.
    rows = [row for row in rows if row[0] in methods or row[0] != "ddm"]
    assert [(name, group) for name, group, _text in rows] == [(m.name, m.group) for m in sinew.methods()]
    for (_name, _group, text), method in zip(rows, sinew.methods(), strict=True):
        assert method.label.lower() in text.lower()
        assert method.description[1:] in text
