# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Flex: what it finds, where a click goes, and that the file stays as it is until then."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import read_page
import scenes
from sinew_addon.features.diagnose import diagnose
from sinew_addon.features.flex import feature
from sinew_addon.features.flex.verdict import Finding
from sinew_addon.features.variants import choices
from sinew_addon.io import armature_io
from sinew_addon.skinning.variants import parse
from whole_file import assert_same, content

pytestmark = pytest.mark.long_term


@pytest.fixture
def arm_with_a_bare_patch():
    """An arm whose last vertices have no weights, and whose elbow is hard; at rest."""
    obj, armature = scenes.make_arm(sides=16, rings=81, weights="rigid")
    armature.animation_data_clear()
    bare = [vertex.index for vertex in obj.data.vertices][-5:]
    for group in obj.vertex_groups:
        group.remove(bare)
    scenes.add_sinew(obj, "dq")
    yield obj, armature, bare
    feature.results.clear()


# Methods of the skin, and of what a bone carries.
MOVING = "dq", "lbs"


def findings() -> dict[str, tuple[int, int, Finding]]:
    """By name, each with the numbers of the joint and of the fault."""
    result = feature.results[bpy.context.scene.session_uid]
    return {
        finding.limit.name: (number, place, finding)
        for number, joint in enumerate(result.verdict.joints)
        for place, finding in enumerate(joint.findings)
    }


def faults() -> dict[tuple[str, str], Finding]:
    """By joint and name."""
    joints = feature.results[bpy.context.scene.session_uid].verdict.joints
    return {(joint.name, finding.limit.name): finding for joint in joints for finding in joint.findings}


def test_it_finds_the_faults_and_changes_nothing(arm_with_a_bare_patch):
    _obj, _armature, bare = arm_with_a_bare_patch
    before = content()
    assert bpy.ops.sinew.flex(others=True) == {"FINISHED"}
    assert_same(before)
    found = findings()
    assert {"unweighted", "stretch"} <= set(found)
    assert found["unweighted"][2].vertices == len(bare)
    # The variants of the character but the one that it has, and each says what it mends.
    tried = feature.results[bpy.context.scene.session_uid].methods
    labels = [choices.label(parse(key)) for key in tried]
    assert labels[:2] == ["As Blender", "Centres of Rotation"]
    assert len(labels) == 4
    soft = "=dq+twist_spread+delta_mush"
    mended = {fault for fault, finding in faults().items() if soft in finding.mends}
    assert mended
    assert bpy.ops.sinew.use_variant(variant=soft) == {"FINISHED"}
    assert bpy.ops.sinew.flex() == {"FINISHED"}
    assert mended.isdisjoint(faults())


def test_a_click_goes_to_the_place(arm_with_a_bare_patch):
    obj, _armature, bare = arm_with_a_bare_patch
    bpy.ops.sinew.flex()
    joint, place, finding = findings()["unweighted"]
    assert bpy.ops.sinew.flex_place(joint=joint, finding=place) == {"FINISHED"}
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [vertex.index for vertex in obj.data.vertices if vertex.select] == bare
    assert finding.vertex in bare


def test_what_comes_from_a_patch_is_told_below_it_and_goes_with_it(arm_with_a_bare_patch):
    """An artist mends it where it is told, by one undo step."""
    obj, _armature, bare = arm_with_a_bare_patch
    bpy.ops.sinew.flex()
    (first, others), *_rest = feature.results[bpy.context.scene.session_uid].verdict.by_cause()
    assert first.limit.name == "unweighted"
    assert {"stretch"} <= {each.limit.name for each in others}
    assert {each.caused_by for each in others} == {(first.joint, first.limit)}
    key = f"unweighted {first.joint}"
    assert diagnose.has(obj, key)
    assert bpy.ops.sinew.mend(object=obj.name, finding=key, how="fill") == {"FINISHED"}
    assert not diagnose.has(obj, key)
    assert all(obj.data.vertices[vertex].groups for vertex in bare)
    bpy.ops.sinew.flex()
    left = feature.results[bpy.context.scene.session_uid].verdict.findings
    assert "unweighted" not in {each.limit.name for each in left}


def test_a_click_poses_the_bone_as_it_was_bent(arm_with_a_bare_patch):
    obj, armature, _bare = arm_with_a_bare_patch
    armature.pose.bones[0].rotation_mode = "XYZ"
    armature.pose.bones[1].location = (0.0, 0.0, 0.0)
    bpy.ops.sinew.flex()
    joint, place, finding = findings()["stretch"]
    for bone in armature.pose.bones:
        bone.matrix_basis.identity()
    assert bpy.ops.sinew.flex_pose(joint=joint, finding=place) == {"FINISHED"}
    bpy.context.view_layer.update()
    # The shape of now is that in which the edge is longest.
    result = feature.results[bpy.context.scene.session_uid]
    name = result.verdict.joints[joint].name
    bones = armature_io.read_bones(armature)
    number = bones.names.index(name)
    posed = np.array(armature.pose.bones[name].matrix)[:3, :3]
    wanted = result.poses[armature.name, name, finding.pose][name] @ bones.rest[number, :3, :3]
    np.testing.assert_allclose(posed, wanted, atol=1e-5)
    points = scenes.final_points(obj)
    edges = np.array([edge.vertices[:] for edge in obj.data.edges])
    rest = scenes.rest_points(obj)
    before, after = (np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (rest, points))
    assert finding.vertex in edges[np.argsort(before - after)[:80]]


def test_the_poses_are_saved_as_a_page(arm_with_a_bare_patch, tmp_path):
    """Its shapes are those that Blender makes of the same poses, with stages, also of an eye; nothing is
    changed."""
    obj, armature, _bare = arm_with_a_bare_patch
    obj.sinew.twist_spread.enabled = obj.sinew.bulge_limit.enabled = True
    bpy.ops.mesh.primitive_cube_add(size=0.2)
    eye = bpy.context.object
    eye.parent, eye.parent_type, eye.parent_bone = armature, "BONE", armature.data.bones[-1].name
    armature.location, armature.scale = (0.3, -0.4, 0.2), (1.3, 1.3, 1.3)
    scenes.bend(armature, 50.0)
    assert not bpy.ops.sinew.save_flex.poll()
    bpy.context.view_layer.objects.active = obj
    bpy.ops.sinew.flex()
    before, path = content(), tmp_path / "bent.html"
    assert bpy.ops.sinew.save_flex(filepath=str(path)) == {"FINISHED"}
    assert_same(before)
    header, meshes = read_page.read(path)
    assert list(header["methods"]) == ["dq", "lbs", "cor"]
    assert [part["name"] for part in header["parts"]] == [obj.name, eye.name]
    result = feature.results[bpy.context.scene.session_uid]
    assert len(header["frames"]) == len({id(rotations) for rotations in result.poses.values()}) + 1
    known = findings()
    assert len(header["flex"]["findings"]) == len(result.verdict.findings)
    for entry in header["flex"]["findings"]:
        (name,) = [each for each, (*_n, finding) in known.items() if finding.limit.label == entry["measure"]]
        joint, place, finding = known[name]
        for bone in armature.pose.bones:
            bone.matrix_basis.identity()
        if finding.pose:
            bpy.ops.sinew.flex_pose(joint=joint, finding=place)
            assert header["frames"][entry["frame"]] == f"{entry['joint']}: {finding.pose}"
        else:
            assert header["frames"][entry["frame"]] == "At rest"
        bpy.context.view_layer.update()
        assert (entry["mesh"], entry["vertex"]) == (obj.name, finding.vertex)
        for part, arrays, mesh, method in zip(header["parts"], meshes, (obj, eye), MOVING, strict=True):
            world = arrays["worlds"][entry["frame"]].astype(np.float64)
            found = read_page.points(part, arrays, method, entry["frame"]) @ world[:3, :3].T + world[:3, 3]
            np.testing.assert_allclose(found, scenes.world_points(mesh), atol=2e-5)
    armature.data.bones[-1].name = "Renamed"
    with pytest.raises(RuntimeError, match="has changed since it was bent"):
        bpy.ops.sinew.save_flex(filepath=str(path))


def test_what_is_gone_is_said(arm_with_a_bare_patch):
    obj, _armature, _bare = arm_with_a_bare_patch
    with pytest.raises(RuntimeError, match="press Flex again"):
        bpy.ops.sinew.flex_place(joint=0, finding=0)
    bpy.ops.sinew.flex()
    joint, place, _finding = findings()["unweighted"]
    obj.name = "Renamed"
    with pytest.raises(RuntimeError, match="other vertices"):
        bpy.ops.sinew.flex_place(joint=joint, finding=place)
    with pytest.raises(RuntimeError, match="press Flex again"):
        bpy.ops.sinew.flex_pose(joint=joint, finding=place)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert feature.results == {}
