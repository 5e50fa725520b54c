# SPDX-License-Identifier: GPL-3.0-or-later
"""A character of five meshes and a prop, as artists build them: plain bpy, without Sinew."""

from __future__ import annotations

import bpy
import window_scene

MESHES = ("Body", "Shirt_With_A_Long_Name_From_The_Store.001", "Hair", "Eyes", "Shoes")
SHIRT = MESHES[1]


def make(vertices: int = window_scene.LARGE) -> bpy.types.Object:
    """Returns the armature. The shirt has Solidify, the hair Subdivision; the eyes are small; the hat is
    parented to a bone, and no armature deforms it. Only the body is selected."""
    body = window_scene.make_character("Body", vertices, (0.0, 0.0, 0.0))
    armature = bpy.data.objects["Body Rig"]
    armature.name = "Hero Rig"
    for name in MESHES[1:]:
        obj = body.copy()
        obj.data = body.data.copy()
        obj.name = name
        bpy.context.scene.collection.objects.link(obj)
    eyes = window_scene.make_character("Small", window_scene.SMALL, (0.0, 0.0, 0.0))
    small = bpy.data.objects["Small Rig"]
    bpy.data.objects["Eyes"].data = eyes.data
    for made in (eyes, small):
        bpy.data.objects.remove(made)
    solidify = bpy.data.objects[SHIRT].modifiers.new("Solidify", "SOLIDIFY")
    solidify.thickness = -0.02
    bpy.data.objects["Hair"].modifiers.new("Subdivision", "SUBSURF").levels = 1
    hat = bpy.data.objects.new("Hat", bpy.data.meshes.new("Hat"))
    hat.data.from_pydata([(0, 0, 0), (0.3, 0, 0), (0, 0.3, 0)], [], [(0, 1, 2)])
    bpy.context.scene.collection.objects.link(hat)
    hat.parent, hat.parent_type, hat.parent_bone = armature, "BONE", "bone.2"
    select(body)
    return armature


def select(*objects: bpy.types.Object) -> None:
    """Selects these; the first becomes the active one."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]
