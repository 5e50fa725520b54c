# SPDX-License-Identifier: GPL-3.0-or-later
"""A Python with Blender as a module exits with status 0, whatever Sinew did in it."""

from __future__ import annotations

import pytest
from program import run_script

REGISTER = """
import bpy
import sinew_addon
sinew_addon.register()
"""
USE = """
from sinew_addon.attach import attach
import scenes
obj, armature = scenes.make_arm()
attach.add(obj, "dq")
for frame in (3, 7):
    bpy.context.scene.frame_set(frame)
"""
HEAT = """
obj.sinew.heat = True
bpy.context.scene.frame_set(5)
"""
UNREGISTER = """
sinew_addon.unregister()
"""
FAIL_TO_REGISTER = """
import bpy
import sinew_addon
from sinew_addon import registration
from sinew_addon.attach.feature import Feature

def fail():
    raise RuntimeError

features = registration._features()
registration._features = lambda: (*features, Feature(begin=fail))
try:
    sinew_addon.register()
except RuntimeError:
    registration._features = lambda: features
"""


@pytest.mark.parametrize(
    "parts",
    [
        (REGISTER,),
        (REGISTER, UNREGISTER, REGISTER, UNREGISTER),
        (REGISTER, USE, HEAT),
        (REGISTER, USE, HEAT, UNREGISTER),
        (FAIL_TO_REGISTER,),
        (FAIL_TO_REGISTER, REGISTER, USE, UNREGISTER),
    ],
    ids=["registered", "registered again", "in use", "used", "failed", "failed, then in use"],
)
def test_a_script_ends_with_status_0(parts, tmp_path):
    run_script(tmp_path / "script.py", "".join(parts))
