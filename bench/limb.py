# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh along X in Blender, with two bones that bend it by 100 degrees from frame 1 to 11."""

from __future__ import annotations

import math
import time

import bpy
import numpy as np

FRAMES = range(2, 12)


def make_limb(points: np.ndarray, faces: np.ndarray) -> bpy.types.Object:
    """Alone in an empty file. points: [vertices, 3], from 0 to 2 along X; faces: [faces, corners]"""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    link = bpy.context.scene.collection.objects.link
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for index in range(2):
        bone = armature.data.edit_bones.new(f"bone.{index}")
        bone.head, bone.tail = (index, 0.0, 0.0), (index + 1.0, 0.0, 0.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    bone = armature.pose.bones[1]
    bone.rotation_mode = "XYZ"
    for frame, degrees in ((1, 0.0), (11, 100.0)):
        bone.rotation_euler = (math.radians(degrees), 0.0, math.radians(degrees))
        bone.keyframe_insert("rotation_euler", frame=frame)
    mesh = bpy.data.meshes.new("Limb")
    mesh.from_pydata(points, [], faces.tolist())
    obj = bpy.data.objects.new("Limb", mesh)
    link(obj)
    for index in range(2):
        group = obj.vertex_groups.new(name=f"bone.{index}")
        for vertex, share in enumerate(points[:, 0] / 2.0):
            group.add([vertex], float(share if index else 1.0 - share), "REPLACE")
    obj.modifiers.new("Armature", "ARMATURE").object = armature
    return obj


def least_frame() -> float:
    """The minimum time of a frame, seconds."""
    times = []
    for frame in FRAMES:
        started = time.perf_counter()
        bpy.context.scene.frame_set(frame)
        times.append(time.perf_counter() - started)
    return min(times)
