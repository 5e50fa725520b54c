# SPDX-License-Identifier: GPL-3.0-or-later
"""One control for a character of five meshes: each of its settings applies to all followers."""

from __future__ import annotations

import bpy
import five_meshes
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach, properties
from sinew_addon.attach.subscribers import subscribers
from sinew_addon.deform import session, small_meshes
from sinew_addon.ui import character, operators, state_text

pytestmark = pytest.mark.long_term


@pytest.fixture
def armature():
    return five_meshes.make(vertices=1200)


def meshes() -> list[bpy.types.Object]:
    return [bpy.data.objects[name] for name in five_meshes.MESHES]


def methods() -> list[str]:
    return [properties.of(obj).method for obj in meshes()]


def shared() -> bpy.types.PropertyGroup:
    return character.of(bpy.context.scene)


@pytest.mark.parametrize("selected", ["Hero Rig", "Body", "Shoes", "Hat"])
def test_one_click_adds_sinew_with_a_method_to_all_five(armature, selected):
    five_meshes.select(bpy.data.objects[selected])
    assert bpy.ops.sinew.add(method="dq") == {"FINISHED"}
    assert methods() == ["dq"] * 5
    assert not properties.has_sinew(bpy.data.objects["Hat"])


def test_all_five_have_the_shape_of_their_armature_modifiers(armature):
    """The oracle is Blender's Preserve Volume, followed by Solidify and Subdivision."""
    bpy.context.scene.frame_set(15)
    expected = []
    for obj in meshes():
        obj.modifiers["Armature"].use_deform_preserve_volume = True
        expected.append(scenes.final_points(obj))
        obj.modifiers["Armature"].use_deform_preserve_volume = False
    moved = [
        np.abs(points - scenes.final_points(obj)).max()
        for points, obj in zip(expected, meshes(), strict=True)
    ]
    assert min(moved) > 0.01, "both methods have one shape: nothing is tested"
    bpy.ops.sinew.add()
    assert methods() == ["lbs"] * 5
    shared().method = "dq"
    for points, obj in zip(expected, meshes(), strict=True):
        np.testing.assert_allclose(scenes.final_points(obj), points, atol=1e-5 * scenes.diagonal(obj) * 3)


def test_the_lead_follows_what_belongs_to_the_character_now(armature):
    """Its mesh is assigned to another armature while the selection stays the same."""
    five_meshes.select(armature)
    bpy.ops.sinew.add()
    context = bpy.context
    first = character.lead(context)
    assert len(character.known_meshes(context)) == 5
    other = scenes.added("Other Rig", armature.data)
    properties.of(first).enabled = False
    first.modifiers["Armature"].object = other
    # Also while Sinew is off.
    context.view_layer.update()
    assert len(character.known_meshes(context)) == 4
    properties.of(first).enabled = True
    context.view_layer.update()
    assert properties.of(first).armature == other
    assert len(character.known_meshes(context)) == 4
    properties.of(first).method = "log"
    assert shared().method == "lbs"
    assert character.lead(context) != first


def test_every_shared_setting_goes_to_all_and_only_by_the_character(armature):
    bpy.ops.sinew.add()
    own = properties.of(bpy.data.objects["Hair"])
    own.method = "qv"
    assert methods() == ["lbs", "lbs", "qv", "lbs", "lbs"], "a script sets one mesh"
    shared().method = "log"
    shared().scale_rule = _scale_rules()[-1]
    shared().leave_small = False
    shared().mix.method = "lbs"
    shared().mix.group = "bone.1"
    shared().delta_mush.enabled = True
    shared().delta_mush.iterations = 7
    shared().bulge_limit.strength = 0.25
    for obj in meshes():
        settings = properties.of(obj)
        assert (settings.method, settings.mix.method, settings.mix.group) == ("log", "lbs", "bone.1")
        assert settings.scale_rule == _scale_rules()[-1] != _scale_rules()[0]
        assert settings.leave_small is False
        assert (settings.delta_mush.enabled, settings.delta_mush.iterations) == (True, 7)
        assert settings.bulge_limit.strength == 0.25
        assert not settings.error


def _scale_rules() -> list[str]:
    return [item.identifier for item in properties.SinewSettings.bl_rna.properties["scale_rule"].enum_items]


def test_all_that_a_mesh_is_set_to_is_set_for_a_character():
    """Settings that are added to a mesh must be added here, too."""
    of_a_mesh = (
        "enabled heat error is_own replaced_modifiers identity stack before storage driver rna_type name"
    )
    names = set(properties.SinewSettings.bl_rna.properties.keys()) - {*of_a_mesh.split(), "variants"}
    assert names == set(character.SinewCharacter.bl_rna.properties.keys()) - {
        *("rna_type", "name", "enabled", "row", "chosen")
    }


@pytest.mark.parametrize("door", ["panel", "menu", "mesh", "preset"])
@pytest.mark.parametrize("method", ["lbs", "qv"])
def test_a_method_goes_to_all_modifiers_of_a_mesh(armature, door, method):
    """Wherever it is chosen, and also if the mesh has it already."""
    body = bpy.data.objects["Body"]
    second = body.modifiers.new("Second", "ARMATURE")
    second.object, second.use_multi_modifier = armature, True
    body.modifiers.move(len(body.modifiers) - 1, 1)
    bpy.ops.sinew.add(method="lbs")
    replaced = properties.of(body).replaced_modifiers[1]
    replaced.method = "dq"
    if door == "panel":
        shared().method = method
    elif door == "menu":
        bpy.ops.sinew.use_method(method=method)
    elif door == "mesh":
        properties.of(body).method = method
    else:
        exec(f"character.method = {method!r}", {"character": shared()})
    assert (properties.of(body).method, replaced.method) == (method, properties.SAME_METHOD)


def test_another_character_stays_bound(armature):
    bpy.ops.sinew.add(method="dq")
    bound = [session.skinned_of(obj).bound for obj in meshes()]
    other, _rig = scenes.make_arm(name="Other")
    five_meshes.select(other)
    bpy.ops.sinew.add(method="dq")
    bpy.context.scene.frame_set(7)
    assert [session.skinned_of(obj).bound for obj in meshes()] == bound
    bpy.ops.sinew.remove()
    bpy.context.scene.frame_set(8)
    assert all(session.skinned_of(obj).bound is each for obj, each in zip(meshes(), bound, strict=True))
    assert session.skinned_of(other) is None


def test_one_mesh_can_differ_and_follow_again(armature):
    bpy.ops.sinew.add(method="dq")
    assert bpy.ops.sinew.own_settings(name="Hair") == {"FINISHED"}
    hair = properties.of(bpy.data.objects["Hair"])
    hair.method = "lbs"
    hair.delta_mush.enabled = True
    shared().method = "qv"
    assert methods() == ["qv", "qv", "lbs", "qv", "qv"]
    five_meshes.select(bpy.data.objects["Hair"])
    assert shared().method == "qv", "the character's is shown, not the mesh's that differs"
    bpy.ops.sinew.use_method(method="log")
    assert methods() == ["log", "log", "lbs", "log", "log"]
    bpy.ops.sinew.own_settings(name="Hair")
    assert methods() == ["log"] * 5
    assert hair.delta_mush.enabled is False


def test_on_off_and_remove_for_all_or_for_one(armature):
    before = [scenes.final_points(obj) for obj in meshes()]
    bpy.ops.sinew.add(method="dq")
    shared().enabled = False
    assert [properties.of(obj).enabled for obj in meshes()] == [False] * 5
    for points, obj in zip(before, meshes(), strict=True):
        np.testing.assert_array_equal(scenes.final_points(obj), points)
    shared().enabled = True
    assert [properties.of(obj).enabled for obj in meshes()] == [True] * 5
    bpy.ops.sinew.remove(name="Hair")
    assert [properties.has_sinew(obj) for obj in meshes()] == [True, True, False, True, True]
    bpy.ops.sinew.remove()
    assert not any(properties.has_sinew(obj) for obj in meshes())
    assert not bpy.context.scene.is_property_set("sinew_character"), "an empty group stays in the file"


def test_a_mesh_that_comes_later_joins_with_the_characters_settings(armature):
    bpy.ops.sinew.add(method="dq")
    shared().delta_mush.enabled = True
    bpy.ops.sinew.remove(name="Shoes")
    bpy.ops.sinew.add(name="Shoes")
    shoes = properties.of(bpy.data.objects["Shoes"])
    assert (shoes.method, shoes.delta_mush.enabled) == ("dq", True)


def test_add_skips_a_mesh_that_is_refused(armature):
    cloth = scenes.put_in_front(bpy.data.objects["Hair"], "CLOTH", "Cloth")
    assert cloth == bpy.data.objects["Hair"].modifiers[0]
    assert bpy.ops.sinew.add() == {"FINISHED"}
    assert [properties.has_sinew(obj) for obj in meshes()] == [True, True, False, True, True]


def test_a_mesh_of_another_armature_is_left_alone(armature):
    other, _rig = scenes.make_arm(name="Other")
    five_meshes.select(bpy.data.objects["Body"])
    bpy.ops.sinew.add()
    assert not properties.has_sinew(other)
    assert other not in operators.targets(bpy.context)


def test_what_is_at_work_is_said_above_the_modifiers(armature, monkeypatch):
    monkeypatch.setattr(small_meshes, "is_used", True)
    body = bpy.data.objects["Body"]
    bpy.ops.sinew.add()
    assert "same shape in less time" in state_text.sentence_of(body)
    shared().method = "dq"
    assert state_text.sentence_of(body) == "Dual Quaternion in the place of Armature"
    bpy.ops.sinew.heat_map()
    assert state_text.sentence_of(body).startswith(
        "Dual Quaternion in the place of Armature, after Blender's"
    )
    bpy.ops.sinew.heat_map()
    shared().enabled = False
    assert state_text.sentence_of(body) == "Off: Armature deforms it"
    shared().enabled = True
    body.modifiers.remove(body.modifiers["Armature"])
    bpy.context.view_layer.update()
    assert "its Armature modifier was deleted" in state_text.sentence_of(body)
    assert state_text.icon_of(body) == "ERROR"


def test_polls_without_a_window():
    """As in a script's worker thread, whose context has no selection."""
    obj, _armature = scenes.skinned_arm()
    kinds = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("SINEW_OT_")]
    expected = {kind.__name__: kind.poll(bpy.context) for kind in kinds if hasattr(kind, "poll")}
    # A window's sidebar has it.
    expected["SINEW_OT_open_tab"] = False
    assert any(expected.values())
    with bpy.context.temp_override(window=None):
        assert not hasattr(bpy.context, "selected_objects")
        got = {name: getattr(bpy.types, name).poll(bpy.context) for name in expected}
        assert operators.selected(bpy.context) == [obj]
        assert operators.active_object(bpy.context) == obj
    assert got == expected


def test_a_subscriber_that_raises_costs_itself_alone(caplog):
    obj, _armature = scenes.skinned_arm()
    bpy.context.scene.frame_set(8)

    def fail(*_):
        raise ValueError("not this one")

    for functions in (subscribers.before_removal, subscribers.deformed, subscribers.node_group):
        functions.insert(0, fail)
    try:
        session.refresh(bpy.context)
        attach.remove(obj)
    finally:
        for functions in (subscribers.before_removal, subscribers.deformed, subscribers.node_group):
            functions.remove(fail)
    assert not properties.has_sinew(obj)
    assert [modifier.type for modifier in obj.modifiers] == ["ARMATURE"]
    assert obj.modifiers[0].show_viewport
    # Once for all of them.
    assert [record.message for record in caplog.records if "not this one" in record.message] == [
        "test_a_subscriber_that_raises_costs_itself_alone.<locals>.fail failed: not this one"
    ]
