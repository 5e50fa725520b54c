# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects docs/results.md: it is what its numbers, docs/results.json, give."""

import json
from pathlib import Path

import pytest
from sinew_addon.base.errors import SinewError
from smith_2013 import paper

DOCS = Path(__file__).resolve().parents[2] / "docs"
CONTENT = json.loads((DOCS / "results.json").read_text(encoding="utf-8"))


def test_the_page_is_what_its_numbers_make_of_it():
    assert (DOCS / "results.md").read_text(encoding="utf-8") == paper.page(CONTENT)


def test_incomplete_reports_make_no_page(tmp_path):
    report = {
        **CONTENT,
        "quick": False,
        "tables": {number: {"missing": None, "rows": [], **of} for number, of in CONTENT["tables"].items()},
        "figures": {number: {"missing": None, **of} for number, of in CONTENT["figures"].items()},
    }
    assert paper.digest(report)["studies"] == CONTENT["studies"]
    report["figures"]["3.11"]["missing"] = "Not drawn"
    with pytest.raises(SinewError, match=r"what is missing in it: Figure 3\.11"):
        paper.digest(report)
    report["quick"] = True
    file = tmp_path / "report.json"
    file.write_text(json.dumps(report))
    with pytest.raises(SinewError, match="without --quick"):
        paper.read(file)
