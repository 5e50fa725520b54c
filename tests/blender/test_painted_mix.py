# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender is the oracle of the library's stage `mix`: a linear Armature modifier, and behind it one with
Preserve Volume, Multi Modifier and the vertex group."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
import sinew
from conftest import REPOSITORY
from sinew_addon.attach import attach
from sinew_addon.io import files

GROUP = "Painted mix"


def painted(count: int) -> np.ndarray:
    """Runs of 0 and of 1, and values in between."""
    rng = np.random.default_rng(1)
    return np.repeat(np.clip(rng.uniform(-0.6, 1.6, count // 50 + 1), 0.0, 1.0), 50)[:count].astype(
        np.float32
    )


def mixed_by_blender(obj: bpy.types.Object, shares: np.ndarray) -> np.ndarray:
    group = obj.vertex_groups.new(name=GROUP)
    for vertex, share in enumerate(shares):
        if share > 0.0:
            group.add([vertex], float(share), "REPLACE")
    first = next(modifier for modifier in obj.modifiers if modifier.type == "ARMATURE")
    first.use_deform_preserve_volume = False
    second = obj.modifiers.new("Second", "ARMATURE")
    second.object, second.vertex_group = first.object, GROUP
    second.use_multi_modifier = second.use_deform_preserve_volume = True
    obj.modifiers.move(len(obj.modifiers) - 1, list(obj.modifiers).index(first) + 1)
    for other in obj.modifiers:
        other.show_viewport = other in (first, second)
    return scenes.final_points(obj)


def mixed_by_sinew(obj: bpy.types.Object, armature: bpy.types.Object, shares: np.ndarray) -> np.ndarray:
    """Reads pose and weights one by one."""
    evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bones = {bone.name: number for number, bone in enumerate(armature.data.bones) if bone.use_deform}
    rest = np.array([bone.matrix_local for bone in armature.data.bones])
    motions = np.array([bone.matrix for bone in evaluated.pose.bones]) @ np.linalg.inv(rest)
    offsets, indices, weights = [0], [], []
    for vertex in obj.data.vertices:
        for entry in vertex.groups:
            name = obj.vertex_groups[entry.group].name
            if name in bones:
                indices.append(bones[name])
                weights.append(entry.weight)
        offsets.append(len(indices))
    binding = sinew.Binding(
        scenes.rest_points(obj),
        np.int32(offsets),
        np.int32(indices),
        np.float32(weights),
        rest.astype(np.float32),
    )
    deformer = sinew.Deformer(binding, "lbs", mix=("dq", shares))
    to_armature = np.array(armature.matrix_world.inverted() @ obj.matrix_world)
    return deformer.deform(motions.astype(np.float32), bones_from_model=to_armature.astype(np.float32))


def assert_equal_to_blender(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    shares = painted(len(obj.data.vertices))
    assert (shares == 0.0).any()
    assert (shares == 1.0).any()
    assert ((shares > 0.0) & (shares < 1.0)).any()
    linear = scenes.modifier_shapes(obj, [bpy.context.scene.frame_current], False)[0]
    volume = scenes.modifier_shapes(obj, [bpy.context.scene.frame_current], True)[0]
    tolerance = scenes.TOLERANCE * scenes.diagonal(obj)
    assert scenes.worst(linear, volume) > 100 * tolerance, "both methods agree in this pose"
    expected = mixed_by_blender(obj, shares)
    assert scenes.worst(mixed_by_sinew(obj, armature, shares), expected) <= tolerance


@pytest.mark.parametrize(("name", "frame"), [("wrist", 20), ("shoulder", 25), ("tentacle", 30)])
def test_own_rigs(name, frame):
    files.open_file(REPOSITORY / "blend_files" / f"{name}.blend")
    (obj,) = attach.deformed_meshes(list(bpy.context.scene.objects))
    bpy.context.scene.frame_set(frame)
    assert_equal_to_blender(obj, attach.armature_of(obj))


def test_a_mesh_that_lies_elsewhere():
    obj, armature = scenes.make_arm(bones=3, rings=41)
    obj.location, obj.rotation_euler = (0.4, -1.0, 0.3), (0.2, 0.5, 0.1)
    armature.location = (1.0, 2.0, -0.5)
    bpy.context.scene.frame_set(9)
    assert_equal_to_blender(obj, armature)
