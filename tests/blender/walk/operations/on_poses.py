# SPDX-License-Identifier: GPL-3.0-or-later
"""Time, poses, inverse kinematics, and where objects are."""

from __future__ import annotations

import random

import bpy
import numpy as np
from mathutils import Euler
from walk_sides import armature_modifiers, remove_curves
from walker import FRAMES, TARGET, TURN, Walker, operation

# --- Time and poses


@operation(10)
def frame(w: Walker, r: random.Random) -> None:
    number = r.randint(*FRAMES)
    bpy.context.scene.frame_set(number)


@operation(2)
def subframe(w: Walker, r: random.Random) -> None:
    number, part = r.randint(*FRAMES), r.random()
    bpy.context.scene.frame_set(number, subframe=part)


@operation(2)
def play(w: Walker, r: random.Random) -> None:
    first = bpy.context.scene.frame_current
    for number in range(first, first + 3):
        bpy.context.scene.frame_set(number)


@operation(1)
def scrub(w: Walker, r: random.Random) -> None:
    frames = [r.randint(*FRAMES) for _step in range(5)]
    for number in frames:
        bpy.context.scene.frame_set(number)


@operation(0.7)
def current_frame(w: Walker, r: random.Random) -> None:
    number = r.randint(*FRAMES)
    bpy.context.scene.frame_current = number


def _turn(r: random.Random) -> Euler:
    return Euler([r.uniform(-TURN, TURN) for _axis in range(3)])


@operation(6)
def pose(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = _turn(r)
    if r.random() < 0.3:
        bone.location = [r.uniform(-0.2, 0.2) for _axis in range(3)]


@operation(0.5)
def pose_scale(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    bone.scale = r.choice(((1, 1, 1), (1.3, 0.8, 1.1)))


@operation(2)
def key_pose(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    number = r.randint(*FRAMES)
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = _turn(r)
    bone.keyframe_insert("rotation_euler", frame=number)
    w.this_frame()


@operation(0.6)
def rest_position(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    rig.data.pose_position = "REST" if rig.data.pose_position == "POSE" else "POSE"


@operation(0.7)
def clear_animation(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.armatures(), *(o for o in w.meshes() if not w.side.is_method_keyed(o))])
    if obj.type == "ARMATURE":
        obj.animation_data_clear()
    else:
        remove_curves(obj, "")


@operation(0.4)
def push_action(w: Walker, r: random.Random) -> None:
    """Moves it into a strip, as for layers of animation."""
    rig = w.armature(r)
    animation = rig.animation_data
    w.skip_if(animation is None or animation.action is None or rig.override_library is not None)
    action, slot = animation.action, getattr(animation, "action_slot", None)
    strip = animation.nla_tracks.new().strips.new(w.new_name("strip"), 1, action)
    if slot is not None:
        strip.action_slot = slot
    animation.action = None
    w.this_frame()


@operation(0.7)
def constrain_bone(w: Walker, r: random.Random) -> None:
    rig = w.armature(r)
    bone = w.one(r, rig.pose.bones)
    target = w.one(r, [a for a in w.armatures() if a != rig])
    w.skip_if(any(c.type == "COPY_ROTATION" for b in target.pose.bones for c in b.constraints))
    of_artist = [c for c in bone.constraints if c.type in ("COPY_ROTATION", "IK")]
    if of_artist:
        bone.constraints.remove(of_artist[0])
        return
    other = w.one(r, target.pose.bones)
    constraint = bone.constraints.new("COPY_ROTATION")
    constraint.target, constraint.subtarget, constraint.influence = target, other.name, 0.5


# --- Inverse kinematics


@operation(1.5)
def ik_chain(w: Walker, r: random.Random) -> None:
    """A chain of bones starts or stops following a target."""
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or rig.data.is_editmode)
    bone, length = w.one(r, [bone for bone in rig.pose.bones if bone.parent is not None]), r.choice((0, 2))
    place = [r.uniform(-1, 2) for _axis in range(3)]
    there = next((c for c in bone.constraints if c.type == "IK"), None)
    if there is not None:
        bone.constraints.remove(there)
        return
    target = bpy.data.objects.new(w.new_name(TARGET), None)
    bpy.context.scene.collection.objects.link(target)
    target.location = place
    constraint = bone.constraints.new("IK")
    constraint.target, constraint.chain_count = target, length


@operation(2)
def move_target(w: Walker, r: random.Random) -> None:
    target = w.one(r, [o for o in w.objects("EMPTY") if o.name.startswith(TARGET) and o.library is None])
    frame = r.choice((None, r.randint(*FRAMES)))
    place = [r.uniform(-1, 2) for _axis in range(3)]
    target.location = place
    if frame is not None:
        target.keyframe_insert("location", frame=frame)
        w.this_frame()


# --- Positions


@operation(3)
def move_object(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.meshes(), *w.armatures()])
    obj.location = [r.uniform(-1, 1) for _axis in range(3)]
    if r.random() < 0.3:
        obj.rotation_euler = _turn(r)
    if r.random() < 0.2:
        obj.scale = [r.uniform(0.7, 1.4) for _axis in range(3)]


@operation(1)
def key_object(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.meshes(), *w.armatures()])
    w.skip_if(obj.override_library is not None)
    for number in r.sample(range(1, 12), 2):
        obj.location = [r.uniform(-1, 1) for _axis in range(3)]
        obj.keyframe_insert("location", frame=number)
    w.this_frame()


# These keep the shape of a mesh without size; others depend on directions that it has not.
_KEEP_COLLAPSED = {"ARMATURE", "SUBSURF", "MIRROR", "TRIANGULATE", "MASK"}


def _is_collapsed_once(obj: bpy.types.Object) -> bool:
    """Whether one transform of the mesh and its armatures has no inverse. Where two have none, or one nearly
    has none, rounding decides the shape. Where one is hidden, its transform may be an earlier one. Inverse
    kinematics of an armature without size gives bones matrices that transform nothing."""
    armatures = [modifier.object for modifier in armature_modifiers(obj) if modifier.object is not None]
    all_of = [obj, *armatures]
    are_affine = all(bone.matrix[3][3] == 1.0 for each in armatures for bone in each.pose.bones)
    if not (are_affine and all(each.visible_get() for each in all_of)):
        return False
    sizes = [abs(each.matrix_world.determinant()) for each in all_of]
    return sorted(size for size in sizes if size < 1e-6) == [0.0]


@operation(1)
def no_size(w: Walker, r: random.Random) -> None:
    """A scale of 0 or one that is not finite, at a frame that comes after two others. What is shown then
    depends on neither of them."""
    obj = w.one(r, [o for o in (*w.meshes(), *w.armatures()) if o.override_library is None])
    scale = r.choice(((0.0, 0.0, 0.0), (1.0, 0.0, 1.0), (float("nan"), 1.0, 1.0), (1.0, float("inf"), 1.0)))
    number, others = r.randint(*FRAMES), r.sample(range(FRAMES[0], FRAMES[1] + 1), 2)
    w.object_mode()
    before, found = obj.scale[:], []
    for other in others:
        obj.scale = before
        w.before_evaluation()
        bpy.context.scene.frame_set(other)
        obj.scale = scale
        w.before_evaluation()
        bpy.context.scene.frame_set(number)
        bpy.context.view_layer.update()
        w.side.wait()
        # What is simulated depends on other frames, without Sinew, too.
        shown = [o for o in w.meshes() if w.side.has_sinew(o) and o.visible_get() and o.rigid_body is None]
        found.append([w.shown_points(each) for each in shown])
    for each, *points in zip(shown, *found, strict=True):
        if not np.array_equal(*points, equal_nan=True):
            raise ValueError(f"{each.name}: without size its shape depends on the frame before")
        is_kept = _KEEP_COLLAPSED.issuperset(modifier.type for modifier in w.modifiers(each))
        if np.isfinite(scale).all() and is_kept and _is_collapsed_once(each):
            # In the world, as the direction in which a mesh has no size shows nothing. Points can be far from
            # the origin, and are as exact as that.
            world = np.array(each.matrix_world)
            points = np.vstack((points[0] @ world[:3, :3].T + world[:3, 3], np.zeros(3)))
            w.rendered[f"{each.name_full} in the render, without size"] = points
    obj.scale = before
    w.this_frame()


@operation(2)
def parent(w: Walker, r: random.Random) -> None:
    obj, rig = w.mesh(r), w.armature(r)
    kind = r.choice(("none", "OBJECT", "OBJECT", "BONE", "ARMATURE"))
    w.skip_if(obj.override_library is not None)
    obj.parent = None if kind == "none" else rig
    if kind == "none":
        obj.parent_type = "OBJECT"
        # Blender by itself keeps the shape that a parent of type Armature made.
        obj.update_tag()
        return
    obj.parent_type = kind
    if kind == "BONE":
        bone = w.one_or_none(r, rig.data.bones)
        obj.parent_bone = bone.name if bone is not None else ""


@operation(1)
def parent_as_artists_do(w: Walker, r: random.Random) -> None:
    """The command adds an Armature modifier to a mesh if none of its own points to the armature, such as
    those that Sinew has cleared."""
    obj, rig = w.mesh(r, lambda o: not w.side.has_sinew(o)), w.armature(r)
    is_plain = obj.override_library is None and obj.parent_type != "ARMATURE"
    w.skip_if(not is_plain or len(w.modifiers(obj)) > 5 or not w.select(obj, rig))
    before = len(armature_modifiers(obj))
    bpy.ops.object.parent_set(type="ARMATURE")
    for modifier in armature_modifiers(obj)[before:]:
        w.side.set_preserve_volume(modifier, False)
