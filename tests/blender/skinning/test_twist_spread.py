# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage twist_spread: its oracle is the float64 reference, from the shape before it and Blender's
poses."""

import math

import bpy
import fuzz_reference
import numpy as np
import pytest
import routes
import scenes
from mathutils import Quaternion
from sinew_addon.attach import properties, stage_settings
from sinew_addon.deform import session
from sinew_addon.skinning.twists import Twists

pytestmark = pytest.mark.long_term


def spread(obj: bpy.types.Object, **values: object) -> None:
    scenes.set_stage(obj, "twist_spread", **values)


def assert_spread(obj: bpy.types.Object, before: np.ndarray) -> None:
    """before: float32 [vertices, 3], the shape without the stage"""
    found, state = scenes.final_points(obj), session.skinned_of(obj)
    values = {"twist_spread": stage_settings.values_of(properties.of(obj), "twist_spread")}
    shown = state.shown
    expected = fuzz_reference.stages_after(
        state.bound.skin_stack, before, shown.rest_points, shown.frames, values
    )
    assert np.abs(expected - before).max() > 0.005
    assert scenes.worst(found, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def arm(method: str = "lbs") -> tuple[bpy.types.Object, bpy.types.Object]:
    """A tube of three bones, of which the last is the hand, without keys and with Euler angles."""
    obj, armature = scenes.make_arm(bones=3)
    scenes.forget_keys(armature)
    for bone in armature.pose.bones:
        bone.rotation_mode = "YXZ"
        bone.rotation_euler = (0.0, 0.0, 0.0)
    scenes.add_sinew(obj, method)
    return obj, armature


def twist(armature: bpy.types.Object, degrees: float, bend: float = 0.0) -> None:
    armature.pose.bones["bone.2"].rotation_euler = (math.radians(bend), math.radians(degrees), 0.0)
    bpy.context.view_layer.update()


@pytest.mark.parametrize(
    ("method", "degrees"), [("lbs", 120.0), ("lbs", 300.0), ("dq", -170.0), ("cor", 120.0), ("log", 300.0)]
)
def test_a_twisted_hand_has_the_shape_of_the_reference(method, degrees, route):
    obj, armature = arm(method)
    twist(armature, degrees, bend=30.0)
    before = scenes.final_points(obj)
    spread(obj)
    assert_spread(obj, before)
    twist(armature, 0.0)
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) < 1e-7
    twist(armature, degrees, bend=30.0)
    assert_spread(obj, before)
    assert routes.taken(obj, 0) == route


def test_it_turns_on_beyond_half_a_turn(route):
    """A whole turn has the same matrices as none, so only channels tell it."""
    obj, armature = arm()
    spread(obj)
    twist(armature, 360.0)
    rest = scenes.rest_points(obj)
    assert scenes.worst(scenes.final_points(obj), rest) > 0.2
    armature.pose.bones["bone.2"].rotation_euler.y = 0.0
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), rest) < 1e-6
    twist(armature, 360.0)
    spread(obj, turns=False)
    assert scenes.worst(scenes.final_points(obj), rest) < 1e-5
    spread(obj, turns=True)
    # A quaternion tells no turns.
    armature.pose.bones["bone.2"].rotation_mode = "QUATERNION"
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), rest) < 1e-5


def test_bones_have_an_amount_and_a_curve_that_can_be_keyed(route):
    obj, armature = arm()
    spread(obj)
    twist(armature, 90.0)
    whole = scenes.final_points(obj)
    own = armature.pose.bones["bone.1"]
    own.sinew_twist_amount = 0.0
    bpy.context.view_layer.update()
    plain = scenes.final_points(obj)
    assert scenes.worst(whole, plain) > 0.05
    scenes.key(own, "sinew_twist_amount", ((1, 0.0), (11, 1.0)))
    scenes.key(own, "sinew_twist_curve", ((1, 0.0), (11, 0.8)))
    at = scenes.shapes(obj, [1, 6, 11])
    assert scenes.worst(at[0], plain) < 1e-6
    bpy.context.scene.frame_set(6)
    assert_spread(obj, plain)
    assert scenes.worst(at[2], whole) > 0.01
    assert routes.taken(obj, 0) == route


def test_where_scale_is_ignored_it_is_here_too(route):
    obj, armature = arm("dq")
    twist(armature, 100.0, bend=110.0)
    spread(obj)
    properties.of(obj).bulge_limit.enabled = True
    properties.of(obj).scale_rule = "none"
    before = scenes.final_points(obj)
    armature.pose.bones[-1].scale = (1.5, 1.0, 0.7)
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), before) < 1e-5


def test_bones_are_found_by_names_and_chains():
    armature = scenes.added("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    made = {}

    def bone(name: str, parent: str, head: tuple, tail: tuple) -> None:
        made[name] = armature.data.edit_bones.new(name)
        made[name].head, made[name].tail = head, tail
        made[name].parent = made.get(parent)

    bone("spine", "", (0, 0, 0), (0, 0, 1))
    bone("neck", "spine", (0, 0, 1), (0, 0, 1.3))
    bone("head", "neck", (0, 0, 1.3), (0, 0, 1.6))
    for side, x in ((".L", 1.0), (".R", -1.0)):
        bone("clavicle" + side, "spine", (0.05 * x, 0, 1), (0.2 * x, 0, 1))
        bone("upper_arm" + side, "clavicle" + side, (0.2 * x, 0, 1), (0.5 * x, 0, 1))
        bone("forearm" + side, "upper_arm" + side, (0.5 * x, 0, 1), (0.8 * x, 0, 1))
        bone("hand" + side, "forearm" + side, (0.8 * x, 0, 1), (0.9 * x, 0, 1))
        for number in range(2):
            bone(f"index.0{number}{side}", "hand" + side, (0.9 * x, 0.1 * number, 1), (x, 0.1 * number, 1))
        # No reason to leave the forearm out.
        bone("weapon" + side, "forearm" + side, (0.8 * x, 0, 1), (0.8 * x, 0.3, 1))
        bone("thigh" + side, "spine", (0.1 * x, 0, 0), (0.1 * x, 0, -0.5))
        bone("shin" + side, "thigh" + side, (0.1 * x, 0, -0.5), (0.1 * x, 0, -1))
        bone("foot" + side, "shin" + side, (0.1 * x, 0, -1), (0.1 * x, -0.2, -1))
        # What Sinew puts in the place of bendy bones.
        bone(f"Segment_upper_arm{side}_1", "clavicle" + side, (0.2 * x, 0, 1), (0.3 * x, 0, 1))
    bone("hub", "", (3, 0, 0), (3, 0, 1))
    for number in range(3):
        bone(f"spoke{number}", "hub", (3, 0, 1), (3, 0.2 * number, 2))
    bone("tail", "", (5, 0, 0), (5, 0, 1))
    bone("tail.001", "tail", (5, 0, 1), (5, 0, 2))
    bpy.ops.object.mode_set(mode="OBJECT")
    from sinew_addon.io import armature_io

    armature.data.bones["tail.001"].bbone_segments = 4
    bpy.context.view_layer.update()
    twists = armature_io.read_bones(armature).twists
    from_parent = dict(zip(twists.bones, twists.rows[:, 3].tolist(), strict=True))
    tips = dict(zip(twists.bones, twists.tips, strict=True))
    sides = (".L", ".R")
    assert from_parent == {
        **{f"{name}{side}": 1 for name in ("upper_arm", "thigh") for side in sides},
        **{f"{name}{side}": 0 for name in ("forearm", "shin") for side in sides},
        **{"neck": 0, "tail": 0},
    }
    assert {f"forearm{side}": f"hand{side}" for side in sides}.items() <= tips.items()
    assert tips["neck"] == "head"
    assert tips["thigh.L"] == "thigh.L"
    assert "hub carries 3 bones, which may twist apart" in twists.left_out


NAMES = {
    "chain": ("bone.0", "bone.1", "bone.2"),
    "arm": ("LeftShoulder", "LeftArm", "LeftForeArm"),
    "forearm": ("upperarm_l", "lowerarm_l", "hand_l"),
}
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def limb(names: tuple[str, ...], seed: int | None, across: bool = True) -> bpy.types.Object:
    """arm() with Twist Spread, whose bones stand across it."""
    obj, armature = scenes.make_arm(bones=3)
    scenes.forget_keys(armature)
    if across:
        scenes.stand_across(armature, seed)
    for bone, name in zip(armature.pose.bones, names, strict=True):
        bone.location = (0.0, 0.0, 0.0)
        # Its vertex group follows.
        bone.name = name
    scenes.add_sinew(obj, "dq")
    spread(obj)
    return obj


def twists_of(obj: bpy.types.Object) -> Twists:
    return session.skinned_of(obj).bound.first_deformer.bones.twists


def changed_by_the_stage(obj: bpy.types.Object) -> float:
    shapes = []
    for is_on in (False, True):
        properties.of(obj).twist_spread.enabled = is_on
        bpy.context.view_layer.update()
        shapes.append(scenes.final_points(obj))
    return scenes.worst(*shapes)


@pytest.mark.parametrize("seed", [None, 1, 2, 3])
@pytest.mark.parametrize("naming", NAMES)
def test_bones_across_their_limb_twist_as_those_along_it(naming, seed):
    """A bend alone changes nothing, and a twist spreads along the limb, whatever the bones' own axes are."""
    shapes = []
    for across in (True, False):
        obj = limb(NAMES[naming], seed, across)
        armature = properties.of(obj).armature
        for bone in armature.pose.bones[1:]:
            scenes.rotate_in_armature(bone, Quaternion(Z, math.radians(80.0)))
        bpy.context.view_layer.update()
        assert changed_by_the_stage(obj) < 1e-5
        for bone in armature.pose.bones[1:]:
            scenes.rotate_in_armature(bone, Quaternion(X, math.radians(100.0)))
        bpy.context.view_layer.update()
        shapes.append(scenes.final_points(obj))
        assert changed_by_the_stage(obj) > 0.05
    assert scenes.worst(*shapes) < 1e-4


def test_a_bone_whose_limb_nothing_tells_is_left_out():
    """An upper arm across its limb that carries nothing is told by its skin, where it has some."""
    obj = limb(("spine", "LeftShoulder", "LeftArm"), None)
    assert "LeftArm" in twists_of(obj).bones
    scenes.rotate_in_armature(properties.of(obj).armature.pose.bones[2], Quaternion(Z, math.radians(80.0)))
    bpy.context.view_layer.update()
    assert changed_by_the_stage(obj) < 1e-3
    obj.vertex_groups.remove(obj.vertex_groups["LeftArm"])
    scenes.rebind(obj)
    assert "LeftArm" not in twists_of(obj).bones
    assert twists_of(obj).left_out == (
        "LeftArm carries no bone and moves no skin that its axis could be told from",
    )
