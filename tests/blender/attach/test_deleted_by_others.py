# SPDX-License-Identifier: GPL-3.0-or-later
"""Other add-ons' handlers, called before Sinew's, delete and rename what changed in the same evaluation.

Blender frees it immediately but still lists it; reading its original can then crash Blender. Each test
therefore is a separate process."""

from __future__ import annotations

import pytest
from conftest import halved
from program import run_script

BEGIN = """
import bpy, numpy as np
import scenes, sinew_addon
bpy.ops.wm.read_factory_settings(use_empty=True)
sinew_addon.register()
obj, armature = scenes.make_arm()
scene, events = bpy.context.scene, bpy.app.handlers

def make(count):
    made = []
    for number in range(count):
        mesh = bpy.data.meshes.new(f"gone {number}")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        other = bpy.data.objects.new(mesh.name, mesh)
        other.shape_key_add(name="Basis")
        other.shape_key_add(name="up").keyframe_insert("value", frame=1)
        other.keyframe_insert("location", frame=1)
        other.keyframe_insert("location", frame=9)
        scene.collection.objects.link(other)
        made.append(other)
    bpy.context.view_layer.update()
    return made

def evaluate(act, change):
    def once(*_):
        if not called:
            called.append(True)
            act()
    called = []
    getattr(events, EVENT).insert(0, once)
    change()
    if EVENT == "frame_change_post":
        scene.frame_set(scene.frame_current % 9 + 1)
    else:
        bpy.context.view_layer.update()
    getattr(events, EVENT).remove(once)
    assert called
"""
ADD = """
scenes.add_sinew(obj, "dq")
"""
DELETE = """
for turn in range(5):
    others = make(40)
    def delete():
        bpy.data.batch_remove([block for other in others for block in
                               (other, other.data, other.data.shape_keys, other.animation_data.action)])
    def change():
        for other in others:
            other.data.update_tag()
            other.data.shape_keys.key_blocks[1].value = 0.5
            other.animation_data.action.update_tag()
    evaluate(delete, change)
    rubbish = [bytes(1000) for _ in range(5000)]
"""
RENAME = """
def rename():
    obj.data.name, obj.name = "another mesh", "another object"
def change():
    obj.vertex_groups[0].add(range(len(obj.data.vertices) // 2), 0.9, "REPLACE")
    obj.data.update_tag()
evaluate(rename, change)
"""
COMPARE = """
got = scenes.shapes(obj, [1, 6, 11])
sinew_addon.unregister()
wanted = scenes.shapes(obj, [1, 6, 11])
assert np.abs(got - wanted).max() < 1e-5, np.abs(got - wanted).max()
"""


# Deleted beside nothing of Sinew, then beside a skinned mesh.
@pytest.mark.parametrize(
    ("event", "parts"),
    halved(
        [
            ("depsgraph_update_post", (ADD, RENAME, COMPARE)),
            ("depsgraph_update_post", (DELETE, ADD, DELETE, COMPARE)),
            ("frame_change_post", (DELETE, ADD, DELETE, COMPARE)),
            ("frame_change_post", (ADD, RENAME, COMPARE)),
        ]
    ),
    ids=["rename-update", "delete-update", "delete-frame", "rename-frame"],
)
def test_others_delete_before_sinew_is_called(parts, event, tmp_path):
    ran = run_script(tmp_path / "script.py", "\n".join((f"EVENT = {event!r}", BEGIN, *parts)))
    assert "Traceback" not in ran.stderr, ran.stderr
