# SPDX-License-Identifier: GPL-3.0-or-later
"""Small meshes use their Armature modifiers if these have the same shape, while Sinew stays on."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest
import scenes
import whole_file
from sinew_addon.attach import attach, normals, properties, stack
from sinew_addon.deform import session, small_meshes
from sinew_addon.skinning.scale_rule import IGNORED
from sinew_addon.ui import state_text

pytestmark = pytest.mark.long_term

FRAMES = [1, 6, 11]


@pytest.fixture(autouse=True)
def left_where_faster(small_meshes_as_users_have_them, monkeypatch):
    monkeypatch.setattr(small_meshes, "is_used", True)


@pytest.fixture
def obj():
    return scenes.skinned_arm()[0]


def deformer(obj: bpy.types.Object) -> str:
    """The modifier that deforms the object; checks that there is one, that frames show its shape, and
    Sinew's record of it."""
    own, sinews = obj.modifiers["Armature"], stack.sinew_modifier(obj)
    by_blender = not sinews.show_viewport
    assert own.object is not None
    assert (own.show_viewport and own.show_render) or not by_blender
    assert sinews.show_render == sinews.show_viewport
    settings, state = properties.of(obj), session.skinned_of(obj)
    assert (settings.enabled, settings.error) == (True, "")
    assert state.plan.uses_builtin == by_blender
    drivers = obj.animation_data.drivers if obj.animation_data else []
    assert (len(drivers) == 0) == by_blender
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        ((_obj, known),) = scenes.deformed_now(obj)
        assert scenes.worst(known.points, scenes.final_points(obj)) <= 1e-5 * scenes.diagonal(obj)
    return "blender" if by_blender else "sinew"


@pytest.mark.parametrize(("preserve_volume", "method"), [(False, "lbs"), (True, "dq")])
def test_left_where_the_modifier_blends_alike(preserve_volume, method):
    obj, _armature = scenes.make_arm()
    obj.modifiers[0].use_deform_preserve_volume = preserve_volume
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj, method)
    assert deformer(obj) == "blender"
    assert np.array_equal(scenes.shapes(obj, FRAMES), expected)
    for other, who in (("qv", "sinew"), ("lbs" if preserve_volume else "dq", "sinew"), (method, "blender")):
        properties.of(obj).method = other
        assert deformer(obj) == who
        assert (scenes.worst(scenes.shapes(obj, FRAMES), expected) > 1e-3) == (who == "sinew")


def set_to(name: str, value: object) -> Callable[[bpy.types.Object], None]:
    return lambda obj: setattr(properties.of(obj), name, value)


def keep_volume(obj: bpy.types.Object) -> None:
    own = obj.modifiers["Armature"]
    own.use_deform_preserve_volume = not own.use_deform_preserve_volume


def unkey(obj: bpy.types.Object) -> None:
    properties.of(obj).keyframe_delete("method", frame=1)
    obj.update_tag()


def reweigh_at_a_frame(obj: bpy.types.Object) -> None:
    bpy.context.scene.frame_set(11)
    obj.vertex_groups["bone.0"].add(list(range(100, 200)), 1.0, "REPLACE")
    obj.vertex_groups["bone.1"].add(list(range(100, 200)), 0.0, "REPLACE")
    bpy.context.scene.frame_set(6)


def subdivide(_obj: bpy.types.Object) -> None:
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")


def take_another_armature(obj: bpy.types.Object) -> None:
    other = scenes.copied(properties.of(obj).armature)
    scenes.bend(other, 30.0)
    obj.modifiers["Armature"].object = other


def rename_a_bone(obj: bpy.types.Object) -> None:
    armature = obj.modifiers["Armature"].object
    scenes.enter(armature, "EDIT")
    armature.data.edit_bones["bone.0"].name = "new"
    bpy.ops.object.mode_set(mode="OBJECT")


# What the artist does, and who deforms then.
CHANGES = {
    "never": [(set_to("leave_small", False), "sinew"), (set_to("leave_small", True), "blender")],
    "a scale rule": [(set_to("scale_rule", IGNORED.name), "sinew"), (set_to("scale_rule", "4.0"), "blender")],
    "a heat map": [(set_to("heat", True), "sinew"), (set_to("heat", False), "blender")],
    "Preserve Volume": [(keep_volume, "sinew"), (keep_volume, "blender")],
    "keys": [
        (lambda obj: properties.of(obj).keyframe_insert("method", frame=1), "sinew"),
        (unkey, "blender"),
    ],
    "in front": [
        (lambda obj: scenes.put_in_front(obj, "MIRROR", "Mirror"), "sinew"),
        (lambda obj: obj.modifiers.remove(obj.modifiers["Mirror"]), "blender"),
    ],
    "edits": [(reweigh_at_a_frame, "blender"), (subdivide, "blender")],
    "armatures": [(take_another_armature, "blender"), (rename_a_bone, "blender")],
}


@pytest.mark.parametrize("name", CHANGES)
def test_taken_up_and_left_by_what_the_artist_does(obj, name):
    assert deformer(obj) == "blender"
    for act, who in CHANGES[name]:
        act(obj)
        bpy.context.view_layer.update()
        assert deformer(obj) == who


def test_larger_ones_are_taken_up(obj, monkeypatch):
    monkeypatch.setitem(small_meshes.VERTICES, "lbs", len(obj.data.vertices))
    bpy.ops.sinew.rebind()
    assert deformer(obj) == "sinew"


def test_on_and_off_and_removed(tmp_path):
    obj, _armature = scenes.make_arm()
    obj.modifiers[0].show_expanded = False
    before = whole_file.content()
    scenes.add_sinew(obj)
    properties.of(obj).method = "qv"
    properties.of(obj).method = "lbs"
    properties.of(obj).enabled = False
    assert scenes.deformed_now(obj) == []
    properties.of(obj).enabled = True
    assert deformer(obj) == "blender"
    bpy.context.scene.frame_set(1)
    attach.remove(obj)
    session.refresh(bpy.context)
    whole_file.assert_same(before)


def add_keyed_mesh():
    """Another mesh of the scene, which its shape keys change in every frame."""
    mesh = bpy.data.meshes.new("Keyed")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    obj = scenes.added("Keyed", mesh)
    scenes.key_shape(obj)


@pytest.mark.parametrize("leave", [True, False])
@pytest.mark.parametrize("beside", ["nothing", "keyed mesh", "own keys", "one that is off"])
def test_frames_are_not_looked_at_for_what_goes_on_beside(monkeypatch, leave, beside):
    obj, _armature = scenes.make_arm()
    if beside == "keyed mesh":
        add_keyed_mesh()
    elif beside == "own keys":
        scenes.key_shape(obj)
    elif beside == "one that is off":
        other, _rig = scenes.skinned_arm(name="Other")
        properties.of(other).enabled = False
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj)
    properties.of(obj).leave_small = leave
    scenes.shapes(obj, FRAMES)
    looked_at = []
    monkeypatch.setattr(session, "update", lambda *arguments: looked_at.append(arguments))
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= 1e-5 * scenes.diagonal(obj)
    assert looked_at == []


@pytest.mark.parametrize("beside", ["nothing", "one that is left to Blender"])
def test_what_a_script_appends_between_two_frames_is_deformed(obj, tmp_path, beside):
    """Where Sinew has nothing to do in frames; Blender has no other event for it."""
    properties.of(obj).method = "qv"
    of_qv = scenes.shapes(obj, FRAMES)
    scenes.save(tmp_path / "arm.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if beside != "nothing":
        other, _rig = scenes.skinned_arm(name="Other")
        bpy.context.scene.frame_set(1)
        assert deformer(other) == "blender"
    bpy.context.view_layer.update()
    obj = scenes.link_here(tmp_path / "arm.blend", "Arm", "Arm Rig", link=False)[0]
    assert scenes.worst(scenes.shapes(obj, FRAMES), of_qv) <= 1e-5 * scenes.diagonal(obj)


def test_chained_modifiers_each_by_its_own():
    obj, armature = scenes.make_arm()
    second = obj.modifiers.new("Second", "ARMATURE")
    second.object, second.use_deform_preserve_volume = armature, True
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj)
    assert session.plan_of(obj).uses_builtin
    assert np.array_equal(scenes.shapes(obj, FRAMES), expected)
    properties.of(obj).replaced_modifiers[1].method = "SAME"
    assert not session.plan_of(obj).uses_builtin


def test_a_mesh_that_is_left_again_has_no_attribute_of_sinews(obj):
    scenes.shapes(obj, FRAMES)
    before = set(obj.data.attributes.keys())
    properties.of(obj).leave_small = False
    expected = scenes.shapes(obj, FRAMES)
    assert set(obj.data.attributes.keys()) == before | {properties.of(obj).storage.attribute}
    properties.of(obj).leave_small = True
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= 1e-5 * scenes.diagonal(obj)
    assert set(obj.data.attributes.keys()) == before


def test_numbers_are_those_of_sinew(obj):
    measured = []
    for leave in (True, False):
        properties.of(obj).leave_small = leave
        bpy.context.scene.frame_set(6)
        result = scenes.measure(obj, "dq").measured
        measured.append((result.entry("volume_change"), result.field("distance").copy()))
    assert measured[0][0] == pytest.approx(measured[1][0], abs=1e-6)
    assert measured[0][1] == pytest.approx(measured[1][1], abs=1e-6)
    assert measured[0][1].max() > 1e-3


@pytest.mark.parametrize("kind", ["shape-keys", "mdd"])
def test_baked(obj, tmp_path, kind):
    expected = scenes.shapes(obj, FRAMES)
    scenes.save(tmp_path / "arm.blend")
    assert bpy.ops.sinew.bake(kind=kind, frames="1-11") == {"FINISHED"}
    assert not properties.has_sinew(obj)
    assert not any(m.show_viewport for m in obj.modifiers if m.type == "ARMATURE")
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= 1e-5 * scenes.diagonal(obj)


@pytest.mark.skipif(not normals.ARE_SUPPORTED, reason="Blender takes no normals that are given")
@pytest.mark.parametrize("kind", normals.Kind)
def test_fewer_are_left_where_sinew_gives_normals(kind, monkeypatch):
    obj, _armature = scenes.make_arm()
    count = len(obj.data.vertices)
    monkeypatch.setitem(small_meshes.VERTICES_WITH_NORMALS, kind, {"lbs": count})
    scenes.add_sinew(obj, "lbs")
    assert deformer(obj) == "blender"
    obj.data.shade_smooth()
    if kind is not normals.Kind.VERTEX:
        obj.data.edges[7].use_edge_sharp = True
    if kind is normals.Kind.CUSTOM:
        obj.data.normals_split_custom_set([(0.0, 0.0, 1.0)] * len(obj.data.loops))
    obj.data.update()
    bpy.context.view_layer.update()
    assert deformer(obj) == "sinew"
    monkeypatch.setitem(small_meshes.VERTICES_WITH_NORMALS, kind, {"lbs": count + 1})
    session.refresh(bpy.context)
    assert deformer(obj) == "blender"
    monkeypatch.setitem(small_meshes.VERTICES_WITH_NORMALS, kind, {"lbs": count})
    session.refresh(bpy.context)
    assert deformer(obj) == "sinew"
    properties.of(obj).normals = properties.LEAVE_NORMALS
    assert deformer(obj) == "blender"


def test_the_icons_of_a_mesh_that_is_left_to_blender(obj):
    """That of the Armature modifier hides it, as it deforms in Sinew's place; Sinew's own takes it over."""
    own, sinews = obj.modifiers["Armature"], stack.sinew_modifier(obj)
    bpy.context.scene.frame_set(6)
    shape = scenes.final_points(obj)

    def flags() -> list[tuple[bool, bool]]:
        bpy.context.view_layer.update()
        return [(modifier.show_viewport, modifier.show_render) for modifier in (own, sinews)]

    own.show_viewport = own.show_render = False
    assert flags() == [(False, False), (False, False)]
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) == 0.0
    assert "Not deformed" in state_text.sentence_of(obj)
    own.show_viewport = own.show_render = True
    assert flags() == [(True, True), (False, False)]
    assert deformer(obj) == "blender"
    sinews.show_viewport = True
    assert flags() == [(True, True), (True, True)]
    assert not properties.of(obj).leave_small
    assert deformer(obj) == "sinew"
    bpy.context.scene.frame_set(6)
    assert scenes.worst(scenes.final_points(obj), shape) <= scenes.TOLERANCE * scenes.diagonal(obj)
    attach.remove(obj)
    assert (own.show_viewport, own.show_render) == (True, True)
