# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of a character that Sinew deforms, after which it still follows its armature."""

from __future__ import annotations

from functools import partial

import bpy
import numpy as np
import pytest
import scenes
import whole_file
from sinew_addon.attach import attach, modifier_types, other_tools, point_store, properties
from sinew_addon.base.errors import SinewError
from sinew_addon.deform import safe_mode, session, survey
from sinew_addon.deform.plan import State
from sinew_addon.io import armature_io
from sinew_addon.ui import state_text

pytestmark = pytest.mark.both_ways


def assert_follows(obj: bpy.types.Object) -> None:
    """Asserts that the object's shape by Sinew is the linear modifier's, which it has when Sinew is off."""
    settings = properties.of(obj)
    assert settings.enabled, settings.error
    settings.method = "lbs"
    got = scenes.shapes(obj, [1, 6, 11])
    settings.enabled = False
    expected = scenes.shapes(obj, [1, 6, 11])
    settings.enabled = True
    assert not settings.error
    assert scenes.worst(expected[0], expected[-1]) > 0.05, "the pose moves nothing: nothing is tested"
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_grey_add_says_why():
    obj, armature = scenes.skinned_arm()
    with pytest.raises(RuntimeError, match="The meshes of the armature have Sinew already"):
        bpy.ops.sinew.add()
    armature.select_set(False)
    obj.select_set(False)
    bpy.context.view_layer.objects.active = None
    with pytest.raises(RuntimeError, match="Select a mesh with an Armature modifier"):
        bpy.ops.sinew.add()


@pytest.mark.parametrize("by_script", [True, False])
@pytest.mark.parametrize("heat", [False, True])
@pytest.mark.parametrize("set_up", [None, scenes.put_in_front, partial(scenes.copied, linked=True)])
def test_helpers_of_a_deleted_mesh_are_deleted(set_up, heat, by_script):
    """Its mesh, which is the artist's, has Blender's shape."""
    obj, _armature = scenes.make_arm()
    if set_up is not None:
        set_up(obj)
    kinds = ("objects", "meshes", "node_groups", "materials")

    def names():
        return {(kind, item.name) for kind in kinds for item in getattr(bpy.data, kind)}

    before = names()
    scenes.add_sinew(obj, "dq")
    properties.of(obj).heat = heat
    bpy.context.scene.frame_set(5)
    assert names() != before, "nothing is tested"
    if by_script:
        bpy.data.objects.remove(obj)
    else:
        with bpy.context.temp_override(selected_objects=[obj]):
            bpy.ops.object.delete()
    bpy.context.view_layer.update()
    assert names() == before - {("objects", "Arm")}


@pytest.mark.by_sinew
def test_an_error_refuses_one_object_once_and_no_other(monkeypatch, caplog):
    obj, armature = scenes.make_arm()
    other, _rig = scenes.make_arm(name="Other")
    scenes.add_sinew(obj)
    scenes.add_sinew(other)
    read = armature_io.read_pose

    def fail_for_one(evaluated, bones):
        if evaluated.original == armature:
            raise RuntimeError("disk on fire")
        return read(evaluated, bones)

    monkeypatch.setattr(armature_io, "read_pose", fail_for_one)
    scenes.shapes(obj, [4, 5, 6])
    assert properties.of(obj).enabled
    assert session.plan_of(obj).state is State.REFUSED
    assert "disk on fire" in properties.of(obj).error
    assert obj.modifiers["Armature"].show_viewport
    assert sum("disk on fire" in record.getMessage() for record in caplog.records) == 1
    assert properties.of(other).enabled
    monkeypatch.undo()
    bpy.context.view_layer.objects.active = obj
    bpy.ops.sinew.rebind()
    assert_follows(obj)
    assert_follows(other)


@pytest.mark.by_sinew
def test_settings_stay_where_the_armature_modifier_is_gone():
    obj, armature = scenes.skinned_arm()
    obj.modifiers.remove(obj.modifiers["Armature"])
    bpy.context.view_layer.update()
    mix = obj.sinew.mix
    mix.method = "lbs"
    # A group that was removed meanwhile would be freed memory.
    mix.group = "lower"
    assert (obj.sinew.mix.method, obj.sinew.mix.group) == ("lbs", "lower")
    bpy.context.view_layer.objects.active = obj
    with pytest.raises(RuntimeError, match="was deleted or applied; add another and press Rebind"):
        bpy.ops.sinew.rebind()
    assert session.plan_of(obj).state is State.REFUSED
    assert "was deleted or applied" in properties.of(obj).error
    obj.modifiers.new("Armature", "ARMATURE").object = armature
    bpy.ops.sinew.rebind()
    assert_follows(obj)


def test_an_unchanged_object_is_not_written(monkeypatch):
    monkeypatch.setattr(safe_mode, "_forced", True)
    _obj, _armature = scenes.skinned_arm()
    bpy.context.scene.frame_set(6)
    written = []
    monkeypatch.setattr(point_store, "write", lambda *_args: written.append(1))
    bpy.context.scene.frame_set(6)
    session.refresh(bpy.context)
    assert not written


@pytest.mark.by_sinew
@pytest.mark.parametrize("has_group", [True, False])
def test_hooks_behind_take_a_vertex_group(has_group):
    obj, _armature = scenes.make_arm()
    hook, vertices = obj.modifiers.new("Hook", "HOOK"), [1, 3, 6, 30]
    hook.object = scenes.added("Hand", None)
    if has_group:
        obj.vertex_groups.new(name="hooked").add(vertices, 1.0, "REPLACE")
        hook.vertex_group = "hooked"
    else:
        hook.vertex_indices_set(vertices)
    hook.object.location.z = 3.0
    bpy.context.scene.frame_set(6)
    expected = scenes.final_points(obj)
    scenes.add_sinew(obj)
    warnings = " ".join(session.state_of(obj).bound.facts.warnings)
    is_equal = scenes.worst(scenes.final_points(obj), expected) <= 1e-5
    assert is_equal == has_group
    assert ("this Hook" in warnings) != has_group


def test_nothing_is_left_where_blender_alone_knows_that_sinew_can_not_be_added(monkeypatch):
    """A sculpted character; test_fuzz.py and test_scripted_walks.py have what Sinew knows, too."""
    monkeypatch.setattr(modifier_types, "NEED_ORIGINAL_MESH", frozenset())
    obj, armature = scenes.make_arm()
    scenes.deform_by_parent(obj, armature)
    obj.modifiers.new("Multires", "MULTIRES")
    bpy.ops.object.multires_subdivide(modifier="Multires")
    bpy.context.scene.frame_set(6)
    before = whole_file.content()
    expected = scenes.final_points(obj)
    with pytest.raises(SinewError, match="original data"):
        attach.add(obj, "lbs")
    bpy.context.view_layer.update()
    whole_file.assert_same(before)
    assert np.array_equal(scenes.final_points(obj), expected)


@pytest.mark.parametrize("in_front", [False, True])
@pytest.mark.parametrize("kind", ["hair", "hair on vertices", "cloth", "cloth with a rest shape"])
def test_warnings_of_modifiers_that_act_differently_behind_sinew(kind, in_front):
    """Before it is added, too; not where a modifier in front does more than deform, as without Sinew."""
    obj, _armature = scenes.make_arm()
    if in_front:
        scenes.put_in_front(obj, "MIRROR", "Mirror")
    if kind.startswith("cloth"):
        modifier = obj.modifiers.new("Behind", "CLOTH")
        if kind != "cloth":
            obj.shape_key_add(name="Basis")
            modifier.settings.rest_shape_key = obj.shape_key_add(name="Rest")
    else:
        particles = obj.modifiers.new("Behind", "PARTICLE_SYSTEM").particle_system.settings
        particles.type, particles.emit_from = "HAIR", "FACE" if kind == "hair" else "VERT"
    is_warned = not in_front and kind in ("hair", "cloth with a rest shape")
    before = other_tools.warnings(obj)
    scenes.add_sinew(obj)
    assert [bool(sentences) for sentences in (before, other_tools.warnings(obj))] == [is_warned, is_warned]
    assert (before == [s for s in state_text.problems_of(obj) if "behind Sinew's" in s]) or not is_warned
    assert is_warned == ("behind Sinew's" in " ".join(survey.describe_in_file(obj).warnings))
