# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what the heat map adds to a frame in Blender: python bench/heat_map.py [FILE.blend MESH]

Without a file, a tube of 100,000 vertices. Frames with each measure and without alternate; prints the
differences of the minimum times in milliseconds.
"""

from __future__ import annotations

import math
import sys
import time

import bpy
import numpy as np
import sinew_addon
from sinew_addon.attach import attach
from sinew_addon.core.metrics import METRICS
from sinew_addon.deform import session
from sinew_addon.features.heat import measures

SIDES, RINGS, ROUNDS, FRAMES = 200, 500, 8, range(2, 12)


def make_tube() -> bpy.types.Object:
    """A tube along X with two bones that bend it by 100 degrees from frame 1 to 11."""
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
    x = np.repeat(np.linspace(0.0, 2.0, RINGS), SIDES)
    angle = np.tile(2 * np.pi * np.arange(SIDES) / SIDES, RINGS)
    points = np.stack([x, 0.25 * np.cos(angle), 0.25 * np.sin(angle)], axis=1)
    here = np.arange((RINGS - 1) * SIDES)
    beside = here // SIDES * SIDES + (here + 1) % SIDES
    mesh = bpy.data.meshes.new("Tube")
    mesh.from_pydata(points, [], np.stack([here, beside, beside + SIDES, here + SIDES], axis=1).tolist())
    obj = bpy.data.objects.new("Tube", mesh)
    link(obj)
    for index in range(2):
        group = obj.vertex_groups.new(name=f"bone.{index}")
        for vertex, share in enumerate(x / 2.0):
            group.add([vertex], float(share if index else 1.0 - share), "REPLACE")
    obj.modifiers.new("Armature", "ARMATURE").object = armature
    return obj


def least_time(scene: bpy.types.Scene) -> float:
    """The minimum time of a frame, milliseconds."""
    times = []
    for frame in FRAMES:
        started = time.perf_counter()
        scene.frame_set(frame)
        times.append(1000.0 * (time.perf_counter() - started))
    return min(times)


def main() -> None:
    if len(sys.argv) == 3:
        bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
        obj = bpy.data.objects[sys.argv[2]]
    else:
        obj = make_tube()
    scene = bpy.context.scene
    attach.add(obj, "dq")
    session.refresh(bpy.context)
    least = {name: math.inf for name in ("off", *METRICS)}
    for _round in range(ROUNDS):
        least["off"] = min(least["off"], least_time(scene))
        obj.sinew.heat = True
        for name in METRICS:
            measures.of(scene).quantity = name
            least[name] = min(least[name], least_time(scene))
        obj.sinew.heat = False
    print(f"{len(obj.data.vertices):,} vertices; a frame without heat map: {least['off']:.2f} ms")
    for name in METRICS:
        print(f"{name:10} {least[name] - least['off']:6.2f} ms more")


sinew_addon.register()
try:
    main()
finally:
    # Handlers still registered at the end of the process crash Blender 4.2 and hang 4.5.
    sinew_addon.unregister()
