# SPDX-License-Identifier: GPL-3.0-or-later
"""The contact sheet of a character as an image; its rows; the pose that one goes to from a cell, and the
artist's, which comes back. sheet_in_window.py clicks on it."""

from __future__ import annotations

import bpy
import five_meshes
import numpy as np
import pytest
import read_page
import scenes
import test_clip
import whole_file
from sinew_addon.attach import properties, variant_settings
from sinew_addon.base.errors import SinewError
from sinew_addon.features.contact_sheet import feature, look, rows
from sinew_addon.features.measure import battery, live, motion_range
from sinew_addon.features.measure.rigs import rigs_of
from sinew_addon.features.pages.contact_sheet import Bent
from sinew_addon.features.pages.shaded import FRONT
from sinew_addon.features.pages.sheet import CLOTH, PAPER
from sinew_addon.features.pages.sheet_layout import Layout
from sinew_addon.features.suggest import recommend
from sinew_addon.features.variants import choices
from sinew_addon.skinning.variants import parse

pytestmark = pytest.mark.long_term

SIZE = 96


@pytest.fixture
def character() -> tuple[bpy.types.Object, bpy.types.Object]:
    obj, armature = scenes.skinned_arm("dq")
    five_meshes.select(obj)
    bpy.context.scene.frame_set(11)
    return obj, armature


def labels(text: str = "") -> list[str]:
    return list(map(choices.label, rows.rows(bpy.context, text)))


def test_rows_are_the_variants_of_the_character(character):
    obj, _armature = character
    usual = labels()
    assert usual[:3] == ["As Blender", "Dual Quaternion", "Centres of Rotation"]
    assert len(usual) == 5
    properties.of(obj).method = "log"
    assert labels() == ["As Blender", "Now", *usual[1:]]
    bpy.ops.sinew.add_variant(name="Mine")
    assert labels() == ["As Blender", "Mine"]
    scenes.set_stage(obj, "delta_mush", enabled=True)
    assert labels() == ["As Blender", "Now", "Mine"]
    assert bpy.ops.sinew.recommend() == {"FINISHED"}
    assert labels() == ["As Blender", "Recommended", "Mine"]
    recommended = rows.rows(bpy.context, "")[1]
    assert recommended.agrees_with(variant_settings.read(obj))
    assert recommended.method == recommend.choices[bpy.context.scene.session_uid].variant.method
    assert labels("cor, blender, Soft=dq+delta_mush") == ["Centres of Rotation", "Armature modifier", "Soft"]
    with pytest.raises(SinewError, match="choose it for the character first"):
        rows.rows(bpy.context, "recommended")


def test_meshes_with_settings_of_their_own_keep_them(character):
    obj, armature = character
    other, _rig = scenes.make_arm(name="Shirt")
    other.modifiers[0].object = armature
    bpy.ops.sinew.add()
    properties.of(other).is_own = True
    properties.of(other).method = "log"
    of_meshes = rows.of_meshes(bpy.context, [parse("cor")])
    assert {each.name: variant.method for each, variant in of_meshes[0].items()} == {
        obj.name: "cor",
        other.name: "log",
    }


@pytest.mark.parametrize("is_on", [True, False])
def test_the_image(character, is_on):
    obj, _armature = character
    properties.of(obj).enabled = is_on
    before = scenes.world_points(obj)
    arguments = {"variants": "blender, far=lbs+delta_mush:iterations=60", "size": SIZE}
    for _time in range(2):
        assert bpy.ops.sinew.contact_sheet("EXEC_DEFAULT", **arguments) == {"FINISHED"}
    assert [image.name for image in bpy.data.images] == [feature.IMAGE]
    np.testing.assert_array_equal(scenes.world_points(obj), before)
    assert properties.of(obj).enabled == is_on
    plain = pixels()
    layout = Layout(2, len(rows.joints(bpy.context)), SIZE)
    assert plain.shape == (layout.height, layout.width, 3)
    # Letters in the labels, clay in the cells.
    np.testing.assert_allclose(plain[0, 0], PAPER, atol=0.01)
    for row in range(2):
        label, picture = layout.label(row), layout.picture(row, 0)
        assert (part(plain, label).sum(axis=2) < 1.2).any()
        shown = part(plain, picture)
        is_cloth = np.abs(shown - CLOTH).max(axis=2) < 0.01
        assert 0.05 < is_cloth.mean() < 0.95
        assert (np.abs(shown - 0.8 * FRONT).max(axis=2) < 0.2).mean() > 0.05
    bpy.ops.sinew.contact_sheet("EXEC_DEFAULT", difference=True, **arguments)
    coloured = pixels()
    first, second = (layout.picture(row, 0) for row in range(2))
    np.testing.assert_allclose(part(coloured, first), part(plain, first), atol=1e-6)
    hues = np.ptp(part(coloured, second), axis=2)
    assert hues.max() > 0.3 > np.ptp(part(plain, second), axis=2).max()


@pytest.mark.parametrize("is_on", [True, False])
def test_the_sheet_as_a_page(character, tmp_path, is_on):
    """Of each cell: the pose that it goes to, with the shape and the view that it shows; and all else of the
    range of motion. The artist's pose, frame and settings stay."""
    obj, armature = character
    scenes.set_stage(obj, "delta_mush", iterations=7)
    bpy.ops.sinew.add_variant(name="Soft")
    scenes.set_stage(obj, "delta_mush", enabled=False)
    properties.of(obj).enabled = is_on
    joints, before, content = rows.joints(bpy.context), scenes.world_points(obj), whole_file.content()
    page = tmp_path / "sheet.html"
    assert bpy.ops.sinew.save_contact_sheet(filepath=str(page)) == {"FINISHED"}
    np.testing.assert_array_equal(scenes.world_points(obj), before)
    whole_file.assert_same(content)
    header, (arrays,) = read_page.read(page)
    sheet, variants = header["sheet"], rows.rows(bpy.context, "")
    keys = [each.key for each in variants]
    assert [row["name"] for row in sheet["rows"]] == keys == list(header["methods"])
    assert len(sheet["columns"]) == len(joints) == len(sheet["rows"][0]["cells"])
    assert header["frames"][0] == "At rest"
    of_range = motion_range.poses(joints[0].rig.bones, {}, joints[0].rig.is_moving)
    assert header["frames"][1 : 1 + len(of_range)] == [pose.name for pose in of_range]
    world = np.array(armature.matrix_world)
    for column, joint in zip(sheet["columns"], joints, strict=True):
        np.testing.assert_allclose(column["target"], joint.view.target)
        np.testing.assert_allclose(column["direction"], joint.view.direction)
        for variant in variants:
            found = read_page.points(header["parts"][0], arrays, variant.key, column["frame"])
            expected = joint.moment.points_under([variant])
            assert scenes.worst(found @ world[:3, :3].T + world[:3, 3], expected) < 1e-5


def pixels() -> np.ndarray:
    """From the top."""
    image = bpy.data.images[feature.IMAGE]
    assert not image.is_dirty
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found.reshape(image.size[1], image.size[0], 4)[::-1, :, :3]


def part(whole: np.ndarray, box) -> np.ndarray:
    top, left = int(box.top), int(box.left)
    return whole[top : top + int(box.height), left : left + int(box.width)]


def test_one_goes_to_the_shape_of_a_cell(character):
    obj, _armature = character
    before, content = scenes.world_points(obj), whole_file.content()
    joint = max(rows.joints(bpy.context), key=lambda each: each.bent_share)
    variant = variant_settings.read(obj)
    posed = look.Posed(bpy.context.scene)
    posed.show(joint)
    shown = scenes.world_points(obj)
    assert scenes.worst(shown, before) > 0.1
    assert scenes.worst(joint.moment.measured_under([variant]).shape.points.T, shown) < 1e-5
    posed.show(joint)
    assert scenes.worst(scenes.world_points(obj), shown) < 1e-6
    posed.end()
    assert scenes.worst(scenes.world_points(obj), before) < 1e-6
    whole_file.assert_same(content)


def test_the_artists_pose_comes_back():
    """Where strips, drivers and constraints move bones, and a bone differs from its keys."""
    obj, armature = test_clip.make_figure("mixamo", 4)
    five_meshes.select(obj)
    joint = joint_of(obj, armature)
    test_clip.obstruct(armature, "mixamo")
    armature.pose.bones[2].location = (0.0, 0.9, 0.1)
    bpy.context.view_layer.update()
    pose, content = scenes.pose_of(armature), whole_file.content()
    posed = look.Posed(bpy.context.scene)
    posed.show(joint)
    np.testing.assert_allclose(scenes.pose_of(armature), posed_by(joint), atol=2e-5)
    posed.end()
    np.testing.assert_allclose(scenes.pose_of(armature), pose, atol=1e-6)
    whole_file.assert_same(content)


def test_a_range_of_motion_goes_on():
    obj, armature = test_clip.make_figure("mixamo", 4)
    five_meshes.select(obj)
    joint = joint_of(obj, armature)
    bpy.ops.sinew.motion_range()
    pose = scenes.pose_of(armature)
    posed = look.Posed(bpy.context.scene)
    posed.show(joint)
    np.testing.assert_allclose(scenes.pose_of(armature), posed_by(joint), atol=2e-5)
    posed.end()
    np.testing.assert_allclose(scenes.pose_of(armature), pose, atol=1e-6)
    assert bpy.ops.sinew.end_motion_range() == {"FINISHED"}


def joint_of(obj, armature):
    """A joint in a pose, of a figure without a surface that bends."""
    now = live.Moment.of(live.measure_now([obj], "blender", "bend"))
    (rig,) = rigs_of(now)
    assert rig.armature == armature
    return Bent(now, [rig], rig, motion_range.columns(rig.bones, rig.is_moving)[0])


def posed_by(joint) -> np.ndarray:
    bones = joint.rig.bones
    return battery.posed(bones, joint.pose)[: len(bones.names)]
