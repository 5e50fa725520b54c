# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew check`, the preflight for farms: its reports on files, and on the Blender that will render them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import bpy
import pytest
import scenes
import sinew
from program import run_sinew
from sinew_addon.attach import attach, properties
from sinew_addon.commands.check import line_of


def check(*arguments: object, status: int = 0) -> dict[str, dict]:
    """The reports of `sinew check --json`, by the names of files; checks that its text says the same."""
    reports = json.loads(run_sinew("check", *arguments, "--json", status=status).stdout)["files"]
    for report in reports:
        line = line_of(report)
        assert line.startswith(report["file"])
        assert all(problem in line for problem in report["problems"])
        assert ("ok" in line) == (not report["problems"])
    return {Path(report["file"]).name: report for report in reports}


def printed_lines(*arguments: object, status: int = 0) -> list[str]:
    return run_sinew("check", *arguments, status=status).stdout.splitlines()


def save(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def empty() -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def test_files_that_are_well(tmp_path):
    scenes.make_arm()
    save(tmp_path / "in" / "plain.blend")
    _obj, _armature = scenes.skinned_arm("dq", name="Other")
    hidden, _armature = scenes.skinned_arm("qv", name="Hidden")
    hidden.hide_viewport = hidden.hide_render = True
    save(tmp_path / "in" / "deep" / "skinned.blend")
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


def test_what_is_switched_off_needs_no_sinew(tmp_path):
    obj, _armature = scenes.skinned_arm("dq")
    properties.of(obj).enabled = False
    report = check(save(tmp_path / "off.blend"))["off.blend"]
    assert (report["needs_sinew"], report["notes"]) == (
        False,
        ["Arm is switched off: its Armature modifier deforms it"],
    )


def simulated(obj, armature):
    modifier = scenes.put_in_front(obj, "CLOTH", "Cloth")
    return f"modifier {modifier.name} in front of Armature is a simulation"


def without_armature(obj, armature):
    bpy.data.objects.remove(armature)
    return "the armature of Armature is gone"


def without_armature_modifier(obj, armature):
    obj.modifiers.remove(obj.modifiers["Armature"])
    return "the Armature modifier that Sinew stands in for is gone"


def without_settings(obj, armature):
    properties.clear(obj)
    return "has the modifier Sinew of Sinew without its settings"


@pytest.mark.parametrize("harm", [simulated, without_armature, without_armature_modifier, without_settings])
def test_what_sinew_can_not_drive(harm, tmp_path):
    obj, armature = scenes.skinned_arm("dq")
    wanted = harm(obj, armature)
    report = check(save(tmp_path / "a.blend"), status=1)["a.blend"]
    assert any(wanted in problem for problem in report["problems"]), report
    assert all(problem.startswith("Arm") for problem in report["problems"])


def test_an_armature_modifier_that_was_left_off(tmp_path):
    """The state of a file that lost Sinew's settings: object and modifier are otherwise complete."""
    obj, _armature = scenes.skinned_arm("dq")
    attach.remove(obj)
    modifier = obj.modifiers["Armature"]
    assert "ok" in run_sinew("check", save(tmp_path / "a.blend")).stdout
    modifier.object, modifier.show_viewport, modifier.show_render = None, False, False
    (problem,) = check(save(tmp_path / "b.blend"), status=1)["b.blend"]["problems"]
    assert "Armature is switched off and has no armature" in problem


def test_what_is_hidden_in_another_scene(tmp_path):
    """Such objects are checked as well."""
    obj, armature = scenes.skinned_arm("dq")
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(obj)
    other.collection.objects.link(armature)
    bpy.context.scene.collection.objects.unlink(obj)
    bpy.context.scene.collection.objects.unlink(armature)
    obj.hide_viewport = True
    assert check(save(tmp_path / "a.blend"))["a.blend"]["meshes"] == [{"object": "Arm", "method": "dq"}]


def test_linked_without_an_override(tmp_path):
    _obj, _armature = scenes.skinned_arm("dq")
    library = save(tmp_path / "hero.blend")
    scenes.link(library, "Arm", "Arm Rig")
    (problem,) = check(save(tmp_path / "shot.blend"), status=1)["shot.blend"]["problems"]
    assert "Arm is linked from another file" in problem
    assert "library override" in problem
    for linked in (bpy.data.objects["Arm"], bpy.data.objects["Arm Rig"]):
        linked.override_create(remap_local_usages=True)
    report = check(save(tmp_path / "override.blend"))["override.blend"]
    assert report["meshes"] == [{"object": "Arm", "method": "dq"}]
    library.unlink()
    report = check(tmp_path / "override.blend", status=1)["override.blend"]
    assert any("hero.blend is missing" in note for note in report["notes"])


def test_what_can_not_be_read_does_not_stop_the_others(tmp_path):
    scenes.make_arm()
    save(tmp_path / "a.blend")
    (tmp_path / "b.blend").write_bytes(b"BLENDER and then nothing")
    (tmp_path / "c.blend").mkdir()
    save(tmp_path / "d.blend")
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

# A Blender program made from this Python's bpy, with preferences in a folder next to it.
PROGRAM = """#!/bin/sh
here=$(dirname "$0")
BLENDER_USER_RESOURCES="$here/user" PYTHONPATH="$here/site" exec {python} -S -c '
import os, sys
import bpy
expression = sys.argv[sys.argv.index("--python-expr") + 1]
assert "--factory-startup" not in sys.argv
if bpy.app.version >= (4, 3):  # before, it crashes in bpy as a module
    bpy.ops.wm.read_userpref()
print("Blender says what it likes", flush=True)
exec(expression, {{"__name__": "__main__"}})
os._exit(0)
' "$@"
"""

INSTALL = """
import sys
import bpy, addon_utils
addon_utils.enable("bl_pkg")
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
bpy.ops.wm.save_userpref()
import os
os._exit(0)
"""


@pytest.fixture
def skinned(tmp_path):
    _obj, _armature = scenes.skinned_arm("dq")
    return save(tmp_path / "skinned.blend")


@pytest.fixture
def plain(tmp_path):
    empty()
    scenes.make_arm()
    return save(tmp_path / "plain.blend")


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


def make_other_blender(folder: Path) -> Path:
    """A Blender program in a new folder, without Sinew."""
    (folder / "site").mkdir(parents=True)
    for entry in Path(sysconfig.get_paths()["purelib"]).iterdir():
        if "sinew" not in entry.name.lower() and entry.suffix != ".pth":
            (folder / "site" / entry.name).symlink_to(entry)
    return script(folder / "blender", PROGRAM.format(python=sys.executable))


def install_extension(blender: Path) -> None:
    """Installs the zip in a Blender of make_other_blender(); skips the test if that is not possible."""
    package = os.environ.get("SINEW_PACKAGE")
    if not package:
        pytest.skip("SINEW_PACKAGE is not set: the zip is not tested; ./dev package builds it")
    if bpy.app.version < (4, 3):
        pytest.skip("bpy 4.2 as a module crashes when it reads preferences")
    subprocess.run(
        [sys.executable, "-S", "-c", INSTALL, package],
        check=True,
        capture_output=True,
        env={
            **os.environ,
            "PYTHONPATH": str(blender.with_name("site")),
            "BLENDER_USER_RESOURCES": str(blender.with_name("user")),
        },
    )


@pytest.fixture
def other_blender(tmp_path):
    return make_other_blender(tmp_path / "other")


def test_another_blender_without_sinew(skinned, plain, other_blender):
    reports = check(plain, skinned, "--blender", other_blender, status=1)
    assert reports["plain.blend"]["problems"] == []
    (problem,) = reports["skinned.blend"]["problems"]
    assert problem.startswith(
        f"needs Sinew, which {other_blender} (Blender {bpy.app.version_string}) does not"
    )
    assert "the extension is not enabled" in problem


def test_another_blender_with_sinew(skinned, other_blender):
    install_extension(other_blender)
    assert check(skinned, "--blender", other_blender)["skinned.blend"]["problems"] == []
    # Its library is removed, or another version is installed.
    (manifest,) = other_blender.with_name("user").rglob("sinew/blender_manifest.toml")
    whole = manifest.read_text()
    manifest.write_text(whole.replace(f'version = "{sinew.__version__}"', 'version = "0.0.9"'))
    (problem,) = check(skinned, "--blender", other_blender, status=1)["skinned.blend"]["problems"]
    assert f"has Sinew 0.0.9, this is {sinew.__version__}; install the same" in problem
    manifest.write_text(whole)
    manifest.with_name("__init__.py").write_text("raise RuntimeError('broken')")
    (problem,) = check(skinned, "--blender", other_blender, status=1)["skinned.blend"]["problems"]
    assert "enabled and does not load" in problem


@pytest.mark.once
@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("#!/bin/sh\nsleep 314.159 & sleep 314.159\n", "no answer after 1 s"),
        ("#!/bin/sh\nkill -SEGV $$\n", "ended (SIGSEGV) without an answer"),
        ("#!/bin/sh\necho 'SINEW-STATUS {'\n", "ended (status 0) without an answer"),
        ("#!/bin/sh\necho 'SINEW-STATUS [1]'\n", "ended (status 0) without an answer: SINEW-STATUS [1]"),
        ("#!/bin/sh\necho 'no library' >&2\nexit 1\n", "ended (status 1) without an answer: no library; "),
        ("no program\n", "can not be started"),
        (None, "can not be started"),
    ],
)
def test_another_blender_that_does_not_answer(text, wanted, skinned, tmp_path):
    program = tmp_path / "blender"
    if text is not None:
        script(program, text)
    started = time.monotonic()
    failed = run_sinew("check", skinned, "--blender", program, "--timeout", "1", status=1)
    assert wanted in failed.stderr
    assert time.monotonic() - started < 60
    assert subprocess.run(["pgrep", "-f", "sleep 314.159"], capture_output=True, check=False).stdout == b""


@pytest.mark.window
def test_a_whole_blender(skinned, plain, tmp_path):
    """A real one, with its own program, as users have it."""
    program = os.environ.get("SINEW_FULL_BLENDER")
    package = os.environ.get("SINEW_PACKAGE")
    if not program or not package or bpy.app.version < (5, 2):
        pytest.skip("tested once, beside bpy 5.2, where SINEW_FULL_BLENDER and SINEW_PACKAGE are set")
    user = tmp_path / "user"
    other = script(
        tmp_path / "whole",
        f'#!/bin/sh\ncd {tmp_path}\nBLENDER_USER_RESOURCES={user} exec {program} run "$@"\n',
    )
    (problem,) = check(skinned, "--blender", other, status=1)["skinned.blend"]["problems"]
    assert "the extension is not enabled" in problem
    shutil.copy(package, tmp_path / "sinew.zip")
    subprocess.run(
        [other, "--command", "extension", "install-file", "-r", "user_default", "-e", tmp_path / "sinew.zip"],
        check=True,
        capture_output=True,
    )
    assert check(skinned, plain, "--blender", other)
    # Also in that Blender itself, with the command that the extension adds.
    plain.with_name("broken.blend").write_bytes(b"BLENDER and then nothing")
    names = ("skinned.blend", "plain.blend", "broken.blend")
    done = subprocess.run(
        [other, "--command", "sinew", "check", *(tmp_path / name for name in names)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stdout + done.stderr
    said = dict(zip(names, done.stdout.splitlines()[-3:], strict=True))
    assert "ok: Sinew deforms 1 mesh by dq" in said["skinned.blend"]
    assert "ok: does not need Sinew" in said["plain.blend"]
    assert "Blender can not read it" in said["broken.blend"]
