# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes to bones play in a Blender without Sinew, and in a glTF reader, with the errors that they report."""

from __future__ import annotations

import json

import bmesh
import bpy
import numpy as np
import pytest
import read_glb
import scenes
from program import checked, run_sinew, without_sinew
from sinew_addon.attach import point_store
from sinew_addon.base.errors import SinewError
from sinew_addon.features.bake import bake
from sinew_addon.features.bake.helper_bones import HelperOptions
from sinew_addon.features.heat import bake_error, measures
from sinew_addon.io import actions
from test_bake import FRAMES, read_elsewhere

pytestmark = pytest.mark.outer_versions

METHOD = "dq"
# World points of float32 matrices.
ROUNDING = 3e-6

EXPORT = """
import sys, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Object, "sinew")
bpy.ops.export_scene.gltf(filepath=sys.argv[2])
"""


def baked(path, out, *options, method=METHOD):
    """The file, and its report for each armature."""
    command = ("bake", path, "--method", method, "--to", "bones", "--frames", "1-11", "--json", "--out", out)
    (said,) = json.loads(run_sinew(*command, *options).stdout)
    assert said["errors"] == []
    return out / path.name, said["bones"]


def rms_and_worst(points, expected):
    distances = np.linalg.norm(np.asarray(points) - np.asarray(expected), axis=-1)
    return np.sqrt(np.square(distances).mean()), distances.max()


def assert_states(report, points, expected):
    """The played shape has the reported error."""
    stated = report["after"]
    for found, said in zip(rms_and_worst(points, expected), (stated["rms"], stated["worst"]), strict=True):
        assert abs(found - said) <= 1e-3 * said + ROUNDING * report["diagonal"]


def test_a_blend_file_plays_elsewhere_to_the_stated_error(arm, tmp_path):
    obj, path = arm
    before = path.read_bytes()
    scenes.add_sinew(obj, METHOD)
    expected = scenes.world_shapes(obj, FRAMES)
    bones = {bone.name: np.array(bone.matrix_local) for bone in obj.modifiers["Armature"].object.data.bones}
    file, (report,) = baked(path, tmp_path / "out")
    assert path.read_bytes() == before
    assert_states(report, read_elsewhere(file, FRAMES, tmp_path)["Arm"], expected)
    assert (report["helpers"], report["influences"]) == (2, 4)
    assert report["after"]["rms"] < 0.3 * report["before"]["rms"]

    bpy.ops.wm.open_mainfile(filepath=str(file))
    obj, armature = bpy.data.objects["Arm"], bpy.data.objects["Arm Rig"].data
    (modifier,) = obj.modifiers
    assert (modifier.type, modifier.use_deform_preserve_volume) == ("ARMATURE", False)
    (collection,) = (c for c in armature.collections if c.name == "Sinew helpers")
    helpers = [bone for bone in armature.bones if bone.name.startswith("Helper_")]
    assert set(collection.bones) == set(helpers)
    assert {bone.parent.name for bone in helpers} <= bones.keys()
    for name, rest in bones.items():
        assert np.array_equal(np.array(armature.bones[name].matrix_local), rest)
    for vertex in obj.data.vertices:
        weights = [entry.weight for entry in vertex.groups if entry.weight > 0.0]
        assert len(weights) <= 4
        assert abs(sum(weights) - 1.0) < 1e-5
    errors = np.empty(len(obj.data.vertices), dtype=np.float32)
    obj.data.attributes["Sinew bake error"].data.foreach_get("value", errors)
    assert np.isclose(np.sqrt(np.square(errors).mean()), report["after"]["rms"], rtol=1e-4)
    # The original data is still there, so that the bake can be reverted.
    kept = {"Arm": bpy.data.meshes, "Arm Rig": bpy.data.armatures, "Arm RigAction": bpy.data.actions}
    assert all(data[name].use_fake_user for name, data in kept.items())
    assert [bone.name for bone in bpy.data.armatures["Arm Rig"].bones] == list(bones)


def pose_anew(rig):
    """Another action than the baked one, with rotations that this one does not have."""
    rig.animation_data_clear()
    for bone in list(rig.pose.bones)[:2]:
        bone.rotation_mode, bone.location, bone.scale = "XYZ", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
        turns = ((1, (0.4, -0.9, 0.3)), (6, (-1.2, 0.2, -0.5)), (11, (0.9, 1.0, 0.8)))
        scenes.key(bone, "rotation_euler", turns)


@pytest.mark.parametrize(("method", "share", "scaled"), [(METHOD, 0.25, False), ("cor", 0.35, True)])
def test_helper_bones_that_follow_the_pose_play_other_animation(arm, tmp_path, scaled, method, share):
    obj, path = arm
    rig = obj.modifiers["Armature"].object
    if scaled:
        rig.scale, rig.rotation_euler = (2.0, 2.0, 2.0), (0.3, 0.2, 0.1)
        bone = rig.pose.bones["bone.1"]
        scenes.key(bone, "scale", ((1, (1.0, 1.0, 1.0)), (11, (1.2, 1.5, 1.3))))
        scenes.save(path)
    scenes.add_sinew(obj, method)
    expected = scenes.world_shapes(obj, FRAMES)
    file, (report,) = baked(path, tmp_path / "out", "--motion", "pose", "--helpers", "3", method=method)
    assert_states(report, read_elsewhere(file, FRAMES, tmp_path)["Arm"], expected)
    assert report["after"]["rms"] < 0.25 * report["before"]["rms"]
    assert report["unseen_after"]["rms"] < 0.25 * report["unseen_before"]["rms"]
    keyed, _reports = baked(path, tmp_path / "keyed", "--helpers", "3", method=method)

    # An animation from which neither was made: Sinew's shape, and the played one.
    pose_anew(rig)
    expected = scenes.world_shapes(obj, FRAMES)
    obj.sinew.method = "lbs"
    linear = rms_and_worst(scenes.world_shapes(obj, FRAMES), expected)[0]
    found = {}
    for each in (file, keyed):
        bpy.ops.wm.open_mainfile(filepath=str(each))
        pose_anew(bpy.data.objects["Arm Rig"])
        scenes.save(tmp_path / "other.blend")
        played = read_elsewhere(tmp_path / "other.blend", FRAMES, tmp_path)["Arm"]
        found[each] = rms_and_worst(played, expected)[0]
    assert found[file] < share * linear
    assert found[file] < 0.5 * found[keyed]


def test_meshes_of_one_armature_with_keys_and_transforms(arm, tmp_path):
    """They share helper bones; shape keys still play, as do motion and scale of the object."""
    obj, path = arm
    rig = obj.modifiers["Armature"].object
    sleeve = scenes.copied(obj, "Sleeve")
    scenes.key_shape(sleeve, (1.0, 1.3, 1.3))
    rig.scale, rig.rotation_euler = (2.0, 2.0, 2.0), (0.3, 0.2, 0.1)
    for each in (obj, sleeve):
        each.parent = rig
    # A bone that grows, unevenly at the end.
    bone = rig.pose.bones["bone.0"]
    scenes.key(bone, "scale", ((1, (1.0, 1.0, 1.0)), (11, (1.2, 1.5, 1.3))))
    bpy.context.scene.render.frame_map_new = 200
    scenes.save(path)
    for each in (obj, sleeve):
        scenes.add_sinew(each, METHOD)
    expected = [scenes.world_shapes(each, FRAMES) for each in (obj, sleeve)]
    file, (report,) = baked(path, tmp_path / "out", "--helpers", "6", "--influences", "3")
    read = read_elsewhere(file, FRAMES, tmp_path)
    assert_states(report, np.hstack([read["Arm"], read["Sleeve"]]), np.hstack(expected))
    assert report["influences"] == 3
    assert report["after"]["rms"] < 0.3 * report["before"]["rms"]


def skinned_by_gltf(glb, frames, rate):
    """World points [frames, vertices, 3] in Blender's axes, blended linearly by the reader for engines."""
    header = read_glb.File(glb).header
    assert "JOINTS_1" not in header["meshes"][0]["primitives"][0]["attributes"]
    # The action without helper bones remains in the file, and is exported, too.
    made = [each["name"] for each in header["animations"] if each["name"].endswith("Helpers")]
    (name,) = made or [each["name"] for each in header["animations"]]
    (points,) = read_glb.points_at(glb, np.array(frames) / rate, name).values()
    return points


@pytest.mark.parametrize(("motion", "method"), [("keys", METHOD), ("pose", METHOD), ("pose", "cor")])
def test_gltf_plays_to_the_stated_error(arm, tmp_path, motion, method):
    """The exporter converts constraints to keys."""
    obj, path = arm
    scenes.add_sinew(obj, method)
    expected = scenes.world_shapes(obj, FRAMES)
    file, (report,) = baked(path, tmp_path / "out", "--motion", motion, method=method)
    glb = tmp_path / "arm.glb"
    checked(without_sinew.run(EXPORT, file, glb), 0)
    played = skinned_by_gltf(glb, FRAMES, bpy.context.scene.render.fps)
    # Vertices are split at seams.
    nearest = np.linalg.norm(played[0][:, None] - expected[0][None], axis=2).argmin(axis=1)
    assert set(nearest) == set(range(expected.shape[1]))
    rms, worst = rms_and_worst(played, expected[:, nearest])
    # Weights are rounded there, and split vertices count twice.
    assert worst <= 1.001 * report["after"]["worst"] + 1e-5 * report["diagonal"]
    assert rms <= 1.2 * report["after"]["rms"]
    assert scenes.worst(played[0], played[-1]) > 0.5


@pytest.mark.parametrize("motion", ["keys", "pose"])
def test_errors_before_and_after_as_heat_maps(arm, motion):
    obj, _path = arm
    mesh = obj.data
    obj.modifiers[0].use_deform_preserve_volume = False
    lbs = scenes.world_shapes(obj, FRAMES)
    scenes.add_sinew(obj, METHOD)
    mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    mesh.attributes.active_color_name = "Paint"
    expected = scenes.world_shapes(obj, FRAMES)
    before = list(mesh.attributes.keys())
    with pytest.raises(RuntimeError, match="No mesh here was baked"):
        bpy.ops.sinew.heat_map(quantity="bake_error")
    bpy.ops.sinew.bake(kind="bones", frames=",".join(map(str, FRAMES)), motion=motion, helpers=2)
    played = scenes.world_shapes(obj, FRAMES)
    colours = {}
    for choice, shape in ((bake_error.BEFORE, lbs), (bake_error.AFTER, played)):
        wanted = np.sqrt(np.square(shape - expected).sum(axis=2).mean(axis=0))
        found = bake_error.errors_of(obj.data, choice, len(obj.data.vertices))
        mean = np.sqrt(np.square(wanted).mean())
        assert np.isclose(bake_error.rms([obj], choice), mean, rtol=1e-3)
        assert np.allclose(found, wanted, atol=1e-4 * scenes.diagonal(obj))
        assert bpy.ops.sinew.heat_map(quantity=choice) == {"FINISHED"}
        assert bake_error.shown(bpy.context.scene) == [obj]
        name = obj.data.attributes.active_color_name
        shown = np.empty(4 * len(wanted), dtype=np.float32)
        obj.data.attributes[name].data.foreach_get("color", shown)
        colours[choice] = shown.reshape(-1, 4)[:, :3]
        # In one range: from dark violet at 0 to yellow at the largest error before.
        order = np.argsort(found)
        light = colours[choice] @ (0.2126, 0.7152, 0.0722)
        assert (np.diff(light[order]) > -1e-3).all()
    assert colours[bake_error.BEFORE].max() > 0.8
    assert colours[bake_error.AFTER].mean() < colours[bake_error.BEFORE].mean()
    bpy.ops.sinew.heat_map()
    # Numbers are read from the mesh once, until it changes.
    assert bake_error.summary_of(obj.data) is bake_error.summary_of(obj.data)
    kept = {"Sinew bake error", "Sinew bake error before"}
    assert set(obj.data.attributes.keys()) - kept == set(before) - {point_store.ATTRIBUTE}
    assert obj.data.attributes.active_color_name == "Paint"
    assert bake_error.shown(bpy.context.scene) == []
    settings = measures.of(bpy.context.scene)
    most = bake_error.scale_of(settings, [obj]).high
    edited = bmesh.new()
    edited.from_mesh(obj.data)
    errors = bake_error.errors_of(obj.data, bake_error.BEFORE, len(obj.data.vertices))
    worst = [v for v in edited.verts if errors[v.index] > 0.5 * most]
    bmesh.ops.delete(edited, geom=worst, context="VERTS")
    edited.to_mesh(obj.data)
    edited.free()
    assert bake_error.scale_of(settings, [obj]).high <= 0.5 * most


@pytest.mark.parametrize("of", ["two modifiers", "in front", "rest", "linked"])
def test_what_bones_can_not_reproduce_is_refused(arm, tmp_path, of):
    obj, path = arm
    rig = obj.modifiers["Armature"].object
    if of == "two modifiers":
        obj.modifiers.new("Second", "ARMATURE").object = rig
    elif of == "in front":
        scenes.put_in_front(obj, "MIRROR", "Mirror")
    elif of == "rest":
        rig.data.pose_position = "REST"
    else:
        scenes.save(path)
        obj = scenes.copied(scenes.link(path, "Arm", "Arm Rig")[0], linked=True)
    scenes.add_sinew(obj, METHOD)
    sentence = {
        "two modifiers": "has several Armature modifiers",
        "in front": "Mirror changes the mesh ahead of the armature",
        "rest": "is in Rest Position",
        "linked": "is linked, and can not have bones of its own",
    }[of]
    with pytest.raises(SinewError, match=sentence):
        bake.start([obj], "bones", FRAMES, tmp_path / "arm.blend", overwrite=False)


def test_helper_bones_for_a_stage_without_a_weighted_bone_are_refused(arm, tmp_path):
    obj, _path = arm
    obj.vertex_groups.clear()
    scenes.add_sinew(obj, METHOD)
    obj.sinew.delta_mush.enabled, obj.sinew.delta_mush.scale = True, 0.0
    options = HelperOptions(helpers=3)
    started = bake.start([obj], "bones", FRAMES, tmp_path / "arm.blend", overwrite=False, helpers=options)
    with pytest.raises(SinewError, match="Arm: no bone has weights here"):
        list(started.sample())


def test_in_the_open_file_modes_and_selection_stay(arm, tmp_path):
    obj, _path = arm
    rig = obj.modifiers["Armature"].object
    scenes.add_sinew(obj, METHOD)
    bpy.context.view_layer.objects.active = rig
    rig.select_set(True)
    obj.select_set(False)
    bpy.ops.object.mode_set(mode="POSE")
    curves = len(actions.all_curves(rig.animation_data.action, actions.slot_of(rig.animation_data)))
    options = HelperOptions(helpers=3)
    started = bake.start([obj], "bones", FRAMES, tmp_path / "arm.blend", overwrite=False, helpers=options)
    list(started.sample())
    started.place()
    assert (rig.mode, bpy.context.view_layer.objects.active, rig.select_get()) == ("POSE", rig, True)
    assert not obj.select_get()
    all_curves = actions.all_curves(rig.animation_data.action, actions.slot_of(rig.animation_data))
    moved = {curve.data_path for curve in all_curves if "Helper_" in curve.data_path}
    assert len(all_curves) == curves + 7 * len(moved) // 2
    assert all(len(c.keyframe_points) == len(FRAMES) for c in all_curves if "Helper_" in c.data_path)


@pytest.mark.parametrize("moving", [False, True])
def test_envelopes_that_reach_other_vertices_from_frame_to_frame_are_refused(arm, tmp_path, moving):
    """Such as where the armature moves relative to the mesh; if it moves together with the mesh, they are
    baked."""
    obj, _path = arm
    rig = obj.modifiers["Armature"].object
    obj.vertex_groups.clear()
    obj.modifiers["Armature"].use_bone_envelopes = True
    scenes.key(rig, "location", ((1, (0.0, 0.0, 0.0)), (11, (1.5, 0.0, 0.0))))
    if not moving:
        obj.parent = rig
    scenes.add_sinew(obj, METHOD)
    started = bake.start([obj], "bones", FRAMES, tmp_path / "arm.blend", overwrite=False)
    if moving:
        with pytest.raises(SinewError, match="envelopes of its bones reach other vertices"):
            list(started.sample())
        return
    list(started.sample())
    (report,) = started.reports
    assert report.after.rms < 0.5 * report.before.rms


@pytest.mark.parametrize("against", ["option", "mask"])
def test_what_the_modifier_does_not_deform_stays(arm, tmp_path, against):
    """Although it has weights, which the modifier would then use."""
    obj, _path = arm
    modifier = obj.modifiers["Armature"]
    if against == "option":
        modifier.use_vertex_groups = False
    else:
        half = list(range(len(obj.data.vertices) // 2))
        obj.vertex_groups.new(name="Half").add(half, 1.0, "REPLACE")
        modifier.vertex_group = "Half"
    scenes.add_sinew(obj, METHOD)
    expected = scenes.shapes(obj, FRAMES)
    started = bake.start([obj], "bones", FRAMES, tmp_path / "arm.blend", overwrite=False)
    list(started.sample())
    started.place()
    (report,) = started.reports
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= 1.01 * report.after.worst + 1e-5
