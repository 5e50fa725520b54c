# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of a character that Sinew deforms, after which it still follows its armature, also those about which
Blender does not notify Sinew."""

from __future__ import annotations

import threading
from functools import partial

import bpy
import numpy as np
import pytest
import routes
import scenes
import whole_file
from sinew_addon.attach import attach, layout, modifier_types, other_tools, point_store, properties
from sinew_addon.attach.updates import updates_suspended
from sinew_addon.base.errors import SinewError
from sinew_addon.deform import apply_plan, characters, in_depsgraph, safe_mode, session, survey, update
from sinew_addon.deform.plan import State
from sinew_addon.io import actions, armature_io, mesh_io
from sinew_addon.skinning import vertex_data
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
    warnings = " ".join(survey.facts_of(obj, session.skinned_of(obj)).warnings)
    is_equal = scenes.worst(scenes.final_points(obj), expected) <= 1e-5
    assert is_equal == has_group
    assert ("this Hook" in warnings) != has_group


def test_nothing_is_left_where_blender_alone_knows_that_sinew_can_not_be_added(monkeypatch):
    """A sculpted character; the fuzzer and test_scripted_walks.py have what Sinew knows, too."""
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


# --- Without a sign from Blender; each caused a fault once


def test_swapped_bone_names_swap_the_groups():
    obj, armature = scenes.skinned_arm()
    bones = armature.data.bones
    bones["bone.0"].name = "x"
    bones["bone.1"].name = "bone.0"
    bones["x"].name = "bone.1"
    bpy.context.view_layer.update()
    assert [group.name for group in obj.vertex_groups] == ["bone.1", "bone.0"]
    assert_follows(obj)


def test_a_bone_renamed_and_another_made_in_one_edit():
    obj, armature = scenes.skinned_arm()
    scenes.enter(armature, "EDIT")
    bpy.context.view_layer.update()
    armature.data.edit_bones["bone.1"].name = "forearm"
    extra = armature.data.edit_bones.new("extra")
    extra.head, extra.tail = (0, 0, 1), (0, 0, 2)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [group.name for group in obj.vertex_groups] == ["bone.0", "forearm"]
    assert_follows(obj)


@pytest.mark.parametrize("heat", [False, True])
def test_while_off_the_mesh_has_no_attribute_of_sinews(heat):
    obj, _armature = scenes.skinned_arm("qv")
    properties.of(obj).heat = heat
    frames = [3, 7]
    shown = scenes.shapes(obj, frames)

    def ours() -> list[str]:
        return [attribute.name for attribute in obj.data.attributes if "sinew" in attribute.name]

    # The points of a mesh with a heat map are stored in a separate object.
    assert len(ours()) == (not heat)
    for _again in range(2):
        properties.of(obj).enabled = False
        bpy.context.scene.frame_set(5)
        assert ours() == []
        properties.of(obj).enabled = True
        assert np.array_equal(scenes.shapes(obj, frames), shown)
        assert len(ours()) == (not heat)


def test_points_that_are_never_requested_are_deformed_after_the_update(monkeypatch):
    obj, _armature = scenes.skinned_arm("dq")
    expected = scenes.shapes(obj, [3, 6, 11])
    monkeypatch.setattr(session.requests, "mesh_requested", lambda _mesh: None)
    monkeypatch.setattr(properties.listeners, "mesh_requested", lambda _mesh: None)
    scenes.shapes(obj, [1, 2])
    assert np.array_equal(scenes.shapes(obj, [3, 6, 11]), expected)
    state = session.skinned_of(obj)
    assert state.plan.state is State.AFTER_UPDATE
    assert update.NOT_REQUESTED in state.plan.reason
    assert any(update.NOT_REQUESTED in each for each in state_text.problems_of(obj))


@pytest.mark.usefixtures("route")
def test_a_character_appended_in_place_of_two_objects(tmp_path):
    obj, armature = scenes.skinned_arm("dq")
    expected = scenes.shapes(obj, [11])
    path = str(tmp_path / "arm.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    obj_name, armature_name = obj.name, armature.name
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    others = [scenes.added("Empty", None) for _number in range(2)]
    bpy.context.view_layer.update()
    for other in others:
        bpy.data.objects.remove(other)
    appended = scenes.link_here(path, obj_name, armature_name, link=False)[0]
    assert np.array_equal(scenes.shapes(appended, [11]), expected)


@pytest.mark.usefixtures("route")
def test_two_objects_swap_their_names():
    obj, armature = scenes.make_arm()
    other, other_armature = scenes.make_arm(name="Other")
    bpy.data.objects.remove(other_armature)
    other.modifiers["Armature"].object = armature
    other.vertex_groups[1].add(list(range(80, 200)), 0.2, "REPLACE")
    for each in (obj, other):
        scenes.add_sinew(each, "dq")
    expected = [scenes.shapes(each, [11]) for each in (obj, other)]
    bpy.context.scene.frame_set(5)
    obj.name, other.name, obj.name = "Third", "Arm", "Other"
    seen = []
    with scenes.handler(
        "frame_change_post", lambda *_args: seen.append(scenes.final_points(obj)), first=True
    ):
        bpy.context.scene.frame_set(11)
    for each, shape in zip((obj, other), expected, strict=True):
        assert np.array_equal(scenes.final_points(each), shape[0])
    assert safe_mode.is_on() or np.array_equal(seen[0], expected[0][0])


def test_what_the_artist_switched_while_off_stays():
    obj, _armature = scenes.skinned_arm()
    properties.of(obj).enabled = False
    obj.modifiers["Armature"].show_render = False
    properties.of(obj).enabled = True
    attach.remove(obj)
    assert obj.modifiers["Armature"].show_viewport
    assert not obj.modifiers["Armature"].show_render


def test_a_driver_that_gives_no_method_is_said_so():
    obj, _armature = scenes.skinned_arm("dq")
    driver = obj.driver_add("sinew.method").driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = obj, '["number"]'
    for number, error in ((1, ""), (999, "the driver of its method")):
        obj["number"] = number
        scenes.rebind(obj)
        bpy.context.scene.frame_set(11)
        bpy.context.view_layer.update()
        assert error in properties.of(obj).error
    assert properties.of(obj).enabled
    assert session.plan_of(obj).state is State.REFUSED


def test_a_new_method_reads_only_changed_weights(monkeypatch):
    obj, _armature = scenes.make_arm()
    characters.use_method(obj, "dq")
    bpy.context.scene.frame_set(11)
    reads, read = [], mesh_io.read_group_weights
    monkeypatch.setattr(
        mesh_io, "read_group_weights", lambda mesh, *known: reads.append(mesh) or read(mesh, *known)
    )
    bpy.context.view_layer.update()
    reads.clear()
    for method in ("lbs", "qv", "dq"):
        characters.use_method(obj, method)
        bpy.context.scene.frame_set(10)
        bpy.context.scene.frame_set(11)
    assert reads == []
    before = scenes.final_points(obj)
    obj.vertex_groups["bone.1"].remove(range(len(obj.data.vertices)))
    obj.data.update()
    characters.use_method(obj, "lbs")
    assert len(reads) == 1
    expected = scenes.rest_points(obj)
    assert scenes.worst(before, expected) > 0.1
    characters.use_method(obj, "blender")
    expected = scenes.final_points(obj)
    characters.use_method(obj, "lbs")
    assert scenes.worst(scenes.final_points(obj), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.by_sinew
def test_the_surface_is_read_once_however_often_methods_are_chosen(monkeypatch):
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "cor")
    made = [skin.deformer.vertex_data.made["cor"] for skin in session.skinned_of(obj).bound.skin_stack.skins]
    monkeypatch.setattr(mesh_io, "read_triangles", None)
    monkeypatch.setattr(vertex_data, "_key", None)
    for method in ("lbs", "cor", "dq", "cor", "qv"):
        obj.sinew.method = method
        bpy.context.view_layer.update()
        assert session.plan_of(obj).state is State.IN_DEPSGRAPH
    skins = session.skinned_of(obj).bound.skin_stack.skins
    assert all(
        skin.deformer.vertex_data.made["cor"][1] is array
        for skin, (_, array) in zip(skins, made, strict=True)
    )


@pytest.mark.by_sinew
@pytest.mark.parametrize("kind", [None, "SMOOTH", "MIRROR"])
def test_an_undo_that_has_nothing_to_do_with_it_applies_nothing(monkeypatch, kind):
    obj, _armature = scenes.make_arm()
    if kind is not None:
        scenes.put_in_front(obj, kind)
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(6)
    expected = scenes.final_points(obj)
    bpy.ops.ed.undo_push(message="before")
    bpy.context.scene.render.fps += 1
    bpy.ops.ed.undo_push(message="unrelated")
    # What Sinew made between two steps is read again after the first.
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    applied, apply = [], apply_plan.apply
    monkeypatch.setattr(apply_plan, "apply", lambda *given: applied.append(given) or apply(*given))
    for step in (bpy.ops.ed.redo, bpy.ops.ed.undo, bpy.ops.ed.redo):
        step()
        bpy.context.view_layer.update()
        obj = bpy.data.objects["Arm"]
        assert session.plan_of(obj).state is State.IN_DEPSGRAPH
        np.testing.assert_array_equal(scenes.final_points(obj), expected)
    assert applied == []


def test_what_is_kept_of_many_modifiers_is_of_each():
    """Blender moves all of them in memory when more are added."""
    obj, armature = scenes.make_arm()
    for number in range(20):
        obj.modifiers.new(f"More {number}", "ARMATURE").object = armature
    pairs = attach.replaced_modifiers(obj)
    there = properties.of(obj).replaced_modifiers
    assert [kept.as_pointer() for _modifier, kept in pairs] == [kept.as_pointer() for kept in there]
    assert [kept.name for kept in there] == [modifier.name for modifier in obj.modifiers]


@pytest.fixture
def deformed(route) -> bpy.types.Object:
    """An arm by dq at frame 6."""
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(6)
    assert (session.plan_of(obj).state is State.AFTER_UPDATE) == (route == routes.UPDATE)
    return obj


@pytest.mark.parametrize("gone", ["applied", "deleted"])
def test_another_armature_modifier_in_the_place_of_one_that_is_gone(deformed, gone):
    armature = deformed.modifiers["Armature"].object
    bpy.context.scene.frame_set(6)
    bpy.context.view_layer.objects.active = deformed
    act = bpy.ops.object.modifier_apply if gone == "applied" else bpy.ops.object.modifier_remove
    act(modifier="Armature")
    bpy.context.view_layer.update()
    assert "deleted or applied; add another and press Rebind, or Remove" in session.plan_of(deformed).reason
    assert not any(m.is_on for m in layout.read(deformed).modifiers)
    another = deformed.modifiers.new("Another", "ARMATURE")
    another.object, another.use_deform_preserve_volume = armature, True
    bpy.context.scene.frame_set(8)
    expected = scenes.final_points(deformed)
    assert scenes.worst(expected, scenes.rest_points(deformed)) > 0.05
    bpy.ops.sinew.rebind()
    assert session.plan_of(deformed).state is not State.REFUSED
    assert scenes.worst(scenes.final_points(deformed), expected) <= scenes.TOLERANCE * scenes.diagonal(
        deformed
    )
    attach.remove(deformed)
    assert [modifier.name for modifier in deformed.modifiers] == ["Another"]


@pytest.mark.parametrize("keyed", ["viewport", "render"])
def test_keys_of_one_visibility_leave_the_other(deformed, rendered_points, keyed):
    modifier = deformed.modifiers["Armature"]
    scenes.key(modifier, f"show_{keyed}", ((1, True), (5, False)))
    for frame in (8, 3, 8, 3, 6):
        bpy.context.scene.frame_set(frame)
    shown, rendered = scenes.final_points(deformed), rendered_points(deformed)
    attach.remove(deformed)
    bpy.context.scene.frame_set(6)
    assert (modifier.show_viewport, modifier.show_render) == (keyed == "render", keyed == "viewport")
    modifier.use_deform_preserve_volume = True
    near = scenes.TOLERANCE * scenes.diagonal(deformed)
    assert scenes.worst(shown, scenes.final_points(deformed)) <= near
    assert scenes.worst(rendered, rendered_points(deformed)) <= near
    assert scenes.worst(shown, rendered) > 0.1


def test_an_artists_driver_stays(deformed):
    driver = deformed.driver_add("location", 0).driver
    variable = driver.variables.new()
    variable.name = "sinew_0"
    variable.targets[0].id, variable.targets[0].data_path = deformed, "location[1]"
    scenes.shapes(deformed, [1, 6, 11])
    properties.of(deformed).heat = True
    scenes.shapes(deformed, [1, 6, 11])
    attach.remove(deformed)
    assert [curve.data_path for curve in deformed.animation_data.drivers] == ["location"]


@pytest.mark.by_sinew
def test_a_failure_within_the_evaluation_is_counted_and_deformed_after_it(monkeypatch):
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(6)

    def fail(*_args: object) -> None:
        raise RuntimeError("disk on fire")

    monkeypatch.setattr(in_depsgraph, "_deform", fail)
    got = scenes.shapes(obj, [2, 3, 4, 5])
    state = session.skinned_of(obj)
    assert state.failures.count > 0
    assert "disk on fire" in state.failures.last
    assert state.plan.state is State.AFTER_UPDATE
    assert "disk on fire" in state.plan.reason
    monkeypatch.undo()
    attach.remove(obj)
    expected = scenes.modifier_shapes(obj, [4, 5], preserve_volume=True)
    assert scenes.worst(got[2:], expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.by_sinew
def test_suspended_by_two_threads_at_once():
    """As by a window and its render's thread: the second one waits, and at the end nothing is suspended."""
    order, entered = [], threading.Event()

    def other() -> None:
        entered.set()
        with updates_suspended():
            order.append("other")

    thread = threading.Thread(target=other)
    with updates_suspended():
        thread.start()
        entered.wait(10)
        thread.join(0.2)
        with updates_suspended() as may_react:
            assert not may_react
        order.append("this")
    thread.join(10)
    assert order == ["this", "other"]
    with updates_suspended() as may_react:
        assert may_react


def test_keys_that_two_objects_share_go_with_the_last(route):
    obj, _armature = scenes.skinned_arm("dq")
    obj.keyframe_insert("sinew.method", frame=4)
    other = scenes.copied(obj, linked=True)
    session.refresh(bpy.context)
    assert other.animation_data.action == obj.animation_data.action
    attach.remove(obj)
    assert "sinew.method" in actions.animated_paths(other)
    attach.remove(other)
    bpy.context.scene.frame_set(5)
    for each in (obj, other):
        assert not actions.animated_paths(each)
        assert not each.is_property_set("sinew")


@pytest.mark.parametrize("name", ["Sinew", "Armature"])
def test_a_renamed_modifier_is_no_failure(name, route):
    obj, _armature = scenes.skinned_arm()
    bpy.context.scene.frame_set(9)
    expected = scenes.final_points(obj)
    obj.modifiers[name].name = "Another"
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), expected) <= 1e-6
    assert session.skinned_of(obj).failures.count == 0
