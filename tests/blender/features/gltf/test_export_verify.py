# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew export --verify`: each cause that is planted alone is found, with its distance; a file that was
changed afterwards has a difference without a cause."""

from __future__ import annotations

import json
import struct
from dataclasses import asdict
from importlib.util import find_spec

import addon_utils
import bpy
import numpy as np
import other_gltf
import program
import pytest
import scenes
from mathutils import Matrix
from program import run_sinew
from scipy.spatial import cKDTree
from sinew_addon.features.bake import bake_apart
from sinew_addon.features.gltf import feature, played, verify
from sinew_addon.features.gltf.export_check import CAUSES, EXPLAINED
from test_segment_bones import make_bendy, world_rest

pytestmark = pytest.mark.outer_versions

FRAMES = list(range(1, 12))


@pytest.fixture
def scene(empty_file, tmp_path):
    """An arm of three bones, and its armature: bends, moved and rotated, as a whole."""
    return scenes.placed_arm()


def exported(tmp_path, *options, method="lbs", ending=".glb", status=0):
    """What is said of the only mesh."""
    file, out = tmp_path / "arm.blend", tmp_path / f"arm{ending}"
    scenes.save(file)
    given = ("--method", method, "--verify", "--json", "--out", out, *options)
    said = json.loads(run_sinew("export", file, *given, status=status).stdout)
    assert said["errors"] == []
    (mesh,) = said["meshes"]
    return mesh


def found_causes(mesh):
    """Those of whole frames."""
    found = {name for name, each in mesh["causes"].items() if each["largest"] > EXPLAINED * mesh["diagonal"]}
    return found - {"sampling"}


@pytest.mark.parametrize("ending", [".glb", ".usdc", ".fbx"])
def test_a_file_without_faults(scene, tmp_path, ending):
    skip_without_reader(ending)
    mesh = exported(tmp_path, ending=ending)
    assert found_causes(mesh) == set()
    assert mesh["total"]["largest"] <= 1e-6 * mesh["diagonal"]
    assert mesh["explained"]


def skip_without_reader(ending):
    if ending == ".usdc" and bpy.app.version < (4, 4, 0):
        pytest.skip("pxr is not for others' scripts")
    if ending == ".fbx":
        pytest.importorskip("ufbx")


def add_control(rig):
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = rig.data.edit_bones.new("control")
    bone.tail, bone.use_deform = (0.0, 0.0, 1.0), False
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("ending", [".glb", ".usdc", ".fbx"])
@pytest.mark.parametrize("is_in_a_group", [False, True], ids=["none", "of_control"])
def test_vertices_that_no_bone_moves(scene, tmp_path, ending, is_in_a_group):
    """In no group, or in that of a bone which does not deform and moves."""
    skip_without_reader(ending)
    obj, rig = scene
    for group in obj.vertex_groups:
        group.remove([100, 101, 150])
    if is_in_a_group:
        add_control(rig)
        scenes.key(rig.pose.bones["control"], "location", ((1, (0, 0, 0)), (11, (0.0, 0.0, 2.0))))
        obj.vertex_groups.new(name="control").add([100, 101, 20], 0.5, "REPLACE")
    mesh = exported(tmp_path, ending=ending)
    assert found_causes(mesh) == set()
    assert mesh["total"]["largest"] <= 1e-6 * mesh["diagonal"]


def plant(cause, obj, rig):
    """Returns options of the command."""
    if cause == "method":
        return {"method": "dq"}
    if cause == "influences":
        return {"options": ("--influences", "1")}
    if cause == "modifiers":
        modifier = obj.modifiers.new("Smooth", "SMOOTH")
        modifier.iterations = 5
    elif cause == "shear_scale":
        rig.data.bones[1].inherit_scale = "NONE"
        scenes.key(rig.pose.bones[0], "scale", ((1, (1, 1, 1)), (11, (1.1, 1.5, 0.7))))
    elif cause == "transforms":
        scenes.key(obj, "location", ((1, (0, 0, 0)), (11, (0.1, 0.2, 0.0))))
    elif cause == "pose":
        rig.animation_data_clear()
        rig.pose.bones[1].rotation_mode = "XYZ"
        rig.pose.bones[1].rotation_euler = (0.4, 0.2, 0.7)
    elif cause == "shape_keys":
        # Exporters write all of a key, whatever group limits it to.
        scenes.key_shape(obj, (1.0, 1.0, 1.5))
        obj.data.shape_keys.key_blocks["Key"].vertex_group = "bone.1"
    return {}


@pytest.mark.parametrize(
    "cause", [c for c in CAUSES if c not in ("bendy", "several", "sampling", "actions", "rest")]
)
def test_each_cause_alone(scene, tmp_path, cause):
    planted = plant(cause, *scene)
    mesh = exported(tmp_path, *planted.get("options", ()), method=planted.get("method", "lbs"))
    assert found_causes(mesh) == {cause}
    distance = mesh["causes"][cause]["largest"]
    assert distance > 1e-3 * mesh["diagonal"]
    assert np.isclose(distance, mesh["total"]["largest"], rtol=1e-3)
    assert np.isclose(mesh["causes"][cause]["mean"], mesh["total"]["mean"], rtol=1e-3)


def test_several_armature_modifiers(scene, tmp_path):
    """The file has the first; a .glb lacks Sinew's data, which is an error."""
    obj, rig = scene
    second = obj.modifiers.new("Second", "ARMATURE")
    second.object, second.vertex_group = rig, "bone.1"
    scenes.save(tmp_path / "arm.blend")
    words = ("export", tmp_path / "arm.blend", "--method", "lbs", "--verify", "--json", "--out")
    said = json.loads(run_sinew(*words, tmp_path / "arm.glb", status=1).stdout)
    (mesh,) = said["meshes"]
    assert found_causes(mesh) == {"several"}
    assert mesh["causes"]["several"]["largest"] > 0.05 * mesh["diagonal"]
    assert mesh["explained"]
    assert ["several Armature modifiers" in error for error in said["errors"]] == [True]


@pytest.mark.parametrize("ending", [".glb", ".usdc", ".fbx"])
@pytest.mark.parametrize("mode", ["NONE", "FULL"])
def test_unequal_scale(scene, tmp_path, ending, mode):
    """The bone below is named, unless its Inherit Scale is Full, which is exact."""
    skip_without_reader(ending)
    _obj, rig = scene
    rig.data.bones[2].inherit_scale = mode
    scenes.key(rig.pose.bones[1], "scale", ((1, (1.0, 1.75, 0.5)), (11, (1.0, 1.75, 0.5))))
    mesh = exported(tmp_path, ending=ending)
    assert found_causes(mesh) == (set() if mode == "FULL" else {"shear_scale"})
    assert mesh["explained"]
    assert mesh["names"].get("shear_scale") == (None if mode == "FULL" else "bone.2")


@pytest.mark.parametrize("ending", [".glb", ".usdc", ".fbx"])
def test_a_mesh_that_is_not_the_armatures_child(scene, tmp_path, ending):
    """As the armature object moves, the mesh stays in Blender, and moves in the file."""
    skip_without_reader(ending)
    obj, rig = scene
    obj.parent = None
    scenes.key(rig, "location", ((1, (0, 0, 0)), (11, (0, 0, 3))))
    mesh = exported(tmp_path, ending=ending)
    assert found_causes(mesh) == {"transforms"}
    assert mesh["names"]["transforms"] == "Arm Rig"
    assert np.isclose(mesh["causes"]["transforms"]["largest"], mesh["total"]["largest"], rtol=1e-3)


@pytest.mark.parametrize("ending", [".glb", ".fbx"])
def test_what_moves_is_read_where_the_exporter_reads_it(scene, tmp_path, ending):
    """glTF's exporter is at frame 0; FBX has the action for each armature that could play it."""
    skip_without_reader(ending)
    _obj, rig = scene
    scenes.key(rig, "location", ((0, (0.3, -0.4, 0.2)), (11, (0.5, 0.1, 0.2))))
    scenes.copied(rig, "Z", linked=True).animation_data_clear()
    bpy.context.scene.frame_set(6)
    assert found_causes(exported(tmp_path, ending=ending)) == set()


def test_other_actions_of_fbx(scene, tmp_path):
    """One that keys what the current one does not; another comes from the current one alone."""
    skip_without_reader(".fbx")
    _obj, rig = scene
    constraint = rig.pose.bones[2].constraints.new("COPY_ROTATION")
    constraint.target, constraint.subtarget, constraint.mix_mode = rig, rig.pose.bones[1].name, "BEFORE"
    current = rig.animation_data.action
    rig.animation_data.action = before = bpy.data.actions.new("A")
    before.use_fake_user = True
    scenes.key(constraint, "influence", ((1, 1.0), (11, 1.0)))
    rig.animation_data.action = current
    constraint.influence = 0.0
    mesh = exported(tmp_path, ending=".fbx")
    assert found_causes(mesh) == {"actions"}
    assert np.isclose(mesh["causes"]["actions"]["largest"], mesh["total"]["largest"], rtol=1e-3)
    assert mesh["total"]["largest"] > 0.01 * mesh["diagonal"]


def test_without_weights(scene, tmp_path):
    obj, _rig = scene
    obj.vertex_groups.clear()
    scenes.save(tmp_path / "arm.blend")
    words = ("export", tmp_path / "arm.blend", "--method", "lbs", "--verify", "--out", tmp_path / "arm.glb")
    assert "without a skin, as no vertex has a weight" in run_sinew(*words, status=1).stderr


def make_human():
    """At each bone of the add-on's own armature a triangle, which the bone and the one above move."""
    bpy.ops.icyp.make_basic_armature()
    rig = bpy.context.object
    points = [bone.head_local + corner for bone in rig.data.bones for corner in 0.1 * Matrix.Identity(3)]
    mesh = bpy.data.meshes.new("Human")
    mesh.from_pydata(points, [], np.arange(len(points)).reshape(-1, 3).tolist())
    obj = scenes.added("Human", mesh)
    obj.parent = rig
    obj.modifiers.new("Armature", "ARMATURE").object = rig
    for number, bone in enumerate(rig.data.bones):
        group = obj.vertex_groups.get(bone.name) or obj.vertex_groups.new(name=bone.name)
        group.add([3 * number, 3 * number + 1], 1.0, "REPLACE")
        if bone.parent is not None:
            obj.vertex_groups[bone.parent.name].add([3 * number + 1, 3 * number + 2], 0.5, "REPLACE")
    for number, name in enumerate(("spine", "head", "upper_arm.L", "lower_arm.L", "lower_leg.R")):
        rig.pose.bones[name].rotation_mode = "XYZ"
        scenes.key(rig.pose.bones[name], "rotation_euler", ((1, (0, 0, 0)), (11, (0.4, 0.2 * number, 0.5))))
    rig.location, rig.rotation_euler = (0.3, -0.4, 0.2), (0.0, 0.0, 0.6)
    bpy.context.scene.frame_end = 11
    return obj, rig


@pytest.mark.parametrize("version", ["0.0", "1.0"])
def test_vrm(empty_file, tmp_path, version):
    """In the poses of the scene's bones, about the file's joints, with the scene's shape keys."""
    out, file = tmp_path / "human.vrm", tmp_path / "human.blend"
    words = ("export", file, "--method", "lbs", "--out", out, "--verify", "--json")
    if find_spec("io_scene_vrm") is None:
        scenes.make_arm()
        scenes.save(file)
        assert "the add-on VRM Format, which is not installed" in run_sinew(*words, status=1).stderr
        assert not out.exists()
        pytest.skip("the VRM add-on is not installed: pip install bpy-vrm-format")
    addon_utils.enable("io_scene_vrm", default_set=True)
    try:
        obj, rig = make_human()
        scenes.key_shape(obj)
        rig.data.vrm_addon_extension.spec_version = version
        scenes.save(file)
    finally:
        # Blender would wait for it at the end of Python.
        addon_utils.disable("io_scene_vrm", default_set=True)
    (mesh,) = json.loads(run_sinew(*words).stdout)["meshes"]
    assert found_causes(mesh) == set()
    assert mesh["total"]["largest"] <= 1e-5 * mesh["diagonal"]
    (found,) = played.read_gltf(out, [], 24.0)
    assert ("VRM" in played.GltfFile(out).header["extensions"]) == (version == "0.0")
    assert set(found.joints) >= {bone.name for bone in rig.data.bones}


def test_the_panel_exports_and_verifies(scene, tmp_path):
    """As the command does; the open file stays as it is."""
    obj, _rig = scene
    of_command = exported(tmp_path, method="dq")
    obj = bpy.context.scene.objects["Arm"]
    scenes.add_sinew(obj, "dq")
    before = [(modifier.name, modifier.type) for modifier in obj.modifiers]
    with pytest.raises(RuntimeError, match="is there already"):
        bpy.ops.sinew.export(kind=".glb", verify=True)
    assert bpy.ops.sinew.export(kind=".glb", verify=True, overwrite=True) == {"FINISHED"}
    assert [(modifier.name, modifier.type) for modifier in obj.modifiers] == before
    basis, (check,) = feature.results[bpy.context.scene.session_uid]
    assert basis.changes(bpy.context.scene, [obj]) == []
    obj.sinew.delta_mush.enabled = True
    assert basis.changes(bpy.context.scene, [obj]) == ["stages"]
    obj.sinew.delta_mush.enabled = False
    assert {**asdict(check), "explained": True} == of_command
    assert feature.SINEW_PT_verified.poll(bpy.context)
    assert bpy.ops.sinew.export(kind=".glb", overwrite=True) == {"FINISHED"}
    assert not feature.SINEW_PT_verified.poll(bpy.context)
    assert {path.suffix for path in tmp_path.iterdir()} <= {".blend", ".blend1", ".glb"}


def test_the_panels_export_that_is_stopped_leaves_nothing(scene, tmp_path):
    obj, _rig = scene
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_end = 3000
    scenes.save(tmp_path / "arm.blend")
    before = sorted(tmp_path.iterdir())
    task = {"command": "write", "objects": [obj.name], "options": {"verify": True}}
    shares = bake_apart.follow(task, tmp_path / "arm.glb")
    next(share for share in shares if share > 0.0)
    (child,) = program.own_children()
    shares.close()
    assert not child.is_running()
    assert sorted(tmp_path.iterdir()) == before


def test_shape_keys_along_bendy_bones(empty_file, tmp_path):
    obj = make_bendy(unequal=False)
    scenes.key_shape(obj, (0.9, 1.0, 1.0))
    # The weights are those of the scene's first frame, whatever is compared.
    mesh = exported(tmp_path, "--frames", "6,11")
    assert found_causes(mesh) == {"bendy"}
    assert np.isclose(mesh["causes"]["bendy"]["largest"], mesh["total"]["largest"], rtol=1e-3)


def test_envelopes(scene, tmp_path):
    """Files have the weights of groups alone."""
    obj, rig = scene
    obj.modifiers["Armature"].use_bone_envelopes = True
    for group in list(obj.vertex_groups)[1:]:
        group.remove([vertex.index for vertex in obj.data.vertices if vertex.co.x > 2.2])
    for bone in rig.data.bones:
        bone.envelope_distance = 0.6
    mesh = exported(tmp_path)
    assert found_causes(mesh) == {"influences"}
    assert mesh["causes"]["influences"]["largest"] > 1e-2 * mesh["diagonal"]


@pytest.mark.parametrize("multiplied", [False, True])
def test_envelopes_of_bendy_bones(empty_file, tmp_path, multiplied):
    """The weights of the plain bones have the envelopes in them."""
    obj = make_bendy(unequal=False)
    rig = obj.parent
    obj.modifiers["Armature"].use_bone_envelopes = not multiplied
    for group in list(obj.vertex_groups)[1:] if not multiplied else ():
        group.remove([vertex.index for vertex in obj.data.vertices if vertex.co.x > 2.2])
    for bone in rig.data.bones:
        bone.envelope_distance, bone.use_envelope_multiply = 0.6, multiplied
        bone.head_radius = bone.tail_radius = 0.1
    rig.data.bones[0].bbone_segments = 1
    assert not found_causes(exported(tmp_path, "--influences", "16"))


def test_normals(empty_file, tmp_path):
    """A tube along a bone that is scaled across: its faces' normals are at odd multiples of 15 degrees."""
    _obj, rig = scenes.make_arm(bones=1)
    scenes.key(rig.pose.bones[0], "scale", ((1, (1.0, 1.0, 1.0)), (11, (2.0, 1.0, 1.0))))
    mesh = exported(tmp_path)
    across = np.radians(np.arange(15, 360, 30))
    skinned, shown = (np.arctan2(np.sin(across), s * np.cos(across)) for s in (2.0, 0.5))
    angles = np.degrees(np.abs(np.angle(np.exp(1j * (skinned - shown)))))
    assert np.isclose(mesh["normals"]["largest"], angles.max(), rtol=1e-3)
    mesh = exported(tmp_path, "--frames", "1")
    assert mesh["normals"]["largest"] < 0.05


@pytest.mark.slow
def test_half_floats_of_usd(empty_file, tmp_path):
    skip_without_reader(".usdc")
    make_bendy()
    mesh = exported(tmp_path, ending=".usdc")
    assert found_causes(mesh) == {"shear_scale"}
    assert mesh["explained"]


@pytest.mark.parametrize("scales", [(1.0, 1.008), (0.02, 0.029), (1.0, 1.1)])
def test_slow_scales_of_usd(scene, tmp_path, scales):
    """Exact but for half floats, 2**-12 of a number at most; before 4.4 a sentence says what is lost."""
    _obj, rig = scene
    scenes.key(rig.pose.bones[1], "scale", [(1, (scales[0],) * 3), (100, (scales[1],) * 3)])
    bpy.context.scene.frame_end = 100
    if bpy.app.version >= (4, 4, 0):
        mesh = exported(tmp_path, ending=".usdc")
        assert found_causes(mesh) == {"shear_scale"}
        assert mesh["total"]["largest"] < 2**-11 * scales[1] * mesh["diagonal"]
    else:
        scenes.save(tmp_path / "arm.blend")
        words = ("export", tmp_path / "arm.blend", "--method", "lbs", "--out", tmp_path / "arm.usdc")
        assert "bones' scales are up to 0.0" in run_sinew(*words, status=1).stderr


def test_between_frames(scene, tmp_path):
    """The distance in the middle between frames is that of Blender's shape from the file's."""
    obj, rig = scene
    mesh = exported(tmp_path)
    sampled = mesh["causes"]["sampling"]["largest"]
    middles = [frame + 0.5 for frame in FRAMES[:-1]]
    name = rig.animation_data.action.name
    rate = bpy.context.scene.render.fps
    expected = scenes.world_shapes(obj, middles)
    rest, shapes = other_gltf.points_at(tmp_path / "arm.glb", np.array(middles) / rate, name)
    distances, vertices = cKDTree(world_rest(obj)).query(rest)
    assert distances.max() <= 1e-6
    assert np.isclose(np.linalg.norm(shapes - expected[:, vertices], axis=2).max(), sampled, rtol=1e-4)


@pytest.mark.slow
def test_the_limit_of_the_user(scene, tmp_path):
    exported(tmp_path, "--at-most", "50", method="dq")
    exported(tmp_path, "--at-most", "0.1", method="dq", status=1)


@pytest.mark.parametrize(("method", "scale"), [("dq", -1.0), ("dq", 1.0), ("lbs", -1.0)])
def test_a_mirrored_bone_in_usd(scene, tmp_path, method, scale):
    _obj, rig = scene
    scenes.key(rig.pose.bones[2], "scale", [(1, (scale, 1.0, 1.0))])
    scenes.save(tmp_path / "arm.blend")
    words = ("export", tmp_path / "arm.blend", "--method", method, "--out", tmp_path / "a.usdc")
    said = "are mirrored, such as bone.2" in run_sinew(*words).stderr
    assert said == (method == "dq" and scale < 0.0)


def test_two_bones_of_one_name_in_usd(scene, tmp_path):
    """The exporter would write a skeleton that nobody can read, and say nothing."""
    _obj, armature = scene
    armature.data.bones[0].name, armature.data.bones[1].name = "arm.L", "arm_L"
    scenes.save(tmp_path / "arm.blend")
    words = ("export", tmp_path / "arm.blend", "--method", "lbs", "--out")
    # Of different parents, their paths differ.
    run_sinew(*words, tmp_path / "arm.usdc")
    (tmp_path / "arm.usdc").unlink()
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones["arm_L"].parent = None
    bpy.ops.object.mode_set(mode="OBJECT")
    scenes.save(tmp_path / "arm.blend")
    said = program.complaint(run_sinew(*words, tmp_path / "arm.usdc", status=1).stderr)
    assert said.endswith("rename one")
    assert "arm.L and arm_L" in said
    assert not (tmp_path / "arm.usdc").exists()
    run_sinew(*words, tmp_path / "arm.glb")


def test_more_than_four_influences(scene, tmp_path):
    scenes.save(tmp_path / "arm.blend")
    words = ("export", tmp_path / "arm.blend", "--method", "lbs", "--out")
    said = run_sinew(*words, tmp_path / "a.glb", "--influences", "8").stderr
    assert "Blender, Godot play more than four influences; F3D, panda3d, " in said
    assert "more than four" not in run_sinew(*words, tmp_path / "b.glb").stderr
    assert "more than four" not in run_sinew(*words, tmp_path / "c.usdc", "--influences", "8").stderr


def test_sentences(scene, tmp_path):
    file, out = tmp_path / "arm.blend", tmp_path / "a.glb"
    scenes.save(file)
    command = ("export", file, "--method", "dq", "--out", out, "--frames", "1,6,11")
    first, second, *others = run_sinew(*command, "--verify").stdout.splitlines()
    assert first.startswith("Arm: the file plays 0.")
    assert second.endswith(CAUSES["method"])
    assert others[0].endswith("normals, which engines skin as they were at rest")
    assert others[1:] == [str(out)]
    assert "--frames and --at-most go with --verify" in run_sinew(*command, status=2).stderr


def test_a_changed_file_has_a_difference_without_a_cause(scene, tmp_path):
    obj, _rig = scene
    scenes.add_sinew(obj, "lbs")
    recording = verify.Recording([obj], [1, 6, 11], [], 4, ".glb", lambda _share: None)
    path = tmp_path / "a.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), export_influence_nb=4)
    (check,) = recording.verify(path, {})
    assert check.is_explained
    file = played.GltfFile(path)
    number = file.header["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    view = file.header["bufferViews"][file.header["accessors"][number]["bufferView"]]
    data = bytearray(path.read_bytes())
    start = 28 + struct.unpack("<I", data[12:16])[0] + view.get("byteOffset", 0)
    assert np.frombuffer(data, "<f4", 4, start).sum() == 1.0
    # The first vertex, of the first bone, is given half to another joint.
    data[start : start + 16] = struct.pack("<4f", 0.5, 0.5, 0.0, 0.0)
    joints = file.header["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"]
    view = file.header["bufferViews"][file.header["accessors"][joints]["bufferView"]]
    at = 28 + struct.unpack("<I", data[12:16])[0] + view.get("byteOffset", 0)
    assert file.header["accessors"][joints]["componentType"] == 5121
    data[at : at + 4] = bytes([0, 2, 0, 0])
    path.write_bytes(data)
    (check,) = recording.verify(path, {})
    assert not check.is_explained
    assert check.causes["rest"].largest == check.total.largest > 1e-2 * check.diagonal


def test_the_reader_plays_as_others_do(scene, tmp_path):
    """With shape keys, between frames."""
    obj, rig = scene
    scenes.key_shape(obj)
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "a.glb"))
    names = {rig.animation_data.action.name}
    rate = bpy.context.scene.render.fps
    (mesh,) = played.read_gltf(tmp_path / "a.glb", names, rate)
    times = np.array([1.0, 3.3, 7.5, 11.0])
    _rest, expected = other_gltf.points_at(tmp_path / "a.glb", times / rate, *names)
    for time, shape in zip(times, expected, strict=True):
        found = played.blended(mesh.slots, mesh.weights, mesh.motions(time), mesh.rest)
        assert scenes.worst(found, shape) < 1e-6
    assert mesh.targets.shape[0] == 1
