# SPDX-License-Identifier: GPL-3.0-or-later
"""Modifiers that are moved, added and deleted while Sinew is on, compared with Blender's own modifiers
alone."""

from __future__ import annotations

import bpy
import pytest
import scenes
from sinew_addon.attach import attach, properties
from sinew_addon.deform import session

FRAMES = [1, 6, 11]


def make_chained():
    """An arm with two Armature modifiers, each with its own armature, the second with Preserve Volume."""
    obj, _armature = scenes.make_arm()
    _other, armature = scenes.make_arm(name="Other")
    scenes.key_pose(armature, 40.0)
    second = obj.modifiers.new("Second", "ARMATURE")
    second.object, second.use_deform_preserve_volume = armature, True
    return obj


def names(obj):
    return [modifier.name for modifier in obj.modifiers]


def put(obj, name, ahead_of):
    """Like dragging in the stack."""
    place = names(obj).index(name)
    target = names(obj).index(ahead_of)
    obj.modifiers.move(place, target - (place < target))
    bpy.context.view_layer.update()


def check(obj, expected):
    got = scenes.shapes(obj, FRAMES)
    assert properties.of(obj).error == ""
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_what_is_kept_of_many_modifiers_is_of_each():
    """Blender moves all of them in memory when more are added."""
    obj, armature = scenes.make_arm()
    for number in range(20):
        obj.modifiers.new(f"More {number}", "ARMATURE").object = armature
    pairs = attach.replaced_modifiers(obj)
    there = properties.of(obj).replaced_modifiers
    assert [kept.as_pointer() for _modifier, kept in pairs] == [kept.as_pointer() for kept in there]
    assert [kept.name for kept in there] == names(obj)


@pytest.mark.parametrize("place", ["in front", "behind"])
def test_a_chain_with_a_modifier_that_has_no_armature_follows_the_pose(place):
    obj, armature = scenes.make_arm()
    obj.modifiers.new("None", "ARMATURE")
    if place == "in front":
        put(obj, "None", "Armature")
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj, "lbs")
    check(obj, expected)
    # Set by hand: no frame event then corrects the evaluation's result.
    bone = armature.pose.bones[1]
    bone.rotation_mode, bone.rotation_euler = "XYZ", (0.5, 0.4, 0.3)
    bpy.context.view_layer.update()
    got = scenes.final_points(obj)
    properties.of(obj).enabled = False
    assert scenes.worst(got, scenes.final_points(obj)) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("on", [False, True])
def test_moved_and_renamed_before_anybody_sees_it(on):
    """A script does both at once, or an artist while Sinew is off."""
    obj = make_chained()
    obj.modifiers.new("Cast", "CAST").factor = 0.2
    scenes.add_sinew(obj)
    properties.of(obj).enabled = on
    obj.modifiers.move(names(obj).index("Cast"), 0)
    obj.modifiers["Armature"].name = "Third"
    obj.modifiers["Second"].name = "Armature"
    bpy.context.view_layer.update()
    got = scenes.shapes(obj, FRAMES)
    assert [replaced.name for replaced in properties.of(obj).replaced_modifiers] == (
        ["Third", "Armature"] if on else ["Armature", "Second"]
    )
    properties.of(obj).enabled = True
    assert [replaced.name for replaced in properties.of(obj).replaced_modifiers] == ["Third", "Armature"]
    again = scenes.shapes(obj, FRAMES)
    assert properties.of(obj).error == ""
    attach.remove(obj)
    session.refresh(bpy.context)
    for shapes in (got, again):
        assert scenes.worst(shapes, scenes.shapes(obj, FRAMES)) <= scenes.TOLERANCE * scenes.diagonal(obj)
