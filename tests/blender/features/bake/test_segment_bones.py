# SPDX-License-Identifier: GPL-3.0-or-later
"""Bendy bones as plain ones: exported files, read by others than Blender, have the shapes of the Armature
modifier with the bendy bones, and what is not exact is reported."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import other_gltf
import pytest
import read_glb
import scenes
from pygltflib import GLTF2
from scipy.spatial import cKDTree
from sinew_addon import cli
from sinew_addon.features.bake import bake, bake_bones
from sinew_addon.features.bake.helper_bones import HelperOptions
from sinew_addon.features.gltf import export

pytestmark = pytest.mark.outer_versions

FRAMES = list(range(1, 12))
# Of the diagonal.
EXACT = 1e-6


@pytest.fixture
def bendy(empty_file):
    return make_bendy


def make_bendy(curved=False, bent=True, unequal=True):
    """An arm of three bendy bones that bend, twist and grow; with `bent` not set, they only twist."""
    obj, rig = scenes.placed_arm()
    for bone in rig.data.bones:
        bone.bbone_segments, bone.bbone_mapping_mode = 6, "CURVED" if curved else "STRAIGHT"
        if curved:
            bone.bbone_curveinx, bone.bbone_curveoutz, bone.bbone_rollin = 0.3, 0.2, 0.4
    for bone in rig.pose.bones:
        scenes.key(bone, "bbone_rollout", ((1, 0.0), (11, 0.6)))
        if bent:
            bone.bbone_curveinx, bone.bbone_scalein = 0.2, (1.2, 0.9, 1.1)
    if not bent:
        rig.animation_data.action = None
        for bone in rig.pose.bones:
            bone.matrix_basis.identity()
            scenes.key(bone, "bbone_rollout", ((1, 0.0), (11, 0.6)))
    if unequal:
        # At the end of the chain, so that no child is sheared.
        scenes.key(rig.pose.bones[2], "scale", ((1, (1.0, 1.0, 1.0)), (11, (1.1, 1.3, 0.9))))
    bpy.context.view_layer.update()
    return obj


def baked(obj, method="lbs", frames=FRAMES, **options):
    """The report of a bake into the open file."""
    scenes.add_sinew(obj, method)
    started = bake.start([obj], "bones", frames, Path("arm.blend"), False, HelperOptions(**options))
    list(started.sample())
    started.place()
    (report,) = started.reports
    return report


def size_of(shapes):
    return np.linalg.norm(np.ptp(shapes[0], axis=0))


def assert_plays(read, expected, rest, tolerance=EXACT):
    """read: rest points, and points at the frames, of vertices that may be split at seams."""
    read_rest, played = read
    distances, vertices = cKDTree(rest).query(read_rest)
    assert distances.max() <= EXACT * size_of(expected)
    assert set(vertices) == set(range(len(rest)))
    distances = np.linalg.norm(played - expected[:, vertices], axis=2)
    assert distances.max() <= tolerance * size_of(expected)
    return distances.max()


def world_rest(obj):
    return np.array([obj.matrix_world @ vertex.co for vertex in obj.data.vertices])


def played_gltf(path, action=None):
    names = [each.name for each in GLTF2().load(str(path)).animations]
    name = action or next((n for n in names if n.endswith("Helpers")), names[0])
    return other_gltf.points_at(path, np.array(FRAMES) / bpy.context.scene.render.fps, name)


SLOW = {"marks": pytest.mark.slow}


@pytest.mark.parametrize(
    ("curved", "motion"),
    [
        (False, "keys"),
        (True, "pose"),
        pytest.param(False, "pose", **SLOW),
        pytest.param(True, "keys", **SLOW),
    ],
)
def test_gltf_has_the_armature_modifiers_shape(bendy, tmp_path, curved, motion):
    obj = bendy(curved)
    expected, rest = scenes.world_shapes(obj, FRAMES), world_rest(obj)
    report = baked(obj, motion=motion)
    assert report.helpers == 0
    assert (report.segments.bendy, report.segments.bones) == (3, 21)
    for cause in ("method", "sliding", "shear", "cut"):
        assert getattr(report.segments, cause) <= EXACT * report.diagonal
    assert np.abs(scenes.world_shapes(obj, FRAMES) - expected).max() <= EXACT * size_of(expected)
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "a.glb"))
    assert_plays(played_gltf(tmp_path / "a.glb"), expected, rest)
    assert scenes.worst(expected[0], expected[-1]) > 0.1


@pytest.mark.skipif(bpy.app.version < (4, 4, 0), reason="pxr is not for others' scripts")
@pytest.mark.parametrize("bent", [False, True])
def test_usd_has_it_too(bendy, tmp_path, bent):
    """UsdSkel stores scales as half floats: joints that only twist are exact."""
    import other_usd

    obj = bendy(curved=False, bent=bent, unequal=bent)
    expected, rest = scenes.world_shapes(obj, FRAMES), world_rest(obj)
    baked(obj)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = FRAMES[0], FRAMES[-1]
    bpy.ops.wm.usd_export(
        filepath=str(tmp_path / "a.usdc"),
        export_animation=True,
        export_armatures=True,
        only_deform_bones=False,
    )
    read = other_usd.points_at(tmp_path / "a.usdc", FRAMES)
    worst = assert_plays(read, expected, rest, 1e-3 if bent else EXACT)
    assert (worst > EXACT * size_of(expected)) == bent


def test_bendy_bones_play_other_animation(bendy, tmp_path):
    """Those that follow the joints."""
    obj = bendy(curved=True)
    rig = obj.parent
    action, slot = rig.animation_data.action, getattr(rig.animation_data, "action_slot", None)
    rig.animation_data.action = None
    for number, bone in enumerate(rig.pose.bones):
        bone.matrix_basis.identity()
        scenes.key(
            bone, "rotation_quaternion", ((1, (1, 0, 0, 0)), (11, (0.8, 0.6 - 0.2 * number, 0.2, 0.3)))
        )
    other = rig.animation_data.action
    expected, rest = scenes.world_shapes(obj, FRAMES), world_rest(obj)
    rig.animation_data.action = action
    if slot is not None:
        rig.animation_data.action_slot = slot
    baked(obj, motion="pose")
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "a.glb"))
    assert_plays(played_gltf(tmp_path / "a.glb", action=other.name), expected, rest)


CAUSES = ("method", "sliding", "shear", "cut")


@pytest.mark.parametrize("cause", CAUSES)
def test_what_is_not_exact_is_reported(bendy, tmp_path, cause):
    """Each cause alone. Its distance is that of Blender's shapes with it and without, or of a file's."""
    obj, rest, options = bendy(unequal=False), None, {"influences": 8, "method": "lbs"}
    modifier = obj.modifiers["Armature"]
    if cause == "method":
        linear = scenes.world_shapes(obj, FRAMES)
        options["method"], modifier.use_deform_preserve_volume = "dq", True
    elif cause == "sliding":
        scenes.key_shape(obj, (0.9, 1.0, 1.0))
    elif cause == "shear":
        scenes.key(obj.parent.pose.bones[0], "scale", ((1, (1, 1, 1)), (11, (1.1, 1.4, 0.8))))
        rest = world_rest(obj)
    else:
        options["influences"] = 2
    expected = scenes.world_shapes(obj, FRAMES)
    scenes.add_sinew(obj, options["method"])
    (report,), _names, kept = bake_bones.replace_bendy_bones([obj], FRAMES, options["influences"])
    assert kept == []
    obj.sinew.enabled = False
    if cause == "method":
        played = linear
    elif cause == "shear":
        bpy.ops.export_scene.gltf(filepath=str(tmp_path / "a.glb"))
        read_rest, played = played_gltf(tmp_path / "a.glb")
        expected = expected[:, cKDTree(rest).query(read_rest)[1]]
    else:
        if cause == "cut":
            bpy.context.view_layer.objects.active = obj
            bpy.ops.object.vertex_group_limit_total(group_select_mode="ALL", limit=2)
        played = scenes.world_shapes(obj, FRAMES)
    size, distance = size_of(expected), np.linalg.norm(played - expected, axis=2).max()
    found = {name: getattr(report, name) for name in CAUSES}
    assert distance > 1e-3 * size
    assert np.isclose(found.pop(cause), distance, rtol=1e-3)
    assert max(found.values()) <= EXACT * size, found
    assert f"{distance:.2g}" in report.sentence("m")


def test_bakes_of_what_is_not_exact_come_nearer(bendy):
    """Weights are solved again, and helper bones are added, as for other rigs."""
    obj = bendy()
    obj.modifiers["Armature"].use_deform_preserve_volume = True
    expected = scenes.world_shapes(obj, FRAMES)
    report = baked(obj, "dq", influences=8)
    assert report.helpers == 4
    rms = np.sqrt(np.square(scenes.world_shapes(obj, FRAMES) - expected).sum(axis=2).mean())
    assert np.isclose(rms, report.after.rms, rtol=1e-2)
    assert report.after.rms < 0.7 * report.before.rms
    assert report.segments.method > report.after.worst


@pytest.mark.parametrize("method", ["lbs", pytest.param("dq", **SLOW), pytest.param("cor", **SLOW)])
def test_the_command_exports_plain_bones(bendy, tmp_path, capfd, method):
    obj = bendy(curved=True)
    file, glb = tmp_path / "arm.blend", tmp_path / "arm.glb"
    scenes.save(file)
    rest = world_rest(obj)
    if method == "cor":
        scenes.add_sinew(obj, "cor")
    obj.modifiers["Armature"].use_deform_preserve_volume = method == "dq"
    expected = scenes.world_shapes(obj, FRAMES)
    assert cli.main(["export", str(file), "--method", method, "--out", str(glb)]) == 0
    assert "Arm Rig: 21 bones for 3 bendy ones" in capfd.readouterr().err
    if method == "lbs":
        assert_plays(played_gltf(glb), expected, rest)
        return
    times = np.array(FRAMES) / bpy.context.scene.render.fps
    (played,) = read_glb.points_at(glb, times).values()
    assert_plays((played[0], played), expected, expected[0], 1e-5)


def test_the_exporter_tells_of_bendy_bones(bendy, tmp_path):
    obj = bendy()
    scenes.add_sinew(obj, "lbs")
    _found, left_out = export.collect(bpy.context)
    assert left_out == [
        "Arm: exported without the bends of its bendy bones; run `sinew export`, or bake to bones first"
    ]
