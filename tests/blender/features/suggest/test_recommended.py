# SPDX-License-Identifier: GPL-3.0-or-later
"""The preset Recommended: it finds what a constructed case needs, sets only that, and leaves all else."""

from __future__ import annotations

import json
import math
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from conftest import REPOSITORY
from program import run_sinew
from sinew_addon.attach import properties, stage_settings
from sinew_addon.base.steps import result_of
from sinew_addon.deform import characters
from sinew_addon.features.measure import battery
from sinew_addon.features.suggest import recommend
from sinew_addon.io import armature_io
from sinew_addon.skinning.variants import parse
from whole_file import assert_same, content

pytestmark = pytest.mark.long_term

OTHER_SIGNS = "hierarchy"


def arm(degrees: float, axis: int, **options: object) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A tube whose second bone rotates about one of its axes, up to frame 11; deformed by linear blending."""
    obj, armature = scenes.make_arm(**options)
    armature.animation_data_clear()
    bone = armature.pose.bones[1]
    bone.rotation_mode, bone.location = "XYZ", (0.0, 0.0, 0.0)
    bone.rotation_quaternion = (1.0, 0.0, 0.0, 0.0)
    angles = np.zeros(3)
    angles[axis] = math.radians(degrees)
    scenes.key(bone, "rotation_euler", ((1, (0.0, 0.0, 0.0)), (11, tuple(angles))))
    scenes.add_sinew(obj, "lbs")
    return obj, armature


def stored_in(path: Path) -> bpy.types.PropertyGroup:
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return properties.of(bpy.data.objects["Arm"])


def stages_on(obj: bpy.types.Object) -> list[str]:
    return stage_settings.names_on(properties.of(obj))


def test_a_twisted_limb_gets_twist_spread():
    obj, _armature = arm(150.0, axis=1, sides=16, rings=41)
    assert bpy.ops.sinew.recommend() == {"FINISHED"}
    assert "twist_spread" in stages_on(obj)
    bpy.context.scene.frame_set(11)
    # The tube keeps its radius.
    radii = np.linalg.norm(scenes.final_points(obj)[:, 1:], axis=1)
    assert radii.min() > 0.8 * 0.25


def test_an_elbow_that_would_bulge_does_not():
    obj, _armature = arm(130.0, axis=0, sides=24, rings=61)
    for vertex, point in enumerate(scenes.rest_points(obj)):
        share = min(max((point[0] - 0.7) / 0.6, 0.0), 1.0)
        weight = share * share * (3.0 - 2.0 * share)
        for group, value in zip(obj.vertex_groups, (1.0 - weight, weight), strict=True):
            group.add([vertex], value, "REPLACE")
    bpy.ops.sinew.rebind()
    bpy.context.scene.frame_set(11)

    def of_limbs(name: str) -> float:
        return float(np.max(scenes.measure(obj).measured.by_limb()[name]))

    lost = of_limbs("volume")
    properties.of(obj).method = "dq"
    swollen = of_limbs("bulge")
    bpy.ops.sinew.recommend()
    assert "twist_spread" not in stages_on(obj)
    assert of_limbs("bulge") < 0.5 * swollen
    assert of_limbs("volume") < 0.5 * lost


def test_a_shoulder_that_linear_blending_collapses_does_not():
    bpy.ops.wm.open_mainfile(filepath=str(REPOSITORY / "blend_files/shoulder.blend"))
    (obj,) = (each for each in bpy.data.objects if each.type == "MESH")
    scenes.add_sinew(obj, "lbs")
    assert bpy.ops.sinew.recommend() == {"FINISHED"}
    assert properties.of(obj).method != "lbs"


def test_crude_weights_get_delta_mush_and_painted_ones_do_not():
    crude, _armature = arm(90.0, axis=0, sides=16, rings=41, weights="rigid", name="Crude")
    bpy.ops.sinew.recommend()
    assert "delta_mush" in stages_on(crude)
    scenes.bpy.data.objects.remove(crude)
    painted, _armature = arm(90.0, axis=0, sides=16, rings=41, name="Painted")
    bpy.ops.sinew.recommend()
    assert "delta_mush" not in stages_on(painted)


def test_without_an_action_poses_are_measured_and_the_file_stays(monkeypatch):
    obj, armature = arm(0.0, axis=0)
    armature.animation_data_clear()
    armature.pose.bones[1].rotation_euler = (0.1, 0.2, 0.0)
    bpy.context.scene.frame_set(7)
    bpy.context.view_layer.update()
    posed = []
    monkeypatch.setattr(
        recommend.battery, "posed", lambda *args, own=battery.posed: posed.append(args[1].name) or own(*args)
    )
    before, shape = content(), scenes.final_points(obj)
    shares: list[float] = []
    choice = result_of(recommend.search(bpy.context.scene, [obj]), shares.append)
    assert_same(before)
    np.testing.assert_array_equal(scenes.final_points(obj), shape)
    assert {"Swing X 1", "Twist 1"} <= set(posed)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    # These poses bend and twist it.
    assert choice.variant.method != "lbs"


def test_add_takes_it_as_a_choice():
    obj, armature = scenes.make_arm(sides=16, rings=41)
    bpy.ops.sinew.add(method="RECOMMENDED")
    assert properties.has_sinew(obj)
    assert (properties.of(obj).method, stages_on(obj)) != ("lbs", [])
    assert armature.animation_data.action is not None


@pytest.fixture
def with_own_signs():
    """An arm that gets dq, with a parameter of dq that differs from its default."""
    obj, _armature = arm(150.0, axis=0, sides=16, rings=41)
    properties.of(obj).dq.signs = OTHER_SIGNS
    return obj


def test_parameters_of_the_method_stay(with_own_signs, tmp_path):
    obj, path = with_own_signs, scenes.save(tmp_path / "arm.blend")
    bpy.ops.sinew.recommend()
    settings = properties.of(obj)
    assert (settings.method, settings.dq.signs) == ("dq", OTHER_SIGNS)
    options = ("--frames", "none", "--no-pictures")
    run_sinew("reskin", path, "--out", tmp_path / "out", "--preset", "recommended", *options)
    settings = stored_in(tmp_path / "out" / "arm.blend")
    assert (settings.method, settings.dq.signs) == ("dq", OTHER_SIGNS)


def test_a_comparison_of_variants_has_the_parameters_of_the_method(with_own_signs):
    """Another variant of the same method takes nothing from what is chosen."""
    obj = with_own_signs
    whole = {name: {obj: parse(name)} for name in ("recommended", "dq")}
    chosen = characters.with_presets(whole["recommended"])[obj]
    assert (chosen.method, dict(chosen.values)["dq.signs"]) == ("dq", OTHER_SIGNS)
    assert characters.with_presets(whole["dq"])[obj] == parse("dq")
    with characters.kept_choices([obj], ["recommended"], {"A=dq": whole["dq"]}):
        for name, signs in (("A=dq", "blender"), ("recommended", OTHER_SIGNS)):
            characters.use_method_on([obj], name)
            assert (properties.of(obj).method, properties.of(obj).dq.signs) == ("dq", signs)


def test_limits_are_read_as_armatures_have_them():
    _obj, armature = scenes.make_arm()
    bone = armature.pose.bones[1]
    bone.use_ik_limit_x, bone.ik_min_x, bone.ik_max_x = True, -0.5, 2.0
    bone.lock_ik_y = True
    limit = armature.pose.bones[0].constraints.new("LIMIT_ROTATION")
    limit.owner_space, limit.use_limit_z, limit.max_z = "LOCAL", True, 1.0
    limits = armature_io.read_limits(armature)
    np.testing.assert_allclose(limits["bone.1"][:2], [[-0.5, 2.0], [0.0, 0.0]], atol=1e-6)
    np.testing.assert_allclose(limits["bone.0"][2], [0.0, 1.0], atol=1e-6)
    assert np.isnan([limits["bone.1"][2], limits["bone.0"][0]]).all()


def test_commands_take_the_preset(tmp_path):
    obj, _armature = arm(150.0, axis=1, sides=16, rings=41)
    path = scenes.save(tmp_path / "arm.blend")
    options = ("--frames", "11", "--out", tmp_path / "arm.npz")
    assert "Twist Spread" in run_sinew("points", path, "--preset", "recommended", *options).stderr
    bpy.ops.sinew.recommend()
    bpy.context.scene.frame_set(11)
    with np.load(tmp_path / "arm.npz") as points:
        np.testing.assert_allclose(points["Arm"][0], scenes.final_points(obj), atol=1e-6)


def test_a_batch_stores_what_it_chose_and_set_overrides_it(tmp_path):
    arm(150.0, axis=1, sides=16, rings=41)
    path = scenes.save(tmp_path / "arm.blend")
    options = ("--preset", "recommended", "--set", "twist_spread.amount=0.5", "--frames", "none")
    run_sinew("reskin", path, "--out", tmp_path / "out", *options, "--no-pictures")
    settings = stored_in(tmp_path / "out" / "arm.blend")
    assert settings.twist_spread.enabled
    assert settings.twist_spread.amount == 0.5
    job = tmp_path / "job.toml"
    job.write_text('inputs = "arm.blend"\nout = "other"\nmethod = "recommended"\n', encoding="utf-8")
    run_sinew("reskin", "--job", job, "--frames", "none", "--no-pictures")
    assert stored_in(tmp_path / "other" / "arm.blend").twist_spread.enabled


@pytest.mark.once
def test_methods_lists_it_and_both_are_refused(tmp_path):
    presets = json.loads(run_sinew("methods", "--json").stdout)["presets"]
    assert [preset["name"] for preset in presets] == ["recommended"]
    both = ("--method", "dq", "--preset", "recommended")
    result = run_sinew("points", "a.blend", *both, "--frames", "1", "--out", tmp_path / "a.npz", status=2)
    assert "not allowed with" in result.stderr
