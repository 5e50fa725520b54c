# SPDX-License-Identifier: GPL-3.0-or-later
"""The contact sheet: its shapes are those that Blender evaluates under each variant in the same pose, and the
command writes all of it."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import read_page
import scenes
from mathutils import Matrix
from PIL import Image
from program import run_sinew
from sinew_addon.attach import properties, variant_settings
from sinew_addon.deform import session
from sinew_addon.features.pages import contact_sheet
from sinew_addon.skinning.variants import parse

pytestmark = pytest.mark.long_term

VARIANTS = (
    "blender",
    "lbs",
    "dq+scale_rule=none",
    "cor",
    "dq+bulge_limit+delta_mush:iterations=9",
    "lbs+mix=dq",
    "unity",
)


@pytest.mark.parametrize("text", VARIANTS)
def test_shapes_are_those_of_blender(text):
    obj, armature = scenes.skinned_arm("lbs")
    scenes.forget_keys(armature)
    obj.location, armature.rotation_euler = (0.3, 0.1, 0.0), (0.2, 0.1, 0.4)
    scenes.paint(obj, "Mix", np.linspace(0.0, 1.0, len(obj.data.vertices)))
    properties.of(obj).mix.group = "Mix"
    bpy.context.view_layer.update()
    before = scenes.world_points(obj)
    joints = contact_sheet.columns([obj])
    joint = max(joints, key=lambda each: each.bent_share)
    variant = parse(text)
    found = joint.moment.measured_under([variant]).shape.points.T
    np.testing.assert_array_equal(scenes.world_points(obj), before, "nothing is posed")
    with session.changing(bpy.context):
        variant_settings.use([obj], variant)
    ((bone, rotation),) = joint.pose.rotations.items()
    scenes.rotate_in_armature(armature.pose.bones[bone], Matrix(rotation.tolist()).to_quaternion())
    bpy.context.view_layer.update()
    shown = scenes.world_points(obj)
    assert scenes.worst(shown, before) > 0.1
    assert scenes.worst(found, shown) < 1e-5


def test_what_is_set_is_a_variant_and_back():
    obj, _armature = scenes.skinned_arm("lbs")
    variant = parse(
        "dq:signs=hierarchy+twist_spread:amount=0.5+delta_mush:iterations=9+scale_rule=3.x+normals=LEAVE"
    )
    with session.changing(bpy.context):
        variant_settings.use([obj], variant)
    assert variant_settings.read(obj) == variant
    with session.changing(bpy.context):
        variant_settings.use([obj], parse("blender"))
    assert not properties.of(obj).enabled
    assert variant_settings.read(obj) == parse("blender")


def is_yellow(pixels):
    """What is far from the first row, and the end of the legend."""
    red, green, blue = np.moveaxis(pixels.astype(int), -1, 0)
    return (red > 120) & (green > 120) & (blue < 90)


def test_the_command_writes_a_cell_for_each(tmp_path):
    scenes.make_arm()
    path, sheet = scenes.save(tmp_path / "arm.blend"), tmp_path / "sheet.png"
    before = path.read_bytes()
    run_sinew("compare", path, "--sheet", sheet, "--variants", "blender, soft=dq+delta_mush", "--size", 96)
    pixels = np.asarray(Image.open(sheet).convert("RGB")).astype(int)
    assert path.read_bytes() == before
    # Clay in the cells, on their background.
    clay = (pixels[..., 0] - pixels[..., 2] > 8) & (pixels.sum(axis=2) > 90)
    assert clay.sum() > 2 * 96 * 96 * 0.1
    coloured = tmp_path / "coloured.png"
    options = "--variants", "blender, soft=dq+delta_mush:iterations=60", "--size", 96, "--difference"
    run_sinew("compare", path, "--sheet", coloured, *options)
    assert is_yellow(np.asarray(Image.open(coloured).convert("RGB"))).sum() > 50
    assert not is_yellow(pixels).any()
    page = tmp_path / "sheet.html"
    run_sinew("compare", path, "--sheet", sheet, "--variants", "dq, soft=lbs+delta_mush", "--viewer", page)
    header, _meshes = read_page.read(page)
    assert [row["name"] for row in header["sheet"]["rows"]] == ["=dq", "soft=lbs+delta_mush"]
    assert header["methods"]["soft=lbs+delta_mush"] == "soft: Linear Blend with Delta Mush"
    wrong = run_sinew("compare", path, "--out", tmp_path, "--difference", status=2)
    assert "it goes with --sheet" in wrong.stderr
    wrong = run_sinew("compare", path, "--sheet", sheet, "--frames", "1", status=2)
    assert "--frames does not go with it" in wrong.stderr
    wrong = run_sinew("compare", path, path, "--sheet", sheet, status=2)
    assert "a single file" in wrong.stderr
