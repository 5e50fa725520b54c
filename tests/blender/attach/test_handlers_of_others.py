# SPDX-License-Identifier: GPL-3.0-or-later
"""What handlers of other add-ons do to an object while Sinew is on it: they edit, pose, rename, exchange and
delete, before Sinew's handlers and behind them, some without any sign from Blender."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import bpy
import numpy as np
import pytest
import routes
import scenes
import sinew_addon
from conftest import halved
from program import run_script
from sinew_addon.attach import attach, properties, stack
from sinew_addon.deform import session
from sinew_addon.deform.plan import State
from sinew_addon.features.compare import comparison

FRAMES = [1, 6, 11]
STATES = {routes.EVALUATION: State.IN_DEPSGRAPH, routes.UPDATE: State.AFTER_UPDATE}


@pytest.fixture
def arm(route) -> bpy.types.Object:
    obj, _armature = scenes.skinned_arm("dq")
    bpy.context.scene.frame_set(6)
    assert session.skinned_of(obj).plan.state is STATES[route]
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
    assert session.skinned_of(copy) is not None
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
    if route == routes.UPDATE:
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


# --- A mesh, or an armature's bones, exchanged as Keymesh does

EXCHANGED = (5, 6, 7, 3)


def other_mesh(obj, vertices_too=False):
    """A thicker one; with other weights, and on demand with other vertices."""
    if vertices_too:
        other, rig = scenes.make_arm(sides=9, name="Other")
        mesh = other.data
        bpy.data.objects.remove(other)
        bpy.data.objects.remove(rig)
    else:
        mesh = obj.data.copy()
        for vertex in mesh.vertices:
            for entry in vertex.groups:
                entry.weight *= 0.5 if entry.group else 1.0
    for vertex in mesh.vertices:
        vertex.co.y *= 3.0
    for block in mesh.shape_keys.key_blocks if mesh.shape_keys is not None else ():
        for point in block.points:
            point.co.y *= 3.0
    return mesh


def plain(_obj):
    pass


def with_a_key(obj):
    scenes.key_shape(obj)
    obj.data.shape_keys.animation_data_clear()


def subdivided(obj):
    scenes.put_in_front(obj)


def displaced(obj):
    scenes.put_in_front(obj, "DISPLACE").strength = 0.1


def exchanges(obj, by_frame, use):
    def exchange(scene, *_):
        wanted = by_frame[scene.frame_current >= 6]
        if getattr(obj, use) != wanted:
            setattr(obj, use, wanted)

    return exchange


def shown(obj, event, exchange, first):
    with scenes.handler(event, exchange, first):
        return [scenes.shapes(obj, [frame])[0] for frame in EXCHANGED]


def assert_alike(obj, event, exchange, first, before):
    expected = shown(obj, event, exchange, first)
    obj.data = before
    bpy.context.scene.frame_set(1)
    scenes.add_sinew(obj)
    got = shown(obj, event, exchange, first)
    for frame, mine, its in zip(EXCHANGED, got, expected, strict=True):
        assert mine.shape == its.shape, frame
        assert scenes.worst(mine, its) <= scenes.TOLERANCE * scenes.diagonal(obj), frame


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("first", [False, True], ids=["behind Sinew's", "before Sinew's"])
@pytest.mark.parametrize("vertices_too", [False, True], ids=["same vertices", "other vertices"])
@pytest.mark.parametrize("prepare", [plain, with_a_key, subdivided, displaced])
def test_a_mesh_exchanged_by_a_handler(prepare, vertices_too, first):
    obj, _armature = scenes.make_arm()
    prepare(obj)
    meshes = obj.data, other_mesh(obj, vertices_too)
    exchange = exchanges(obj, meshes, "data")
    assert_alike(obj, "frame_change_post", exchange, first, meshes[0])


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("event", ["frame_change_pre", "frame_change_post"])
def test_a_mesh_exchanged_on_a_still_pose(event):
    obj, armature = scenes.make_arm()
    bpy.context.scene.frame_set(11)
    armature.animation_data_clear()
    meshes = obj.data, other_mesh(obj)
    assert_alike(obj, event, exchanges(obj, meshes, "data"), True, meshes[0])


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("first", [False, True])
def test_a_mesh_exchanged_in_a_render(rendered_points, first):
    obj, _armature = scenes.make_arm()
    meshes = obj.data, other_mesh(obj)
    exchange = exchanges(obj, meshes, "data")

    def rendered():
        found = []
        with scenes.handler("frame_change_post", exchange, first):
            for frame in (5, 6):
                bpy.context.scene.frame_set(1)
                bpy.context.scene.frame_current = frame
                found.append(rendered_points(obj))
        return np.array(found)

    expected = rendered()
    obj.data = meshes[0]
    scenes.add_sinew(obj)
    assert scenes.worst(rendered(), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("first", [False, True])
def test_bones_exchanged_by_a_handler(first):
    """After the update what handlers pose is there at the next event alone."""
    obj, armature = scenes.make_arm()
    other = armature.data.copy()
    bpy.context.scene.frame_set(1)
    armature.data = other
    scenes.enter(armature, "EDIT")
    other.edit_bones["bone.1"].head.y += 0.3
    other.edit_bones["bone.1"].tail.y += 0.1
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.data, both = bpy.data.armatures["Arm Rig"], (bpy.data.armatures["Arm Rig"], other)
    exchange = exchanges(armature, both, "data")
    expected = shown(obj, "frame_change_post", exchange, first)
    armature.data = both[0]
    bpy.context.scene.frame_set(1)
    scenes.add_sinew(obj)
    got = shown(obj, "frame_change_post", exchange, first)
    assert scenes.worst(np.array(got), np.array(expected)) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_mesh_exchanged_by_a_script():
    obj, _armature = scenes.skinned_arm()
    bpy.context.scene.frame_set(8)
    obj.data = other_mesh(obj)
    bpy.context.view_layer.update()
    shown_now = scenes.final_points(obj)
    attach.remove(obj)
    assert scenes.worst(shown_now, scenes.final_points(obj)) <= scenes.TOLERANCE * scenes.diagonal(obj)


# --- Deleted and renamed before Sinew is called. Blender frees it immediately but still lists it; reading its
# original can then crash Blender: each test is a separate process.

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
