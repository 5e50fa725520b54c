# SPDX-License-Identifier: GPL-3.0-or-later
"""The program `sinew`, run as a user runs it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy
import numpy as np
import program
import pytest
import scenes
from program import complaint, run_program, run_sinew
from sinew_addon.attach import properties
from sinew_addon.base.steps import result_of
from sinew_addon.cli import make_parser
from sinew_addon.features.action_copy import action_copy
from sinew_addon.features.inbetween import inbetween_bake
from sinew_addon.io import files
from sinew_addon.skinning.engines import METHODS

pytestmark = pytest.mark.outer_versions


@pytest.fixture
def arm_file(tmp_path):
    """A saved arm of linear weights: file, and the modifier's shapes [2, vertices, 3] at frames 6 and 11."""
    obj, _armature = scenes.make_arm()
    expected = scenes.modifier_shapes(obj, [6, 11], preserve_volume=True)
    path = scenes.save(tmp_path / "arm.blend")
    return path, expected


@pytest.mark.once
def test_help_everywhere():
    assert "reskin" in run_program("--help").stdout
    # tests/project/test_documented.py checks that docs/command-line.md names all of them.
    _parser, commands = make_parser()
    assert "check" in commands
    for command in commands:
        assert "usage: sinew" in run_sinew(command, "--help").stdout


@pytest.mark.once
def test_wrong_use_has_status_2():
    run_sinew(status=2)
    run_sinew("points", status=2)


@pytest.mark.once
@program.needs_interrupts
@pytest.mark.parametrize("name", ["numpy", "sinew_addon.commands.render", "bpy_types", "sinew_addon.ui"])
def test_ctrl_c_stops_a_command_that_starts(arm_file, name):
    """Blender ignores what is raised while it starts, and lacks some of its modules then."""
    code = f"""
import os, signal, sys
class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if name.lstrip("_") == {name!r}:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupts())
from sinew_addon.cli import run
run()
"""
    command = [sys.executable, "-c", code, "info", arm_file[0]]
    done = program.ran(*command, env=program.ENVIRONMENT)
    assert (done.returncode, done.stderr) == (130, "sinew: stopped\n")
    assert not done.stdout


@pytest.mark.once
def test_methods_is_the_table():
    printed = json.loads(run_sinew("methods", "--json").stdout)
    assert [row["name"] for row in printed["methods"]] == list(METHODS)
    assert "mix.group" in printed["stages"][0]["parameters"]
    text = run_sinew("methods").stdout
    for method in METHODS.values():
        assert method.label in text


def test_json_is_all_that_is_printed_where_a_colour_configuration_is_set():
    """As in the pipelines of many studios: Blender 5.3 prints which it uses."""
    config = Path(bpy.utils.system_resource("DATAFILES")) / "colormanagement" / "config.ocio"
    assert config.exists()
    printed = run_program("methods", "--json", env_more={"OCIO": str(config)}).stdout
    assert json.loads(printed)["methods"]


def test_info(arm_file):
    path, _expected = arm_file
    report = json.loads(run_sinew("info", path, "--json").stdout)
    assert report == [
        {
            "file": str(path),
            "meshes": [
                {
                    "object": "Arm",
                    "armature": "Arm Rig",
                    "vertices": 252,
                    "bones": 2,
                    "bones_with_weights": 2,
                    "influences_mean": pytest.approx(1.4286, abs=1e-4),
                    "influences_most": 2,
                    "warnings": [],
                }
            ],
            "left_to_blender": [],
        }
    ]
    assert "252" in run_sinew("info", path).stdout


def test_info_names_what_is_left_to_blender(tmp_path):
    _obj, armature = scenes.make_arm()
    lattice = scenes.added("Cage", bpy.data.lattices.new("Cage"))
    lattice.modifiers.new("Armature", "ARMATURE").object = armature
    scenes.save(tmp_path / "cage.blend")
    assert (
        "left to their Armature modifiers: Cage (Lattice)"
        in run_sinew("info", tmp_path / "cage.blend").stdout
    )
    lattice.select_set(True)
    bpy.ops.sinew.add()
    assert not any(properties.has_sinew(o) for o in (lattice, armature))
    assert lattice.modifiers["Armature"].object == armature


def test_info_warns(tmp_path):
    obj, _armature = scenes.make_arm()
    obj.vertex_groups.new(name="nobody")
    for group in obj.vertex_groups:
        group.remove([0, 1, 2])
    scenes.save(tmp_path / "faulty.blend")
    report = json.loads(run_sinew("info", tmp_path / "faulty.blend", "--json").stdout)
    warnings = " ".join(report[0]["meshes"][0]["warnings"])
    assert "3 of 252 vertices have no weights" in warnings
    assert "nobody" in warnings


def test_points(arm_file, tmp_path):
    path, expected = arm_file
    out = tmp_path / "deep" / "points.npz"
    run_sinew("points", path, "--method", "dq", "--frames", "6,11", "--out", out)
    with np.load(out) as points:
        assert set(points.files) == {"Arm", "frames"}
        assert points["Arm"].dtype == np.float32
        assert points["frames"].tolist() == [6, 11]
        assert scenes.worst(points["Arm"], expected) <= 1e-5
    run_sinew("points", path, "--method", "lbs", "--frames", "1,3-5,6.5", "--object", "Arm", "--out", out)
    with np.load(out) as points:
        assert points["frames"].tolist() == [1, 3, 4, 5, 6.5]


@pytest.mark.once
@pytest.mark.parametrize(
    ("given", "status", "sentence"),
    [
        (("bulge_limit.form=hard",), 2, "bulge_limit.form: expected one of continuous, kim_han, got 'hard'"),
        (("mix=dq", "mix.group=none such"), 1, "no mesh has a vertex group 'none such'"),
        (("mix=bulge",), 2, "mix: expected one of off, lbs"),
        (("delta_mush=dq",), 2, "delta_mush: expected on or off, got 'dq'"),
        (("delta_mush.iterations=1001",), 2, "expected a whole number from 0 to 1000"),
        (("strength=1",), 2, "expected one of mix, "),
    ],
)
def test_parameters_that_are_none(arm_file, tmp_path, given, status, sentence):
    path, _expected = arm_file
    options = [option for text in given for option in ("--set", text)]
    arguments = ("points", path, "--method", "lbs", "--frames", "1", "--out", tmp_path / "o.npz")
    result = run_sinew(*arguments, *options, status=status)
    assert sentence in result.stderr
    assert "Traceback" not in result.stderr


def test_reskin_never_writes_to_the_input_folder(arm_file):
    path, _expected = arm_file
    before = path.read_bytes()
    assert "input" in run_sinew("reskin", path, "--method", "dq", "--out", path.parent, status=2).stderr
    assert path.read_bytes() == before


@pytest.mark.once
def test_bad_input_is_one_sentence(arm_file, tmp_path):
    path, _expected = arm_file
    (tmp_path / "empty.blend").touch()
    (tmp_path / "none").mkdir()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scenes.save(tmp_path / "nothing.blend")
    out, one = tmp_path / "points.npz", ("--method", "dq", "--frames", "1")
    cases = [
        (["points", tmp_path / "no.blend", *one, "--out", out], "no such file"),
        (["points", tmp_path / "empty.blend", *one, "--out", out], "is empty"),
        (["points", tmp_path, *one, "--out", out], "is a folder"),
        (["points", tmp_path / "nothing.blend", *one, "--out", out], "no mesh is deformed"),
        (["points", path, "--method", "best", "--frames", "1", "--out", out], "expected one of"),
        (["points", path, "--method", "dq", "--frames", "9-3", "--out", out], "backwards"),
        (["points", path, "--method", "dq", "--frames", "one", "--out", out], "expected frames"),
        (["points", path, *one, "--object", "Leg", "--out", out], "no mesh called 'Leg'"),
        (["bake", path, "--to", "mdd", "--set", "mix=dq", "--out", out], "--set goes with --method"),
        (["compare", path, "--methods", "lbs,x", "--out", tmp_path], "expected one of"),
        (["compare", path, "--frames", "9-3", "--out", tmp_path], "backwards"),
        (["compare", path, "--frames", "1,nan", "--out", tmp_path], "expected -1048574 to 1048574"),
        (["compare", path, "--frames", "1-10000000", "--out", tmp_path], "expected -1048574 to 1048574"),
        (["compare", path, "--frames", "", "--out", tmp_path], "expected frames"),
        (["compare", path, "--out", path], "is a file"),
        (["render", path, *one, "--out", path / "golden"], "is a file"),
        (["compare", path, "--reference", "best", "--out", tmp_path], "expected one of"),
        (["compare", path, "--pictures", "-1", "--out", tmp_path], "expected 0 or more"),
        (["compare", path, "--influences", "-1", "--out", tmp_path], "expected 0 or more"),
        (["compare", path, "--size", "10", "--out", tmp_path], "expected 64 to 4096"),
        (["compare", path, tmp_path / path.name, "--out", tmp_path], "would both be written"),
        (["compare", tmp_path / "no.blend", "--out", tmp_path], "no such file"),
        (["render", path, "--out", tmp_path], "are needed"),
        (["render", path, "--tolerance", "-1", "--out", tmp_path], "a percentage"),
        (["render", path, "--against", tmp_path / "none", "--out", tmp_path / "o"], "make golden pictures"),
        (["render", path, "--against", tmp_path, "--out", tmp_path], "would replace the golden pictures"),
        (["render", path, *one, "--own-look", "--out", tmp_path / "o"], "no camera"),
        (["render", path, *one, "--size", "9", "--out", tmp_path / "o"], "64 to 4096"),
        (["info", tmp_path / "no.blend"], "no such file"),
    ]
    of_files = {
        "is a file",
        "no such file",
        "is empty",
        "is a folder",
        "no mesh is deformed",
        "no mesh called 'Leg'",
        "make golden pictures",
        "no camera",
    }
    for arguments, sentence in cases:
        result = run_sinew(*arguments, status=1 if sentence in of_files else 2)
        assert sentence in complaint(result.stderr)
    assert not out.exists()


def test_glb_files_are_read(real_rig, tmp_path):
    path = real_rig("Fox.glb")
    report = json.loads(run_sinew("info", path, "--json").stdout)
    assert [mesh["object"] for mesh in report[0]["meshes"]] == ["fox"]
    run_sinew("reskin", path, "--method", "lbs", "--out", tmp_path)
    assert (tmp_path / "Fox.blend").exists()


def test_points_override_a_keyed_method(tmp_path):
    obj, _armature = scenes.make_arm(name="file")
    expected = scenes.modifier_shapes(obj, [11], preserve_volume=True)
    scenes.add_sinew(obj, "lbs")
    obj.keyframe_insert("sinew.method", frame=1)
    scenes.save(tmp_path / "keyed.blend")
    out = tmp_path / "points.npz"
    run_sinew("points", tmp_path / "keyed.blend", "--method", "dq", "--frames", "11", "--out", out)
    with np.load(out) as points:
        assert scenes.worst(points["file"], expected) <= 1e-5


def bones_of(armature: bpy.types.Object, frames: list[int]) -> np.ndarray:
    return scenes.at_frames(frames, lambda: scenes.pose_of(armature))


@pytest.fixture
def keyed_file(tmp_path):
    """Two armatures, and the motion of their bones by ScLERP on a spline: file, and [11, bones, 4, 4] of
    each."""
    armatures = [scenes.make_arm(bones=3, name=name)[1] for name in ("Left", "Right")]
    frames = list(range(1, 12))
    blender = bones_of(armatures[0], frames)
    expected = []
    for armature in armatures:
        result_of(inbetween_bake.steps(armature, "sclerp", "spline"))
        expected.append(bones_of(armature, frames))
        action_copy.restore(armature)
    assert np.abs(expected[0] - blender).max() > 0.01
    path = scenes.save(tmp_path / "keyed.blend")
    return path, expected


def test_inbetween_writes_copies_of_all_armatures(keyed_file, tmp_path):
    path, expected = keyed_file
    before = path.read_bytes()
    options = ["--method", "sclerp", "--path", "spline", "--out", tmp_path / "out"]
    result = run_sinew("inbetween", path, *options)
    assert "1 of 1 files" in result.stdout
    assert path.read_bytes() == before
    files.open_file(tmp_path / "out" / "keyed.blend")
    for name, bones in zip(("Left Rig", "Right Rig"), expected, strict=True):
        armature = bpy.data.objects[name]
        assert action_copy.is_on(armature)
        assert np.abs(bones_of(armature, list(range(1, 12))) - bones).max() < 1e-5
    assert len(bpy.data.actions) == 4, "the keyed actions stay in the file"
    assert "--overwrite" in run_sinew("inbetween", path, *options, status=1).stderr
