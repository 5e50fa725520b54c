# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo and redo of what Sinew reacted to after Blender had made its step: Blender keeps an object that is the
same in both steps, and with it what the object refers to. A test that fails here mostly ends the process."""

import bpy
import pytest
import routes
import scenes
from sinew_addon.attach import properties, stack


@pytest.fixture(autouse=True)
def released():
    yield
    routes.release()


def _arm_beside_cube():
    """An arm with Sinew and shape keys, and a cube beside it; both selected, the cube active."""
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
    """The cube gets the arm's mesh, so that Sinew has to keep the arm's points elsewhere."""
    arm, cube = bpy.data.objects["Arm"], bpy.data.objects["Cube"]
    bpy.context.view_layer.objects.active = arm
    bpy.ops.ed.undo_push(message="active")
    bpy.ops.ed.undo_push(message="active")
    with bpy.context.temp_override(active_object=arm, object=arm, selected_editable_objects=[cube, arm]):
        bpy.ops.object.make_links_data("EXEC_DEFAULT", True, type="OBDATA")
    assert cube.data == arm.data
    assert properties.of(arm).point_buffer is not None


def _make_keys_absolute():
    """Blender's keys are then no longer what Sinew deforms by itself: it has a proxy in front."""
    path = 'scene.objects["Arm"].data.shape_keys.use_relative'
    bpy.ops.wm.context_toggle("EXEC_DEFAULT", True, data_path=path)
    arm = bpy.data.objects["Arm"]
    assert not arm.data.shape_keys.use_relative
    assert properties.of(arm).upstream_proxy is not None


def test_undo_of_sculpt_mode():
    """In it Preserve Volume is set for dq; whatever step Blender goes to, the artist's own comes back."""
    obj, _armature = scenes.make_arm()
    modifier = obj.modifiers["Armature"]
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(8)
    expected = scenes.final_points(obj)
    bpy.ops.ed.undo_push(message="before")
    for mode in ("SCULPT", "OBJECT", "SCULPT"):
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=mode)
        bpy.context.view_layer.update()
    assert modifier.use_deform_preserve_volume
    for step in (*[bpy.ops.ed.undo] * 3, *[bpy.ops.ed.redo] * 3, *[bpy.ops.ed.undo] * 2):
        step()
        bpy.context.view_layer.update()
        obj = bpy.data.objects["Arm"]
        is_sculpted = obj.mode == "SCULPT"
        assert obj.modifiers["Armature"].use_deform_preserve_volume == is_sculpted
        assert properties.of(obj).has_nearest_volume == is_sculpted
        assert scenes.worst(scenes.final_points(obj), expected) <= 1e-6
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert not obj.modifiers["Armature"].use_deform_preserve_volume


@pytest.mark.parametrize("name", ["Sinew", "Skin"])
@pytest.mark.parametrize("change", [_link_data, _make_keys_absolute])
@pytest.mark.parametrize("route", routes.ROUTES)
def test_undo_of_what_sinew_reacted_to_after_the_step(route, change, name):
    routes.force(route)
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
