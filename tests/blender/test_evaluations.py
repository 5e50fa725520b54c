# SPDX-License-Identifier: GPL-3.0-or-later
"""How often a frame makes Blender evaluate a mesh: once, as with the Armature modifier."""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
from collections.abc import Callable, Iterator

import bpy
import pytest
import scenes
from sinew_addon.blender import properties


@pytest.fixture
def counting() -> Iterator[None]:
    """Blender says each evaluation on its standard output; only a depsgraph made meanwhile does."""
    bpy.app.debug_depsgraph_eval = True
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield
    bpy.app.debug_depsgraph_eval = False


def evaluations(obj: bpy.types.Object, frame: int) -> int:
    """How often Blender evaluates the modifiers of `obj` on going to a frame."""
    return evaluations_of(obj, lambda: bpy.context.scene.frame_set(frame))


def evaluations_of(obj: bpy.types.Object, change: Callable[[], None]) -> int:
    """How often Blender evaluates the modifiers of `obj` in what `change` does."""
    with tempfile.TemporaryFile() as said:
        sys.stdout.flush()
        stdout = os.dup(1)
        os.dup2(said.fileno(), 1)
        try:
            change()
        finally:
            ctypes.CDLL(None).fflush(None)
            os.dup2(stdout, 1)
            os.close(stdout)
        said.seek(0)
        return said.read().count(f"BKE_object_eval_uber_data on OB{obj.name} (".encode())


def key(block: bpy.types.bpy_struct, path: str, first: object, last: object) -> None:
    for frame, value in ((1, first), (11, last)):
        setattr(block, path, value)
        block.keyframe_insert(path, frame=frame)


def still(_obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    pass


def moving_armature(_obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    key(armature, "location", (0.0, 0.0, 0.0), (3.0, 1.0, 0.0))


def modifier_in_front(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    obj.modifiers.new("Front", "SOLIDIFY")
    obj.modifiers.move(len(obj.modifiers) - 1, 0)


def moving_parent(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    obj.parent = armature
    moving_armature(obj, armature)


def moving_mesh(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    key(obj, "location", (0.0, 0.0, 0.0), (3.0, 1.0, 0.0))


def moving_keys(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    obj.shape_key_add(name="Basis")
    block = obj.shape_key_add(name="Key")
    block.data[0].co.z += 0.3
    key(block, "value", 0.0, 1.0)


Setup = Callable[[bpy.types.Object, bpy.types.Object], None]


@pytest.mark.usefixtures("counting")
@pytest.mark.parametrize(
    "set_up", [still, moving_armature, modifier_in_front, moving_parent, moving_mesh, moving_keys]
)
def test_a_frame_evaluates_the_mesh_once(set_up: Setup):
    obj, armature = scenes.make_arm()
    set_up(obj, armature)
    bpy.context.scene.frame_set(2)
    assert evaluations(obj, 5) == 1
    scenes.add_sinew(obj)
    for _round in range(2):
        # The first frame after a switch may take a second round.
        for frame in (1, 2):
            bpy.context.scene.frame_set(frame)
        assert [evaluations(obj, frame) for frame in (3, 4, 5, 6)] == [1, 1, 1, 1]
        properties.of(obj).enabled = False
        bpy.context.scene.frame_set(2)
        properties.of(obj).enabled = True


@pytest.mark.usefixtures("counting")
def test_posing_evaluates_the_mesh_once():
    obj, armature = scenes.make_arm()
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(2)

    def pose() -> None:
        armature.pose.bones[1].rotation_quaternion[1] += 0.25
        bpy.context.view_layer.update()

    assert [evaluations_of(obj, pose) for _ in range(3)] == [1, 1, 1]


def share_mesh(obj: bpy.types.Object) -> None:
    """What is shared can not be written while Blender evaluates."""
    other = bpy.data.objects.new("Other", obj.data)
    bpy.context.collection.objects.link(other)


@pytest.mark.parametrize("set_up", [moving_parent, moving_mesh, moving_keys])
def test_what_stands_behind_is_evaluated_once_where_the_frame_dirties_the_mesh(set_up: Setup):
    obj, armature = scenes.make_arm()
    obj.modifiers.new("Behind", "SUBSURF")
    set_up(obj, armature)
    share_mesh(obj)
    expected = scenes.shapes(obj, [2, 3, 4, 5])
    scenes.add_sinew(obj)
    first_round = []

    def watch(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        first_round.append(len(obj.evaluated_get(depsgraph).data.vertices))

    bpy.app.handlers.frame_change_post.insert(0, watch)
    try:
        got = scenes.shapes(obj, [2, 3, 4, 5])
    finally:
        bpy.app.handlers.frame_change_post.remove(watch)
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    # From the second frame on: that a mesh moves is known only when it did.
    assert first_round[1:] == [len(obj.data.vertices)] * 3
    assert got.shape[1] > len(obj.data.vertices)
    assert obj.modifiers["Behind"].show_viewport
    assert obj.modifiers["Behind"].show_render
    assert not properties.of(obj).error
