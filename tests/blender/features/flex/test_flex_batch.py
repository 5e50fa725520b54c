# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew flex` of many files: what is done is not done again, whatever ends a run; a crash is one row."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import pytest
import read_page
import scenes
from program import needs_interrupts, run_sinew, start_sinew
from test_batch import (
    contents,
    crash,
    journal_of,
    make_rig,
    make_rigs,
    newest_only,
    wait_for_work,
)

NOTHING_BENT = '[joints]\nother = ["twist 1"]\n'


def flex(*words: object, status: int = 0) -> list[dict]:
    return json.loads(run_sinew("flex", *words, "--json", status=status).stdout)


def done_in(out: Path) -> list[str]:
    """The names of the files in the order in which they were done."""
    return [Path(record["file"]).name for record in journal_of(out)]


@newest_only
def test_resume_does_only_what_is_missing_or_changed(tmp_path):
    folder, out, table = tmp_path / "in", tmp_path / "out", tmp_path / "table.toml"
    paths = make_rigs(folder / "sub", 3)
    (folder / "bad.blend").write_text("nothing")
    table.write_text(NOTHING_BENT)
    before = contents(folder)
    words = folder, "--poses", table, "--out", out
    first = flex(*words, status=1)
    assert [Path(report["file"]).name for report in first] == ["bad.blend", *(path.name for path in paths)]
    assert [report["passed"] for report in first] == [False, True, True, True]
    assert "is not a .blend file" in first[0]["error"]
    assert contents(folder) == before
    assert sorted(path.name for path in out.iterdir()) == ["report.json", "sinew-journal.jsonl"]
    assert json.loads((out / "report.json").read_text(encoding="utf-8")) == first
    # The same without a journal, of files of one name in two folders, too.
    other = make_rig(folder / paths[0].name)
    assert flex(other, *paths, "--poses", table, "--jobs", 1)[1:] == first[1:]
    other.unlink()

    count = len(done_in(out))
    again = run_sinew("flex", *words, "--resume", status=1)
    assert done_in(out)[count:] == ["bad.blend"]
    assert again.stderr.count(", unchanged") == 3
    (folder / "bad.blend").unlink()
    make_rig(paths[1], 77.0)
    count = len(done_in(out))
    assert flex(*words, "--resume") == first[1:]
    assert done_in(out)[count:] == [paths[1].name]
    # Other limits are another verdict.
    table.write_text(f"{NOTHING_BENT}[limits]\npivot = 0.0\n")
    count = len(done_in(out))
    assert not any(report["passed"] for report in flex(*words, "--resume", status=1))
    assert sorted(done_in(out)[count:]) == [path.name for path in paths]
    # A record that can not be reported is none.
    lines = (out / "sinew-journal.jsonl").read_text().replace('"findings"', '"found"')
    (out / "sinew-journal.jsonl").write_text(lines)
    count = len(done_in(out))
    flex(*words, "--resume", status=1)
    assert len(done_in(out)) == count + 3
    assert "--out" in run_sinew("flex", folder, "--resume", status=2).stderr


@newest_only
def test_a_page_that_is_gone_is_written_again(tmp_path):
    rig, page = make_rig(tmp_path / "rig.blend"), tmp_path / "page.html"
    words = "flex", rig, "--out", tmp_path / "out", "--viewer", page, "--resume"
    run_sinew(*words)
    first = page.stat().st_mtime_ns
    run_sinew(*words)
    assert page.stat().st_mtime_ns == first
    page.unlink()
    run_sinew(*words)
    assert read_page.read(page)[0]["flex"]["verdict"] == "2 of 2 joints pass"


@pytest.mark.slow
@newest_only
@needs_interrupts
def test_a_crash_is_one_row_and_ctrl_c_loses_nothing(tmp_path):
    folder, out = tmp_path / "in", tmp_path / "out"
    paths = make_rigs(folder, 2)
    scenes.write_slow_file(folder / "a endless.blend", 500, 100_000_000)
    words = "flex", folder, "--out", out, "--jobs", 2
    process = start_sinew(*words)
    lines = [process.stderr.readline() for _ in range(2)]
    assert all("2 of 2 joints pass" in line for line in lines), lines
    wait_for_work(process)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "2 of 3 files are done; --resume does the others" in errors
    assert "Traceback" not in errors
    assert output.count("2 of 2 joints pass") == 2
    assert sorted(done_in(out)) == [path.name for path in paths]

    process = start_sinew(*words, "--resume", "--timeout", 60)
    first = wait_for_work(process)
    how = crash(first)
    crash(wait_for_work(process, but=first.pid))
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 1, errors
    assert f"Blender crashed ({how}) while opening it; tried 2 times" in output
    assert output.count("2 of 2 joints pass") == 2
    assert "no end after 3 s" in flex(*words[1:], "--resume", "--timeout", 3, status=1)[0]["error"]
