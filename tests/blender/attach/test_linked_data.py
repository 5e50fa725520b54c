# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters that come from another file: library overrides, and objects whose mesh is linked."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach, properties, stack
from sinew_addon.base.errors import SinewError

FRAMES = [1, 4, 11]


def save_library(folder: Path, skinned: bool, front: bool) -> np.ndarray:
    """A file with an arm in a collection; the arm's shapes under Preserve Volume."""
    obj, armature = scenes.make_arm()
    if front:
        scenes.put_in_front(obj)
    expected = scenes.modifier_shapes(obj, FRAMES, preserve_volume=True)
    collection = bpy.data.collections.new("Character")
    bpy.context.scene.collection.children.link(collection)
    scenes.move_to(collection, obj, armature)
    if skinned:
        scenes.add_sinew(obj, "dq")
    scenes.save(folder / "library.blend")
    return expected


def link(folder: Path, override: bool) -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    library = folder / "library.blend"
    if override:
        with bpy.data.libraries.load(str(library), link=True) as (_source, target):
            target.collections = ["Character"]
        # Blender 5.3 makes no override of a collection that is not in the scene, and says nothing.
        bpy.context.scene.collection.children.link(target.collections[0])
        target.collections[0].override_hierarchy_create(
            bpy.context.scene, bpy.context.view_layer, do_fully_editable=True
        )
    else:
        scenes.link_here(library, "Arm", "Arm Rig")[0].make_local()
    bpy.context.view_layer.update()


def character() -> bpy.types.Object:
    (obj,) = (
        o for o in bpy.data.objects if o.type == "MESH" and o.library is None and not properties.is_helper(o)
    )
    assert obj.data.library is not None
    return obj


def assert_shapes(expected: np.ndarray) -> None:
    got = scenes.shapes(character(), FRAMES)
    assert got.shape == expected.shape
    assert scenes.worst(got, expected) <= 1e-5


@pytest.mark.parametrize("front", [False, True], ids=["alone", "front"])
@pytest.mark.parametrize("skinned", [False, True], ids=["plain", "skinned"])
@pytest.mark.parametrize("override", [False, True], ids=["local", "override"])
def test_linked_meshes(tmp_path, override, skinned, front):
    expected = save_library(tmp_path, skinned, front)
    link(tmp_path, override)
    scenes.add_sinew(character(), "dq")
    assert_shapes(expected)
    assert not properties.of(character()).error
    scenes.reopened(tmp_path / "shot.blend")
    assert properties.has_sinew(character())
    assert_shapes(expected)
    if skinned and override:
        with pytest.raises(SinewError, match="from its library"):
            attach.remove(character())
        properties.of(character()).enabled = False
        scenes.reopened(tmp_path / "shot.blend")
        assert not properties.of(character()).enabled
        assert len(attach.replaced_modifiers(character())) == 1
    else:
        attach.remove(character())
    obj = character()
    obj.modifiers["Armature"].use_deform_preserve_volume = True
    assert obj.modifiers["Armature"].object is not None
    assert_shapes(expected)
    if skinned and override:
        return
    # An override of a hierarchy includes what the library's own character has of Sinew.
    local = [o for o in bpy.data.objects if o.library is None and o.override_library is None]
    assert not any(properties.is_helper(o) for o in local)


def test_a_saved_override_works_without_sinew(tmp_path):
    """With settings that notify Sinew when an artist changes them."""
    save_library(tmp_path, skinned=True, front=False)
    link(tmp_path, override=True)
    obj = character()
    properties.of(obj).leave_small = False
    assert stack.sinew_modifier(obj).show_viewport
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"), copy=True)
    assert stack.sinew_modifier(obj).show_viewport
    with bpy.data.libraries.load(str(tmp_path / "shot.blend"), link=True) as (_source, target):
        target.objects = [obj.name]
    saved = target.objects[0]
    assert saved.library.name == "shot.blend"
    assert [(m.type, m.show_viewport) for m in scenes.modifiers(saved)] == [
        ("ARMATURE", True),
        ("NODES", False),
    ]


def test_an_override_keeps_its_own_stages_and_parameters(tmp_path):
    save_library(tmp_path, skinned=True, front=False)
    link(tmp_path, override=True)
    settings = properties.of(character())
    settings.mix.method, settings.mix.group = "lbs", "bone.1"
    settings.delta_mush.iterations, settings.delta_mush.enabled = 9, True
    settings.sdef.interpolation = "slerp"
    expected = scenes.shapes(character(), FRAMES)
    scenes.reopened(tmp_path / "shot.blend")
    settings = properties.of(character())
    assert (settings.mix.method, settings.mix.group, settings.sdef.interpolation) == (
        "lbs",
        "bone.1",
        "slerp",
    )
    assert (settings.delta_mush.iterations, settings.delta_mush.enabled) == (9, True)
    assert_shapes(expected)
