# SPDX-License-Identifier: GPL-3.0-or-later
"""Variants of a character: the file keeps them, a click uses one, and a comparison shows their shapes."""

from __future__ import annotations

import bpy
import five_meshes
import numpy as np
import pytest
import scenes
from sinew_addon.attach import properties, variant_settings
from sinew_addon.features.compare import comparison_state
from sinew_addon.skinning.variants import parse

pytestmark = pytest.mark.long_term


def texts(obj):
    return properties.of(obj).variants.splitlines()


def character():
    obj, _armature = scenes.skinned_arm("dq")
    five_meshes.select(obj)
    bpy.context.scene.frame_set(11)
    return obj


def test_what_is_set_is_kept_and_used_again(tmp_path):
    obj = character()
    scenes.set_stage(obj, "delta_mush", enabled=True, iterations=9)
    properties.of(obj).scale_rule = "none"
    assert bpy.ops.sinew.add_variant(name="Soft") == {"FINISHED"}
    soft = scenes.final_points(obj)
    (text,) = texts(obj)
    assert text == "Soft=dq+delta_mush:iterations=9+scale_rule=none+normals=BY_SINEW"
    assert bpy.ops.sinew.use_variant(variant="lbs+scale_rule=4.0") == {"FINISHED"}
    assert scenes.worst(scenes.final_points(obj), soft) > 1e-3
    assert bpy.ops.sinew.use_variant(variant="As Blender=blender") == {"FINISHED"}
    assert not properties.of(obj).enabled
    path = scenes.save(tmp_path / "kept.blend")
    obj = scenes.opened(path)
    five_meshes.select(obj)
    assert texts(obj) == [text]
    assert bpy.ops.sinew.use_variant(variant=text) == {"FINISHED"}
    bpy.context.scene.frame_set(11)
    assert scenes.worst(scenes.final_points(obj), soft) < 1e-6
    assert parse(text).agrees_with(variant_settings.read(obj))
    with pytest.raises(RuntimeError, match="expected one of mix"):
        bpy.ops.sinew.use_variant(variant="dq+foo")


def test_they_are_edited():
    obj = character()
    bpy.ops.sinew.add_variant(name="A")
    properties.of(obj).method = "cor"
    bpy.ops.sinew.add_variant(name="B")

    def edit(number, action, **values):
        assert bpy.ops.sinew.edit_variant(number=number, action=action, **values) == {"FINISHED"}
        return [parse(text).name + parse(text).method for text in texts(obj)]

    assert edit(0, "DUPLICATE") == ["Adq", "Adq", "Bcor"]
    assert edit(1, "RENAME", name="C") == ["Adq", "Cdq", "Bcor"]
    assert edit(2, "UP") == ["Adq", "Bcor", "Cdq"]
    assert edit(0, "DOWN") == ["Bcor", "Adq", "Cdq"]
    assert edit(2, "UPDATE") == ["Bcor", "Adq", "Ccor"]
    assert edit(1, "DELETE") == ["Bcor", "Ccor"]
    for number, action, said in ((0, "UP", "at the end of the list"), (5, "DELETE", "no such variant")):
        with pytest.raises(RuntimeError, match=said):
            bpy.ops.sinew.edit_variant(number=number, action=action)
    with pytest.raises(RuntimeError, match="has one of"):
        bpy.ops.sinew.edit_variant(number=0, action="RENAME", name="a+b")
    assert len(texts(obj)) == 2
    bpy.ops.sinew.remove()
    assert not obj.is_property_set("sinew")


def test_all_meshes_of_a_character_have_them():
    body, armature = scenes.skinned_arm("dq")
    other, _rig = scenes.make_arm(name="Shirt")
    other.modifiers[0].object = armature
    five_meshes.select(body)
    bpy.ops.sinew.add_variant(name="A")
    bpy.ops.sinew.add()
    assert texts(other) == texts(body) != []
    bpy.data.objects.remove(body)
    bpy.context.view_layer.update()
    five_meshes.select(other)
    bpy.ops.sinew.add_variant(name="B")
    assert [parse(text).name for text in texts(other)] == ["A", "B"]


def test_a_comparison_shows_their_shapes():
    obj = character()
    scenes.set_stage(obj, "twist_spread", enabled=True)
    key = "Soft=dq+delta_mush:iterations=9"
    assert bpy.ops.sinew.compare(methods={"dq"}, variants=key) == {"FINISHED"}
    state = comparison_state.of_scene(bpy.context.scene)
    assert comparison_state.methods_of(state) == ["dq", key]
    assert (state.first, state.second) == ("dq", key)
    own, soft = (
        variant_settings.read(copy)
        for copy in sorted(
            comparison_state.copies_of(state), key=lambda copy: properties.of(copy).identity.method
        )
    )
    assert {own.text.partition("+scale")[0], soft.text.partition("+scale")[0]} == {
        "dq+twist_spread",
        "dq+delta_mush:iterations=9",
    }
    copy = next(c for c in comparison_state.copies_of(state) if properties.of(c).identity.method == key)
    shown = scenes.world_points(copy) - 2 * state.spacing * np.array(state.axis)
    state.arrangement = comparison_state.ONE_OF_TWO
    bpy.ops.sinew.flip_comparison()
    assert comparison_state.shown_methods(state) == [key]
    assert comparison_state.label_of(key) == "Soft: Dual Quaternion with Delta Mush"
    bpy.ops.sinew.end_comparison()
    bpy.ops.sinew.use_variant(variant=key)
    assert scenes.worst(scenes.world_points(obj), shown) < 1e-5
    with pytest.raises(RuntimeError, match="can not be shown as a variant"):
        bpy.ops.sinew.compare(methods={"dq"}, variants="file")
