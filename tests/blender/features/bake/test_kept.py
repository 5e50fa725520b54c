# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh keeps the numbers of its last bake, and what deformed it before: Sinew on it once more takes that by
a click, also in another session."""

from __future__ import annotations

import bpy
import pytest
import scenes
from sinew_addon.attach import properties
from sinew_addon.features.bake import kept

pytestmark = pytest.mark.outer_versions


def baked_arm(kind: str, **options: object) -> bpy.types.Object:
    """By dual quaternions with Delta Mush, faded by a vertex group."""
    obj, _armature = scenes.skinned_arm("dq")
    settings = properties.of(obj)
    obj.vertex_groups.new(name="Soft").add(range(8), 0.5, "REPLACE")
    settings.delta_mush.enabled, settings.delta_mush.iterations = True, 7
    settings.delta_mush.group = "Soft"
    assert bpy.ops.sinew.bake(kind=kind, frames="1-5", **options) == {"FINISHED"}
    assert not properties.has_sinew(obj)
    return obj


def test_numbers_stay_in_the_file(tmp_path):
    obj = baked_arm("bones", helpers=2)
    (said,) = kept.sentences_of(obj)
    assert said.startswith(f"{obj.modifiers['Armature'].object.name}: 2 helper bones; error ")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    (read,) = kept.sentences_of(next(filter(kept.is_baked, bpy.data.objects)))
    assert (read, read.template, read.values) == (said, said.template, said.values)


def test_what_was_made_is_said_of_shape_keys():
    assert kept.sentences_of(baked_arm("shape-keys")) == ["5 shape keys, one a frame"]


@pytest.mark.parametrize("kind", ["shape-keys", "bones"])
def test_a_click_takes_what_was_set_before(kind):
    obj = baked_arm(kind)
    scenes.add_sinew(obj, "lbs")
    assert kept.before(obj).method == "dq"
    assert bpy.ops.sinew.use_before_bake() == {"FINISHED"}
    settings = properties.of(obj)
    found = settings.method, settings.delta_mush.enabled, settings.delta_mush.iterations
    assert found == ("dq", True, 7)
    # A bake to bones replaces the weights, and keeps other groups or not.
    assert settings.delta_mush.group == ("Soft" if "Soft" in obj.vertex_groups else "")
    assert kept.before(obj) is None


def test_a_mesh_that_was_not_baked_has_nothing():
    obj, _armature = scenes.skinned_arm("dq")
    assert kept.before(obj) is None
    assert kept.sentences_of(obj) == []
    assert not obj.is_property_set("sinew_bake")
