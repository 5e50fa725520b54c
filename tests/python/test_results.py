# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results.md: what is generated from its numbers, docs/results.json, and from other numbers."""

import copy
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from sinew_addon.core.errors import SinewError
from smith_2013 import paper

DOCS = Path(__file__).resolve().parents[2] / "docs"
EXPERIMENTS = DOCS.parent / "experiments"
CONTENT = json.loads((DOCS / "results.json").read_text(encoding="utf-8"))


@pytest.fixture
def content():
    return copy.deepcopy(CONTENT)


def section(text, number):
    return re.search(rf"^## {number}\. .*?(?=^## )", text, re.MULTILINE | re.DOTALL)[0]


def test_the_page_is_what_its_numbers_make_of_it(content):
    assert (DOCS / "results.md").read_text(encoding="utf-8") == paper.page(content)


def test_its_plots_are_there():
    pytest.importorskip("matplotlib")
    named = set(re.findall(r"\]\((results-\w+\.svg)\)", paper.page(CONTENT)))
    plots = paper.plots(CONTENT)
    assert named == plots.keys()
    for name, text in plots.items():
        kept = (DOCS / name).read_text(encoding="utf-8")
        # Releases of matplotlib differ slightly in positions; the words are the same.
        assert re.findall(r"<text[^>]*>([^<]*)<", kept) == re.findall(r"<text[^>]*>([^<]*)<", text)
        assert len(kept) < 100_000


def test_every_length_of_a_study_is_named(content):
    content["studies"]["accuracy, 16"]["dual_quat"]["rms"] = 4.4e-7
    assert "dual quaternions 4.4e-07" in section(paper.page(content), 2)


def test_what_is_the_most_accurate_is_said_of_the_numbers(content):
    for length in (4, 16, 64, 256):
        for place, name in enumerate(("quat_vec", "dual_quat", "affine")):
            content["studies"][f"accuracy, {length}"][name]["rms"] = 1e-7 * (place + 1)
    text = section(paper.page(content), 2)
    assert text.startswith("## 2. Pairs are the most accurate\n")
    assert "Pairs are more accurate than dual quaternions with 4, 16, 64 and 256 links." in text
    for length in (4, 16, 64, 256):
        content["studies"][f"accuracy, {length}"]["quat_vec"]["rms"] = 9e-7
    text = section(paper.page(content), 2)
    assert text.startswith("## 2. Dual quaternions are the most accurate\n")
    assert "in none of these lengths" in text


@pytest.mark.parametrize(
    ("last", "title"), [(3.0, "adds up in long"), (0.1, "evens out"), (1.0, "does not add up")]
)
def test_whether_dlb_adds_up_is_said_of_the_numbers(content, last, title):
    first = content["studies"]["drift, 4"]["dlb"]["rms"]
    content["studies"]["drift, 256"]["dlb"]["rms"] = last * first
    assert title in section(paper.page(content), 3).splitlines()[0]


def test_the_order_of_times_is_said_of_the_numbers(content):
    for number in paper.TIMES:
        for fact in content["tables"][number]["facts"][:2]:
            fact["agrees"] = True
    text = section(paper.page(content), 1)
    assert text.startswith("## 1. The order of the times holds for the best implementations, too\n")
    assert "in 3 of 3 tables" in text
    content["tables"]["3.5"]["facts"][1]["agrees"] = False
    assert "that of a build without optimisation" in section(paper.page(content), 1)


def test_what_keeps_its_radius_is_said_of_the_numbers(content):
    (fact,) = content["figures"]["3.11"]["facts"]
    fact["values"] = {"radius, lbs": 0.99, "radius, dq": 0.4}
    text = section(paper.page(content), 4)
    assert "with linear matrices; the others keep less: dual quaternions 40%" in text
    assert text.startswith("## 4. What blends of joints keep\n")


def test_what_is_not_whole_makes_no_page(content, tmp_path):
    report = {
        **content,
        "quick": False,
        "tables": {number: {"missing": None, "rows": [], **of} for number, of in content["tables"].items()},
        "figures": {number: {"missing": None, **of} for number, of in content["figures"].items()},
    }
    assert paper.digest(report)["studies"] == content["studies"]
    report["figures"]["3.11"]["missing"] = "Not drawn"
    with pytest.raises(SinewError, match=r"what is missing in it: Figure 3\.11"):
        paper.digest(report)
    report["quick"] = True
    file = tmp_path / "report.json"
    file.write_text(json.dumps(report))
    with pytest.raises(SinewError, match="without --quick"):
        paper.read(file)


def run(*options):
    command = [sys.executable, "-m", "smith_2013", *map(str, options)]
    return subprocess.run(command, cwd=EXPERIMENTS, capture_output=True, text=True, timeout=120, check=False)


def test_the_command_says_what_it_wants(tmp_path):
    assert "--out FOLDER is missing" in run().stderr
    assert "--from takes --results FOLDER" in run("--from", tmp_path / "report.json").stderr
    done = run("--from", tmp_path / "none.json", "--results", tmp_path)
    assert "none.json: no report.json of ./dev report" in done.stderr
    assert done.returncode == 1
