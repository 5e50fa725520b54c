# SPDX-License-Identifier: GPL-3.0-or-later
"""How often a frame makes Blender evaluate a mesh: once, as with the Armature modifier."""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach, layout, properties
from sinew_addon.attach.updates import updates_suspended
from sinew_addon.deform import session
from sinew_addon.io import files, mesh_io
from sinew_addon.jobs.job_file import Settings
from sinew_addon.jobs.tasks import reskin
from sinew_addon.skinning.skin_stack import SkinDeformer


@pytest.fixture
def counting() -> Iterator[None]:
    """Blender prints each evaluation on its standard output, if the depsgraph was created in the
    meantime."""
    bpy.app.debug_depsgraph_eval = True
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield
    bpy.app.debug_depsgraph_eval = False


def evaluations(obj: bpy.types.Object, frame: int) -> int:
    """How often Blender evaluates the modifiers of `obj` when going to a frame."""
    return evaluations_in(lambda: bpy.context.scene.frame_set(frame), obj.name)


def evaluations_in(action: Callable[[], object], name: str) -> int:
    """How often Blender evaluates the modifiers of the object called `name` in this block."""
    with tempfile.TemporaryFile() as said:
        sys.stdout.flush()
        stdout = os.dup(1)
        os.dup2(said.fileno(), 1)
        try:
            action()
        finally:
            ctypes.CDLL(None).fflush(None)
            os.dup2(stdout, 1)
            os.close(stdout)
        said.seek(0)
        return said.read().count(f"BKE_object_eval_uber_data on OB{name} (".encode())


def pose(armature: bpy.types.Object) -> None:
    """Bends it further."""
    armature.pose.bones[1].rotation_quaternion[1] += 0.25
    bpy.context.view_layer.update()


def move(owner: bpy.types.Object) -> None:
    scenes.key(owner, "location", ((1, (0.0, 0.0, 0.0)), (11, (3.0, 1.0, 0.0))))


def moving_parent(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    obj.parent = armature
    move(armature)


SETUPS = {
    "still": lambda obj, armature: None,
    "moving armature": lambda obj, armature: move(armature),
    "modifier in front": lambda obj, armature: scenes.put_in_front(obj, "SOLIDIFY"),
    "shared mesh": lambda obj, armature: scenes.added("Other", obj.data),
    "moving parent": moving_parent,
    "moving mesh": lambda obj, armature: move(obj),
    "moving keys": lambda obj, armature: scenes.key_shape(obj),
}


def skinned(set_up: str) -> tuple[bpy.types.Object, bpy.types.Object]:
    obj, armature = scenes.make_arm()
    SETUPS[set_up](obj, armature)
    scenes.add_sinew(obj)
    return obj, armature


with_few = pytest.mark.parametrize("set_up", ["still", "modifier in front", "shared mesh"])


@pytest.mark.usefixtures("counting")
@pytest.mark.parametrize("set_up", SETUPS)
def test_a_frame_evaluates_the_mesh_once(set_up):
    obj, armature = scenes.make_arm()
    SETUPS[set_up](obj, armature)
    bpy.context.scene.frame_set(2)
    assert evaluations(obj, 5) == 1
    scenes.add_sinew(obj)
    for _round in range(2):
        # The first frame after a switch may take a second evaluation.
        for frame in (1, 2):
            bpy.context.scene.frame_set(frame)
        assert [evaluations(obj, frame) for frame in (3, 4, 5, 6)] == [1, 1, 1, 1]
        properties.of(obj).enabled = False
        bpy.context.scene.frame_set(2)
        properties.of(obj).enabled = True


@pytest.mark.usefixtures("counting")
@with_few
def test_posing_evaluates_the_mesh_once(set_up):
    obj, armature = skinned(set_up)
    bpy.context.scene.frame_set(2)
    assert [evaluations_in(lambda: pose(armature), obj.name) for _ in range(3)] == [1, 1, 1]


@pytest.mark.usefixtures("route")
def test_a_frame_computes_the_shape_once(monkeypatch):
    scenes.skinned_arm()
    bpy.context.scene.frame_set(2)
    shapes, shape = [], SkinDeformer._shape
    monkeypatch.setattr(SkinDeformer, "_shape", lambda *args: (shapes.append(args), shape(*args)))
    for frame in (3, 4, 5):
        bpy.context.scene.frame_set(frame)
    assert len(shapes) == 3


@pytest.mark.usefixtures("counting")
@with_few
@pytest.mark.parametrize("modifier", ["Sinew", "Armature"])
def test_a_click_on_an_icon_evaluates_the_mesh_as_often_as_blender(set_up, modifier):
    obj, _armature = skinned(set_up)
    bpy.context.scene.frame_set(2)

    def click() -> None:
        own = obj.modifiers[modifier]
        own.show_viewport = not own.show_viewport
        scenes.final_points(obj)

    assert [evaluations_in(click, obj.name) for _ in range(4)] == [1, 1, 1, 1]


def modules_passed(action: Callable[[], object]) -> dict[str, set[str]]:
    """The extension's modules whose functions run during the action on this thread, by the function that
    Blender called."""
    root = str(Path(session.__file__).resolve().parents[1]) + os.sep
    passed: dict[str, set[str]] = {}

    def note(frame: FrameType | None, event: str, _argument: object) -> None:
        own = []
        while frame is not None and event == "call":
            own += [frame.f_code] if frame.f_code.co_filename.startswith(root) else []
            frame = frame.f_back
        if own:
            passed.setdefault(own[-1].co_name, set()).add(own[0].co_filename.removeprefix(root))

    sys.setprofile(note)
    try:
        action()
    finally:
        sys.setprofile(None)
    return passed


@with_few
def test_a_frame_passes_few_modules_after_the_evaluation(set_up):
    obj, armature = skinned(set_up)
    for frame in (1, 2, 3):
        bpy.context.scene.frame_set(frame)
    pose(armature)
    shown = session.skinned_of(obj).shown.number
    passed = modules_passed(lambda: pose(armature))
    passed |= modules_passed(lambda: bpy.context.scene.frame_set(4))
    assert session.skinned_of(obj).shown.number == shown + 2
    for function, modules in passed.items():
        print(function, len(modules), *sorted(modules))
    assert len(passed["on_frame_change"]) <= 7
    assert len(passed["on_depsgraph_update"]) <= 10
    # Blender may call it on another thread.
    assert len(passed.get("get", ())) <= 15


CHANGES = {
    "rename": lambda obj, armature: setattr(obj, "name", "Another"),
    "hide in renders": lambda obj, armature: setattr(obj.modifiers["Sinew"], "show_render", False),
    "edit a bone": lambda obj, armature: setattr(armature.data.bones[1], "use_deform", False),
    "mute the driver": lambda obj, armature: setattr(obj.animation_data.drivers[0], "mute", True),
    "swap the armature": lambda obj, armature: setattr(
        obj.modifiers["Armature"], "object", scenes.copied(armature, linked=True)
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_changes_along_with_a_pose_is_noticed(change):
    """As by a script: Blender lists both at once."""
    obj, armature = scenes.skinned_arm()
    bpy.context.scene.frame_set(2)
    pose(armature)
    CHANGES[change](obj, armature)
    pose(armature)
    shown, state = scenes.final_points(obj), session.skinned_of(obj)
    assert state.is_as_noted(obj, layout.read(obj))
    assert state.noted.name == obj.name
    scenes.assert_as_without(obj, shown)


@with_few
def test_a_simulation_behind_runs_on_the_shape_of_its_own_frame(set_up):
    """If it were evaluated before Sinew deformed it, it would show the previous frame."""
    obj, armature = scenes.make_arm(sides=8, rings=12)
    SETUPS[set_up](obj, armature)
    obj.modifiers["Armature"].use_deform_preserve_volume = True
    pinned = obj.vertex_groups.new(name="Pinned")
    pinned.add([vertex.index for vertex in obj.data.vertices if vertex.index % 3], 1.0, "REPLACE")
    cloth = obj.modifiers.new("Cloth", "CLOTH")
    cloth.settings.vertex_group_mass = "Pinned"
    cloth.settings.quality = 2
    frames = list(range(1, 9))
    expected = scenes.shapes(obj, frames)
    scenes.add_sinew(obj, "dq")
    got = scenes.shapes(obj, frames)
    assert scenes.worst(got, expected) < 1e-3
    for frame in (3, 6):
        assert scenes.worst(expected[frame], expected[frame - 1]) > 0.01
    attach.remove(obj)
    assert obj.modifiers["Armature"].object is not None


@with_few
def test_a_rig_that_follows_a_deformed_mesh_uses_the_same_frame(set_up):
    """Read in the first evaluation: a later request would make Blender evaluate the rest."""
    followed, armature = scenes.make_arm()
    SETUPS[set_up](followed, armature)
    obj, follower = scenes.make_arm()
    constraint = follower.pose.bones[1].constraints.new("COPY_LOCATION")
    constraint.target, constraint.subtarget = followed, followed.vertex_groups[-1].name
    scenes.key(armature, "location", ((1, (0.0, 0.0, 0.0)), (11, (3.0, 1.0, 0.0))))
    shapes: list[np.ndarray] = []

    def record(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        shapes.append(mesh_io.read_points(obj.evaluated_get(depsgraph).data))

    frames = (5, 9, 2)
    with scenes.handler("frame_change_post", record):
        for modifier in (followed.modifiers["Armature"], obj.modifiers["Armature"]):
            modifier.use_deform_preserve_volume = True
        for frame in frames:
            bpy.context.scene.frame_set(frame)
        for each in (followed, obj):
            scenes.add_sinew(each, "dq")
        bpy.context.scene.frame_set(1)
        shapes.pop()
        for frame in frames:
            bpy.context.scene.frame_set(frame)
    assert scenes.worst(shapes[0], shapes[1]) > 0.1
    for expected, got in zip(shapes[:3], shapes[3:], strict=True):
        assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def task(path: Path) -> dict:
    return {
        "command": "reskin",
        "source": str(path),
        "target": str(path.with_name("copy.blend")),
        "unfinished": str(path.with_name("unfinished.blend")),
        "settings": Settings(method="dq").as_task(),
        "frames": "none",
        "pictures": None,
    }


@pytest.mark.usefixtures("counting")
def test_a_batch_evaluates_a_file_once_more_than_blender_opens_and_saves_it(tmp_path):
    scenes.make_arm()
    path = scenes.save(tmp_path / "arm.blend")

    def open_and_save() -> None:
        files.open_file(path, load_ui=True)
        files.save_beside(path, path, tmp_path / "plain.blend")

    plain = evaluations_in(open_and_save, "Arm")
    assert plain > 0
    # Blender updates the scene before it saves: bpy.ops does so before any operator.
    assert evaluations_in(lambda: reskin.reskin(task(path), lambda _doing: None), "Arm") <= plain + 1


@pytest.fixture
def weights_read(monkeypatch) -> list[str]:
    """The names of the meshes whose weights are read, one by one."""
    read, read_group_weights = [], mesh_io.read_group_weights

    def count(mesh: bpy.types.Mesh, *known: object) -> object:
        read.append(mesh.name)
        return read_group_weights(mesh, *known)

    monkeypatch.setattr(mesh_io, "read_group_weights", count)
    return read


def test_saving_reads_no_weights_again_and_a_batch_reads_them_once(tmp_path, weights_read):
    obj, _armature = scenes.make_arm()
    path = scenes.save(tmp_path / "arm.blend")
    scenes.add_sinew(obj, "dq")
    assert weights_read == ["Arm"]
    live = str(path.with_name("live.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=live)
    weights_read.clear()
    bpy.ops.wm.save_as_mainfile(filepath=live)
    bpy.context.scene.frame_set(5)
    assert weights_read == []
    obj.vertex_groups[0].add(range(30), 0.25, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=live)
    assert weights_read == ["Arm"]
    weights_read.clear()
    reskin.reskin(task(path), lambda _doing: None)
    assert weights_read == ["Arm"]


def test_a_copy_holds_what_the_window_would_show(tmp_path):
    """With shape keys, an upstream modifier, a parent that deforms, and a file that already has Sinew."""
    obj, _armature = scenes.make_arm()
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Fat").points[30].co.z += 0.2
    obj.data.shape_keys.key_blocks["Fat"].value = 0.7
    front, _ = scenes.make_arm(name="Front")
    scenes.put_in_front(front, "SOLIDIFY")
    child, armature = scenes.make_arm(name="Child")
    scenes.deform_by_parent(child, armature)
    _skinned, _ = scenes.skinned_arm("lbs", name="Driven")
    bpy.context.scene.frame_set(7)
    path = scenes.save(tmp_path / "all.blend")
    names = ["Arm", "Front", "Child", "Driven"]
    for name in names:
        scenes.add_sinew(bpy.data.objects[name], "dq")
    session.refresh(bpy.context)
    expected = {name: scenes.final_points(bpy.data.objects[name]) for name in names}
    reskin.reskin(task(path), lambda _doing: None)
    copy = str(tmp_path / "unfinished.blend")
    # As saved in the file, before Sinew deforms it: with the modifiers.
    with updates_suspended():
        bpy.ops.wm.open_mainfile(filepath=copy)
        for name in names:
            obj = bpy.data.objects[name]
            off = scenes.worst(scenes.final_points(obj), expected[name])
            assert off <= scenes.TOLERANCE * scenes.diagonal(obj), name
    bpy.ops.wm.open_mainfile(filepath=copy)
    for name in names:
        assert np.array_equal(scenes.final_points(bpy.data.objects[name]), expected[name]), name


def test_objects_that_move_beside_their_armatures():
    """Their transforms belong to the frame when Sinew deforms, whichever of Blender's threads is first:
    several objects, moved by one action."""
    objects = [scenes.make_arm(sides=6, rings=9, name=name)[0] for name in ("One", "Two", "Three")]
    first = objects[0]
    scenes.key(first, "location", ((1, (0.0, 0.0, 0.0)), (11, (2.0, 0.0, 0.0))))
    for obj in objects[1:]:
        animation = obj.animation_data_create()
        animation.action = first.animation_data.action
        if hasattr(animation, "action_slot"):
            animation.action_slot = first.animation_data.action_slot
    frames = range(1, 12)
    wanted = [scenes.modifier_shapes(obj, frames, preserve_volume=False) for obj in objects]
    for obj in objects:
        scenes.add_sinew(obj, "lbs")
    for _again in range(3):
        for index, frame in enumerate(frames):
            bpy.context.scene.frame_set(frame)
            for obj, expected in zip(objects, wanted, strict=True):
                off = scenes.worst(scenes.final_points(obj), expected[index])
                assert off <= scenes.TOLERANCE * scenes.diagonal(obj), (obj.name, frame)


def test_a_frame_writes_into_the_evaluated_mesh_alone():
    """Not into the mesh itself, of which it is a copy; skinned_of() returns the same shape."""
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(1)
    attribute = obj.data.attributes[properties.of(obj).storage.attribute]
    stored = scenes.points_of(attribute.data, "vector")
    bpy.context.scene.frame_set(7)
    ((_obj, state),) = scenes.deformed_now(obj)
    shown = scenes.final_points(obj)
    assert scenes.worst(shown, stored) > 0.1 * scenes.diagonal(obj)
    assert np.array_equal(state.points, shown)
    assert np.array_equal(scenes.points_of(attribute.data, "vector"), stored)
