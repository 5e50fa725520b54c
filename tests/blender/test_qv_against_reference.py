# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender has no quaternion-vector skinning: the oracle is the float64 reference, with Blender's own
poses."""

from __future__ import annotations

import sys

import bpy
import numpy as np
import scenes
from conftest import REPOSITORY
from sinew_addon.attach import attach
from sinew_addon.io import files

sys.path.append(str(REPOSITORY / "tests" / "python"))
import reference


def assert_equal_to_reference(obj: bpy.types.Object, frame: int) -> None:
    """Reads pose and weights one by one, without Sinew's code."""
    armature = attach.armature_of(obj)
    scenes.add_sinew(obj, "qv")
    bpy.context.scene.frame_set(frame)
    evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bones = [bone.name for bone in armature.data.bones]
    motions = np.array([np.array(b.matrix @ b.bone.matrix_local.inverted()) for b in evaluated.pose.bones])
    chosen = range(0, len(obj.data.vertices), 7)
    offsets, indices, weights = [0], [], []
    for vertex in chosen:
        for entry in obj.data.vertices[vertex].groups:
            indices.append(bones.index(obj.vertex_groups[entry.group].name))
            weights.append(entry.weight)
        offsets.append(len(indices))
    # The blend rotates about the armature's origin, wherever the mesh object is.
    to_armature = np.array(armature.matrix_world.inverted() @ obj.matrix_world)
    rest = scenes.rest_points(obj)[::7] @ to_armature[:3, :3].T + to_armature[:3, 3]
    expected, margins = reference.deform("qv", rest, offsets, indices, weights, motions)
    back = np.linalg.inv(to_armature)
    expected = expected @ back[:3, :3].T + back[:3, 3]
    # Within rounding of a tie, both signs are right.
    decided = margins > 1e-4
    assert decided.mean() > 0.95
    assert scenes.worst(
        scenes.final_points(obj)[::7][decided], expected[decided]
    ) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_own_rigs():
    for name, frame in (("wrist", 20), ("shoulder", 25), ("tentacle", 30)):
        files.open_file(REPOSITORY / "blend_files" / f"{name}.blend")
        (obj,) = attach.deformed_meshes(list(bpy.context.scene.objects))
        assert_equal_to_reference(obj, frame)


def test_a_mesh_that_lies_elsewhere():
    obj, armature = scenes.make_arm(bones=3)
    obj.location, obj.rotation_euler = (0.4, -1.0, 0.3), (0.2, 0.5, 0.1)
    armature.location = (1.0, 2.0, -0.5)
    bpy.context.view_layer.update()
    assert_equal_to_reference(obj, 8)


def test_a_real_rig(real_rig):
    files.open_file(real_rig("human.blend"))
    (obj,) = attach.deformed_meshes(list(bpy.context.scene.objects))
    assert_equal_to_reference(obj, 16)
