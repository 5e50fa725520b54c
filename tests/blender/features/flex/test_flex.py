# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew flex`: planted faults are named at the right joint, good rigs pass, and nothing is changed."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from xml.etree import ElementTree

import bpy
import numpy as np
import planted
import pytest
import read_page
import scenes
from planted import HUMAN, PLANTS, Plant, Rig
from program import ran, run_sinew
from sinew_addon.attach import properties
from sinew_addon.base.steps import result_of
from sinew_addon.features.flex import flex
from sinew_addon.features.measure.limits import Table
from whole_file import assert_same, content

pytestmark = pytest.mark.long_term

ROOT = Path(__file__).resolve().parents[4]
OWN_RIGS = ("elbow", "shoulder", "wrist", "tentacle", "report_links", "report_mesh")
# Faults of different kinds; the others are found in the same way.
QUICK = ("a finger bleeds into the belly", "a hard knee", "rolled by 90 degrees")
# The fingers of human.blend have their bones outside of the skin: see docs/flex.md.
FINGERS = ("index", "middle", "ring", "pinky", "thumb")


def skinned(**options: object) -> bpy.types.Object:
    obj, armature = scenes.make_arm(**{"sides": 16, "rings": 41, **options})
    armature.animation_data_clear()
    return obj


@pytest.fixture(scope="module")
def of_human(real_rig) -> set[tuple[str, str]]:
    """What is found in human.blend as it is."""
    Rig.open(real_rig("human.blend"), HUMAN)
    return planted.found(planted.verdict())


@pytest.mark.parametrize(
    "plant",
    [
        pytest.param(each, id=each.name, marks=[] if each.name in QUICK else [pytest.mark.slow])
        for each in PLANTS
    ],
)
def test_a_planted_fault_is_named_at_its_joint(real_rig, of_human, plant: Plant):
    rig = Rig.open(real_rig("human.blend"), HUMAN)
    plant.plant(rig)
    if not plant.is_of_bones:
        rig.store()
    new = planted.found(planted.verdict()) - of_human
    wanted = {(rig.names[joint], name) for joint in plant.joints for name in plant.findings}
    assert new & wanted, new


@pytest.mark.parametrize("near", ["shin.L", "thigh.L"])
def test_what_a_stroke_causes_is_told_below_it(real_rig, of_human, near):
    """A stroke of the hand tears leg and arm: it comes first, and they have no advice of their own."""
    rig = Rig.open(real_rig("human.blend"), HUMAN)
    rig.give(rig.patch(near, 40), "hand.L", 0.4)
    rig.store()
    (first, others), *rest = planted.verdict().by_cause()
    assert (first.joint, first.limit.name) == ("hand_l", "bleed")
    assert {"calf_l", "lowerarm_l", "hand_l"} <= {each.joint for each in others}
    assert all("hand_l: Bleeding weights" in each.advice for each in others)
    assert {(own.joint, own.limit.name) for own, _others in rest} <= of_human


def test_no_limb_loses_more_than_its_volume(real_rig):
    rig = Rig.open(real_rig("human.blend"), HUMAN)
    rig.give(rig.patch("shin.L", 40), "hand.L", 0.4)
    rig.store()
    lost = [each.value for each in planted.verdict().findings if each.limit.name == "volume_loss"]
    assert lost
    assert max(lost) <= 1.0


def test_only_the_fingers_of_human_fail(of_human):
    assert {joint for joint, _name in of_human if not joint.startswith(FINGERS)} == set()
    assert {name for _joint, name in of_human} >= {"pivot"}


@pytest.mark.parametrize("name", ["CesiumMan.glb", "Fox.glb"])
def test_good_rigs_pass(real_rig, name):
    Rig.open(real_rig(name), {})
    assert planted.found(planted.verdict()) == set()


@pytest.mark.parametrize("name", OWN_RIGS)
def test_rigs_of_the_pictures_pass(name):
    Rig.open(ROOT / "blend_files" / f"{name}.blend", {})
    assert planted.found(planted.verdict()) == set()


def test_nothing_is_changed():
    obj = skinned()
    scenes.add_sinew(obj, "cor")
    properties.of(obj).delta_mush.enabled = True
    armature = properties.of(obj).armature
    armature.pose.bones[1].rotation_euler = (0.1, 0.2, 0.0)
    bpy.context.scene.frame_set(7)
    bpy.context.view_layer.update()
    before, shape = content(), scenes.final_points(obj)
    shares: list[float] = []
    verdict = result_of(flex.flex([obj], ["lbs"], Table(), {}), shares.append).verdict
    assert_same(before)
    np.testing.assert_array_equal(scenes.final_points(obj), shape)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert set(verdict.joints[1].values) == {"own", "lbs"}
    # The pose of now takes no part.
    steps = flex.flex([obj], ["lbs"], Table(), {})
    armature.pose.bones[1].rotation_euler = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    again, known = (each.joints[1].values["own"] for each in (result_of(steps).verdict, verdict))
    assert {name: value for name, (value, _pose) in again.items()} == pytest.approx(
        {name: value for name, (value, _pose) in known.items()}, abs=1e-5
    )


def test_the_command_says_what_is_wrong_where_and_what_mends_it(tmp_path):
    skinned()
    good = scenes.save(tmp_path / "good.blend")
    table = tmp_path / "table.toml"
    table.write_text('[joints]\nother = ["twist 170"]\n')
    limits = tmp_path / "limits.toml"
    limits.write_text("[limits]\nradius = 0.05\nstretch = 99\nvolume_loss = 9\nflips = 1\ncrossings = 1\n")
    assert "ok: 2 of 2 joints pass" in run_sinew("flex", good).stdout
    result = run_sinew("flex", good, "--poses", table, "--methods", "dq", status=1)
    assert "FAILED: 1 of 2 joints pass" in result.stdout
    assert "Radius" in result.stdout
    assert "(twist 170)" in result.stdout
    assert "; not under dq" in result.stdout
    tried = "--variants", "dq+delta_mush:iterations=2, Plain=lbs"
    result = run_sinew("flex", good, "--poses", table, *tried, status=1)
    assert "; not under dq+delta_mush:iterations=2" in result.stdout
    assert "Plain" not in result.stdout
    run_sinew("flex", good, "--poses", table, "--thresholds", limits)
    before = good.read_bytes()
    page = tmp_path / "bent.html"
    run_sinew("flex", good, "--poses", table, "--methods", "dq", "--viewer", page, status=1)
    header, _meshes = read_page.read(page)
    bent = [f"{bone.name}: twist 170" for bone in bpy.data.armatures[0].bones[1:]]
    assert header["frames"] == ["At rest", *bent]
    assert list(header["methods"]) == ["blender", "dq"]
    assert header["flex"]["verdict"] == "1 of 2 joints pass"
    assert {each["measure"] for each in header["flex"]["findings"]} >= {"Radius"}
    xml, text = tmp_path / "flex.xml", tmp_path / "flex.md"
    arguments = ("--json", "--junit", xml, "--markdown", text, "--poses", table)
    result = run_sinew("flex", good, tmp_path / "none.blend", *arguments, status=1)
    reports = json.loads(result.stdout)
    assert [report["passed"] for report in reports] == [False, False]
    assert "no such file" in reports[1]["error"]
    (found,) = [each for each in reports[0]["joints"][1]["findings"] if each["name"] == "radius"]
    assert found["mesh"] == "Arm"
    assert found["value"] < found["limit"] == 0.5
    assert found["pose"] == "twist 170"
    place = bpy.data.objects["Arm"].matrix_world @ bpy.data.objects["Arm"].data.vertices[found["vertex"]].co
    np.testing.assert_allclose(found["point"], place, atol=1e-5)
    assert len(list(ElementTree.parse(xml).iter("failure"))) == 1
    assert "good.blend" in text.read_text()
    assert good.read_bytes() == before


def test_a_file_is_judged_by_its_own_method(tmp_path):
    obj = skinned()
    scenes.add_sinew(obj, "dq")
    path = scenes.save(tmp_path / "dq.blend")
    table = tmp_path / "table.toml"
    table.write_text('[joints]\nother = ["twist 170"]\n[limits]\nstretch = 99\n')
    found = json.loads(run_sinew("flex", path, "--poses", table, "--methods", "lbs", "--json").stdout)
    values = found[0]["joints"][1]["values"]
    assert values["own"]["radius"]["value"] > 0.95
    assert values["lbs"]["radius"]["value"] < 0.5


@pytest.mark.once
def test_wrong_use(tmp_path):
    path = tmp_path / "table.toml"
    path.write_text("[limits]\nlength = 3\n")
    for arguments, said in (
        (("--methods", "mush"), "expected one of"),
        (("--variants", "dq+mush"), "expected one of"),
        (("--variants", "file"), "says nothing of its own"),
        (("--poses", path), "limits.length"),
        (("--junit", tmp_path / "a.txt"), ".xml"),
        (("b.blend", "--viewer", tmp_path / "page.html"), "a single file"),
    ):
        assert said in run_sinew("flex", "a.blend", *arguments, status=2).stderr


@pytest.mark.slow
def test_the_fixture_fails_a_test_with_what_is_wrong(tmp_path):
    skinned()
    good = scenes.save(tmp_path / "good.blend")
    table = tmp_path / "table.toml"
    table.write_text('[joints]\nother = ["twist 170"]\n')
    (tmp_path / "conftest.py").write_text('pytest_plugins = ["sinew_addon.commands.pytest_flex"]\n')
    (tmp_path / "test_characters.py").write_text(
        f"""
def test_good(sinew_flex):
    assert sinew_flex({str(good)!r})["passed"]

def test_known(sinew_flex):
    bone = "{bpy.data.armatures[0].bones[1].name}"
    sinew_flex({str(good)!r}, options=["--poses", {str(table)!r}], known=[bone])

def test_bad(sinew_flex):
    sinew_flex({str(good)!r}, options=["--poses", {str(table)!r}])

def test_absent(sinew_flex):
    sinew_flex("absent.blend")

def test_wrong(sinew_flex):
    sinew_flex({str(good)!r}, options=["--methods", "mush"])
"""
    )
    words = "-m", "pytest", "-q", "-p", "no:cacheprovider", "-rfp", "test_characters.py"
    done = ran(sys.executable, *words, cwd=tmp_path)
    assert "3 failed, 2 passed" in done.stdout, done.stdout + done.stderr
    for name, said in (("bad", "Radius: "), ("absent", "no such file"), ("wrong", "expected one of")):
        assert f"test_{name}" in done.stdout
        assert said in done.stdout
