# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes human.blend from the panel's dialog in a Blender with a window: each kind once with Esc in the
middle, then to its end, and Ctrl+Z. Keys are simulated, which needs --enable-event-simulate.

    blender --factory-startup --enable-event-simulate --python bake_in_window.py -- sinew.zip FOLDER
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, HERE = window.arguments()
FOLDER = HERE / "baked"
# Blender's folder for the user's files.
USER = HERE / "user"
FRAME = 16
# Long enough to be stopped in between.
LONG = {"shape-keys": 2000, "mdd": 3000, "alembic": 3000, "usd": 3000, "bones": 2000, "vat": 3000}
# Some distributions' builds of Blender lack the other formats.
KINDS = [kind for kind in LONG if kind not in ("alembic", "usd") or getattr(bpy.app, kind).supported]
TICK = 0.1
PATIENCE = 120.0


def press(key: str, **held: bool) -> None:
    main = bpy.context.window_manager.windows[0]
    window.press(key, (main.width // 2, main.height // 2), **held)


def is_baking() -> bool:
    running = bpy.context.window_manager.windows[0].modal_operators
    return any(operator.bl_idname == "SINEW_OT_bake" for operator in running)


def is_done_since(files: list[str], bones: int) -> Callable[[], bool]:
    """Whether a bake has ended that starts with these files and this many bones."""

    def is_done() -> bool:
        now = state()
        return not is_baking() and (now["keys"] or now["bones"] != bones or now["files"] != files)

    return is_done


def blenders() -> int:
    """The child processes of this process."""
    found = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            found += int(stat.read_text().rpartition(")")[2].split()[1]) == os.getpid()
        except OSError:
            continue
    return found


def state() -> dict[str, object]:
    """What a bake must not change if it is stopped or undone."""
    scene, obj = bpy.context.scene, bpy.data.objects["Human"]
    return {
        "frame": [scene.frame_current, scene.frame_subframe, scene.frame_start, scene.frame_end],
        "objects": sorted(o.name for o in bpy.data.objects),
        "selected": sorted(o.name for o in bpy.context.selected_objects),
        "modifiers": [(m.name, m.type, m.show_viewport) for m in obj.modifiers],
        "keys": obj.data.shape_keys is not None,
        "meshes": len(bpy.data.meshes),
        "actions": len(bpy.data.actions),
        "bones": sum(len(o.data.bones) for o in bpy.data.objects if o.type == "ARMATURE"),
        "armatures": len(bpy.data.armatures),
        "method": obj.sinew.method,
        "points": hashlib.sha256(window.final_points(obj)).hexdigest(),
        "files": sorted(str(p.relative_to(HERE)) for p in FOLDER.rglob("*")),
        "folder": sorted(p.name for p in HERE.iterdir() if p != USER),
        "blenders": blenders(),
    }


def start(kind: str, frames: str) -> Iterator[None]:
    """Opens the dialog with the panel's button."""
    with window.in_view3d():
        bpy.ops.sinew.bake("INVOKE_DEFAULT", kind=kind, frames=frames, folder=str(FOLDER), helpers=6)
    yield
    press("RET")


def steps() -> Iterator[None]:
    facts = {"stopped": {}, "ended": {}, "refused": {}}
    window.install(ZIP)
    bpy.ops.wm.open_mainfile(filepath=str(HERE / "human.blend"))
    yield from window.wait()
    scene, obj = bpy.context.scene, bpy.data.objects["Human"]
    window.select_only(obj)
    with window.in_view3d():
        bpy.ops.sinew.add("INVOKE_DEFAULT")
    obj.sinew.method = "dq"
    scene.frame_set(FRAME)
    FOLDER.mkdir()
    # Ctrl+Z goes back to this state.
    bpy.ops.ed.undo_push(message="Before")
    yield
    before = state()
    for kind in KINDS:
        yield from start(kind, f"1-{LONG[kind]}")
        yield from window.until(is_baking, f"a bake to {kind}", PATIENCE)
        for _tick in range(20 if kind in ("alembic", "usd") else 1):
            yield
        middle = state()
        assert is_baking(), kind
        press("ESC")
        yield from window.until(lambda: not is_baking(), "the end", PATIENCE)
        after = state()
        facts["stopped"][kind] = {
            "files meanwhile": [name for name in middle["files"] if name not in before["files"]],
            "blenders meanwhile": middle["blenders"],
            "changed": {k: [before[k], after[k]] for k in before if before[k] != after[k]},
        }
    for kind in KINDS:
        is_done = is_done_since(state()["files"], state()["bones"])
        yield from start(kind, "1-24")
        yield from window.until(is_done, f"the end of a bake to {kind}", PATIENCE)
        ended = state()
        press("Z", ctrl=True)
        for _tick in range(10):
            yield
        after = state()
        left = ("files", "folder")
        facts["ended"][kind] = {
            "files": ended["files"],
            "modifiers": [modifier[1] for modifier in ended["modifiers"]],
            "keys": ended["keys"],
            "not undone": {
                k: [before[k], after[k]] for k in before if before[k] != after[k] and k not in left
            },
        }
    for kind in LONG.keys() - KINDS:
        try:
            bpy.ops.sinew.bake(kind=kind, frames="1-24", folder=str(FOLDER))
        except RuntimeError as error:
            facts["refused"][kind] = str(error)
    print("FACTS " + json.dumps(facts), flush=True)


window.run(steps(), TICK)
