# SPDX-License-Identifier: GPL-3.0-or-later
"""Precomputation for cor: in the background while the artist works, immediately where nobody can look again;
cached."""

from __future__ import annotations

import dataclasses
import threading
import time
from pathlib import Path

import bmesh
import bpy
import numpy as np
import pytest
import scenes
import sinew
from conftest import look_until_done
from program import run_sinew
from sinew_addon.attach import attach, properties, stored_vertex_data
from sinew_addon.attach.subscribers import subscribers
from sinew_addon.base import interrupt
from sinew_addon.base.file_cache import FileCache
from sinew_addon.deform import characters, precompute_watch, precomputing, session
from sinew_addon.deform.plan import State
from sinew_addon.skinning import vertex_data
from sinew_addon.skinning.precompute import precomputations

pytestmark = pytest.mark.long_term

FRAME = 8


class Gate:
    """Starts to compute centres, and counts it; while it is closed, no result comes."""

    def __init__(self, start) -> None:
        self.count, self.is_open = 0, True
        self._start = start

    def close(self) -> None:
        self.is_open = False

    def open(self) -> None:
        self.is_open = True

    def __call__(self, *arrays, gives_way):
        self.count += 1
        self.gives_way = gives_way
        return BehindGate(self, self._start(*arrays, gives_way=gives_way))


class BehindGate:
    """A precomputation whose result the gate keeps back."""

    def __init__(self, gate: Gate, run: sinew.Precomputation) -> None:
        self._gate, self._run, self._is_cancelled = gate, run, False

    @property
    def progress(self) -> float:
        return self._run.progress

    @property
    def has_ended(self) -> bool:
        return self._is_cancelled or (self._gate.is_open and self._run.has_ended)

    def ends_behind_gate(self) -> bool:
        return self._run.wait(60)

    def cancel(self) -> None:
        self._is_cancelled = not self.has_ended

    def wait(self, seconds: float) -> bool:
        end = time.monotonic() + seconds
        while not self.has_ended and time.monotonic() < end:
            time.sleep(0.002)
        return self.has_ended

    def result(self) -> np.ndarray | None:
        return None if self._is_cancelled else self._run.result()


@pytest.fixture(autouse=True)
def gate(monkeypatch, tmp_path):
    """No results of earlier tests exist, and nothing runs after a test."""
    provider = vertex_data.PROVIDERS["cor"]
    gate = Gate(provider.start)
    monkeypatch.setitem(vertex_data.PROVIDERS, "cor", dataclasses.replace(provider, start=gate))
    monkeypatch.setattr(precomputations, "cache", FileCache(tmp_path / "cache", 10**8))
    monkeypatch.setattr(precomputations, "_made", type(precomputations._made)())
    yield gate
    gate.open()


def forget_made() -> None:
    precomputations._made.clear()


def shapes_by_modifier(preserve_volume: bool) -> np.ndarray:
    """The arm's shape by its Armature modifier, for an arm in its own file."""
    obj, _armature = scenes.make_arm(bones=3)
    found = scenes.modifier_shapes(obj, [FRAME], preserve_volume)[0]
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return found


def shape_by_cor() -> np.ndarray:
    obj, _armature = scenes.skinned_arm("cor", bones=3)
    found = scenes.shapes(obj, [FRAME])[0]
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    forget_made()
    return found


def arm_by_cor() -> bpy.types.Object:
    """Added at a frame at which it is bent."""
    obj, _armature = scenes.make_arm(bones=3)
    bpy.context.scene.frame_set(FRAME)
    scenes.add_sinew(obj, "cor")
    return obj


def plan_of(obj: bpy.types.Object):
    return session.skinned_of(obj).plan


@pytest.mark.parametrize("preserve_volume", [False, True])
def test_the_modifiers_shape_until_it_is_found(gate, route, preserve_volume):
    expected, by_modifier = shape_by_cor(), shapes_by_modifier(preserve_volume)
    precomputations.blocks = False
    gate.count = 0
    gate.close()
    obj, _armature = scenes.make_arm(bones=3)
    obj.modifiers["Armature"].use_deform_preserve_volume = preserve_volume
    bpy.context.scene.frame_set(FRAME)
    scenes.add_sinew(obj, "cor")
    tolerance = scenes.TOLERANCE * scenes.diagonal(obj)
    assert gate.count == 1
    assert gate.gives_way
    assert plan_of(obj).lacks
    assert "centres of rotation" in plan_of(obj).lacks
    assert precomputing.running(obj, session.skinned_of(obj)).keys() == {"centres of rotation"}
    assert scenes.worst(scenes.final_points(obj), by_modifier) <= tolerance
    assert precompute_watch.check() is not None
    gate.open()
    look_until_done()
    assert not plan_of(obj).lacks
    assert scenes.worst(scenes.final_points(obj), expected) <= tolerance
    assert scenes.worst(expected, by_modifier) > 100 * tolerance
    assert gate.count == 1


def test_stopped_it_waits_for_the_button(gate, in_window):
    gate.close()
    obj, _armature = scenes.skinned_arm("cor", bones=3)
    assert gate.count == 1
    bpy.ops.sinew.stop_precomputation()
    assert not precomputations.running
    assert plan_of(obj).lacks
    assert "stopped" in plan_of(obj).lacks
    gate.open()
    bpy.context.scene.frame_set(FRAME)
    session.refresh(bpy.context)
    look_until_done()
    assert gate.count == 1
    assert precomputing.stopped(obj, session.skinned_of(obj)) == ["centres of rotation"]
    bpy.ops.sinew.precompute()
    look_until_done()
    assert plan_of(obj).state is State.IN_DEPSGRAPH
    assert gate.count == 2


def test_a_result_that_comes_while_the_watcher_looks(gate, in_window):
    gate.close()
    obj, _armature = scenes.skinned_arm("cor", bones=3)
    assert precomputations.running[0].ends_behind_gate()
    # Between the watcher's look at the object and its last, at what still runs.
    subscribers.precomputation_shown.append(gate.open)
    try:
        look_until_done()
    finally:
        subscribers.precomputation_shown.remove(gate.open)
    assert plan_of(obj).state is State.IN_DEPSGRAPH


@pytest.mark.usefixtures("gate")
def test_a_result_that_comes_between_two_events_is_no_failure():
    """As where a script sets methods of several characters in a window: Blender has no reason yet to evaluate
    this one."""
    obj, _armature = scenes.skinned_arm("cor")
    other, _armature = scenes.make_arm(name="Other")
    scenes.add_sinew(other, "dq")
    bpy.context.scene.frame_set(FRAME)
    state = session.skinned_of(obj)
    other.location.x += 1.0
    bpy.context.view_layer.update()
    assert not state.evaluation.given
    state.bound.first_deformer.vertex_data.version += 1
    assert state.has_new_data
    properties.of(other).method = "qv"
    assert state.failures.count == 0
    assert not state.has_new_data


def test_a_render_waits(gate, route, rendered_points):
    expected = shape_by_cor()
    precomputations.blocks = False
    gate.close()
    obj = arm_by_cor()
    assert plan_of(obj).lacks
    threading.Timer(0.2, gate.open).start()
    points = rendered_points(obj)
    assert scenes.worst(points, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_render_waits_also_for_what_was_stopped(gate, in_window, rendered_points):
    gate.close()
    obj, _armature = scenes.skinned_arm("cor", bones=3)
    bpy.ops.sinew.stop_precomputation()
    gate.open()
    bpy.context.scene.frame_set(FRAME)
    points = rendered_points(obj)
    forget_made()
    precomputations.blocks = True
    scenes.rebind(obj)
    assert scenes.worst(points, scenes.final_points(obj)) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_ctrl_c_ends_the_wait(gate, monkeypatch):
    gate.close()
    obj, _armature = scenes.make_arm(bones=3)
    monkeypatch.setattr(interrupt, "_requested", True)
    with pytest.raises(KeyboardInterrupt):
        characters.use_method(obj, "cor")
    assert gate.count == 1
    assert not precomputations.running


def move_weights(obj: bpy.types.Object) -> None:
    obj.vertex_groups["bone.1"].add(list(range(40, 140)), 0.35, "ADD")
    obj.data.update()
    obj.update_tag()
    bpy.context.view_layer.update()


def test_while_weights_are_painted_the_old_centres_serve(gate, route):
    obj = arm_by_cor()
    assert gate.count == 1
    precomputations.blocks = False
    for _ in range(3):
        move_weights(obj)
        # The next stroke comes before the artist has paused.
        assert precompute_watch.check() is not None
        assert gate.count == 1
        assert not plan_of(obj).lacks
    by_old = scenes.final_points(obj)
    time.sleep(precompute_watch.PAUSE)
    look_until_done()
    assert gate.count == 2
    by_new = scenes.final_points(obj)
    assert scenes.worst(by_old, by_new) > 1e-4
    forget_made()
    precomputations.blocks = True
    scenes.rebind(obj)
    assert scenes.worst(by_new, scenes.final_points(obj)) == 0.0


def test_undo_and_redo_find_what_was_made(gate):
    bpy.context.preferences.edit.use_global_undo = True
    obj, _armature = scenes.make_arm(bones=3)
    bpy.ops.ed.undo_push(message="made")
    bpy.ops.sinew.add()
    obj.sinew.method = "cor"
    bpy.ops.ed.undo_push(message="cor")
    bpy.context.scene.frame_set(FRAME)
    expected = scenes.final_points(obj)
    bpy.ops.ed.undo_push(message="frame")
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    obj = bpy.data.objects["Arm"]
    bpy.context.scene.frame_set(FRAME)
    assert scenes.worst(scenes.final_points(obj), expected) == 0.0
    assert gate.count == 1


@pytest.mark.parametrize("event", ["undo", "delete", "load", "remove", "edit"])
def test_what_happens_meanwhile_does_no_harm(gate, in_window, event):
    bpy.context.preferences.edit.use_global_undo = True
    gate.close()
    obj, _armature = scenes.make_arm(bones=3)
    bpy.ops.ed.undo_push(message="made")
    scenes.add_sinew(obj, "cor")
    bpy.ops.ed.undo_push(message="cor")
    assert gate.count == 1
    if event == "undo":
        bpy.ops.ed.undo()
    elif event == "delete":
        bpy.data.meshes.remove(obj.data)
    elif event == "load":
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        assert not precomputations.running
    elif event == "remove":
        attach.remove(obj)
    else:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.subdivide()
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    precompute_watch.check()
    gate.open()
    look_until_done()
    if event == "edit":
        bpy.context.scene.frame_set(FRAME)
        assert plan_of(obj).state is State.IN_DEPSGRAPH
        assert len(scenes.final_points(obj)) == len(obj.data.vertices)


def test_a_keyed_method_is_asked_for_when_it_comes(gate, route):
    obj, _armature = scenes.skinned_arm("dq", bones=3)
    scenes.key(obj.sinew, "method", ((1, "dq"), (FRAME - 1, "cor"), (FRAME + 2, "dq")))
    bpy.context.scene.frame_set(1)
    session.refresh(bpy.context)
    gate.count = 0
    forget_made()
    scenes.rebind(obj)
    precomputations.blocks = False
    bpy.context.scene.frame_set(FRAME)
    look_until_done()
    found = scenes.final_points(obj)
    assert gate.count == 1
    assert not precomputing.lacking(obj, session.skinned_of(obj))
    obj.animation_data_clear()
    precomputations.blocks = True
    obj.sinew.method = "cor"
    assert scenes.worst(scenes.final_points(obj), found) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_an_object_that_is_off_has_nothing_to_wait_for(gate):
    """Its triangles are not read, so its centres can not be recomputed."""
    obj = arm_by_cor()
    obj.sinew.method = "qv"
    move_weights(obj)
    obj.sinew.enabled = False
    obj.sinew.method = "cor"
    bpy.context.view_layer.update()
    precomputations.blocks = False
    time.sleep(precompute_watch.PAUSE)
    look_until_done()
    assert gate.count == 1
    obj.sinew.enabled = True
    time.sleep(precompute_watch.PAUSE)
    look_until_done()
    assert gate.count == 2


def test_a_mesh_without_faces_is_blended_linearly_and_the_panel_says_so():
    obj, _armature = scenes.make_arm(bones=3)
    edited = bmesh.new()
    edited.from_mesh(obj.data)
    bmesh.ops.delete(edited, geom=edited.faces[:], context="FACES_ONLY")
    edited.to_mesh(obj.data)
    edited.free()
    assert not obj.data.polygons
    scenes.add_sinew(obj, "cor")
    assert "no faces" in session.skinned_of(obj).bound.lacks(["cor"])[0]
    assert session.skinned_of(obj).bound.lacks(["dq"]) == []
    bpy.context.scene.frame_set(FRAME)
    by_cor = scenes.final_points(obj)
    obj.sinew.method = "lbs"
    bpy.context.view_layer.update()
    assert scenes.worst(by_cor, scenes.final_points(obj)) <= 2 * scenes.TOLERANCE * scenes.diagonal(obj)


# --- The cache


def saved(tmp_path) -> tuple[np.ndarray, Path]:
    obj, _armature = scenes.skinned_arm("cor", bones=3)
    bpy.context.scene.frame_set(FRAME)
    return scenes.final_points(obj), scenes.save(tmp_path / "saved.blend")


def test_a_file_has_it(gate, tmp_path):
    points, path = saved(tmp_path)
    for waits in (True, False):
        precomputations.blocks = waits
        forget_made()
        obj = scenes.opened(path)
        assert plan_of(obj).state is State.IN_DEPSGRAPH
        assert scenes.worst(scenes.final_points(obj), points) == 0.0
        assert gate.count == 1


def test_copies_and_libraries_have_it(gate, tmp_path):
    _points, path = saved(tmp_path)
    forget_made()
    obj, armature = scenes.link(path, "Arm", "Arm Rig")
    rig = armature.override_create(remap_local_usages=True)
    over = obj.override_create(remap_local_usages=True)
    assert rig is not None
    bpy.context.view_layer.update()
    assert session.skinned_of(over) is not None
    assert "cor" in session.skinned_of(over).bound.first_deformer.vertex_data.made
    assert gate.count == 1
    obj = scenes.opened(path)
    forget_made()
    for linked in (True, False):
        copy = scenes.copied(obj, linked=linked)
        bpy.context.view_layer.update()
        session.refresh(bpy.context)
        assert "cor" in session.skinned_of(copy).bound.first_deformer.vertex_data.made
    assert gate.count == 1


def test_remove_leaves_none_of_it(tmp_path):
    _points, path = saved(tmp_path)
    obj = scenes.opened(path)
    mesh = obj.data
    assert len(stored_vertex_data.read(mesh)) == 1
    attach.remove(obj)
    assert not mesh.is_property_set(stored_vertex_data.NAME)


def test_another_method_saves_none_of_it(tmp_path):
    _points, path = saved(tmp_path)
    scenes.opened(path).sinew.method = "dq"
    assert stored_vertex_data.read(scenes.reopened(path).data) == {}


def test_data_of_another_mesh_is_not_taken(gate, tmp_path):
    _points, path = saved(tmp_path)
    obj = scenes.opened(path)
    attach.remove(obj)
    session.forget()
    other = {"0" * 32: np.zeros((len(obj.data.vertices), 3), np.float32)}
    stored_vertex_data.write(obj.data, other)
    forget_made()
    scenes.add_sinew(obj, "cor")
    assert gate.count == 2


def _of_another_file(mesh, harm):
    """Replaces what the mesh has stored, with hashes that are right."""
    damaged = {key: harm(array.copy()) for key, array in stored_vertex_data.read(mesh).items()}
    stored_vertex_data.write(mesh, damaged)


def _on_disk(mesh, harm):
    group = getattr(mesh, stored_vertex_data.NAME)
    for name, content in list(group.items()):
        group[name] = harm(np.frombuffer(content, np.float32).copy()).tobytes()


def _multiply_all(array):
    array *= np.float32(1e30)
    return array


def _clear_a_part(array):
    array[: len(array) // 2] = 0
    return array


def _end_early(array):
    return array[: len(array) // 2]


@pytest.mark.parametrize(
    ("method", "store", "harm"),
    [
        *[
            ("ddm", _of_another_file, each)
            for each in (np.zeros_like, _multiply_all, _clear_a_part, _end_early)
        ],
        ("cor", _of_another_file, _multiply_all),
        ("cor", _on_disk, np.zeros_like),
        ("ddm", _on_disk, _end_early),
    ],
)
def test_damaged_data_is_computed_anew(method, store, harm, tmp_path, caplog):
    obj, _armature = scenes.skinned_arm(method, bones=3)
    bpy.context.scene.frame_set(FRAME)
    expected = scenes.final_points(obj)
    scenes.save(tmp_path / "saved.blend")
    session.forget()
    mesh = obj.data
    assert stored_vertex_data.read(mesh)
    store(mesh, harm)
    forget_made()
    obj.sinew.method = "dq"
    obj.sinew.method = method
    bpy.context.scene.frame_set(FRAME)
    assert np.array_equal(scenes.final_points(obj), expected)
    assert "computed anew" in caplog.text
    assert obj.sinew.enabled


def test_data_of_a_mesh_without_weights_is_not_damaged(caplog):
    obj, _armature = scenes.make_arm(bones=3)
    for group in obj.vertex_groups:
        group.remove(range(len(obj.data.vertices)))
    scenes.add_sinew(obj, "ddm")
    bpy.context.scene.frame_set(FRAME)
    session.forget()
    session.refresh(bpy.context)
    bpy.context.scene.frame_set(FRAME + 1)
    assert "ddm" in session.skinned_of(obj).bound.first_deformer.vertex_data.made
    assert "damaged" not in caplog.text


def test_reskin_puts_it_into_the_file(gate, tmp_path):
    scenes.make_arm(bones=3)
    path = scenes.save(tmp_path / "plain.blend")
    run_sinew("reskin", path, "--method", "cor", "--frames", "none", "--out", tmp_path / "out")
    obj = scenes.opened(tmp_path / "out" / "plain.blend")
    bpy.context.scene.frame_set(FRAME)
    assert len(stored_vertex_data.read(obj.data)) == 1
    assert plan_of(obj).state is State.IN_DEPSGRAPH
    assert gate.count == 0


def test_the_folder_has_what_no_file_has(gate, monkeypatch):
    monkeypatch.setattr("sinew_addon.skinning.precompute.SECONDS_WORTH_A_FILE", 0.0)
    for _ in range(2):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        forget_made()
        obj, _armature = scenes.skinned_arm("cor", bones=3)
        assert "cor" in session.skinned_of(obj).bound.first_deformer.vertex_data.made
    assert gate.count == 1
    assert properties.has_sinew(obj)
