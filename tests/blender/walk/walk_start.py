# SPDX-License-Identifier: GPL-3.0-or-later
"""The file in which a walk starts, and the library that it links."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from walker import FRAMES, Walker


def make_tube(name: str, sides: int, rings: int, bones: Sequence[str]) -> bpy.types.Object:
    points, faces = [], []
    length = float(len(bones))
    for ring in range(rings):
        for side in range(sides):
            angle = 2 * np.pi * side / sides
            points.append((length * ring / (rings - 1), 0.25 * np.cos(angle), 0.25 * np.sin(angle)))
    for ring in range(rings - 1):
        for side in range(sides):
            here, beside = ring * sides + side, ring * sides + (side + 1) % sides
            faces.append((here, beside, beside + sides, here + sides))
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    for index, bone in enumerate(bones):
        group = obj.vertex_groups.new(name=bone)
        for vertex, point in enumerate(points):
            weight = max(0.0, 1.0 - abs(point[0] - (index + 0.5)))
            if weight > 0.0:
                group.add([vertex], weight, "REPLACE")
    return obj


def make_rig(name: str, bones: Sequence[str], collection: bpy.types.Collection) -> bpy.types.Object:
    rig = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for index, bone_name in enumerate(bones):
        bone = rig.data.edit_bones.new(bone_name)
        bone.head, bone.tail = (index, 0.0, 0.0), (index + 1.0, 0.0, 0.0)
        bone.parent, bone.use_connect = parent, parent is not None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    for index, bone in enumerate(rig.pose.bones):
        bone.rotation_mode = "XYZ"
        bone.keyframe_insert("rotation_euler", frame=FRAMES[0])
        bone.rotation_euler = (0.7, 0.5, -0.3 - 0.2 * index)
        bone.keyframe_insert("rotation_euler", frame=FRAMES[1])
    return rig


def start(walker: Walker) -> None:
    """An empty file with two armatures, three meshes that they deform, and one other mesh."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    walker.number, walker.unpushed, walker.chosen = 0, False, ""
    walker.compared = False
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = FRAMES
    scene.render.engine = "WALK_RENDER"
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.filepath = str(walker.folder / "render")
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    props = bpy.data.collections.new("Props")
    scene.collection.children.link(props)
    names = ("upper", "lower", "hand")
    rig = make_rig("Rig", names, scene.collection)
    other = make_rig("Other Rig", ("thigh", "shin"), scene.collection)
    arm = make_tube("Arm", 6, 9, names)
    sleeve = make_tube("Sleeve", 5, 7, names[:2])
    leg = make_tube("Leg", 6, 7, ("thigh", "shin"))
    box = make_tube("Box", 4, 3, ("nothing",))
    for obj, armature, collection in (
        (arm, rig, scene.collection),
        (sleeve, rig, props),
        (leg, other, scene.collection),
        (box, None, props),
    ):
        collection.objects.link(obj)
        if armature is not None:
            obj.modifiers.new("Armature", "ARMATURE").object = armature
        walker.side.note_flags(obj)
    bpy.context.view_layer.objects.active = arm
    scene.frame_set(1)


def make_library(walker: Walker) -> None:
    """A file with a character that Sinew deforms, to link and append from."""
    start(walker)
    for name in ("Sleeve", "Leg", "Box", "Other Rig"):
        bpy.data.objects.remove(bpy.data.objects[name])
    for kind, old, new in (
        ("objects", "Arm", "Guest"),
        ("meshes", "Arm", "Guest"),
        ("objects", "Rig", "Guest Rig"),
        ("armatures", "Rig", "Guest Rig"),
    ):
        getattr(bpy.data, kind)[old].name = new
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    walker.side.add(bpy.data.objects["Guest"], "dq", False)
    bpy.ops.wm.save_as_mainfile(filepath=str(walker.folder / "library.blend"))
