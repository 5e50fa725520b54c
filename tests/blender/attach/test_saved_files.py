# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are saved while Sinew is at work: Blender's own for users without Sinew, and Sinew's again
when they are opened with it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from program import checked, without_sinew
from sinew_addon.attach import attach, node_group, note, properties, stack, updates
from sinew_addon.deform import apply_plan, safe_mode, session, small_meshes
from sinew_addon.io import armature_io
from sinew_addon.ui import state_text
from test_bake import read_elsewhere

FRAMES = [1, 6, 11]

READ = """
import json, sys, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Object, "sinew")
obj = bpy.data.objects["Arm"]
sinews = obj.modifiers["Sinew"]
sinews.show_viewport = True
bpy.context.view_layer.update()
warnings = [w.message for w in getattr(sinews, "node_warnings", ())]
print("FACTS " + json.dumps({
    "texts": [text.as_string() for text in bpy.data.texts],
    "labels": [node.label for node in sinews.node_group.nodes if node.type == "FRAME"],
    "warnings": warnings,
    "drivers": [d.data_path for d in obj.animation_data.drivers] if obj.animation_data else [],
}))
"""


def played_without_sinew(path: Path) -> tuple[np.ndarray, dict]:
    """The shapes at FRAMES in a Blender without Sinew, and the file's message there."""
    run = checked(without_sinew.run(READ, path), 0)
    facts = json.loads(next(line for line in run.stdout.splitlines() if line.startswith("FACTS "))[6:])
    return read_elsewhere(path, FRAMES, path.parent)["Arm"], facts


@pytest.mark.parametrize("safe", [False, True])
@pytest.mark.parametrize(
    ("method", "preserve_volume"), [("lbs", False), ("dq", True), ("qv", False)], ids=["lbs", "dq", "qv"]
)
def test_a_blender_without_sinew_plays_the_nearest_shape(
    tmp_path, monkeypatch, method, preserve_volume, safe
):
    monkeypatch.setattr(safe_mode, "_forced", safe)
    obj, _armature = scenes.make_arm()
    obj.modifiers[0].use_deform_preserve_volume = not preserve_volume
    expected = scenes.modifier_shapes(obj, FRAMES, preserve_volume)
    scenes.add_sinew(obj, method)
    ours = scenes.shapes(obj, FRAMES)
    path = scenes.save(tmp_path / "saved.blend")
    # Sinew continues, and the artist's own choice is kept.
    assert np.array_equal(scenes.shapes(obj, FRAMES), ours)
    assert obj.modifiers["Armature"].use_deform_preserve_volume is not preserve_volume
    assert not [text for text in bpy.data.texts if text.get(note.MARK)]
    shapes, facts = played_without_sinew(path)
    assert np.array_equal(shapes, expected)
    assert any("Arm" in text and "Sinew" in text for text in facts["texts"])
    assert any("Sinew" in label for label in facts["labels"])
    assert facts["drivers"] == []
    if hasattr(bpy.types, "GeometryNodeWarning"):
        assert node_group.NEEDS_SINEW in facts["warnings"]
    obj = scenes.opened(path)
    assert np.array_equal(scenes.shapes(obj, FRAMES), ours)
    assert not [text for text in bpy.data.texts if text.get(note.MARK)]
    attach.remove(obj)
    assert obj.modifiers["Armature"].use_deform_preserve_volume is not preserve_volume


def warnings_of(obj: bpy.types.Object) -> list[str]:
    bpy.context.view_layer.update()
    return [warning.message for warning in getattr(stack.sinew_modifier(obj), "node_warnings", ())]


def test_no_warning_of_a_missing_sinew_where_it_is_installed(tmp_path):
    """The nodes of the warning are in saved files alone."""
    obj, _armature = scenes.skinned_arm("dq")
    nodes = set(stack.sinew_modifier(obj).node_group.nodes.keys())
    path = scenes.save(tmp_path / "saved.blend")
    assert set(stack.sinew_modifier(obj).node_group.nodes.keys()) == nodes
    assert warnings_of(obj) == []
    appended, _armature = scenes.link(path, "Arm", "Arm Rig", link=False)
    bpy.context.view_layer.update()
    assert stack.sinew_modifier(appended).show_viewport
    assert set(stack.sinew_modifier(appended).node_group.nodes.keys()) == nodes
    assert warnings_of(appended) == []


def _unknown_method(obj):
    """As a newer Sinew would store it."""
    if bpy.app.version >= (5, 0):
        obj.sinew.bl_system_properties_get()["method"] = 99
    else:
        obj.sinew["method"] = 99
    obj.update_tag()
    bpy.context.view_layer.update()


def test_a_method_of_a_newer_sinew_is_kept_and_others_go_on(tmp_path):
    newer, _armature = scenes.make_arm(name="Newer")
    expected = scenes.shapes(newer, FRAMES)
    scenes.add_sinew(newer, "dq")
    obj, _armature = scenes.skinned_arm("dq")
    _unknown_method(newer)
    # What names the node group's sockets must not rely on what an artist may rename.
    for item in stack.sinew_modifier(obj).node_group.interface.items_tree:
        if item.in_out == "OUTPUT":
            item.name = "Renamed"
    session.refresh(bpy.context)
    path = scenes.save(tmp_path / "saved.blend")
    assert stack.sinew_modifier(obj).show_viewport
    assert "newer Sinew" in properties.of(newer).error
    assert np.array_equal(scenes.shapes(newer, FRAMES), expected)
    scenes.opened(path)
    assert properties.of(bpy.data.objects["Newer"]).enabled
    assert properties.of(bpy.data.objects["Newer"]).method == ""
    assert stack.sinew_modifier(bpy.data.objects["Arm"]).show_viewport
    # A script that ends with this file.
    script = (
        f"import bpy, sinew_addon; sinew_addon.register(); bpy.ops.wm.open_mainfile(filepath={str(path)!r})"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
    newer = bpy.data.objects["Newer"]
    properties.of(newer).method = "lbs"
    assert properties.of(newer).error == ""
    assert stack.sinew_modifier(newer).show_viewport


def test_evaluations_while_saving_change_nothing(tmp_path):
    """A thumbnail evaluates the scene at that time: so does this handler, in background as in a window."""
    obj, armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(11)
    seen = []

    def state() -> tuple:
        own, sinews = obj.modifiers["Armature"], stack.sinew_modifier(obj)
        return own.object, own.show_viewport, own.show_render, sinews.show_viewport, sinews.show_render

    def neighbour(*_args: object) -> None:
        before = state()
        obj.update_tag()
        bpy.context.view_layer.update()
        bpy.context.scene.frame_set(5)
        session.refresh(bpy.context)
        bpy.context.scene.frame_set(11)
        seen.append((before, state()))

    with scenes.handler("save_pre", neighbour):
        scenes.save(tmp_path / "saved.blend")
    blenders_own = (armature, True, True, False, False)
    assert seen == [(blenders_own, blenders_own)]
    assert state() == (armature, True, True, True, True)
    expected = scenes.final_points(obj)
    scenes.shapes(obj, FRAMES)
    assert np.array_equal(scenes.shapes(obj, [11])[0], expected)


def test_edit_by_another_add_on_while_saving(tmp_path):
    obj, _armature = scenes.skinned_arm("lbs")
    bpy.context.scene.frame_set(11)

    def neighbour(*_args: object) -> None:
        obj.vertex_groups["bone.1"].add(range(100), 0.7, "REPLACE")

    with scenes.handler("save_pre", neighbour):
        scenes.save(tmp_path / "saved.blend")
    got = scenes.shapes(obj, FRAMES)
    properties.of(obj).enabled = False
    assert scenes.worst(got, scenes.shapes(obj, FRAMES)) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_save_that_fails_ends_as_one_that_does_not(tmp_path):
    obj, _armature = scenes.skinned_arm("dq")
    expected = scenes.shapes(obj, FRAMES)
    with pytest.raises(RuntimeError):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "no such folder" / "saved.blend"))
    assert np.array_equal(scenes.shapes(obj, FRAMES), expected)
    assert not updates.phase.is_saving


def test_what_fails_for_an_object_while_saving_is_in_its_panel(tmp_path, monkeypatch, caplog):
    obj, _armature = scenes.make_arm()
    other, _rig = scenes.make_arm(name="Other")
    for each in (obj, other):
        scenes.add_sinew(each, "dq")
    expected = scenes.shapes(obj, FRAMES)
    prepare = apply_plan.apply_saved

    def fail_for_one(each, plan):
        if each == obj:
            raise RuntimeError("disk on fire")
        return prepare(each, plan)

    monkeypatch.setattr(apply_plan, "apply_saved", fail_for_one)
    scenes.save(tmp_path / "saved.blend")
    monkeypatch.undo()
    assert "Arm: A Blender without Sinew will not show it posed: RuntimeError: disk on fire" in caplog.text
    assert "disk on fire" in " ".join(state_text.problems_of(obj))
    assert state_text.problems_of(other) == []
    assert np.array_equal(scenes.shapes(obj, FRAMES), expected)
    scenes.save(tmp_path / "saved.blend")
    assert state_text.problems_of(obj) == []


def test_an_error_is_not_saved_as_the_artists_choice(tmp_path, monkeypatch):
    obj, _armature = scenes.skinned_arm("dq")
    expected = scenes.shapes(obj, FRAMES)

    def fail(*_args: object) -> None:
        raise RuntimeError("disk on fire")

    monkeypatch.setattr(armature_io, "read_pose", fail)
    scenes.shapes(obj, FRAMES)
    assert "disk on fire" in properties.of(obj).error
    path = scenes.save(tmp_path / "saved.blend")
    monkeypatch.undo()
    obj = scenes.opened(path)
    assert (properties.of(obj).enabled, properties.of(obj).error) == (True, "")
    assert np.array_equal(scenes.shapes(obj, FRAMES), expected)


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT"])
def test_saved_in_a_mode_of_the_modifier(tmp_path, mode):
    obj, _armature = scenes.make_arm()
    expected = scenes.modifier_shapes(obj, FRAMES, preserve_volume=True)
    scenes.add_sinew(obj, "dq")
    ours = scenes.shapes(obj, FRAMES)
    bpy.ops.object.mode_set(mode=mode)
    bpy.context.view_layer.update()
    scenes.save(tmp_path / "saved.blend")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(scenes.shapes(obj, FRAMES), ours)
    assert not obj.modifiers["Armature"].use_deform_preserve_volume
    shapes, _facts = played_without_sinew(tmp_path / "saved.blend")
    assert scenes.worst(shapes, expected) <= 1e-6


@pytest.mark.parametrize("what", ["small", "off"])
def test_one_character_costs_no_others_file(tmp_path, monkeypatch, what):
    small, armature = scenes.make_arm(name="A First")
    obj, _armature = scenes.make_arm()
    expected = scenes.modifier_shapes(obj, FRAMES, preserve_volume=True)
    monkeypatch.setattr(small_meshes, "is_used", what == "small")
    scenes.add_sinew(small, "lbs")
    monkeypatch.setattr(small_meshes, "is_used", False)
    properties.of(small).enabled = what != "off"
    scenes.add_sinew(obj, "dq")
    scenes.save(tmp_path / "saved.blend")
    shapes, _facts = played_without_sinew(tmp_path / "saved.blend")
    assert np.array_equal(shapes, expected)
    assert small.modifiers["Armature"].object == armature


@pytest.mark.parametrize("is_in_front", [False, True])
@pytest.mark.parametrize("is_safe", [False, True])
def test_in_memory_the_modifiers_keep_their_armatures(monkeypatch, is_in_front, is_safe):
    """For files that Blender writes without notification: autosaves, quit.blend, undo steps."""
    obj, armature = scenes.make_arm()
    if is_in_front:
        scenes.put_in_front(obj, "VERTEX_WEIGHT_EDIT")
    monkeypatch.setattr(safe_mode, "is_on", lambda: is_safe)
    scenes.add_sinew(obj, "dq")
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        assert obj.modifiers["Armature"].object == armature


def test_a_keyed_pose_that_differs_is_not_lost_by_opening(tmp_path):
    """Blender's first evaluation of an opened file takes poses from their keys."""
    obj, armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(11)
    armature.pose.bones[1].rotation_quaternion = (1.0, 0.0, 0.0, 0.0)
    obj = scenes.reopened(tmp_path / "saved.blend")
    bpy.context.view_layer.update()
    shown = scenes.final_points(obj)
    bpy.context.scene.frame_set(10)
    bpy.context.scene.frame_set(11)
    assert np.array_equal(scenes.final_points(obj), shown)


def test_the_menu_of_modifiers_offers_nothing_of_sinews():
    obj, _armature = scenes.skinned_arm("dq")
    properties.of(obj).heat = True
    bpy.ops.sinew.compare(methods={"lbs", "dq"})
    groups = [group for group in bpy.data.node_groups if group.get(node_group.MARK)]
    assert groups
    assert not any(group.is_modifier for group in groups)


def test_an_fbx_export_that_fails_ends_as_one_that_does_not(tmp_path):
    obj, _armature = scenes.skinned_arm("dq")
    ours = scenes.shapes(obj, FRAMES)
    with pytest.raises(RuntimeError):
        bpy.ops.export_scene.fbx(filepath=str(tmp_path / "no such folder" / "arm.fbx"))
    assert scenes.worst(scenes.shapes(obj, FRAMES), ours) <= 1e-6
    assert stack.sinew_modifier(obj).show_viewport
