# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that repair a finding: they do the same as Blender's own operators, on exactly its vertices."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from planted import HUMAN, Rig
from sinew_addon.base.errors import SinewError
from sinew_addon.features.diagnose import diagnose, mending
from sinew_addon.io import mesh_io
from test_diagnostics_panel import LEFTOVER, MANY, SMALL, UNWEIGHTED, faulty_arm, found, of_poses, twisted_arm

pytestmark = pytest.mark.long_term


def dense(obj: bpy.types.Object) -> np.ndarray:
    """[vertices, groups]"""
    obj.update_from_editmode()
    weights = mesh_io.read_group_weights(obj.data)
    return np.stack([weights.of_group(group) for group in range(len(obj.vertex_groups))], axis=1)


def mend(obj: bpy.types.Object, finding: str, how: str) -> None:
    assert bpy.ops.sinew.mend(object=obj.name, finding=finding, how=how) == {"FINISHED"}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT", "WEIGHT_PAINT"])
def test_limit_total_is_blenders_on_these_vertices_alone(mode):
    obj, _armature = faulty_arm()
    before = dense(obj)
    bpy.ops.object.vertex_group_limit_total(group_select_mode="ALL", limit=2)
    bpy.ops.object.vertex_group_normalize_all(group_select_mode="ALL", lock_active=False)
    blenders = dense(obj)
    mesh_io.write_group_weights(
        obj, {v: {g: float(w) for g, w in enumerate(row) if w > 0.0} for v, row in enumerate(before)}
    )
    np.testing.assert_array_equal(dense(obj), before)
    bpy.ops.sinew.add()
    bpy.ops.sinew.check()
    bpy.ops.object.mode_set(mode=mode)
    mend(obj, "many_influences", "limit")
    after = dense(obj)
    np.testing.assert_allclose(after[MANY], blenders[MANY], atol=1e-6)
    others = np.setdiff1d(np.arange(len(before)), MANY)
    np.testing.assert_array_equal(after[others], before[others])
    assert "many_influences" not in found(obj), "it was not checked again"
    assert found(obj)["no_weights"] == UNWEIGHTED


def test_small_sums_are_normalized():
    obj, _armature = faulty_arm()
    bpy.ops.sinew.check()
    mend(obj, "small_sums", "normalize")
    np.testing.assert_allclose(dense(obj)[SMALL, 0], 1.0, atol=1e-6)
    assert "small_sums" not in found(obj)


def test_groups_without_a_bone_are_removed_but_locked_ones():
    obj, _armature = faulty_arm()
    obj.vertex_groups["leftover"].lock_weight = True
    obj.vertex_groups.new(name="rest").add(LEFTOVER, 1.0, "REPLACE")
    bpy.ops.sinew.check()
    mend(obj, "boneless_groups", "remove")
    assert "rest" not in obj.vertex_groups
    with pytest.raises(RuntimeError, match="locked"):
        mend(obj, "boneless_groups", "remove")
    obj.vertex_groups["leftover"].lock_weight = False
    mend(obj, "boneless_groups", "remove")
    assert obj.vertex_groups.keys() == ["bone.0", "bone.1", "bone.2"]
    assert "boneless_groups" not in found(obj)


def test_vertices_without_weights_get_their_neighbours():
    obj, _armature = faulty_arm()
    bpy.ops.sinew.check()
    mend(obj, "no_weights", "fill")
    assert "no_weights" not in found(obj)
    after = dense(obj)[UNWEIGHTED]
    np.testing.assert_allclose(after[:, :3].sum(axis=1), 1.0, atol=1e-6)
    # At the end of the first bone, like all vertices around it.
    assert (after[:, 0] == after[:, :3].max(axis=1)).all()


def two_sided() -> bpy.types.Object:
    """A tube along X about the origin with bones on two sides, whose left half has lost its weights."""
    obj, armature = scenes.make_arm(bones=2)
    for bone, name in zip(list(armature.data.bones), ("hand.R", "hand.L"), strict=True):
        # Groups are renamed with their bones.
        bone.name = name
    for vertex in obj.data.vertices:
        vertex.co.x -= 1.0
    return obj


def test_a_missing_side_is_mirrored_from_the_other():
    obj = two_sided()
    obj.vertex_groups["hand.R"].add([0], 0.75, "REPLACE")
    whole = dense(obj)
    points = scenes.rest_points(obj)
    left = np.flatnonzero(points[:, 0] > 1e-4).tolist()
    mirrored = {
        int(np.linalg.norm(points - points[v] * (-1, 1, 1), axis=1).argmin()): v
        for v in np.flatnonzero(points[:, 0] < -1e-4)
    }
    for group in obj.vertex_groups:
        group.remove(left)
    bpy.ops.sinew.check()
    assert found(obj)["no_weights"] == left
    mend(obj, "no_weights", "mirror")
    after = dense(obj)
    for vertex in left:
        np.testing.assert_allclose(after[vertex], whole[mirrored[vertex]][::-1], atol=1e-7)
    assert "no_weights" not in found(obj)


def test_the_group_of_the_missing_side_is_made():
    obj = two_sided()
    left = np.flatnonzero(scenes.rest_points(obj)[:, 0] > 1e-4).tolist()
    obj.vertex_groups.remove(obj.vertex_groups["hand.L"])
    obj.vertex_groups["hand.R"].remove(left)
    bpy.ops.sinew.check()
    mend(obj, "no_weights", "mirror")
    assert "hand.L" in obj.vertex_groups
    assert "no_weights" not in found(obj)


def test_smoothing_goes_on_until_the_order_decides_nothing_more():
    obj, _armature = twisted_arm()
    bpy.context.scene.frame_set(11)
    bpy.ops.sinew.check()
    assert of_poses(obj) == {"order_of_groups": [100]}
    before = dense(obj)
    mend(obj, "order_of_groups", "smooth")
    after = dense(obj)
    changed = np.flatnonzero((before != after).any(axis=1)).tolist()
    assert changed == [100]
    assert after[100, 0] > before[100, 0], "its neighbours are all of the first bone"


def test_it_is_checked_again_over_the_same_frames():
    obj, _armature = twisted_arm()
    bpy.ops.sinew.check_frames(over="ACTION")
    words = diagnose.of(obj).frames
    mend(obj, "order_of_groups", "smooth")
    assert diagnose.of(obj).frames == words
    assert "near_half_turn" in found(obj)


def test_it_says_why_it_can_not():
    obj, _armature = faulty_arm()
    bpy.ops.sinew.check()
    with pytest.raises(SinewError, match="does not mend"):
        mending.mend(obj, "no_weights", "limit", 4)
    obj.vertex_groups["bone.0"].add([7], 0.9, "REPLACE")
    obj.data.update_tag()
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="press Check again"):
        mend(obj, "many_influences", "limit")


def stray(obj: bpy.types.Object) -> dict[str, list[int]]:
    """Vertices by the keys of findings of one bone."""
    return {each.key: sorted(each.vertices.tolist()) for each in diagnose.of(obj).findings if each.bone}


def test_a_stroke_of_a_far_bone_is_found_and_taken_off(real_rig):
    rig = Rig.open(real_rig("human.blend"), HUMAN)
    patch = sorted(rig.patch("shin.L", 40).tolist())
    before, group = rig.weights.copy(), rig.group("hand.L")
    rig.give(np.array(patch), "hand.L", 0.4)
    rig.weights[patch[:5]] = 0.0
    rig.weights[patch[:5], group] = 1.0
    rig.store()
    obj = rig.obj
    bpy.context.view_layer.objects.active = obj
    bpy.ops.sinew.check()
    known = stray(obj)
    assert known.pop("bleed hand_l") == patch
    assert bpy.ops.sinew.mend(object=obj.name, finding="bleed hand_l", how="unbind") == {"FINISHED"}
    after = dense(obj)
    # Those that had no other bone have those around them; the others what they had before the stroke.
    sums = before[patch[5:]].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(after[patch[5:]], before[patch[5:]] / sums, atol=1e-5)
    np.testing.assert_allclose(after[patch[:5]].sum(axis=1), 1.0, atol=1e-5)
    assert not after[patch, group].any()
    others = np.setdiff1d(np.arange(len(after)), patch)
    np.testing.assert_allclose(after[others], before[others], atol=1e-6)
    assert stray(obj) == known


def test_a_locked_group_keeps_its_stroke(real_rig):
    rig = Rig.open(real_rig("human.blend"), HUMAN)
    rig.give(rig.patch("shin.L", 40), "hand.L", 0.4)
    rig.store()
    rig.obj.vertex_groups["hand_l"].lock_weight = True
    bpy.context.view_layer.objects.active = rig.obj
    bpy.ops.sinew.check()
    before = dense(rig.obj)
    with pytest.raises(RuntimeError, match="the group of the bone is locked"):
        bpy.ops.sinew.mend(object=rig.obj.name, finding="bleed hand_l", how="unbind")
    np.testing.assert_array_equal(dense(rig.obj), before)
