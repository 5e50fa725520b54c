# SPDX-License-Identifier: GPL-3.0-or-later
"""Each operator of variants is one undo step, which brings all back."""

from __future__ import annotations

import bpy
import five_meshes
import numpy as np
import pytest
import scenes
import test_recommended
import whole_file
from sinew_addon.attach import properties, variant_settings
from sinew_addon.deform import session

pytestmark = [pytest.mark.long_term, pytest.mark.outer_versions]

EDITS = {
    "rename": ("edit_variant", {"number": 0, "action": "RENAME", "name": "C"}),
    "set to now": ("edit_variant", {"number": 0, "action": "UPDATE"}),
    "duplicate": ("edit_variant", {"number": 0, "action": "DUPLICATE"}),
    "move up": ("edit_variant", {"number": 1, "action": "UP"}),
    "move down": ("edit_variant", {"number": 0, "action": "DOWN"}),
    "delete": ("edit_variant", {"number": 1, "action": "DELETE"}),
    "add": ("add_variant", {"name": "C"}),
    "use": ("use_variant", {"variant": "A=lbs+delta_mush:iterations=9+scale_rule=4.0+normals=LEAVE"}),
    "use the modifier": ("use_variant", {"variant": "As Blender=blender"}),
    "use Recommended": ("use_variant", {"variant": "recommended"}),
    "use Recommended when off": ("use_variant", {"variant": "recommended"}),
}


def state(obj: bpy.types.Object) -> tuple[str, str, np.ndarray]:
    session.refresh(bpy.context)
    return properties.of(obj).variants, variant_settings.read(obj).text, scenes.final_points(obj)


def assert_state(wanted: tuple[str, str, np.ndarray]) -> None:
    found = state(bpy.data.objects["Arm"])
    assert found[:2] == wanted[:2]
    np.testing.assert_allclose(found[2], wanted[2], atol=1e-6)


@pytest.mark.parametrize("what", EDITS)
def test_one_step(what):
    obj, _armature = test_recommended.arm(143.0, axis=1, sides=16, rings=41)
    five_meshes.select(obj)
    bpy.context.scene.frame_set(11)
    bpy.ops.sinew.add_variant(name="A")
    properties.of(obj).method = "cor"
    bpy.ops.sinew.add_variant(name="B")
    properties.of(obj).twist_spread.enabled = True
    if what == "use Recommended when off":
        properties.of(obj).enabled = False
    before = state(obj)
    content = whole_file.content()
    bpy.ops.ed.undo_push(message="before")
    name, values = EDITS[what]
    # As a click: with the undo step that Blender pushes for the operator.
    assert getattr(bpy.ops.sinew, name)("EXEC_DEFAULT", True, **values) == {"FINISHED"}
    after = state(bpy.data.objects["Arm"])
    assert after[:2] != before[:2]
    assert properties.of(bpy.data.objects["Arm"]).enabled == (what != "use the modifier")
    bpy.ops.ed.undo()
    assert_state(before)
    whole_file.assert_same(content, whole_file.BY_UNDO)
    bpy.ops.ed.redo()
    assert_state(after)
