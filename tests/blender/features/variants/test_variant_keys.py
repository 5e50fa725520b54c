# SPDX-License-Identifier: GPL-3.0-or-later
"""Which variants number keys offer, and what the header says of them; sheet_in_window.py presses the keys."""

from __future__ import annotations

import bpy
import five_meshes
import pytest
import scenes
from sinew_addon.attach import properties
from sinew_addon.features.variants import choices, keys

pytestmark = pytest.mark.long_term


def said() -> str:
    return keys.header(bpy.context, choices.of_character(bpy.context))


def test_the_header_says_what_each_key_uses():
    obj, _armature = scenes.skinned_arm("dq")
    five_meshes.select(obj)
    assert said().startswith("1 As Blender   2 \u25cf Dual Quaternion   3 Centres of Rotation   4 ")
    assert said().endswith("   Esc ends")
    bpy.ops.sinew.add_variant(name="Mine")
    assert said() == "1 As Blender   2 \u25cf Mine   Esc ends"
    properties.of(obj).enabled = False
    assert said() == "1 \u25cf As Blender   2 Mine   Esc ends"
    properties.of(obj).enabled = True
    for number in range(12):
        bpy.ops.sinew.add_variant(name=f"V{number}")
    assert "9 \u25cf V6" in said()
    assert "10 " not in said()


def test_what_a_key_uses_is_what_the_header_says():
    obj, _armature = scenes.skinned_arm("dq")
    five_meshes.select(obj)
    for number, variant in enumerate(choices.of_character(bpy.context), start=1):
        keys.use(variant)
        assert f"{number} \u25cf {choices.label(variant)}" in said()
        assert said().count("\u25cf") == 1


def test_it_needs_a_view():
    obj, _armature = scenes.skinned_arm("dq")
    five_meshes.select(obj)
    with pytest.raises(RuntimeError, match="in a 3D view"):
        bpy.ops.sinew.variant_keys("INVOKE_DEFAULT")
    assert not keys.SINEW_OT_variant_keys.is_on
