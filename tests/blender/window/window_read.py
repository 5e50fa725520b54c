# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads files that were saved with Sinew in a Blender without it.

    python window_read.py SAVED.json

SAVED.json lists the expected content of each file; prints the deviations as JSON.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy
import window_scene

FRAMES = (1, 12, 20)


def faults_of(path: str, characters: dict[str, dict[str, str]], in_memory: bool) -> list[str]:
    """A sentence for each deviation from Blender's own state.

    characters  each mesh object's armature and method; the method is "" if Sinew was off
    in_memory   written by Blender without notification, such as by autosave: the armatures must be there
    """
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not hasattr(bpy.types.Object, "sinew")
    found = []
    for name, wanted in characters.items():
        obj = bpy.data.objects.get(name)
        if obj is None:
            found.append(f"{name} is not in the file")
            continue
        found += [f"{name}: {fault}" for fault in _object_faults(obj, wanted, in_memory)]
    is_on = any(wanted["method"] for wanted in characters.values())
    if is_on and not in_memory and "Sinew" not in bpy.data.texts:
        found.append("no text says that Sinew is missing")
    return found


def _object_faults(obj: bpy.types.Object, wanted: dict[str, str], in_memory: bool) -> list[str]:
    armatures = [modifier for modifier in obj.modifiers if modifier.type == "ARMATURE"]
    found = []
    if [m.object and m.object.name for m in armatures] != [wanted["armature"]]:
        found.append(f"its armatures are {[m.object and m.object.name for m in armatures]}")
    if in_memory or found:
        return found
    modifier = armatures[0]
    if not (modifier.show_viewport and modifier.show_render):
        found.append("its Armature modifier is off")
    if wanted["method"] and modifier.use_deform_preserve_volume != (wanted["method"] == "dq"):
        found.append(f"Preserve Volume is {modifier.use_deform_preserve_volume} for {wanted['method']}")
    for nodes in (m for m in obj.modifiers if m.type == "NODES"):
        if nodes.show_viewport or nodes.show_render:
            found.append(f"Sinew's modifier is on: {nodes.name}")
    shapes, scene = [], next(s for s in bpy.data.scenes if obj.name in s.objects)
    bpy.context.window.scene = scene
    if obj.mode != "OBJECT":
        # Saved in edit mode, it has no evaluated mesh without a window.
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.mode_set(mode="OBJECT")
    method = "dq" if modifier.use_deform_preserve_volume else "lbs"
    for frame in FRAMES:
        scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        shown = window_scene.shown_points(obj, depsgraph)
        expected = window_scene.blender_points(obj, modifier.object, method, depsgraph)
        shapes.append(shown)
        if window_scene.worst(shown, expected) > window_scene.TOLERANCE:
            found.append(f"frame {frame} is off by {window_scene.worst(shown, expected):.4f}")
    if window_scene.worst(shapes[0], shapes[-1]) < 0.1:
        found.append("it is not animated")
    return found


def main() -> None:
    faults: dict[str, list[str]] = {}
    for file in json.loads(Path(sys.argv[1]).read_text()):
        found = faults_of(file["path"], file["characters"], file["in_memory"])
        if found:
            faults.setdefault(file["step"], []).extend(found)
    print("FAULTS " + json.dumps(faults), flush=True)


if __name__ == "__main__":
    main()
