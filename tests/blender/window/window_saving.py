# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps that save, quit and open again."""

from __future__ import annotations

import time
from pathlib import Path

import bpy
import window
from window_hand import FOLDER, PATIENCE, Run, Steps, click, hero, playing, push, rig, set_frame, step, wait
from window_scene import pose


@step("files")
def add(run: Run) -> Steps:
    yield from run.check_frames()


@step("files")
def save_as_with_a_camera(run: Run) -> Steps:
    run.save("saved.blend")
    run.check_shapes("right after saving")
    yield from wait()


@step("files")
def save_with_a_pose_by_hand(run: Run) -> Steps:
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "posed.blend"))
    pose(rig(), 40.0)
    yield
    bpy.ops.wm.save_mainfile()
    run.note_saved(FOLDER / "posed.blend")
    run.check_shapes("right after saving")
    yield from run.see("after saving")
    set_frame(12)


@step("files")
def save_incremental(run: Run) -> Steps:
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "increment.blend"))
    hero().location.x += 0.01
    push("Moved")
    yield
    bpy.ops.wm.save_mainfile(incremental=True)
    run.note_saved(FOLDER / "increment1.blend")
    yield from wait()


@step("files")
def save_while_it_plays(run: Run) -> Steps:
    with playing():
        yield from wait(10)
        for number in range(3):
            run.save(f"playing{number}.blend", copy=True)
            yield from wait(3)
    yield from wait()


@step("files")
def save_over_and_over(run: Run) -> Steps:
    """Ten saves without a frame in between."""
    for number in range(10):
        pose(rig(), 10.0 * number)
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "saved.blend"))
    run.note_saved(FOLDER / "saved.blend")
    yield from run.see("saved ten times")
    set_frame(12)
    yield from run.check_frames()


@step("files")
def revert(run: Run) -> Steps:
    """The file that the second Blender opened works with Sinew, too."""
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "saved.blend"))
    yield from run.see("opened again")
    run.check(hero().sinew.method == "dq", f"its method is {hero().sinew.method}")
    yield from run.check_frames()
    click("sinew.remove", "Hero")
    run.wanted["Hero"] = ""
    yield from wait()
    run.check(
        not hero().modifiers["Armature"].use_deform_preserve_volume, "Preserve Volume stays after Remove"
    )
    run.check_shapes("removed")


@step("quit")
def save_and_leave(run: Run) -> Steps:
    """For the second session, which opens last.blend and recovers quit.blend and the autosave."""
    run.save("last.blend")
    bpy.ops.wm.save_userpref()
    yield from wait()
    hero().location.y += 0.1
    push("Moved after saving")
    yield from wait()


@step("quit")
def autosave(run: Run) -> Steps:
    """Blender sends no notification of it; it happens every minute."""
    started = time.time()

    def newest() -> list[Path]:
        return [path for path in FOLDER.glob("*_autosave.blend") if path.stat().st_mtime > started]

    yield from window.until(newest, "an autosave", PATIENCE)
    yield from wait()
    run.note_saved(newest()[0], in_memory=True)


@step("again")
def opened_again(run: Run) -> Steps:
    """Blender was started with last.blend, and Sinew is enabled in the preferences."""
    run.wanted = {"Hero": "dq", "Small": "lbs", "Front": "dq", "Late": "dq", "Guest": ""}
    yield from wait(4)
    run.check(Path(bpy.data.filepath).name == "last.blend", f"{bpy.data.filepath} is open")
    run.check_shapes("as it opened")
    yield from run.check_frames()


@step("again")
def recover_last_session(run: Run) -> Steps:
    bpy.ops.wm.recover_last_session()
    yield from run.see("recovered", 4)
    yield from run.check_frames()
    run.save("recovered.blend")


@step("again")
def recover_auto_save(run: Run) -> Steps:
    found = max(FOLDER.glob("last*_autosave.blend"), key=lambda path: path.stat().st_mtime)
    bpy.ops.wm.recover_auto_save(filepath=str(found))
    yield from run.see("recovered", 4)
    yield from run.check_frames()
