# SPDX-License-Identifier: GPL-3.0-or-later
"""The mix of two methods painted in a vertex group, compared with the two Armature modifiers that riggers
build by hand."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import properties
from sinew_addon.deform import safe_mode, session, survey
from sinew_addon.deform.plan import State

pytestmark = pytest.mark.long_term

FRAMES = [1, 4, 7, 11]
GROUP = "dq here"


def paint(obj: bpy.types.Object) -> None:
    """Parts of it have weight 1, parts 0, and most between."""
    scenes.paint(obj, GROUP, 0.5 * scenes.rest_points(obj)[:, 0] - 0.2)


def by_two_modifiers(obj: bpy.types.Object) -> np.ndarray:
    """The shape by Blender; restores the object afterwards."""
    first = obj.modifiers["Armature"]
    second = obj.modifiers.new("Second", "ARMATURE")
    obj.modifiers.move(len(obj.modifiers) - 1, list(obj.modifiers).index(first) + 1)
    second.object, second.vertex_group = first.object, GROUP
    second.use_multi_modifier = second.use_deform_preserve_volume = True
    expected = scenes.shapes(obj, FRAMES)
    obj.modifiers.remove(second)
    return expected


def mixed(obj: bpy.types.Object) -> None:
    scenes.add_sinew(obj, "lbs")
    mix = properties.of(obj).mix
    mix.method, mix.group = "dq", GROUP


CHARACTERS = {
    "plain": lambda obj: None,
    "in front": scenes.put_in_front,
    "behind": lambda obj: setattr(obj.modifiers.new("Behind", "SUBSURF"), "levels", 1),
    "with keys": scenes.key_shape,
}


@pytest.mark.parametrize("name", CHARACTERS)
@pytest.mark.parametrize("is_safe", [False, True])
def test_two_modifiers_have_the_same_shape(monkeypatch, name, is_safe):
    obj, _armature = scenes.make_arm()
    paint(obj)
    CHARACTERS[name](obj)
    expected = by_two_modifiers(obj)
    alone = scenes.modifier_shapes(obj, FRAMES, preserve_volume=False)
    assert scenes.worst(alone, expected) > 1e-3
    monkeypatch.setattr(safe_mode, "is_on", lambda: is_safe)
    mixed(obj)
    got = scenes.shapes(obj, FRAMES)
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    assert session.skinned_of(obj).plan.state is (State.AFTER_UPDATE if is_safe else State.IN_DEPSGRAPH)


def test_the_second_method_can_be_keyed():
    obj, _armature = scenes.make_arm()
    paint(obj)
    linear = scenes.modifier_shapes(obj, [4], preserve_volume=False)[0]
    mixed(obj)
    expected = scenes.shapes(obj, [8])[0]
    scenes.key(properties.of(obj).mix, "method", ((5, "OFF"), (6, "dq")))
    got = scenes.shapes(obj, [4, 8])
    assert scenes.worst(got[0], linear) < 1e-5
    assert scenes.worst(got[1], expected) == 0.0


@pytest.mark.parametrize("rule", ["3.x", "none"])
def test_under_other_scale_rules_it_is_between_its_two(rule):
    """Linear blending uses other bones than the rest under Blender 3's rule."""
    obj, armature = scenes.make_arm()
    armature.pose.bones[1].scale = (1.4, 0.8, 1.2)
    paint(obj)
    scenes.add_sinew(obj, "lbs")
    properties.of(obj).scale_rule = rule
    first = scenes.shapes(obj, [8])[0]
    properties.of(obj).method = "dq"
    second = scenes.shapes(obj, [8])[0]
    properties.of(obj).method = "lbs"
    mix = properties.of(obj).mix
    mix.method, mix.group = "dq", GROUP
    got = scenes.shapes(obj, [8])[0]
    shares = scenes.shares_of(obj, GROUP)[:, None]
    assert scenes.worst(got, first + shares * (second - first)) < 1e-5
    assert scenes.worst(first, second) > 1e-3


@pytest.mark.parametrize("name", ["", "not there"])
def test_a_button_makes_the_group_that_is_missing(name):
    """Nothing changes until weights are painted."""
    obj, _armature = scenes.skinned_arm("lbs")
    bpy.context.scene.frame_set(11)
    mix = properties.of(obj).mix
    mix.method, mix.group = "dq", name
    before = scenes.final_points(obj)
    if name:
        assert any(
            "nothing is mixed" in text for text in survey.facts_of(obj, session.skinned_of(obj)).warnings
        )
    assert bpy.ops.sinew.make_group(name=obj.name, stage="mix") == {"FINISHED"}
    assert mix.group == (name or "Mix")
    assert survey.facts_of(obj, session.skinned_of(obj)).warnings == ()
    assert scenes.worst(scenes.final_points(obj), before) == 0.0
    obj.vertex_groups[mix.group].add(range(len(obj.data.vertices)), 1.0, "REPLACE")
    assert scenes.worst(scenes.final_points(obj), before) > 0.01


@pytest.mark.parametrize("stage", ["bulge_limit", "delta_mush"])
def test_a_button_makes_the_group_of_a_stage(stage):
    """It applies everywhere until weights are painted, as without a group."""
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(11)
    without = scenes.final_points(obj)
    settings = getattr(properties.of(obj), stage)
    settings.group, settings.enabled = "not there", True
    before = scenes.final_points(obj)
    assert scenes.worst(without, before) > 0.001
    assert bpy.ops.sinew.make_group(name=obj.name, stage=stage) == {"FINISHED"}
    assert scenes.worst(scenes.final_points(obj), before) < 1e-6
    obj.vertex_groups["not there"].remove(range(len(obj.data.vertices)))
    assert scenes.worst(scenes.final_points(obj), without) < 1e-6
    with pytest.raises(RuntimeError, match="no stage 'none'"):
        bpy.ops.sinew.make_group(name=obj.name, stage="none")
