# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's importers, in a bpy."""

import bpy
import numpy as np
from adapter import NoSkinError, Task, main


def play(task: Task) -> dict:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, ending = bpy.context.scene, task.path.suffix
    scene.render.fps = 30
    if ending == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(task.path))
    elif ending == ".usdc":
        bpy.ops.wm.usd_import(filepath=str(task.path))
    else:
        bpy.ops.import_scene.fbx(filepath=str(task.path), anim_offset=0.0)
    # The importer of glTF makes spheres that draw bones.
    (tube,) = [each for each in scene.objects if each.type == "MESH" and each.find_armature()]
    rig = tube.find_armature()
    if rig is None:
        raise NoSkinError("imported without an armature")
    if task.clip:
        (second,) = [each for each in bpy.data.actions if "B second" in each.name]
        rig.animation_data.action = second
        if hasattr(second, "slots"):
            rig.animation_data.action_slot = second.slots[0]
    rig.data.pose_position = "REST"
    keys = tube.data.shape_keys
    if keys is not None:
        tube.show_only_shape_key = True
    rest = shape(tube, 0.0)
    rig.data.pose_position, tube.show_only_shape_key = "POSE", False
    return {"rest": rest, "points": [shape(tube, time * scene.render.fps) for time in task.times]}


def shape(tube: bpy.types.Object, frame: float) -> np.ndarray:
    bpy.context.scene.frame_set(round(frame))
    evaluated = tube.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.empty(3 * len(evaluated.data.vertices), np.float32)
    evaluated.data.vertices.foreach_get("co", points)
    matrix = np.array(evaluated.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


if __name__ == "__main__":
    main(bpy.app.version_string, play)
