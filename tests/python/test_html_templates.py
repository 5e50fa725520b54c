# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages made from templates: names from files stay text; without Jinja2 only the pages are missing."""

import json
import sys

import pytest
from sinew_addon.batch.report import write_report
from sinew_addon.core.errors import SinewError
from sinew_addon.core.html_templates import FOLDER, can_render, environment, render
from sinew_addon.core.report import page as report_page
from sinew_addon.core.report.model import Page

HOSTILE = "<script>alert('&')</script>"
SUMMARY = {
    "command": "reskin", "files": 2, "written": 1, "unchanged": 0, "failed": 1, "meshes": 1,
    "meshes_left_out": 1, "seconds": 1.25,
}  # fmt: skip
ROWS = [
    {
        "source": f"/in/{HOSTILE}.blend", "file": f"{HOSTILE}.blend", "status": "written",
        "meshes": [{"object": HOSTILE, "before": "lbs", "method": "dq", "warnings": [HOSTILE]}],
        "left_out": [HOSTILE], "notes": [HOSTILE],
        "bakes": [{"file": HOSTILE, "to": "usd", "objects": [HOSTILE, HOSTILE], "frames": 3}],
        "versions": {"blender": "4.5", "sinew": "0.1.0"}, "seconds": {"read": 1.0},
        "pictures": {"before": "a b/before.png", "after": "a b/after.png", "frame": 7},
    },
    {"source": "/in/b.blend", "file": "b.blend", "status": "failed", "error": f"/in/b.blend: {HOSTILE}"},
]  # fmt: skip


def test_names_of_files_and_objects_stay_text(tmp_path):
    html = write_report(tmp_path, SUMMARY, ROWS).read_text(encoding="utf-8")
    assert "<script" not in html
    assert html.count("&lt;script&gt;alert(&#39;&amp;&#39;)&lt;/script&gt;") == 10
    assert 'src="report-pictures/a%20b/before.png"' in html
    assert "before: Armature modifier, frame 7" in html
    # A failed file first, and each with its own sentences.
    assert html.index("b.blend</h2>") < html.index("left as it was")
    assert "largest deviation" not in html, "no mesh has one, so there is no column for it"


def test_a_value_that_a_template_lacks_is_an_error():
    import jinja2

    with pytest.raises(jinja2.UndefinedError):
        render("batch.html", title="")


def test_every_template_is_one():
    names = [path.name for path in FOLDER.iterdir() if path.suffix == ".html"]
    assert len(names) >= 4
    for name in names:
        environment().get_template(name)


def test_without_jinja2_only_the_pages_are_missing(tmp_path, monkeypatch):
    assert can_render()
    monkeypatch.setitem(sys.modules, "jinja2", None)
    assert not can_render()
    path = write_report(tmp_path, SUMMARY, ROWS)
    assert path == tmp_path / "report.json"
    assert json.loads(path.read_text(encoding="utf-8"))["summary"] == SUMMARY
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(SinewError, match="install sinew-blender"):
        report_page.write(Page("0", {}, True, (), (), ()), tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["report.json"]
