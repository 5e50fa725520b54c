# SPDX-License-Identifier: GPL-3.0-or-later
"""Corrective shape keys: with them the Armature modifier alone has the shape that Sinew showed."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach, properties
from sinew_addon.base.errors import SinewError
from sinew_addon.features.corrective import corrective_key

pytestmark = pytest.mark.long_term


@pytest.fixture
def arm():
    obj, armature = scenes.make_arm()
    scenes.key_shape(obj)
    bpy.context.scene.frame_set(8)
    return obj, armature


def choose(armature, bone):
    armature.data.bones.active = armature.data.bones[bone]
    armature.select_set(True)
    scenes.enter(armature, "POSE")


def add_key(obj, method, **options):
    scenes.add_sinew(obj, method)
    shown = scenes.final_points(obj)
    known = set(obj.data.shape_keys.key_blocks.keys()) if obj.data.shape_keys else {"Basis"}
    assert bpy.ops.sinew.corrective_key(**options) == {"FINISHED"}
    (name,) = set(obj.data.shape_keys.key_blocks.keys()) - known
    key = obj.data.shape_keys.key_blocks[name]
    assert key.mute
    assert scenes.worst(scenes.final_points(obj), shown) <= 1e-6 * scenes.diagonal(obj)
    return shown, key


@pytest.mark.parametrize("preserve_volume", [False, True])
@pytest.mark.parametrize("method", ["cor", "ddm"])
def test_the_modifier_alone_has_the_shape(arm, method, preserve_volume):
    obj, _armature = arm
    obj.modifiers[0].use_deform_preserve_volume = preserve_volume
    shown, key = add_key(obj, method)
    attach.remove(obj)
    without = scenes.worst(scenes.final_points(obj), shown)
    key.mute = False
    assert scenes.worst(scenes.final_points(obj), shown) <= 1e-5 * scenes.diagonal(obj)
    assert without > 1e-2 * scenes.diagonal(obj)


def test_stages_are_in_it(arm):
    obj, _armature = arm
    scenes.add_sinew(obj, "dq")
    properties.of(obj).delta_mush.enabled = True
    shown, key = add_key(obj, "dq")
    attach.remove(obj)
    key.mute = False
    assert scenes.worst(scenes.final_points(obj), shown) <= 1e-5 * scenes.diagonal(obj)


def test_of_envelopes():
    """They assign weights by the position of a rest point."""
    obj, armature = scenes.make_arm()
    for bone in armature.data.bones:
        bone.envelope_distance = 0.3
    obj.modifiers[0].use_bone_envelopes = True
    bpy.context.scene.frame_set(6)
    shown, key = add_key(obj, "dq")
    attach.remove(obj)
    without = scenes.worst(scenes.final_points(obj), shown)
    key.mute = False
    assert scenes.worst(scenes.final_points(obj), shown) < 0.2 * without


def test_a_bone_drives_it(arm):
    obj, armature = arm
    choose(armature, "bone.1")
    shown, key = add_key(obj, "cor", driven=True)
    bpy.ops.object.mode_set(mode="OBJECT")
    attach.remove(obj)
    key.mute = False
    assert scenes.worst(scenes.final_points(obj), shown) <= 1e-4 * scenes.diagonal(obj)
    values = []
    for frame in (1, 4, 8, 11):
        bpy.context.scene.frame_set(frame)
        evaluated = scenes.evaluated(obj)
        values.append(evaluated.data.shape_keys.key_blocks[key.name].value)
    assert values[0] == pytest.approx(0.0, abs=2e-3)
    assert 0.2 < values[1] < 0.8
    assert values[2:] == pytest.approx([1.0, 1.0], abs=1e-3)


def test_a_point_that_can_not_be_reached_stays(arm):
    """At 180 degrees linear blending collapses: no offset leads out of a flat position."""
    obj, armature = arm
    scenes.forget_keys(armature)
    bone = armature.pose.bones["bone.1"]
    bone.rotation_mode = "XYZ"
    bone.location, bone.rotation_euler = (0.0, 0.0, 0.0), (0.0, math.pi, 0.0)
    bpy.context.view_layer.update()
    shown, key = add_key(obj, "cor")
    moved = scenes.points_of(key.data)
    assert np.linalg.norm(moved - scenes.rest_points(obj), axis=1).max() < scenes.diagonal(obj)
    attach.remove(obj)
    without = np.linalg.norm(scenes.final_points(obj) - shown, axis=1)
    key.mute = False
    now = np.linalg.norm(scenes.final_points(obj) - shown, axis=1)
    assert (now <= without + 1e-5).all()
    assert now.mean() < 0.3 * without.mean()


@pytest.mark.parametrize(
    ("case", "text"),
    [
        ("front", "changes the mesh ahead of the armature"),
        ("absolute", "absolute"),
        ("same", "has the same shape in this pose"),
        ("no parent", "has no parent"),
        ("at rest", "as at rest"),
    ],
)
def test_what_can_not_be_is_one_sentence(arm, case, text):
    obj, armature = arm
    bone = {"no parent": "bone.0", "at rest": "bone.1"}.get(case)
    if case == "front":
        scenes.put_in_front(obj, "CAST", "Cast")
    if case == "absolute":
        obj.data.shape_keys.use_relative = False
    if case == "at rest":
        bpy.context.scene.frame_set(1)
    scenes.add_sinew(obj, "lbs" if case == "same" else "cor")
    before = len(obj.data.shape_keys.key_blocks)
    if bone is not None:
        choose(armature, bone)
    driver = bpy.context.active_pose_bone if bone is not None else None
    with pytest.raises(SinewError, match=text):
        corrective_key.add(obj, bpy.context.evaluated_depsgraph_get(), driver)
    # The button reports it, too.
    assert bpy.ops.sinew.corrective_key(driven=bone is not None) == {"CANCELLED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.shape_keys.key_blocks) == before
