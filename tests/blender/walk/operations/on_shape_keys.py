# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape keys."""

from __future__ import annotations

import random

import bpy
from mathutils import Vector
from walker import Walker, operation, some_vertices


def _keys(obj: bpy.types.Object) -> list[bpy.types.ShapeKey]:
    keys = obj.data.shape_keys
    return list(keys.key_blocks)[1:] if keys is not None else []


@operation(2)
def add_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.mode == "OBJECT" and o.data.library is None and o.override_library is None)
    w.skip_if(len(_keys(obj)) > 3 or obj.data.is_editmode)
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    made = obj.shape_key_add(name=w.new_name("key"), from_mix=False)
    for index in some_vertices(w, r, obj):
        made.data[index].co += Vector([r.uniform(-0.2, 0.2) for _axis in range(3)])
    made.value = r.random()


@operation(3)
def shape_key_value(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)))
    block = w.one(r, _keys(obj))
    block.value = r.random()
    if r.random() < 0.2:
        block.mute = not block.mute


@operation(1)
def shape_key_points(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.mode == "OBJECT" and o.data.library is None)
    w.skip_if(obj.data.is_editmode)
    block = w.one(r, _keys(obj))
    for index in some_vertices(w, r, obj):
        block.data[index].co += Vector([r.uniform(-0.1, 0.1) for _axis in range(3)])
    obj.data.update()


@operation(1)
def key_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.data.library is None)
    block = w.one(r, _keys(obj))
    for number in r.sample(range(1, 12), 2):
        block.value = r.random()
        block.keyframe_insert("value", frame=number)
    w.this_frame()


@operation(0.7)
def drive_shape_key(w: Walker, r: random.Random) -> None:
    """Sets or removes a driver by a bone, as for correctives."""
    obj, rig = w.mesh(r, lambda o: bool(_keys(o)) and o.data.library is None), w.armature(r)
    bone = w.one(r, rig.pose.bones)
    block = w.one(r, _keys(obj))
    animation = obj.data.shape_keys.animation_data
    path = block.path_from_id("value")
    if animation is not None and any(d.data_path == path for d in animation.drivers):
        block.driver_remove("value")
        return
    driver = block.driver_add("value").driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.type = "TRANSFORMS"
    target = variable.targets[0]
    target.id, target.bone_target = rig, bone.name
    target.transform_type, target.transform_space = "ROT_X", "LOCAL_SPACE"


@operation(1)
def delete_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.mode == "OBJECT" and o.data.library is None)
    w.skip_if(obj.override_library is not None)
    if r.random() < 0.3:
        obj.shape_key_clear()
    else:
        obj.shape_key_remove(w.one(r, _keys(obj)))


@operation(1)
def pin_shape_key(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)))
    obj.active_shape_key_index = r.randrange(len(obj.data.shape_keys.key_blocks))
    obj.show_only_shape_key = not obj.show_only_shape_key
    if obj.override_library is None and obj.data.library is None:
        group = w.one_or_none(r, obj.vertex_groups) if r.random() < 0.5 else None
        obj.active_shape_key.vertex_group = group.name if group is not None else ""


@operation(0.4)
def absolute_shape_keys(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: bool(_keys(o)) and o.data.library is None)
    keys = obj.data.shape_keys
    keys.use_relative = not keys.use_relative
    keys.eval_time = r.uniform(0.0, 20.0)
