# SPDX-License-Identifier: GPL-3.0-or-later
"""Files, names, folders and options that are malicious or damaged."""

from __future__ import annotations

import json
import os
import subprocess

import pytest
import scenes
from program import run_sinew, start_sinew

SCRIPT = "<script>alert(1)</script>"
pytestmark = [pytest.mark.once, pytest.mark.outer_versions]


@pytest.fixture
def arm_file(tmp_path):
    scenes.make_arm(sides=6, rings=5)
    return scenes.save(tmp_path / "in" / "arm.blend")


def test_names_are_no_html(tmp_path):
    obj, armature = scenes.make_arm(sides=6, rings=5)
    obj.name, armature.name = SCRIPT, f"{SCRIPT} Rig"
    armature.animation_data.action.name = SCRIPT
    obj.vertex_groups.new(name=SCRIPT).add([1], 1.0, "REPLACE")
    file = scenes.save(tmp_path / "a'\"&<b>.blend")
    run_sinew("compare", file, "--frames", "1,6", "--pictures", "0", "--out", tmp_path / "pages")
    run_sinew("reskin", file, "--method", "dq", "--no-pictures", "--out", tmp_path / "out")
    for page in ((tmp_path / "pages").glob("*.html"), (tmp_path / "out").glob("*.html")):
        (text,) = [path.read_text(encoding="utf-8") for path in page]
        assert "script&gt;" in text
        assert SCRIPT not in text
        assert "<b>.blend" not in text


def test_names_do_not_steer_a_terminal(tmp_path):
    pty = pytest.importorskip("pty", reason="no terminals here")
    obj, _armature = scenes.make_arm(sides=6, rings=5)
    obj.name = "\x1b]0;owned\x07\x1b[2J"
    file = scenes.save(tmp_path / "arm.blend")
    for command in (("info", file), ("check", file), ("points", file, "--method", "blender", "--frames", "1",
                    "--out", tmp_path / "o.npz")):  # fmt: skip
        ours, theirs = pty.openpty()
        process = start_sinew(*command, stdout=theirs, stderr=theirs)
        os.close(theirs)
        shown = b""
        try:
            while part := os.read(ours, 65536):
                shown += part
        except OSError:
            pass  # no process writes to it any more
        os.close(ours)
        assert process.wait(timeout=60) == 0
        assert b"\x1b]0;" not in shown
        assert b"\x1b[2J" not in shown


@pytest.mark.parametrize("name", ["...blend", "..blend", "a..blend"])
def test_names_of_files_stay_in_the_folder(name, arm_file, tmp_path):
    """The stem of "...blend" is the parent folder."""
    file = arm_file.rename(arm_file.with_name(name))
    out = tmp_path / "above" / "out"
    run_sinew("compare", file, "--frames", "1", "--pictures", "0", "--out", out)
    run_sinew("bake", file, "--method", "dq", "--to", "mdd", "--frames", "1-2", "--out", out)
    assert [path.name for path in (tmp_path / "above").iterdir()] == ["out"]
    assert len(list(out.glob("*/metrics.json"))) == 1
    assert len(list(out.glob("*/*.mdd"))) == 1


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *(("--memory", value) for value in ("-5GiB", "1e400", "nan", "")),
        *(("--timeout", value) for value in ("nan", "-1", "soon")),
        *(("--jobs", value) for value in ("0", "many")),
        *(("--frames", value) for value in ("1e309", "nan", "")),
    ],
)
def test_numbers_that_are_none(option, value, arm_file, tmp_path):
    refused = run_sinew(
        "reskin", arm_file, "--method", "dq", "--out", tmp_path / "out", f"{option}={value}", status=2
    )
    assert option.removeprefix("--") in refused.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(os.name == "nt", reason="names are text there")
def test_names_that_are_no_text(arm_file, tmp_path):
    file = os.fsencode(tmp_path) + b"/latin\xe9.blend"
    os.rename(arm_file, file)
    file = os.fsdecode(file)
    for command in (
        ("info", file),
        ("check", file),
        ("points", file, "--method", "dq", "--frames", "1", "--out", tmp_path / "o.npz"),
        ("compare", file, "--frames", "1", "--pictures", "1", "--size", "64", "--out", tmp_path / "pages"),
        ("render", file, "--method", "dq", "--frames", "1", "--size", "64", "--out", tmp_path / "render"),
        ("bake", file, "--method", "dq", "--to", "pc2", "--frames", "1-2", "--out", tmp_path / "bakes"),
        ("bake", file, "--method", "dq", "--to", "usd", "--frames", "1-2", "--out", tmp_path / "bakes"),
        ("inbetween", file, "--method", "dlb", "--out", tmp_path / "inbetween"),
    ):
        run_sinew(*command)
    process = start_sinew(
        *("reskin", "-", "--method", "dq", "--no-pictures", "--out", tmp_path / "out"),
        stdin=subprocess.PIPE,
        text=False,
        encoding=None,
        env_more={"LC_ALL": "C.UTF-8", "PYTHONIOENCODING": "utf-8:strict"},
    )
    process.communicate(os.fsencode(file) + b"\n", timeout=120)
    assert process.returncode == 0
    assert [os.fsencode(path.name) for path in (tmp_path / "out").glob("*.blend")] == [b"latin\xe9.blend"]


@pytest.mark.parametrize(
    "wrong",
    [
        {"frames": ["../../x"]},
        {"frames": [1e300]},
        {"frames": []},
        {"frames": {"a": 1}},
        {"size": "64"},
        {"method": 3},
        {"engine": None},
        {"views": []},
        {"own_look": "no"},
    ],
)
def test_golden_settings_from_anybody(wrong, arm_file, tmp_path):
    golden = tmp_path / "golden"
    golden.mkdir()
    view = {"direction": [0, 0, 1], "target": [0, 0, 0], "width": 1, "height": 1, "depth": 1}
    right = {"file": "arm.blend", "method": "dq", "frames": [1], "engine": "workbench", "size": 64,
             "own_look": False, "meshes": ["Arm"], "views": [view]}  # fmt: skip
    (golden / "render.json").write_text(json.dumps(right | wrong))
    refused = run_sinew("render", arm_file, "--against", golden, "--out", tmp_path / "out", status=1)
    assert "is not what `sinew render` writes" in refused.stderr


def test_a_journal_with_half_of_what_a_result_has(arm_file, tmp_path):
    """Such a file is processed again."""
    out = tmp_path / "out"
    command = ("reskin", arm_file, "--method", "dq", "--frames", "none", "--no-pictures", "--out", out)
    run_sinew(*command)
    journal = out / "sinew-journal.jsonl"
    for harm in ({"meshes": [{}]}, {"versions": {}}, {"left_out": "a"}):
        whole = json.loads(journal.read_text().splitlines()[-1])
        journal.write_text(json.dumps(whole | harm) + "\n")
        assert "unchanged" not in run_sinew(*command, "--resume").stderr
    assert "unchanged" in run_sinew(*command, "--resume").stderr


def test_links_in_a_folder_from_elsewhere_are_not_followed(arm_file, tmp_path):
    """Half a line at a journal's end is cut off, and unfinished files have predictable names."""
    precious, out = tmp_path / "precious", tmp_path / "out"
    precious.write_bytes(b"one line\nand half of another")
    before = precious.read_bytes()
    out.mkdir()
    (out / "sinew-journal.jsonl").symlink_to(precious)
    reskin = ("reskin", arm_file, "--method", "dq", "--frames", "none", "--no-pictures", "--out", out)
    assert "is no journal but a link" in run_sinew(*reskin, status=1).stderr
    (out / "sinew-journal.jsonl").unlink()
    for name in (".report.unfinished.html", ".report.unfinished.json", ".points.unfinished.npz",
                 ".arm.unfinished.html", ".arm.unfinished.glb", ".arm.unfinished.blend"):  # fmt: skip
        (out / name).symlink_to(precious)
    (out / "arm_cache").mkdir()
    (out / "arm_cache" / ".Arm.mdd.unfinished").symlink_to(precious)
    bake = ("bake", arm_file, "--method", "dq", "--frames", "1-2", "--out", out)
    run_sinew(*bake, "--to", "mdd")
    run_sinew("export", arm_file, "--method", "dq", "--out", out / "arm.glb")
    run_sinew(*reskin, "--overwrite")
    run_sinew("points", arm_file, "--method", "dq", "--frames", "1", "--out", out / "points.npz")
    run_sinew("compare", arm_file, "--frames", "1", "--pictures", "0", "--out", out)
    assert precious.read_bytes() == before
    assert not [path for path in out.rglob("*") if path.is_symlink()]
