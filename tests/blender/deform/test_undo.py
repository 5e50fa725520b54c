# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo and redo of Sinew's reactions after Blender made its step; and what a step leaves alone is not read
again, since Sinew's records of an object outlive it. test_scripted_walks.py has undone edits.

Blender keeps an object that is the same in both steps, and what the object refers to. If a test of the first
kind fails, the process usually crashes. Blender (4.2 to 5.2) also crashes by itself, rarely: where undo reads
the scene into the memory of an object that was deleted after the step, as in
point_store.clear_references_to_itself(). Then bpy.ops.ed.undo is the last call of the traceback.
"""

import bpy
import numpy as np
import pytest
import routes
import scenes
from sinew_addon.attach import attach, node_group, properties, references, stack
from sinew_addon.deform import session


def _arm_beside_cube():
    """An arm with Sinew and shape keys, and a cube next to it; both selected, the cube active."""
    obj, _armature = scenes.make_arm()
    obj.shape_key_add()
    obj.shape_key_add()
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(7)
    bpy.ops.mesh.primitive_cube_add()
    obj.select_set(True)
    # Two steps in which the arm is the same.
    for name in ("first", "second"):
        bpy.ops.ed.undo_push(message=name)
    return obj


def _link_data():
    """The cube gets the arm's mesh, so that Sinew must store the arm's points elsewhere."""
    arm, cube = bpy.data.objects["Arm"], bpy.data.objects["Cube"]
    bpy.context.view_layer.objects.active = arm
    bpy.ops.ed.undo_push(message="active")
    bpy.ops.ed.undo_push(message="active")
    with bpy.context.temp_override(active_object=arm, object=arm, selected_editable_objects=[cube, arm]):
        bpy.ops.object.make_links_data("EXEC_DEFAULT", True, type="OBDATA")
    assert cube.data == arm.data
    assert properties.of(arm).storage.point_buffer is not None


def _make_keys_absolute():
    """Blender's keys are then not what Sinew deforms: it has an upstream proxy."""
    path = 'scene.objects["Arm"].data.shape_keys.use_relative'
    bpy.ops.wm.context_toggle("EXEC_DEFAULT", True, data_path=path)
    arm = bpy.data.objects["Arm"]
    assert not arm.data.shape_keys.use_relative
    assert properties.of(arm).storage.upstream_proxy is not None


@pytest.mark.parametrize("name", ["Sinew", "Skin"])
@pytest.mark.parametrize("change", [_link_data, _make_keys_absolute])
def test_undo_of_what_sinew_reacted_to_after_the_step(route, change, name):
    arm = _arm_beside_cube()
    stack.sinew_modifier(arm).name = name
    bpy.ops.ed.undo_push(message="named")
    expected = scenes.final_points(arm)
    change()
    changed = scenes.final_points(arm)
    for _time in range(3):
        bpy.ops.ed.undo()
        arm = bpy.data.objects["Arm"]
        assert scenes.worst(scenes.final_points(arm), expected) < 1e-6
        assert properties.has_sinew(arm)
        assert stack.sinew_modifier(arm).name == name
        bpy.ops.ed.redo()
        arm = bpy.data.objects["Arm"]
        assert scenes.worst(scenes.final_points(arm), changed) < 1e-6
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert scenes.worst(scenes.final_points(bpy.data.objects["Arm"]), expected) < 1e-6


def _points(arm):
    for vertex in arm.data.vertices:
        vertex.co.z += 0.3
    arm.data.update()


def _removed(arm):
    attach.remove(arm)
    session.refresh(bpy.context)


EDITS = {
    "weights": lambda arm: arm.vertex_groups["bone.0"].add(range(100, 200), 0.3, "REPLACE"),
    "points": _points,
    "key value": lambda arm: setattr(arm.data.shape_keys.key_blocks["Key 1"], "value", 0.7),
    "bone option": lambda arm: setattr(attach.armature_of(arm).data.bones["bone.1"], "use_deform", False),
    "pose": lambda arm: scenes.bend(attach.armature_of(arm), 70.0),
    "added object": lambda arm: scenes.added("Empty", None),
    "added modifier": lambda arm: setattr(arm.modifiers.new("Behind", "SMOOTH"), "show_viewport", False),
    "modifier in front": lambda arm: _in_front(arm),
}


def _in_front(arm):
    for modifier in arm.modifiers:
        if modifier.type == "CAST":
            modifier.factor = 0.9


def _opened_again(tmp_path, edit, front):
    """Two arms in a newly opened file: Sinew has replaced modifiers that are in the first undo step."""
    arm, _rig = scenes.make_arm()
    other, _rig = scenes.make_arm(name="Other")
    other.location.y = 2.0
    if edit == "key value":
        arm.shape_key_add()
        arm.shape_key_add(name="Key 1").value = 1.0
    for obj in (arm, other):
        if front is not None:
            scenes.put_in_front(obj, front)
        scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(7)
    bpy.context.view_layer.objects.active = arm
    scenes.reopened(tmp_path / "undo.blend")
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="opened")


@pytest.mark.parametrize("route", [routes.UPDATE], indirect=True)
@pytest.mark.parametrize("helper", ["point_buffer", "upstream_proxy", "armature", "copied"])
def test_undo_that_takes_another_object_for_the_object(route, helper):
    """Blender does that where it reads the object into the memory that the other had
    (point_store.clear_references_to_itself)."""
    arm, _rig = scenes.make_arm()
    scenes.put_in_front(arm, "CAST")
    scenes.add_sinew(arm, "dq")
    bpy.context.scene.frame_set(7)
    bpy.ops.ed.undo_push(message="first")
    shape, mesh = scenes.final_points(arm), scenes.rest_points(arm)
    _removed(arm)
    bpy.ops.ed.undo_push(message="second")

    def take(*_args):
        found = bpy.data.objects["Arm"]
        settings = properties.of(found)
        groups = {"armature": settings.replaced_modifiers[0], "copied": settings.identity}
        group = groups.get(helper, settings.storage)
        nodes, before = stack.sinew_modifier(found), getattr(group, helper)
        for name in ("Points", "Upstream"):
            if node_group.get_input(nodes, name) == before:
                node_group.set_inputs(nodes, {name: found})
        setattr(group, helper, found)
        taken.append(found)

    taken = []
    with scenes.handler("undo_post", take, first=True):
        bpy.ops.ed.undo()
    assert taken, "nothing is tested"
    arm = bpy.data.objects["Arm"]
    assert scenes.worst(scenes.final_points(arm), shape) <= 1e-6
    np.testing.assert_array_equal(scenes.rest_points(arm), mesh)
    settings = properties.of(arm)
    helpers = (settings.storage.point_buffer, settings.storage.upstream_proxy)
    assert arm not in (*helpers, settings.identity.copied, *settings.armatures)
    attach.remove(arm)
    assert arm == bpy.data.objects.get("Arm")


@pytest.mark.parametrize("route", [routes.EVALUATION], indirect=True)
@pytest.mark.parametrize("front", [None, "CAST", "MIRROR"])
@pytest.mark.parametrize("edit", EDITS)
def test_what_a_step_leaves_alone_is_not_read_again(route, edit, front, tmp_path):
    _opened_again(tmp_path, edit, front)
    # All meshes are reported after undo of a file's first step.
    for each in ("pose", edit):
        EDITS[each](bpy.data.objects["Arm"])
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message=each)
    known = session.skinned_of(bpy.data.objects["Other"])
    bound = known.bound
    # Also a second time: reactions to undo are part of the next step.
    for _time in range(2):
        number = known.shown.number
        bpy.ops.ed.undo()
        other = bpy.data.objects["Other"]
        assert session.skinned_of(other) is known
        assert known.bound is bound
        # Blender itself evaluates objects with an armature once after each step.
        assert known.shown.number <= number + 1
        assert session.skinned_of(bpy.data.objects["Arm"]) is not None
        bpy.ops.ed.redo()
        bpy.context.view_layer.update()
    arm = bpy.data.objects["Arm"]
    shape = scenes.final_points(arm)
    session.forget_object(arm)
    session.refresh(bpy.context)
    np.testing.assert_allclose(scenes.final_points(arm), shape, rtol=0, atol=1e-6)


@pytest.mark.parametrize("route", [routes.EVALUATION], indirect=True)
@pytest.mark.parametrize("front", [None, "CAST"])
@pytest.mark.parametrize("event", ["saved", "opened"])
def test_what_sinew_gives_back_stays_over_undo(route, front, event, tmp_path):
    arm, _rig = scenes.make_arm()
    if front is not None:
        scenes.put_in_front(arm, front)
    scenes.add_sinew(arm, "dq")
    bpy.context.scene.frame_set(7)
    # As the operator does, which only a window invokes.
    references.forget()
    shape = scenes.final_points(arm)
    if event == "opened":
        scenes.reopened(tmp_path / "undo.blend")
        bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="first")
    if event == "saved":
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "undo.blend"))
        bpy.context.view_layer.update()
    bpy.context.scene.render.fps += 1
    bpy.ops.ed.undo_push(message="unrelated")
    known = session.skinned_of(bpy.data.objects["Arm"])
    for step in (bpy.ops.ed.undo, bpy.ops.ed.redo, bpy.ops.ed.undo):
        step()
        bpy.context.view_layer.update()
        arm = bpy.data.objects["Arm"]
        assert session.skinned_of(arm) is known
        np.testing.assert_array_equal(scenes.final_points(arm), shape)


def test_what_a_handler_behind_sinews_changes_in_the_event_of_an_undo(route):
    _obj, armature = scenes.skinned_arm("lbs")
    scenes.forget_keys(armature)
    scenes.bend(armature, 40.0)
    bpy.ops.mesh.primitive_cube_add()
    for x in (0.0, 3.0):
        bpy.data.objects["Cube"].location.x = x
        bpy.ops.ed.undo_push(message="step")
    acted = []

    def act(*_args):
        if not acted:
            acted.append(1)
            _points(bpy.data.objects["Arm"])

    with scenes.handler("depsgraph_update_post", act):
        bpy.ops.ed.undo()
        bpy.context.view_layer.update()
        bpy.data.objects["Cube"].location.x = 1.0
        bpy.context.view_layer.update()
        arm = bpy.data.objects["Arm"]
        assert acted
        scenes.assert_as_without(arm, scenes.final_points(arm))
