# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps with whole objects: copied, joined, scaled, parented, keyed, written to libraries, purged."""

from __future__ import annotations

import bpy
import window
import window_scene
from window_hand import FOLDER, Run, Steps, choose, hero, rig, set_frame, step, wait
from window_scene import blender_points, shown_points, worst


@step("objects")
def copy_and_paste(run: Run) -> Steps:
    """Ctrl+C and Ctrl+V use a temporary file of Blender, without notification."""
    choose("Hero", "Hero Rig")
    with window.in_view3d("WINDOW"):
        bpy.ops.view3d.copybuffer()
        bpy.ops.view3d.pastebuffer()
    yield from wait(4)
    pasted = [o for o in bpy.context.window_manager.windows[0].scene.objects if o.name.startswith("Hero.")]
    run.check(len(pasted) == 1, f"{[o.name for o in pasted]} was pasted")
    for frame in (12, 5):
        set_frame(frame)
        yield from wait()
        for obj in pasted:
            _check_against(run, obj, bpy.data.objects["Hero Rig.001"], f"pasted, at frame {frame}")
    for name in [o.name for o in bpy.data.objects if o.name.startswith(("Hero.", "Hero Rig."))]:
        bpy.data.objects.remove(bpy.data.objects[name])
    yield from run.check_frames()


def _check_against(run: Run, obj: bpy.types.Object, armature: bpy.types.Object, when: str) -> None:
    depsgraph = bpy.context.window_manager.windows[0].view_layer.depsgraph
    off = worst(shown_points(obj, depsgraph), blender_points(obj, armature, "dq", depsgraph))
    run.check(off <= window_scene.TOLERANCE, f"{obj.name} {when} is off by {off:.4f}: {obj.sinew.error}")


@step("objects")
def written_as_a_library(run: Run) -> Steps:
    """As asset browsers and other add-ons do, without notification by Blender."""
    path = FOLDER / "written.blend"
    bpy.data.libraries.write(str(path), {hero(), rig()}, fake_user=True)
    wanted, run.wanted = run.wanted, {"Hero": "dq"}
    run.note_saved(path, in_memory=True)
    run.wanted = wanted
    yield from run.check_frames()
