# SPDX-License-Identifier: GPL-3.0-or-later
"""Diagnostics in the sidebar: exactly the planted faults are found and selected."""

from __future__ import annotations

import math

import bmesh
import bpy
import pytest
import scenes
from mathutils import Quaternion
from sinew_addon.attach import attach
from sinew_addon.attach.subscribers import notify, subscribers
from sinew_addon.features.diagnose import diagnose

pytestmark = pytest.mark.long_term

# Vertices of the planted faults; the tube's rings have twelve.
UNWEIGHTED = [3, 4, 5]
SMALL = [20, 21]
MANY = [130, 131, 140]
LEFTOVER = [60, 61, 62, 63]


def faulty_arm() -> tuple[bpy.types.Object, bpy.types.Object]:
    """Three bones, at most three influences for each vertex, and the faults above."""
    obj, armature = scenes.make_arm(bones=3, rings=19)
    groups = obj.vertex_groups
    for group in groups:
        group.remove(UNWEIGHTED + SMALL)
    groups["bone.0"].add(SMALL, 0.001, "REPLACE")
    for group in groups:
        group.add(MANY, 0.3, "REPLACE")
    groups.new(name="leftover").add(LEFTOVER, 1.0, "REPLACE")
    bpy.context.scene.sinew_most_influences = 2
    return obj, armature


def found(obj: bpy.types.Object) -> dict[str, list[int]]:
    return {finding.name: finding.vertices.tolist() for finding in diagnose.of(obj).findings}


def of_poses(obj: bpy.types.Object) -> dict[str, list[int]]:
    """Without those of weights: what of twisted_arm() is beside other bones follows the first."""
    return {name: vertices for name, vertices in found(obj).items() if name != "astray"}


def selected(obj: bpy.types.Object) -> list[int]:
    if obj.mode == "WEIGHT_PAINT":
        assert obj.data.use_paint_mask_vertex
        return [vertex.index for vertex in obj.data.vertices if vertex.select]
    assert obj.mode == "EDIT"
    return [vertex.index for vertex in bmesh.from_edit_mesh(obj.data).verts if vertex.select]


@pytest.mark.parametrize("skinned", [False, True])
def test_finds_exactly_the_planted_faults(skinned):
    obj, _armature = faulty_arm()
    if skinned:
        bpy.ops.sinew.add()
    assert bpy.ops.sinew.check() == {"FINISHED"}
    assert found(obj) == {
        "no_weights": UNWEIGHTED,
        "small_sums": SMALL,
        "many_influences": MANY,
        "boneless_groups": LEFTOVER,
    }
    groups = next(f for f in diagnose.of(obj).findings if f.name == "boneless_groups").groups
    assert groups == ("leftover",)
    bpy.context.scene.sinew_most_influences = 4
    bpy.ops.sinew.check()
    assert "many_influences" not in found(obj)


def twisted_arm() -> tuple[bpy.types.Object, bpy.types.Object]:
    """Rigid weights, except for one vertex with three bones and one with two. Until frame 11 the bones
    rotate apart: the second by 100 degrees, the third by 200 degrees, or, relative to the first, by 160
    degrees the other way."""
    obj, armature = scenes.make_arm(bones=3, rings=19, weights="hard")
    scenes.forget_keys(armature)
    for group in obj.vertex_groups:
        group.remove(range(len(obj.data.vertices)))
    obj.vertex_groups["bone.0"].add(range(len(obj.data.vertices)), 1.0, "REPLACE")
    for name in ("bone.0", "bone.1", "bone.2"):
        obj.vertex_groups[name].add([100], 0.33, "REPLACE")
    for name in ("bone.0", "bone.2"):
        obj.vertex_groups[name].add([150], 0.5, "REPLACE")
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
    for frame in range(1, 12):
        for bone in list(armature.pose.bones)[1:]:
            bone.rotation_quaternion = Quaternion((0, 1, 0), math.radians(100.0 * (frame - 1) / 10))
            bone.keyframe_insert("rotation_quaternion", frame=frame)
    bpy.context.scene.frame_set(1)
    return obj, armature


def test_findings_of_poses_at_a_frame_and_in_an_action():
    obj, _armature = twisted_arm()
    scenes.add_sinew(obj, "dq")
    bpy.ops.sinew.check()
    assert of_poses(obj) == {}
    bpy.context.scene.frame_set(11)
    bpy.ops.sinew.check()
    # Three bones, each less than 180 degrees from the next and more from the one after that: the order
    # decides.
    assert of_poses(obj) == {"order_of_groups": [100]}
    bpy.context.scene.frame_set(10)
    bpy.ops.sinew.check()
    assert found(obj)["near_half_turn"] == [150]
    bpy.context.scene.frame_set(2)
    assert bpy.ops.sinew.check_frames() == {"FINISHED"}
    assert bpy.context.scene.frame_current == 2
    every = found(obj)
    assert every["order_of_groups"] == [100]
    assert every["near_half_turn"] == [150]
    assert every["jumps"] == [150]
    jumps = next(finding for finding in diagnose.of(obj).findings if finding.name == "jumps")
    assert jumps.frames == (11,)


@pytest.mark.parametrize(
    ("name", "start"),
    [
        *(("no_weights", mode) for mode in ("OBJECT", "EDIT", "WEIGHT_PAINT", "POSE")),
        *((name, "EDIT") for name in ("small_sums", "many_influences", "boneless_groups")),
    ],
)
def test_select_selects_exactly_those(name, start):
    obj, armature = faulty_arm()
    other, _rig = scenes.make_arm(name="Other")
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.context.scene.tool_settings.mesh_select_mode = (False, False, True)
    bpy.ops.object.mode_set(mode="OBJECT")
    scenes.add_sinew(obj, "dq")
    bpy.ops.sinew.check()
    expected = found(obj)[name]
    if start == "POSE":
        bpy.context.view_layer.objects.active = armature
        armature.select_set(True)
    if start != "OBJECT":
        bpy.ops.object.mode_set(mode=start)
    other.select_set(True)
    assert bpy.ops.sinew.select_finding(object="Arm", finding=name) == {"FINISHED"}
    assert bpy.context.object == obj
    assert selected(obj) == expected
    assert other.mode == "OBJECT"
    is_vertices = tuple(bpy.context.scene.tool_settings.mesh_select_mode) == (True, False, False)
    assert is_vertices or start == "WEIGHT_PAINT"


def test_select_shows_what_is_hidden_and_no_more():
    obj, _armature = faulty_arm()
    hidden = [UNWEIGHTED[0], 10, 11, 12]
    for index in hidden:
        obj.data.vertices[index].hide = True
    for elements in (obj.data.edges, obj.data.polygons):
        for element in elements:
            element.hide = bool(set(element.vertices) & set(hidden))
    bpy.ops.sinew.check()
    bpy.ops.sinew.select_finding(object="Arm", finding="no_weights")
    assert selected(obj) == UNWEIGHTED
    still = [vertex.index for vertex in bmesh.from_edit_mesh(obj.data).verts if vertex.hide]
    assert still == [10, 11, 12]


@pytest.mark.parametrize("skinned", [False, True])
def test_results_are_outdated_once_weights_change(skinned):
    obj, armature = faulty_arm()
    if skinned:
        scenes.add_sinew(obj, "dq")
    bpy.ops.sinew.check()
    bpy.context.scene.frame_set(9)
    scenes.bend(armature, 20.0)
    bpy.context.view_layer.update()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.context.view_layer.update()
    assert not diagnose.of(obj).stale
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert not diagnose.of(obj).stale
    obj.vertex_groups["bone.0"].add(UNWEIGHTED, 1.0, "REPLACE")
    obj.data.update()
    bpy.context.view_layer.update()
    assert diagnose.of(obj).stale
    bpy.ops.sinew.check()
    assert not diagnose.of(obj).stale
    assert "no_weights" not in found(obj)
    obj.vertex_groups["leftover"].name = "other"
    assert diagnose.of(obj).stale


def test_weights_changed_in_edit_mode_are_seen():
    obj, _armature = faulty_arm()
    scenes.add_sinew(obj, "dq")
    bpy.ops.sinew.check()
    bpy.ops.sinew.select_finding(object="Arm", finding="no_weights")
    bpy.context.view_layer.update()
    assert not diagnose.of(obj).stale
    obj.vertex_groups.active_index = obj.vertex_groups["bone.0"].index
    bpy.ops.object.vertex_group_assign()
    bpy.context.view_layer.update()
    assert diagnose.of(obj).stale
    bpy.ops.sinew.check()
    assert obj.mode == "EDIT"
    assert "no_weights" not in found(obj)


def test_vertices_that_are_no_more_are_not_selected():
    obj, _armature = faulty_arm()
    bpy.ops.sinew.check()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    with pytest.raises(RuntimeError, match="press Check again"):
        bpy.ops.sinew.select_finding(object="Arm", finding="no_weights")
    with pytest.raises(RuntimeError, match="not in this scene"):
        bpy.ops.sinew.select_finding(object="Gone", finding="no_weights")
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.sinew.check()
    obj.hide_set(True)
    with pytest.raises(RuntimeError, match="is hidden"):
        bpy.ops.sinew.select_finding(object="Arm", finding="no_weights")


def test_with_modifiers_in_front_the_edited_mesh_is_checked():
    obj, _armature = faulty_arm()
    scenes.put_in_front(obj, "MIRROR", "Mirror").use_axis = (False, False, True)
    scenes.add_sinew(obj, "dq")
    assert len(scenes.final_points(obj)) > len(obj.data.vertices)
    bpy.ops.sinew.check()
    assert found(obj)["no_weights"] == UNWEIGHTED
    bpy.ops.sinew.select_finding(object="Arm", finding="no_weights")
    assert selected(obj) == UNWEIGHTED


def test_a_check_touches_nothing(tmp_path):
    obj, _armature = faulty_arm()
    bpy.context.scene.frame_set(5)
    scenes.save(tmp_path / "arm.blend")
    dirty = bpy.data.is_dirty  # 4.2 without a window calls even a newly saved file dirty
    bpy.ops.sinew.check_frames(over="SCENE")
    assert bpy.data.is_dirty == dirty
    assert bpy.context.scene.frame_current == 5
    assert not attach.properties.has_sinew(obj)
    assert not obj.is_property_set("sinew")
    assert not bpy.context.scene.is_property_set("sinew_measures")


def test_meshes_that_were_deleted_since_are_not_read():
    """Simulates that Sinew's own handler deletes helper objects before this one runs: Blender still lists
    them in the update, and reading the deleted ones crashed it."""
    obj, _armature = faulty_arm()
    bpy.ops.sinew.check()
    others = [bpy.data.meshes.new(f"Other {number}") for number in range(40)]
    for mesh in others:
        mesh.from_pydata([(0.0, 0.0, 0.0)] * 2000, [], [])
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(mesh.name, mesh))
    bpy.context.view_layer.update()
    listed = []

    def delete(scene, depsgraph):
        bpy.app.handlers.depsgraph_update_post.remove(delete)
        listed.extend(update.id.name for update in depsgraph.updates if isinstance(update.id, bpy.types.Mesh))
        bpy.data.batch_remove([bpy.data.objects[mesh.name] for mesh in others])
        bpy.data.batch_remove(others)
        # Their memory is in use for something else.
        for number in range(200):
            bpy.data.meshes.new(f"Next {number}")
        notify(subscribers.evaluated, depsgraph)

    for mesh in others:
        mesh.update()
        mesh.update_tag()
    obj.data.update_tag()
    bpy.app.handlers.depsgraph_update_post.append(delete)
    bpy.context.view_layer.update()
    assert {"Other 0", "Other 39", obj.data.name} <= set(listed)
    assert not diagnose.of(obj).stale
