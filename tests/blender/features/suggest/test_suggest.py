# SPDX-License-Identifier: GPL-3.0-or-later
"""All methods measured over frames, which one is best by which criterion, and a click to use it."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
import sinew
import test_recommended
from sinew_addon.attach import properties
from sinew_addon.features.flex import feature as flex_feature
from sinew_addon.features.measure import live, worst_frames
from sinew_addon.features.measure.crossings import crossing_triangles, crossings
from sinew_addon.features.measure.suggestion import CRITERIA, MEASURED, Suggestion
from sinew_addon.features.suggest import recommend, suggest
from sinew_addon.io import actions
from sinew_addon.skinning.variants import parse
from sinew_addon.ui import stepped

pytestmark = pytest.mark.long_term


@pytest.fixture(autouse=True)
def nothing_known():
    suggest.forget()


def found() -> Suggestion:
    return suggest.suggestions[bpy.context.scene.session_uid].suggestion


def test_numbers_are_those_of_each_method():
    obj, _armature = scenes.skinned_arm("dq")
    assert bpy.ops.sinew.suggest() == {"FINISHED"}
    suggestion = found()
    measured = [method.name for method in sinew.methods()]
    assert list(suggestion.methods)[: len(measured)] == measured
    assert suggestion.frames == list(range(1, 12))
    assert properties.of(obj).method == "dq"
    for (method, name), worst in suggestion.worst.items():
        if name not in MEASURED or method not in properties.METHODS:
            continue
        properties.of(obj).method = method
        bpy.context.scene.frame_set(int(worst.frame))
        measured = scenes.measure(obj).measured
        assert worst.value == pytest.approx(measured.entry(MEASURED[name]), rel=1e-5, abs=1e-7)
    # A bent and twisted arm: linear blending loses the most volume.
    assert abs(suggestion.worst["lbs", "volume"].value) > 2 * abs(suggestion.worst["dq", "volume"].value)
    assert "lbs" not in suggestion.best(next(c for c in CRITERIA if c.name == "volume"))


def test_the_recommendation_is_known_before_all_methods_are_measured():
    obj, _armature = scenes.skinned_arm("lbs")
    uid = bpy.context.scene.session_uid
    scan = suggest.scan(bpy.context.scene, [obj], "SCENE")
    assert next(share for share in scan if uid in recommend.choices) < 0.6
    assert uid not in suggest.suggestions
    scan.close()


def test_one_combination_is_recommended_and_a_click_uses_it():
    """The same one as by Recommended, measured in a row of its own."""
    obj, _armature = test_recommended.arm(143.0, axis=1, sides=16, rings=41)
    bpy.ops.sinew.suggest()
    suggestion, choice = found(), recommend.choices[bpy.context.scene.session_uid]
    assert choice == recommend.result_of(recommend.search(bpy.context.scene, [obj]))
    assert choice.variant.stages == ("twist_spread",)
    assert suggest.RECOMMENDED in suggestion.methods
    bpy.ops.sinew.use_recommended()
    assert (properties.of(obj).method, properties.of(obj).twist_spread.enabled) == (
        choice.variant.method,
        True,
    )
    bpy.context.scene.frame_set(11)
    measured = scenes.measure(obj).measured
    known = suggestion.worst[suggest.RECOMMENDED, "volume"]
    assert known.frame == 11
    assert known.value == pytest.approx(measured.entry(MEASURED["volume"]), rel=1e-4)
    bpy.ops.sinew.suggest()
    # What is on is part of each method's shape, but not of what is recommended.
    assert recommend.choices[bpy.context.scene.session_uid] == choice


def test_nothing_is_used_before_it_is_recommended():
    scenes.skinned_arm("lbs")
    with pytest.raises(RuntimeError, match="Nothing is recommended yet"):
        bpy.ops.sinew.use_recommended()


def test_what_is_off_is_named():
    obj, _armature = scenes.skinned_arm("dq")
    properties.of(obj).enabled = False
    with pytest.raises(RuntimeError, match="Arm is switched off"):
        bpy.ops.sinew.suggest()


@pytest.mark.parametrize("stage", ["", "twist_spread", "delta_mush"])
def test_intersections_are_counted_of_all_triangles(stage):
    """Those that one bone moves as a whole cross as they do at rest, unless something else moves them."""
    obj, armature = scenes.skinned_arm("dq")
    scenes.forget_keys(armature)
    bones = armature.pose.bones
    for frame, degrees in ((1, 0.0), (4, 90.0)):
        bones[1].rotation_mode = "XYZ"
        scenes.key(
            bones[1], "rotation_euler", [(frame, (np.radians(2.0 * degrees), np.radians(degrees), 0.0))]
        )
    bpy.context.scene.frame_end = 4
    # A part of the first bone is in another one at rest.
    for vertex in obj.data.vertices[:8]:
        vertex.co.z -= 0.15
    if stage:
        scenes.set_stage(obj, stage)
    bpy.ops.sinew.suggest()
    counts = set()
    for method in sinew.methods():
        worst = found().worst[method.name, "crossings"]
        properties.of(obj).method = method.name
        bpy.context.scene.frame_set(int(worst.frame))
        measured = scenes.measure(obj).measured
        assert worst.value == len(crossings(measured.shape) - crossings(measured.rest)), method.name
        counts.add(worst.value)
    assert len(counts) > 1


def test_what_one_bone_moves_is_asked_where_neighbours_or_stages_move_it():
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(11)
    moment = live.Moment.of(live.measure_now([obj], properties.BLENDER, "measure"))
    shapes = {method.name: moment.measured(method.name) for method in sinew.methods()}
    groups = {name: suggest._moved_alike(moment, shapes["lbs"], shape) for name, shape in shapes.items()}
    assert [name for name, bones in groups.items() if bones is None] == ["ddm"]
    bones, triangles = groups["dq"], shapes["dq"].shape.surface.triangles
    counts, heaviest = moment.pose.skin.influences.counts, moment.pose.skin.limb_of_vertices
    is_whole = (counts[triangles] == 1).all(axis=1) & (np.ptp(heaviest[triangles], axis=1) == 0)
    np.testing.assert_array_equal(bones, np.where(is_whole, heaviest[triangles[:, 0]], -1))
    assert 0.1 < is_whole.mean() < 0.9
    spread = moment.measured("dq", parse("dq+delta_mush:iterations=20").stage_values)
    assert suggest._moved_alike(moment, shapes["lbs"], spread) is None
    scenes.set_stage(obj, "twist_spread")
    bpy.context.scene.frame_set(11)
    staged = live.Moment.of(live.measure_now([obj], properties.BLENDER, "measure"))
    assert suggest._moved_alike(staged, staged.measured("lbs"), staged.measured("dq")) is None


def test_crossings_are_pairs_without_a_common_vertex():
    points = np.array(
        [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0.5, 0.5, -1), (0.6, 0.5, 1), (0.5, 0.6, 1), (5, 0, 0), (5, 1, 0)],
        np.float32,
    )
    triangles = np.array([(0, 1, 2), (3, 4, 5), (0, 1, 6), (5, 6, 7)])
    assert crossing_triangles(points, triangles[[0, 1]]) == {(0, 1)}
    # Adjacent faces share vertices.
    assert crossing_triangles(points, triangles[[0, 2]]) == set()
    assert crossing_triangles(points, triangles[[0, 3]]) == set()


def move_a_vertex(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    obj.data.vertices[7].co.z += 0.1
    obj.data.update()


def weight_a_vertex(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    obj.vertex_groups["bone.1"].add([3], 0.7, "REPLACE")


def move_a_bone(_obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones[-1].tail.z += 0.3
    bpy.ops.object.mode_set(mode="OBJECT")


def key_a_bone(_obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    armature.pose.bones[1].location.x = 0.3
    armature.pose.bones[1].keyframe_insert("location", frame=5)


def play_another_action(_obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    actions.play(armature, armature.animation_data.action.copy())


def choose_another_range(_obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    bpy.context.scene.frame_end += 3


def switch_a_stage_on(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    properties.of(obj).bulge_limit.enabled = True


CHANGES = {
    "mesh": move_a_vertex,
    "weights": weight_a_vertex,
    "bones": move_a_bone,
    "action": key_a_bone,
    "action ": play_another_action,
    "frames": choose_another_range,
    "stages": switch_a_stage_on,
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_result_says_what_has_changed_since(what, route):
    """Suggest's, those of Recommended, Flex and the worst frames; undone, all is as it was."""
    obj, armature = scenes.skinned_arm("dq")
    scene, word = bpy.context.scene, what.strip()
    bpy.ops.sinew.suggest()
    bpy.ops.sinew.flex()
    bpy.ops.sinew.worst_frames()
    uid = scene.session_uid
    bases = {
        "suggest": suggest.suggestions[uid].basis,
        "recommended": recommend.bases[uid],
        "flex": flex_feature.results[uid].basis,
        "worst frames": worst_frames.scans[uid].basis,
    }
    assert not any(basis.changes(scene, [obj]) for basis in bases.values())
    bpy.ops.ed.undo_push()
    properties.of(obj).method = "cor"
    scene.frame_set(4)
    assert not any(bases[name].changes(scene, [obj]) for name in ("suggest", "recommended"))
    properties.of(obj).method = "dq"
    CHANGES[what](obj, armature)
    bpy.context.view_layer.update()
    told = {name for name, basis in bases.items() if basis.changes(scene, [obj]) == [word]}
    unaware = {"action": {"flex"}, "frames": {"flex"}, "stages": {"recommended"}}
    assert told == bases.keys() - unaware.get(word, set())
    bpy.ops.ed.undo_push()
    bpy.ops.ed.undo()
    scene, obj = bpy.context.scene, bpy.data.objects["Arm"]
    bpy.context.view_layer.update()
    assert not any(basis.changes(scene, [obj]) for basis in bases.values())


def test_what_is_recommended_again_has_no_table_of_before():
    obj, _armature = test_recommended.arm(143.0, axis=1, sides=16, rings=41)
    bpy.ops.sinew.suggest()
    uid = bpy.context.scene.session_uid
    bpy.ops.sinew.use_recommended()
    properties.of(obj).twist_spread.enabled = False
    bpy.ops.sinew.recommend()
    # The same, of the same.
    assert uid in suggest.suggestions or properties.of(obj).twist_spread.enabled
    bpy.ops.sinew.suggest()
    CHANGES["mesh"](obj, _armature)
    bpy.context.view_layer.update()
    bpy.ops.sinew.recommend()
    assert uid not in suggest.suggestions
    assert recommend.bases[uid].changes(bpy.context.scene, [obj]) == []


def test_a_window_that_draws_slowly_does_so_less_often():
    """A fifth of the time at most, as far as Esc can wait."""
    between = stepped.seconds_between_redraws
    assert between(0.001) == 0.1
    for drawing in (0.1, 0.25):
        assert drawing / (drawing + between(drawing)) <= 0.2 + 1e-9
    assert between(5.0) == 1.0
