# SPDX-License-Identifier: GPL-3.0-or-later
"""Worst frames, the range fitted to frames, and the numbers in the panel."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.features.heat import heat_map, heat_panel, measures
from sinew_addon.features.measure import live, worst_frames
from sinew_addon.features.measure.comparison import peaks
from sinew_addon.features.measure.metrics import METRICS
from sinew_addon.ui import stepped

pytestmark = pytest.mark.long_term


def waving_arm() -> tuple[bpy.types.Object, bpy.types.Object]:
    """Bent most at frames 5, 15 and 25, of these farthest at 15 and least at 5; at rest at 1, 10, 20 and
    30."""
    obj, armature = scenes.make_arm()
    scenes.forget_keys(armature)
    for frame, degrees in ((1, 0), (5, 40), (10, 0), (15, 140), (20, 0), (25, 90), (30, 0)):
        scenes.bend(armature, degrees)
        armature.pose.bones[1].keyframe_insert("rotation_quaternion", frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 30
    return obj, armature


def skinned_arm() -> tuple[bpy.types.Object, bpy.types.Object]:
    obj, armature = waving_arm()
    scenes.add_sinew(obj, "dq")
    return obj, armature


def scan() -> worst_frames.Scan:
    return worst_frames.scans[bpy.context.scene.session_uid]


@pytest.mark.parametrize("quantity", ["stretch", "area", "bulge", "distance"])
def test_finds_the_peaks_worst_first(quantity):
    obj, _armature = skinned_arm()
    measures.of(bpy.context.scene).quantity = quantity
    assert bpy.ops.sinew.worst_frames() == {"FINISHED"}
    worst = scan().worst()
    assert [frame for frame, _value in worst] == [15, 25, 5]
    # The numbers are those of the frames.
    for frame, value in worst:
        bpy.context.scene.frame_set(frame)
        measured = scenes.measure(obj).measured
        assert measured.summary().__dict__ | {"bulge_worst": measured.summary().bulge_worst}
        assert measured.entry(METRICS[quantity].worst) == pytest.approx(value, rel=1e-6)


def test_ranges_are_the_scenes_the_previews_or_the_actions():
    _obj, armature = waving_arm()
    scene = bpy.context.scene
    scene.frame_end = 20
    assert stepped.frames_over(scene, [armature], "SCENE") == list(range(1, 21))
    assert stepped.frames_over(scene, [armature], "ACTION") == list(range(1, 31))
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 4, 6
    assert stepped.frames_over(scene, [armature], "SCENE") == [4, 5, 6]


def test_a_range_fitted_to_frames_holds_all_their_values():
    obj, _armature = skinned_arm()
    scene = bpy.context.scene
    settings = measures.of(scene)
    settings.quantity = "bulge"
    bpy.ops.sinew.heat_map()
    assert bpy.ops.sinew.fit_heat_range() == {"FINISHED"}
    assert settings.range == measures.FIXED
    largest = 0.0
    for frame in range(1, 31):
        scene.frame_set(frame)
        subject = scenes.measure(obj, settings.other)
        values = subject.measured.field("bulge")
        largest = max(largest, np.abs(values).max())
        scale = heat_map.scale_of(settings, subject.measured, values)
        assert scale.high == settings.length
        assert -scale.low == settings.length
    assert settings.length == pytest.approx(largest, rel=1e-5)


def test_what_can_not_be_measured_is_said():
    obj, armature = skinned_arm()
    armature.animation_data_clear()
    with pytest.raises(RuntimeError, match="no action; choose one"):
        bpy.ops.sinew.worst_frames(over="ACTION")
    obj.sinew.enabled = False
    with pytest.raises(RuntimeError, match="switch Sinew on"):
        bpy.ops.sinew.worst_frames()


def test_peaks():
    assert peaks([0.0, 2.0, 1.0, 3.0, 3.0, 0.0, 1.0], 5) == [3, 1, 6]
    assert peaks([5.0, 4.0, 3.0], 5) == [0]
    assert peaks([1.0, 1.0, 1.0], 5) == [0]
    assert peaks([1.0, 0.0, 2.0, 0.0, 3.0], 2) == [4, 2]
    assert peaks([], 5) == []


def test_numbers_of_the_other_method_are_its_own():
    obj, _armature = skinned_arm()
    scene = bpy.context.scene
    scene.unit_settings.system = "METRIC"
    scene.frame_set(15)
    subject = scenes.measure(obj, "lbs")
    measured, other = subject.measured, live.measured_under_other(subject, "lbs")
    assert dict(heat_panel.distances(scene, measured))["Distance"].endswith(" cm")
    obj.sinew.method = "lbs"
    again = scenes.measure(obj, "lbs")
    for name in ("volume_change", "stretch_max", "bulge_min", "bulge_max"):
        assert again.measured.entry(name) == pytest.approx(other.entry(name), rel=1e-6)
    # The other method is shown: there is nothing to compare with.
    assert live.measured_under_other(again, "lbs") is None
    assert {len(row) for row in heat_panel.rows(scene, again.measured, None)} == {3}
    armature = scenes.measure(obj)
    assert live.measured_under_other(armature, "blender") is not None


def test_measuring_twice_measures_once():
    """The panel draws often, but computes a frame once."""
    obj, _armature = skinned_arm()
    first = scenes.measure(obj, "lbs").measured
    assert scenes.measure(obj, "lbs").measured is first
    subject = scenes.measure(obj, "lbs")
    other = live.measured_under_other(subject, "lbs")
    assert live.measured_under_other(subject, "lbs") is other
    bpy.context.scene.frame_set(9)
    second = scenes.measure(obj, "lbs")
    assert second.measured is not first
    assert live.measured_under_other(second, "lbs") is not other
    gauge = second.gauge
    bpy.context.scene.frame_set(10)
    assert scenes.measure(obj, "lbs").gauge is gauge


def test_topology_edited_is_measured_anew():
    obj, _armature = skinned_arm()
    before = scenes.measure(obj, "lbs").gauge.surface
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.quads_convert_to_tris(quad_method="FIXED_ALTERNATE", ngon_method="CLIP")
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.scene.frame_set(9)
    after = scenes.measure(obj, "lbs").gauge.surface
    assert len(after.edges) == len(obj.data.edges) > len(before.edges)
