# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages in all features that measure, show and write shapes, the mix and the three after the blend together:
each uses the final mesh. The oracles of stages are in test_mix, test_twist_spread, test_bulge_limit and
test_delta_mush."""

from __future__ import annotations

import json

import bpy
import numpy as np
import pytest
import scenes
import test_bake
import test_compare
import test_comparison
import test_heat_map
import trimesh
from program import run_sinew
from sinew_addon.attach import properties
from sinew_addon.deform import characters
from sinew_addon.features.bake import bake
from sinew_addon.features.measure import subjects, worst_frames
from sinew_addon.features.measure.heat_scale import HeatScale, linear
from sinew_addon.features.measure.metrics import METRICS, Measured

pytestmark = pytest.mark.outer_versions

FRAMES = [1, 6, 11]
GROUP = "painted"
AFTER = "after the blend"
STAGES = {
    "mix": ("mix=lbs", f"mix.group={GROUP}"),
    AFTER: (
        *("twist_spread=on", "twist_spread.amount=0.9", f"twist_spread.group={GROUP}"),
        *("bulge_limit=on", "bulge_limit.strength=0.8", f"bulge_limit.group={GROUP}"),
        *("delta_mush=on", "delta_mush.iterations=12", "delta_mush.pin_boundary=on"),
    ),
}


def options(stage: str) -> list[str]:
    """Settings in the form of commands' arguments."""
    return [text for value in STAGES[stage] for text in ("--set", value)]


def set_on(obj: bpy.types.Object, stage: str) -> None:
    """Sets them like the panel."""
    if stage == "mix":
        mix = properties.of(obj).mix
        mix.method, mix.group = "lbs", GROUP
        return
    scenes.set_stage(obj, "twist_spread", amount=0.9, group=GROUP)
    scenes.set_stage(obj, "bulge_limit", strength=0.8, group=GROUP)
    scenes.set_stage(obj, "delta_mush", iterations=12, pin_boundary=True)


@pytest.fixture
def arm(tmp_path):
    """The mesh, and the file in which it is saved."""
    obj, _armature = scenes.make_arm(bones=3)
    scenes.paint(obj, GROUP, scenes.rest_points(obj)[:, 0] - 0.5)
    return obj, scenes.save(tmp_path / "arm.blend")


@pytest.fixture(params=STAGES)
def stage(request):
    return request.param


def with_stage(obj: bpy.types.Object, stage: str) -> tuple[np.ndarray, np.ndarray]:
    """The final shapes without the stage and with it; it stays on. They differ."""
    scenes.add_sinew(obj, "dq")
    without = scenes.shapes(obj, FRAMES)
    set_on(obj, stage)
    shapes = scenes.shapes(obj, FRAMES)
    assert scenes.worst(without, shapes) > 0.005
    return without, shapes


def measured(obj: bpy.types.Object, frame: int, shape: np.ndarray) -> Measured:
    """The measures of the object's final mesh, which is `shape`, from Blender's own evaluations;
    distances are to the Armature modifier. Leaves the object under dq."""
    subject = subjects.gather(bpy.context.scene, [obj])
    shapes = subjects.shapes_at(subject, ("dq", characters.BLENDER), frame)
    np.testing.assert_allclose(shapes["dq"], shape, atol=1e-6)
    found = subject.gauge.measure(shapes["dq"], shapes[characters.BLENDER])
    characters.use_method(obj, "dq")
    return found


def test_compare_measures_the_shapes_with_it(arm, stage):
    obj, path = arm
    _without, shapes = with_stage(obj, stage)
    found = test_compare.compared(path, "--methods", "blender,dq", "--frames", "11", *options(stage))
    rows = {method: row for method, (row,) in found["summaries"].items()}
    characters.use_method(obj, characters.BLENDER)
    # The Armature modifier has no stages.
    blender = scenes.shapes(obj, [11])[0]
    for method, shape in (("dq", shapes[-1]), (characters.BLENDER, blender)):
        mesh = trimesh.Trimesh(shape.astype(np.float64), scenes.triangles_of(obj), process=False)
        assert rows[method]["volume"] == pytest.approx(mesh.volume, rel=1e-4)
        assert rows[method]["area"] == pytest.approx(mesh.area, rel=1e-4)
    apart = np.linalg.norm(shapes[-1].astype(np.float64) - blender, axis=1)
    assert rows["dq"]["distance_max"] == pytest.approx(apart.max(), abs=2e-5)


@pytest.mark.parametrize("quantity", ["stretch", "bulge", "distance"])
def test_the_heat_map_shows_it(arm, stage, quantity):
    obj, _path = arm
    _without, shapes = with_stage(obj, stage)
    expected = measured(obj, 11, shapes[-1])
    values, diagonal = expected.field(quantity), expected.rest.diagonal
    assert np.ptp(values) > 0.02
    test_heat_map.choose(quantity)
    bpy.ops.sinew.heat_map()
    scale = HeatScale.over_values(METRICS[quantity], values.min(), values.max(), diagonal)
    shown = test_heat_map.shown_colours(obj)
    np.testing.assert_allclose(shown, linear(scale.colours(values)), atol=3e-3)


def test_numbers_and_worst_frames_are_of_it(arm, stage):
    obj, _path = arm
    _without, shapes = with_stage(obj, stage)
    expected = {frame: measured(obj, frame, shape) for frame, shape in zip(FRAMES, shapes, strict=True)}
    test_heat_map.choose("stretch")
    assert bpy.ops.sinew.worst_frames() == {"FINISHED"}
    found = dict(worst_frames.scans[bpy.context.scene.session_uid].frames)
    for frame, own in expected.items():
        assert found[frame] == pytest.approx(own.entry(METRICS["stretch"].worst), rel=1e-3, abs=1e-5)
    bpy.context.scene.frame_set(11)
    numbers = scenes.measure(obj).measured
    for name, value in expected[11].summary().__dict__.items():
        assert numbers.summary().__dict__[name] == pytest.approx(value, rel=2e-4, abs=2e-5), name


def test_copies_of_a_comparison_have_the_stages(arm, stage):
    obj, _path = arm
    without, shapes = with_stage(obj, stage)
    assert_copy_shows(obj, without if stage == "mix" else shapes)


@pytest.fixture
def taken_over(arm):
    """The mesh with a Corrective Smooth that was taken over, and its shapes before."""
    obj, _path = arm
    obj.modifiers.new("Smooth", "CORRECTIVE_SMOOTH").iterations = 20
    scenes.add_sinew(obj, "dq")
    behind = scenes.shapes(obj, FRAMES)
    bpy.context.view_layer.objects.active = obj
    assert bpy.ops.sinew.take_over_smooth() == {"FINISHED"}
    assert properties.of(obj).delta_mush.enabled
    return obj, behind


def test_copies_have_a_corrective_smooth_that_was_taken_over_once(taken_over):
    assert_copy_shows(*taken_over)


@pytest.mark.parametrize("kind", ["mdd", "bones"])
def test_a_bake_has_a_corrective_smooth_that_was_taken_over_once(taken_over, kind, tmp_path):
    obj, expected = taken_over
    started = bake.start([obj], kind, FRAMES, tmp_path / "arm.blend", overwrite=False)
    list(started.sample())
    started.publish()
    started.place()
    distances = np.linalg.norm(scenes.shapes(obj, FRAMES) - expected, axis=2)
    stated = started.reports[0].after.worst if kind == "bones" else 0.0
    assert distances.max() <= 1.001 * stated + 1e-5 * scenes.diagonal(obj)


def assert_copy_shows(obj: bpy.types.Object, shapes: np.ndarray) -> None:
    """A shape by dq, in each of FRAMES."""
    test_comparison.compare(obj, {"dq"})
    for frame, expected in zip(FRAMES, shapes, strict=True):
        bpy.context.scene.frame_set(frame)
        found = test_comparison.without_offset(test_comparison.copies(obj)["dq"], 1)
        assert scenes.worst(found, expected) < 1e-5


@pytest.mark.parametrize("kind", ["shape-keys", "mdd"])
def test_a_bake_plays_it_elsewhere(arm, stage, kind, tmp_path):
    obj, path = arm
    _without, shapes = with_stage(obj, stage)
    run_sinew("bake", path, "--method", "dq", *options(stage), "--to", kind, "--out", tmp_path / "out")
    read = test_bake.read_elsewhere(tmp_path / "out" / "arm.blend", FRAMES, tmp_path)["Arm"]
    assert scenes.worst(read, shapes) <= test_bake.TOLERANCE * scenes.diagonal(obj)


def test_points_and_job_files_take_it(arm, stage, tmp_path):
    obj, path = arm
    _without, shapes = with_stage(obj, stage)
    frames = ",".join(map(str, FRAMES))
    run_sinew(
        *("points", path, "--method", "dq", *options(stage), "--frames", frames),
        *("--out", tmp_path / "points.npz"),
    )
    with np.load(tmp_path / "points.npz") as arrays:
        assert scenes.worst(arrays["Arm"], shapes) <= 1e-6
    job = tmp_path / "job.toml"
    job.write_text(
        f"inputs = {json.dumps([str(path)])}\nout = {json.dumps(str(tmp_path / 'copies'))}\n"
        f'method = "dq"\n[[objects]]\nmatch = "A*"\nset = {json.dumps(list(STAGES[stage]))}\n'
    )
    run_sinew("reskin", "--job", job, "--no-pictures")
    copy = scenes.opened(tmp_path / "copies" / "arm.blend")
    assert scenes.worst(scenes.shapes(copy, FRAMES), shapes) <= 1e-6
    assert properties.of(copy).method == "dq"
