# SPDX-License-Identifier: GPL-3.0-or-later
"""Armatures and their bones."""

from __future__ import annotations

import random

import bpy
from mathutils import Vector
from walker import Walker, operation


@operation(0.4)
def apply_pose(w: Walker, r: random.Random) -> None:
    """Applied as the rest pose."""
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or rig.data.users > 1 or not w.select(rig))
    # Blender takes the places that those of bones had when they were last evaluated, so old ones of what is
    # hidden, unless a copy of a comparison has it evaluated (seen on 4.2 to 5.3).
    w.skip_if(any(child.parent_type == "BONE" and not child.visible_get() for child in rig.children))
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.pose.armature_apply(selected=False)
    bpy.ops.object.mode_set(mode="OBJECT")
    for child in rig.children:
        # Blender gives those of bones other transforms, and evaluates these only when something else is
        # changed (seen on 4.2 and 5.2).
        child.update_tag()


@operation(0.3)
def replace_armature_data(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or rig.data.is_editmode)
    rig.data = rig.data.copy()
    rig.data.name = w.new_name("armature")


# --- Bones


@operation(1.5)
def rename_bone(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None)
    bone = w.one(r, rig.data.bones)
    # Blender also renames groups of the mesh, which a comparison's copies share.
    w.skip_if(w.compared)
    bone.name = w.new_name("bone")


@operation(1)
def edit_bones(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or not w.select(rig))
    what = r.choice(("delete", "new", "move", "rename", "roll"))
    if what == "rename" and w.compared:
        what = "roll"
    w.edit_mode()
    bones = rig.data.edit_bones
    bone = w.one_or_none(r, bones)
    if what == "new" or bone is None:
        made = bones.new(w.new_name("bone"))
        made.head, made.tail = (0.5, 0.0, 0.3), (0.5, 0.0, 1.0)
        made.parent = bone
    elif what == "delete" and len(bones) > 1:
        bones.remove(bone)
    elif what == "move":
        bone.tail += Vector((0.0, r.uniform(-0.2, 0.2), r.uniform(-0.2, 0.2)))
    elif what == "rename":
        bone.name = w.new_name("bone")
    else:
        bone.roll += 0.3
    if r.random() < 0.5:
        bpy.context.view_layer.update()
    if r.random() < 0.8 or what == "delete":
        bpy.ops.object.mode_set(mode="OBJECT")
    if what == "delete":
        # Blender evaluates drivers and children of a deleted bone anew only once something touches them (seen
        # on 4.5 and 5.3).
        for obj in w.objects("MESH"):
            obj.update_tag()
            obj.data.update_tag()


@operation(1.5)
def bone_options(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None)
    bone = w.one(r, rig.data.bones)
    what = r.choice(("deform", "segments", "envelope", "inherit"))
    if what == "deform":
        bone.use_deform = not bone.use_deform
    elif what == "segments":
        bone.bbone_segments = r.choice((1, 1, 3))
    elif what == "envelope":
        bone.envelope_distance = r.uniform(0.05, 0.5)
    else:
        bone.use_inherit_rotation = not bone.use_inherit_rotation
