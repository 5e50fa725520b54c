# SPDX-License-Identifier: GPL-3.0-or-later
"""A file saved with Sinew, opened in a Blender that has never heard of it."""

from __future__ import annotations

import subprocess
import sys

import bpy
import numpy as np
import scenes

READ = """
import sys, bpy, numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Object, "sinew")
obj = bpy.data.objects["Arm"]

def points():
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    result = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", result.ravel())
    return result

modifier = obj.modifiers["Armature"]
shown = points()
state = (modifier.object.name, modifier.show_viewport, modifier.show_render)
obj.modifiers["Sinew"].show_viewport = False
modifier.show_viewport = True
bpy.context.view_layer.update()
np.savez(sys.argv[2], shown=shown, switched_on=points(), state=np.array(state, dtype=str))
"""


def test_shows_the_last_shape_and_needs_only_switching_on(tmp_path):
    obj, _armature = scenes.make_arm()
    linear = scenes.modifier_shapes(obj, [11], preserve_volume=False)[0]
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(11)
    dual = scenes.final_points(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    result = tmp_path / "read.npz"
    subprocess.run(
        [sys.executable, "-c", READ, str(tmp_path / "saved.blend"), str(result)], check=True, timeout=60
    )
    with np.load(result) as read:
        assert np.array_equal(read["shown"], dual)
        assert np.array_equal(read["switched_on"], linear)
        assert list(read["state"]) == ["Arm Rig", "False", "False"]
