# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of features_in_window.py: blends actions on human.blend. Esc stops a long blend, the next goes to its
end, and Ctrl+Z undoes it."""

from __future__ import annotations

from collections.abc import Generator

import bpy
import window

_ZIP, FOLDER = window.arguments()
# Long enough to be stopped.
LONG = 20_000


def is_blending() -> bool:
    running = bpy.context.window_manager.windows[0].modal_operators
    return any(operator.bl_idname == "SINEW_OT_blend_actions" for operator in running)


def state() -> dict[str, object]:
    animation = rig().animation_data
    return {
        "actions": sorted(bpy.data.actions.keys()),
        "plays": animation.action.name if animation.action is not None else None,
        "frame": bpy.context.scene.frame_current,
    }


def rig() -> bpy.types.Object:
    return next(obj for obj in bpy.data.objects if obj.type == "ARMATURE")


def blend(**options: object) -> None:
    with window.in_view3d():
        bpy.ops.sinew.blend_actions("INVOKE_DEFAULT", **options)


# As the dialog's OK.
CHOSEN = {
    "in_steps": True,
    "actions": [
        {"name": "STRAIN", "weight": 1.0, "weight_from": 1.0},
        {"name": "LATE", "weight": 0.5, "weight_from": 1.0},
    ],
}


def steps() -> Generator[None, None, dict]:
    facts = {}
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "human.blend"))
    yield from window.wait()
    armature = rig()
    window.select_only(armature)
    strain = armature.animation_data.action
    strain.name = "STRAIN"
    other = strain.copy()
    other.name = "LATE"
    other.use_frame_range, other.frame_start, other.frame_end = True, 9, 40
    bpy.context.scene.frame_set(16)
    yield
    middle = bpy.context.window_manager.windows[0]
    other.frame_end = LONG
    bpy.ops.ed.undo_push(message="Before")
    before = state()
    blend(**CHOSEN)
    yield from window.until(is_blending, "the blend")
    yield
    window.press("ESC", (middle.width // 2, middle.height // 2))
    yield from window.until(lambda: not is_blending(), "the end of the blend")
    facts["stopped"] = [before, state()]
    other.frame_end = 40
    bpy.ops.ed.undo_push(message="Shorter")
    blend(**CHOSEN)
    yield from window.until(lambda: not is_blending() and len(bpy.data.actions) == 3, "the new action")
    facts["ended"] = state()
    window.press("Z", (middle.width // 2, middle.height // 2), ctrl=True)
    yield from window.until(lambda: len(bpy.data.actions) == 2, "undo")
    facts["undone"] = state()
    return facts
