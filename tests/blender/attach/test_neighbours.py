# SPDX-License-Identifier: GPL-3.0-or-later
"""What artists, scripts and other add-ons do to an object while Sinew is on it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import bpy
import numpy as np
import pytest
import scenes
import sinew_addon
from sinew_addon.attach import attach, layout, properties, stack
from sinew_addon.attach.updates import updates_suspended
from sinew_addon.deform import in_depsgraph, safe_mode, session
from sinew_addon.deform.plan import State
from sinew_addon.features.compare import comparison
from sinew_addon.io import actions

FRAMES = [1, 6, 11]


@pytest.fixture(params=[False, True], ids=["in depsgraph", "after update"])
def route(request, monkeypatch) -> State:
    """Runs each test on each route."""
    monkeypatch.setattr(safe_mode, "_forced", request.param)
    return State.AFTER_UPDATE if request.param else State.IN_DEPSGRAPH


@pytest.fixture
def arm(route) -> bpy.types.Object:
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(6)
    assert session.state_of(obj).plan.state is route
    return obj


@pytest.fixture
def neighbour() -> Iterator[Callable]:
    """neighbour(event, function): another add-on's handler, after Sinew's; returns a function that
    removes it."""
    added = []

    def add(event: str, function: Callable[[], None]) -> Callable[[], None]:
        def call(*_args: object) -> None:
            function()

        # Its name begins as Sinew's does.
        call.__module__ = f"{sinew_addon.__name__}_tools"
        functions = getattr(bpy.app.handlers, event)
        functions.append(call)
        added.append(lambda: functions.remove(call) if call in functions else None)
        return added[-1]

    yield add
    for take_off in added:
        take_off()


def assert_modifiers(obj: bpy.types.Object, frames: list[int], got: np.ndarray) -> None:
    """They are the modifier's shapes at these frames."""
    assert not properties.of(obj).error
    properties.of(obj).enabled = False
    expected = scenes.modifier_shapes(obj, frames, preserve_volume=True)
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def edit_weights(obj: bpy.types.Object) -> None:
    obj.vertex_groups["bone.0"].add(range(100, 200), 0.5, "REPLACE")


def edit_vertices(obj: bpy.types.Object) -> None:
    for vertex in obj.data.vertices:
        vertex.co.z += 0.3
    obj.data.update()


@pytest.mark.parametrize("is_rendered", [False, True], ids=["shown", "rendered"])
@pytest.mark.parametrize("is_first", [False, True], ids=["behind Sinew's", "before Sinew's"])
@pytest.mark.parametrize("event", ["frame_change_pre", "frame_change_post"])
def test_group_renamed_by_a_handler(arm, neighbour, rendered_points, event, is_first, is_rendered):
    bpy.context.scene.frame_set(10)

    def act() -> None:
        if "bone.1" in arm.vertex_groups:
            arm.vertex_groups["bone.1"].name = "another"

    neighbour(event, act)
    if is_first:
        functions = getattr(bpy.app.handlers, event)
        functions.insert(0, functions.pop())
    if is_rendered:
        got = rendered_points(arm)
    else:
        bpy.context.scene.frame_set(10)
        got = scenes.final_points(arm)
    properties.of(arm).enabled = False
    expected = rendered_points(arm) if is_rendered else scenes.modifier_shapes(arm, [10], True)[0]
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(arm)


def alone(_obj: bpy.types.Object) -> None:
    pass


def upstream(obj: bpy.types.Object) -> None:
    """What it edits is then in the next frame."""
    scenes.put_in_front(obj, "CAST")
    bpy.context.view_layer.update()


def upstream_beside_a_linked_duplicate(obj: bpy.types.Object) -> None:
    """With the same mesh, and Sinew, but without an upstream modifier."""
    copy = scenes.copied(obj, linked=True)
    bpy.context.view_layer.update()
    assert session.state_of(copy) is not None
    upstream(obj)


def upstream_beside_its_comparison(obj: bpy.types.Object) -> None:
    comparison.start(bpy.context, [obj], ["lbs"], np.array((1.0, 0.0, 0.0)))
    upstream(obj)


@pytest.mark.parametrize("edit", [edit_weights, edit_vertices])
@pytest.mark.parametrize(
    ("set_up", "once"),
    [
        (alone, False),
        (alone, True),
        (upstream, True),
        (upstream_beside_a_linked_duplicate, True),
        (upstream_beside_its_comparison, True),
    ],
)
def test_a_handlers_edit_after_sinews_is_shown(arm, neighbour, edit, set_up, once):
    """Blender evaluates it without notification, and skips the handler that follows one that removes
    itself."""
    set_up(arm)

    def act() -> None:
        if once:
            take_off()
        edit(arm)

    take_off = neighbour("frame_change_post", act)
    if set_up is not alone:
        bpy.context.scene.frame_set(8)
    bpy.context.scene.frame_set(9)
    take_off()
    got = scenes.final_points(arm)
    comparison.end(bpy.context)
    assert_modifiers(arm, [9], got)


MOVES = {
    "pose a bone": lambda obj: scenes.bend(properties.of(obj).armature, 35.0),
    "move the armature": lambda obj: setattr(properties.of(obj).armature.location, "y", 0.4),
    "move the mesh": lambda obj: setattr(obj.location, "y", 0.4),
}


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("event", ["frame_change_post", "depsgraph_update_post"])
def test_what_a_handler_behind_sinews_poses_and_moves(arm, neighbour, event, move, route):
    """Within Blender's evaluation it is part of the frame; after the update it is seen at the next event."""
    calls = []

    def call() -> None:
        calls.append(event)
        MOVES[move](arm)

    take_off = neighbour(event, call)
    if event == "frame_change_post":
        bpy.context.scene.frame_set(9)
    else:
        arm.update_tag()
        bpy.context.view_layer.update()
    got, count = scenes.final_points(arm), len(calls)
    take_off()
    if route is State.AFTER_UPDATE:
        arm.update_tag()
        bpy.context.view_layer.update()
        got = scenes.final_points(arm)
    assert count == 1
    assert not properties.of(arm).error
    properties.of(arm).enabled = False
    arm.modifiers["Armature"].use_deform_preserve_volume = True
    expected = scenes.final_points(arm)
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(arm)


@pytest.mark.parametrize("edit", [edit_weights, edit_vertices])
def test_a_handlers_edit_of_an_edited_mesh_is_in_the_next_event(arm, neighbour, edit):
    take_off = neighbour("depsgraph_update_post", lambda: edit(arm) if arm.pass_index else None)
    arm.pass_index = 1
    arm.data.update()
    bpy.context.view_layer.update()
    take_off()
    assert_modifiers(arm, FRAMES, scenes.shapes(arm, FRAMES))


@pytest.mark.parametrize("gone", ["applied", "deleted"])
def test_another_armature_modifier_in_the_place_of_one_that_is_gone(arm, gone):
    armature = arm.modifiers["Armature"].object
    bpy.context.scene.frame_set(6)
    bpy.context.view_layer.objects.active = arm
    act = bpy.ops.object.modifier_apply if gone == "applied" else bpy.ops.object.modifier_remove
    act(modifier="Armature")
    bpy.context.view_layer.update()
    assert "deleted or applied; add another and press Rebind, or Remove" in session.plan_of(arm).reason
    assert not any(m.is_on for m in layout.read(arm).modifiers)
    another = arm.modifiers.new("Another", "ARMATURE")
    another.object, another.use_deform_preserve_volume = armature, True
    bpy.context.scene.frame_set(8)
    expected = scenes.final_points(arm)
    assert scenes.worst(expected, scenes.rest_points(arm)) > 0.05
    bpy.ops.sinew.rebind()
    assert session.plan_of(arm).state is not State.REFUSED
    assert scenes.worst(scenes.final_points(arm), expected) <= scenes.TOLERANCE * scenes.diagonal(arm)
    attach.remove(arm)
    assert [modifier.name for modifier in arm.modifiers] == ["Another"]


def test_a_node_group_removed_at_every_frame_is_said(arm, neighbour):
    def remove() -> None:
        group = stack.sinew_modifier(arm).node_group
        if group is not None:
            bpy.data.node_groups.remove(group)

    neighbour("frame_change_post", remove)
    for frame in range(2, 8):
        bpy.context.scene.frame_set(frame)
    assert "again and again" in properties.of(arm).error
    assert arm.modifiers["Armature"].show_viewport
    assert scenes.worst(scenes.shapes(arm, [11])[0], scenes.rest_points(arm)) > 0.1


@pytest.mark.parametrize("event", ["frame_change_post", "depsgraph_update_post"])
def test_sinews_modifier_removed_behind_sinews_handler(arm, neighbour, event):
    removed = []

    def remove() -> None:
        if not removed:
            removed.append(arm.modifiers.remove(stack.sinew_modifier(arm)))

    neighbour(event, remove)
    arm.update_tag()
    bpy.context.view_layer.update()
    for frame in (7, 8, 9):
        bpy.context.scene.frame_set(frame)
    assert removed
    assert not properties.has_sinew(arm)
    own = arm.modifiers["Armature"]
    assert own.show_viewport
    assert own.object is not None


@pytest.mark.parametrize("keyed", ["viewport", "render"])
def test_keys_of_one_visibility_leave_the_other(arm, rendered_points, keyed):
    modifier = arm.modifiers["Armature"]
    scenes.key(modifier, f"show_{keyed}", ((1, True), (5, False)))
    for frame in (8, 3, 8, 3, 6):
        bpy.context.scene.frame_set(frame)
    shown, rendered = scenes.final_points(arm), rendered_points(arm)
    attach.remove(arm)
    bpy.context.scene.frame_set(6)
    assert (modifier.show_viewport, modifier.show_render) == (keyed == "render", keyed == "viewport")
    modifier.use_deform_preserve_volume = True
    near = scenes.TOLERANCE * scenes.diagonal(arm)
    assert scenes.worst(shown, scenes.final_points(arm)) <= near
    assert scenes.worst(rendered, rendered_points(arm)) <= near
    assert scenes.worst(shown, rendered) > 0.1


def test_an_artists_driver_stays(arm):
    driver = arm.driver_add("location", 0).driver
    variable = driver.variables.new()
    variable.name = "sinew_0"
    variable.targets[0].id, variable.targets[0].data_path = arm, "location[1]"
    scenes.shapes(arm, FRAMES)
    properties.of(arm).heat = True
    scenes.shapes(arm, FRAMES)
    attach.remove(arm)
    assert [curve.data_path for curve in arm.animation_data.drivers] == ["location"]


def test_a_failure_within_the_evaluation_is_counted_and_deformed_after_it(monkeypatch):
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(6)

    def fail(*_args: object) -> None:
        raise RuntimeError("disk on fire")

    monkeypatch.setattr(in_depsgraph, "_deform", fail)
    got = scenes.shapes(obj, [2, 3, 4, 5])
    state = session.state_of(obj)
    assert state.evaluation.failures > 0
    assert "disk on fire" in state.evaluation.failure
    assert state.plan.state is State.AFTER_UPDATE
    assert "disk on fire" in state.plan.reason
    monkeypatch.undo()
    attach.remove(obj)
    expected = scenes.modifier_shapes(obj, [4, 5], preserve_volume=True)
    assert scenes.worst(got[2:], expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_suspended_by_two_threads_at_once():
    """As by a window and its render's thread: the second one waits, and at the end nothing is suspended."""
    order, entered = [], threading.Event()

    def other() -> None:
        entered.set()
        with updates_suspended():
            order.append("other")

    thread = threading.Thread(target=other)
    with updates_suspended():
        thread.start()
        entered.wait(10)
        thread.join(0.2)
        with updates_suspended() as may_react:
            assert not may_react
        order.append("this")
    thread.join(10)
    assert order == ["this", "other"]
    with updates_suspended() as may_react:
        assert may_react


def test_keys_that_two_objects_share_go_with_the_last(route):
    obj, _armature = scenes.skinned_arm("dq")
    obj.keyframe_insert("sinew.method", frame=4)
    other = scenes.copied(obj, linked=True)
    session.refresh(bpy.context)
    assert other.animation_data.action == obj.animation_data.action
    attach.remove(obj)
    assert "sinew.method" in actions.animated_paths(other)
    attach.remove(other)
    bpy.context.scene.frame_set(5)
    for each in (obj, other):
        assert not actions.animated_paths(each)
        assert not each.is_property_set("sinew")
