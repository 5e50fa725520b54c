# SPDX-License-Identifier: GPL-3.0-or-later
"""Methods that Blender lacks: the oracle is the float64 reference, with Blender's own poses."""

from __future__ import annotations

import sys

import bpy
import numpy as np
import pytest
import scenes
import sinew
from conftest import REPOSITORY
from sinew_addon.attach import attach
from sinew_addon.io import files

sys.path.append(str(REPOSITORY / "tests" / "python"))
import reference

METHODS = ("qv", "cor", "sbs", "dib")
STEP = 7


def centres_of(obj: bpy.types.Object) -> np.ndarray:
    points = np.float32([vertex.co[:] for vertex in obj.data.vertices])
    influences, triangles = scenes.weights_of(obj), scenes.triangles_of(obj)
    return sinew.centres_of_rotation(points, *influences, triangles, exact=len(points) < 1000).result()


def assert_equal_to_reference(
    obj: bpy.types.Object, method: str, centres: np.ndarray, rest: np.ndarray | None = None
) -> None:
    """The points in the current frame.

    centres  float32 [vertices, 3], object space
    rest     the same; None: the mesh's points
    """
    armature = attach.armature_of(obj)
    evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    motions = np.array([np.array(b.matrix @ b.bone.matrix_local.inverted()) for b in evaluated.pose.bones])
    rest_bones = np.array([np.array(bone.matrix_local) for bone in armature.data.bones])
    offsets, indices, weights = scenes.weights_of(obj)
    chosen = range(0, len(obj.data.vertices), STEP)
    spans = [range(offsets[vertex], offsets[vertex + 1]) for vertex in chosen]
    entries = [entry for span in spans for entry in span]
    to_armature = np.array(armature.matrix_world.inverted() @ obj.matrix_world)

    def in_armature(points: np.ndarray) -> np.ndarray:
        return points[::STEP] @ to_armature[:3, :3].T + to_armature[:3, 3]

    expected, margins = reference.deform(
        method,
        in_armature(scenes.rest_points(obj) if rest is None else rest),
        np.cumsum([0, *map(len, spans)]),
        indices[entries],
        weights[entries],
        motions,
        rest_bones,
        {"cor": in_armature(centres)},
    )
    back = np.linalg.inv(to_armature)
    expected = expected @ back[:3, :3].T + back[:3, 3]
    # Within rounding of a tie both results are right.
    decided = margins > 1e-3
    assert decided.mean() > 0.9
    found = scenes.final_points(obj)[::STEP]
    # Larger meshes compute centres by cells, in both.
    assert scenes.worst(found[decided], expected[decided]) <= 2 * scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_real_rig(method, real_rig):
    files.open_file(real_rig("human.blend"))
    (obj,) = attach.deformed_meshes(list(bpy.context.scene.objects))
    scenes.add_sinew(obj, method)
    bpy.context.scene.frame_set(16)
    assert_equal_to_reference(obj, method, centres_of(obj))


def test_centres_are_made_anew_when_the_mesh_changes(route):
    obj, _armature = scenes.skinned_arm("cor", bones=3)
    bpy.context.scene.frame_set(8)
    before = centres_of(obj)
    assert_equal_to_reference(obj, "cor", before)
    for vertex in obj.data.vertices:
        vertex.co.x += 0.4 + 0.3 * vertex.co.z
    obj.data.update()
    bpy.context.scene.frame_set(9)
    after = centres_of(obj)
    assert np.abs(after - before).max() > 0.1
    assert_equal_to_reference(obj, "cor", after)


def test_centres_stay_those_of_the_mesh_under_shape_keys(route):
    obj, _armature = scenes.make_arm(bones=3)
    scenes.key_shape(obj)
    scenes.add_sinew(obj, "cor")
    centres = centres_of(obj)
    values = []
    for frame in (3, 9):
        bpy.context.scene.frame_set(frame)
        keys = obj.data.shape_keys.evaluated_get(bpy.context.evaluated_depsgraph_get())
        values.append(keys.key_blocks["Key"].value)
        # The key lifts all vertices by 0.2.
        rest = scenes.rest_points(obj) + np.float32([0.0, 0.0, 0.2 * values[-1]])
        assert_equal_to_reference(obj, "cor", centres, rest)
    assert values[1] > values[0] + 0.3
