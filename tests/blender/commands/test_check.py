# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew check`, the preflight for farms: its reports on files."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import bpy
import pytest
import scenes
from conftest import IS_NEWEST
from program import ran, run_sinew
from sinew_addon.attach import properties
from sinew_addon.commands.check import line_of

pytestmark = pytest.mark.outer_versions


def check(*arguments: object, status: int = 0) -> dict[str, dict]:
    """The reports of `sinew check --json`, by the names of files; checks that its text says the same."""
    reports = json.loads(run_sinew("check", *arguments, "--json", status=status).stdout)
    for report in reports:
        line = line_of(report)
        assert line.startswith(report["file"])
        assert all(problem in line for problem in report["problems"])
        assert ("ok" in line) == (not report["problems"])
    return {Path(report["file"]).name: report for report in reports}


def printed_lines(*arguments: object, status: int = 0) -> list[str]:
    return run_sinew("check", *arguments, status=status).stdout.splitlines()


def empty() -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def test_files_that_are_well(tmp_path):
    scenes.make_arm()
    scenes.save(tmp_path / "in" / "plain.blend")
    _obj, _armature = scenes.skinned_arm("dq", name="Other")
    hidden, _armature = scenes.skinned_arm("qv", name="Hidden")
    hidden.hide_viewport = hidden.hide_render = True
    scenes.save(tmp_path / "in" / "deep" / "skinned.blend")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.blend")}
    reports = check(tmp_path / "in")
    assert reports["plain.blend"]["needs_sinew"] is False
    assert reports["skinned.blend"]["meshes"] == [
        {"object": "Hidden", "method": "qv"},
        {"object": "Other", "method": "dq"},
    ]
    lines = printed_lines(tmp_path / "in")
    assert lines == [line_of(report) for report in reports.values()]
    assert any("ok: Sinew deforms 2 meshes by dq, qv" in line for line in lines)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.blend")} == before


@pytest.mark.parametrize("amount", [1.0, 0.5])
def test_weights_that_do_not_sum_to_one(tmp_path, amount):
    """Those of groups without a bone do not count."""
    obj, _armature = scenes.skinned_arm("dq")
    everywhere = range(len(obj.data.vertices))
    for group in obj.vertex_groups:
        group.remove(everywhere)
    obj.vertex_groups["bone.0"].add(everywhere, amount, "REPLACE")
    obj.vertex_groups.new(name="Mask").add([1, 2, 3], 0.3, "REPLACE")
    report = check(scenes.save(tmp_path / "sums.blend"))["sums.blend"]
    said = [
        note for note in report["notes"] if note.startswith("Arm: weights do not sum to 1, which Blender")
    ]
    assert len(said) == (amount != 1.0)
    assert report["problems"] == []


def test_what_is_switched_off_needs_no_sinew(tmp_path):
    obj, _armature = scenes.skinned_arm("dq")
    properties.of(obj).enabled = False
    report = check(scenes.save(tmp_path / "off.blend"))["off.blend"]
    assert (report["needs_sinew"], report["notes"]) == (
        False,
        ["Arm is switched off: its Armature modifier deforms it"],
    )


# What is said of each.
HARMS = {
    "modifier Cloth in front of Armature is a simulation": lambda obj, armature: scenes.put_in_front(
        obj, "CLOTH", "Cloth"
    ),
    "the armature of Armature is gone": lambda obj, armature: bpy.data.objects.remove(armature),
    "the Armature modifier that Sinew stands in for is gone": lambda obj, armature: obj.modifiers.remove(
        obj.modifiers["Armature"]
    ),
    "has the modifier Sinew of Sinew without its settings": lambda obj, armature: properties.clear(obj),
}


@pytest.mark.parametrize("wanted", HARMS)
def test_what_sinew_can_not_drive(wanted, tmp_path):
    obj, armature = scenes.skinned_arm("dq")
    HARMS[wanted](obj, armature)
    report = check(scenes.save(tmp_path / "a.blend"), status=1)["a.blend"]
    assert any(wanted in problem for problem in report["problems"]), report
    assert all(problem.startswith("Arm") for problem in report["problems"])


def test_what_is_hidden_in_another_scene(tmp_path):
    """Such objects are checked as well."""
    obj, armature = scenes.skinned_arm("dq")
    other = bpy.data.scenes.new("Other")
    scenes.move_to(other.collection, obj, armature)
    obj.hide_viewport = True
    report = check(scenes.save(tmp_path / "a.blend"))["a.blend"]
    assert report["meshes"] == [{"object": "Arm", "method": "dq"}]


def test_linked_without_an_override(tmp_path):
    _obj, _armature = scenes.skinned_arm("dq")
    library = scenes.save(tmp_path / "hero.blend")
    scenes.link(library, "Arm", "Arm Rig")
    (problem,) = check(scenes.save(tmp_path / "shot.blend"), status=1)["shot.blend"]["problems"]
    assert "Arm is linked from another file" in problem
    assert "library override" in problem
    for linked in (bpy.data.objects["Arm"], bpy.data.objects["Arm Rig"]):
        linked.override_create(remap_local_usages=True)
    report = check(scenes.save(tmp_path / "override.blend"))["override.blend"]
    assert report["meshes"] == [{"object": "Arm", "method": "dq"}]
    library.unlink()
    report = check(tmp_path / "override.blend", status=1)["override.blend"]
    assert any("hero.blend is missing" in note for note in report["notes"])


def test_what_can_not_be_read_does_not_stop_the_others(tmp_path):
    scenes.make_arm()
    scenes.save(tmp_path / "a.blend")
    (tmp_path / "b.blend").write_bytes(b"BLENDER and then nothing")
    (tmp_path / "c.blend").mkdir()
    scenes.save(tmp_path / "d.blend")
    paths = [tmp_path / f"{name}.blend" for name in ("a", "b", "d", "none")]
    reports = check(*paths, status=1)
    assert printed_lines(*paths, status=1) == [line_of(report) for report in reports.values()]
    assert [bool(report["problems"]) for report in reports.values()] == [False, True, False, True]
    assert "no such file" in reports["none.blend"]["problems"][0]
    assert "no .blend files" in run_sinew("check", tmp_path / "c.blend", status=2).stderr


@pytest.mark.once
def test_a_file_that_takes_too_long(tmp_path):
    path = scenes.write_slow_file(tmp_path / "slow.blend", 500, 100_000_000)
    said = run_sinew("check", path, "--timeout", "0.5", status=1)
    assert said.stdout.startswith(f"{path}: no end after 0.5 s while opening it")


# --- Another Blender


@pytest.fixture
def skinned(tmp_path):
    _obj, _armature = scenes.skinned_arm("dq")
    return scenes.save(tmp_path / "skinned.blend")


@pytest.fixture
def plain(tmp_path):
    empty()
    scenes.make_arm()
    return scenes.save(tmp_path / "plain.blend")


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


@pytest.mark.window
def test_a_whole_blender(skinned, plain, tmp_path):
    """A real one, with its own program, as users have it."""
    program = os.environ.get("SINEW_FULL_BLENDER")
    package = os.environ.get("SINEW_PACKAGE")
    if not program or not package or not IS_NEWEST:
        pytest.skip("tested once, beside the newest bpy, where SINEW_FULL_BLENDER and SINEW_PACKAGE are set")
    user = tmp_path / "user"
    other = script(
        tmp_path / "whole",
        f'#!/bin/sh\ncd {tmp_path}\nBLENDER_USER_RESOURCES={user} exec {program} run "$@"\n',
    )
    shutil.copy(package, tmp_path / "sinew.zip")
    install = "--command", "extension", "install-file", "-r", "user_default", "-e"
    assert ran(other, *install, tmp_path / "sinew.zip").returncode == 0
    plain.with_name("broken.blend").write_bytes(b"BLENDER and then nothing")
    names = ("skinned.blend", "plain.blend", "broken.blend")
    done = ran(other, "--command", "sinew", "check", *(tmp_path / name for name in names))
    assert done.returncode == 1, done.stdout + done.stderr
    said = dict(zip(names, done.stdout.splitlines()[-3:], strict=True))
    assert "ok: Sinew deforms 1 mesh by dq" in said["skinned.blend"]
    assert "ok: does not need Sinew" in said["plain.blend"]
    assert "Blender can not read it" in said["broken.blend"]
