# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the page of `./dev report`, made in quick mode: it needs no other files, and agrees with
report.json.

SINEW_EXPERIMENTS is the folder of the built programs of experiments/; without it the page has no times.
"""

import html
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from smith_2013 import measure, tables
from smith_2013.page import format_numbers

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
PROGRAMS = os.environ.get("SINEW_EXPERIMENTS")
TABLES = [f"3.{number}" for number in range(1, 11)]
FIGURES = [f"3.{number}" for number in range(3, 12)]
MEASURED = {"3.2", "3.3", "3.4", "3.5", "3.9", "3.10"}
COLUMNS = ("printed", "ours")
DRAWN = {"3.6", "3.7", "3.8", "3.9", "3.10", "3.11"}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Text of report.html, content of report.json, and the progress messages."""
    folder = tmp_path_factory.mktemp("report")
    programs = ["--programs", PROGRAMS] if PROGRAMS else []
    command = [sys.executable, "-m", "smith_2013", "--out", str(folder), "--quick", *programs]
    done = subprocess.run(command, cwd=EXPERIMENTS, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.split() == [str(folder / "report.html"), str(folder / "report.json")]
    assert sorted(path.name for path in folder.iterdir()) == ["report.html", "report.json"]
    page = (folder / "report.html").read_text(encoding="utf-8")
    return page, json.loads((folder / "report.json").read_text(encoding="utf-8")), done.stderr


def test_it_needs_nothing_beside_itself(made):
    page, _content, _said = made
    assert page.count("<svg") == 6
    assert not re.search(r"<(script|link|iframe|object|embed)\b|@import", page)
    references = re.findall(r"(?:src|href|data)=[\"']([^\"']*)|url\(([^)]*)\)", page)
    assert all(each.startswith(("#", "data:")) for pair in references for each in pair if each)
    # Names of XML namespaces are not fetched.
    addresses = set(re.findall(r"\w+://[^\s\"'<)]+", page))
    assert addresses <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}


def test_every_table_and_figure_has_what_the_json_has(made):
    page, content, _said = made
    assert list(content["tables"]) == TABLES
    assert list(content["figures"]) == FIGURES
    _head, *parts = re.split(r'<h3 id="([a-z]+-[\d.]+)">', page)
    text = {
        name: html.unescape(re.sub(r"<[^>]*>", "|", part))
        for name, part in zip(parts[::2], parts[1::2], strict=True)
    }
    assert list(text) == [f"table-{number}" for number in TABLES] + [f"figure-{number}" for number in FIGURES]
    for number, table in content["tables"].items():
        wanted = [table["missing"]] if table["missing"] else [table["tolerance"], *table["notes"]]
        wanted += [fact["ours"] for fact in table["facts"]]
        for row in table["rows"] if not table["missing"] else ():
            wanted += [
                row["name"],
                row["why"],
                *(format_numbers(row[of], table["decimals"]) for of in COLUMNS),
            ]
            assert bool(row["why"]) == (row["agrees"] is False), (number, row["name"])
        assert all(each in text[f"table-{number}"] for each in wanted)
    for number, figure in content["figures"].items():
        wanted = [*figure["pictures"], *figure["notes"], *[fact["ours"] for fact in figure["facts"]]]
        assert all(each in text[f"figure-{number}"] for each in wanted)
    assert all(answer["question"] in html.unescape(page) for answer in content["answers"])


def test_what_is_missing_says_how_to_get_it(made):
    page, content, said = made
    missing = {f"Table {number}" for number, table in content["tables"].items() if table["missing"]}
    missing |= {f"Figure {number}" for number, figure in content["figures"].items() if figure["missing"]}
    measured = set() if PROGRAMS else {f"Table {number}" for number in MEASURED}
    assert missing == measured | {f"Figure {number}" for number in DRAWN}
    for name in missing:
        assert f"{name}: Not " in said
        assert "./dev report" in said
    assert f"{len(missing)} of {len(TABLES) + len(FIGURES)} tables and figures are missing" in page


@pytest.fixture(scope="module")
def measurements():
    if not PROGRAMS:
        pytest.skip("SINEW_EXPERIMENTS is not set: programs of experiments/ are not run")
    return measure.measure(Path(PROGRAMS), True, lambda what: None)


def test_tables_3_2_and_3_3(measurements):
    points = {row.name: row for row in tables.point_operations(measurements).rows}
    assert points["Rigid transformation matrices"].ours == (9, 9, 18)
    assert points["Quaternion-vector pair"].ours == (18, 15, 33)
    assert points["Unit dual quaternions"].ours == (33, 31, 64)
    assert [row.agrees for row in points.values()] == [True, True, False, None, None]
    chains = {row.name: row for row in tables.chain_operations(measurements).rows}
    assert chains["Rigid transformation matrices"].ours == (27, 36, 63)
    assert chains["Quaternion-vector pair"].ours == (30, 31, 61)
    assert chains["Unit dual quaternions"].ours == (40, 48, 88)
    assert [row.agrees for row in chains.values()] == [True, False, False, None]
