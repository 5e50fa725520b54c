# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo, files, libraries, renders, exports and scripts of others."""

from __future__ import annotations

import random
from pathlib import Path

import bpy
import numpy as np
from walker import FRAMES, Walker, operation, some_vertices


@operation(5)
def undo(w: Walker, r: random.Random) -> None:
    steps = r.choice((1, 1, 2))
    w.push_undo()
    for _step in range(steps):
        bpy.ops.ed.undo()
    for obj in filter(w.shares_action, w.objects()):
        # Blender itself evaluates only one of the objects whose action has changed.
        obj.update_tag(refresh={"OBJECT"})
    if r.random() < 0.3:
        if r.random() < 0.5:
            bpy.context.view_layer.update()
        bpy.ops.ed.redo()


@operation(2.5)
def redo(w: Walker, r: random.Random) -> None:
    w.push_undo()
    bpy.ops.ed.redo()


@operation(1)
def save(w: Walker, r: random.Random) -> None:
    w.this_frame()
    bpy.ops.wm.save_as_mainfile(filepath=str(w.folder / "walk.blend"))


@operation(0.5)
def save_copy(w: Walker, r: random.Random) -> None:
    w.this_frame()
    bpy.ops.wm.save_as_mainfile(filepath=str(w.folder / "copy.blend"), copy=True)


def _read_keys_of_hidden() -> None:
    """Sinew makes Blender read all keys with the first evaluation of a file. Hidden objects that appear
    in a later evaluation have these values then, and without Sinew those that were saved."""
    for obj in bpy.data.objects:
        if obj.animation_data is not None:
            obj.update_tag(refresh={"TIME"})


@operation(1)
def save_and_load(w: Walker, r: random.Random) -> None:
    """Sometimes in the mode that an object is in. Others are then compared before it is left."""
    if r.random() < 0.6:
        w.object_mode()
    w.this_frame()
    path = str(w.folder / "walk.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    _read_keys_of_hidden()
    modes = {o.mode for o in w.objects()}
    w.evaluate()
    for obj in w.meshes() if modes != {"OBJECT"} else ():
        if obj.visible_get() and obj.mode == "OBJECT" and not obj.data.is_editmode:
            w.rendered[f"{obj.name_full} in the render, opened"] = w.shown_points(obj)
    w.object_mode()


@operation(0.5)
def revert(w: Walker, r: random.Random) -> None:
    w.skip_if(Path(bpy.data.filepath).name != "walk.blend")
    bpy.ops.wm.revert_mainfile()
    _read_keys_of_hidden()


def _from_library(w: Walker, link: bool) -> list[bpy.types.Object]:
    path = str(w.folder / "library.blend")
    w.object_mode()
    with bpy.data.libraries.load(path, link=link) as (_source, target):
        target.objects = ["Guest", "Guest Rig"]
    for obj in target.objects:
        # Linked again, it is the same one.
        if obj not in list(bpy.context.scene.collection.objects):
            bpy.context.scene.collection.objects.link(obj)
    return list(target.objects)


def _has_guest() -> bool:
    # Others are left over from undo: Sinew's settings keep an armature as its user, which no modifier does.
    shown = [o for o in bpy.data.objects if o.users_collection]
    return any(o.library is not None or o.override_library is not None for o in shown)


@operation(0.5)
def append(w: Walker, r: random.Random) -> None:
    w.skip_if(len(w.meshes()) > 6)
    guest, rig = _from_library(w, link=False)
    guest.name, guest.data.name = w.new_name("object"), w.new_name("mesh")
    rig.name, rig.data.name = w.new_name("object"), w.new_name("armature")


@operation(0.4)
def link(w: Walker, r: random.Random) -> None:
    w.skip_if(_has_guest())
    _from_library(w, link=True)


@operation(0.6)
def override(w: Walker, r: random.Random) -> None:
    if not _has_guest():
        _from_library(w, link=True)
    guest = next((o for o in w.objects("MESH") if o.library is not None), None)
    w.skip_if(guest is None or guest not in w.in_layer())
    w.object_mode()
    guest.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer, do_fully_editable=True)


@operation(0.5)
def reload_library(w: Walker, r: random.Random) -> None:
    w.skip_if(not bpy.data.libraries)
    w.object_mode()
    bpy.data.libraries[0].reload()


@operation(0.7)
def purge(w: Walker, r: random.Random) -> None:
    bpy.data.orphans_purge(do_recursive=r.random() < 0.7)


@operation(1.5)
def render(w: Walker, r: random.Random) -> None:
    w.object_mode()
    w.before_evaluation()
    w.rendered = {}
    if r.random() < 0.3:
        scene = bpy.context.scene
        first = r.randint(1, 10)
        scene.frame_start, scene.frame_end = first, first + 1
        bpy.ops.render.render(animation=True)
        scene.frame_start, scene.frame_end = FRAMES
    else:
        bpy.ops.render.render()


def meddle(obj: bpy.types.Object, what: str, modifier: str, new: str, vertices: list[int]) -> None:
    """Another add-on's operation on an object, and on the modifier with that name."""
    if what == "add":
        obj.modifiers.new(new, "CAST")
    elif what == "weights" and obj.vertex_groups:
        obj.vertex_groups[0].add(vertices, 0.3, "REPLACE")
    elif what == "move":
        obj.location.z += 0.1
    elif what == "name":
        obj.name = new
    elif what == "mesh":
        obj.data = obj.data.copy()
        obj.data.name = new
        for vertex in obj.data.vertices:
            vertex.co.y *= 1.3
    elif what == "rename":
        obj.modifiers[modifier].name = new
    elif what == "toggle":
        obj.modifiers[modifier].show_viewport = not obj.modifiers[modifier].show_viewport
    elif what == "delete":
        obj.modifiers.remove(obj.modifiers[modifier])


@operation(0.7)
def export(w: Walker, r: random.Random) -> None:
    """The data that another program receives."""
    obj = w.mesh(r)
    w.skip_if(not w.select(obj))
    w.evaluate()
    path = w.folder / "walk.obj"
    bpy.ops.wm.obj_export(
        filepath=str(path),
        export_selected_objects=True,
        export_materials=False,
        export_uv=False,
        export_normals=False,
        forward_axis="Y",
        up_axis="Z",
    )
    lines = (line.split()[1:4] for line in path.read_text().splitlines() if line.startswith("v "))
    points = np.array(list(lines), dtype=np.float32).reshape(-1, 3)
    w.rendered = {f"{obj.name_full} in the render, exported": points}


@operation(0.3)
def safe_mode(w: Walker, r: random.Random) -> None:
    on = r.random() < 0.5
    w.side.set_safe(on)


@operation(1)
def neighbour(w: Walker, r: random.Random) -> None:
    """Another add-on's handler, called once, at a change of frame."""
    obj, when = w.mesh(r), r.choice(("frame_change_pre", "frame_change_post", "depsgraph_update_post"))
    what, number = (
        r.choice(("rename", "toggle", "add", "delete", "weights", "move", "name", "mesh")),
        r.randint(*FRAMES),
    )
    w.skip_if(obj.override_library is not None or obj.mode != "OBJECT" or obj.data.library is not None)
    modifier = w.one_or_none(r, [m for m in w.modifiers(obj) if m.type != "ARMATURE"])
    w.skip_if(what in ("rename", "toggle", "delete") and modifier is None)
    name, vertices, new = obj.name, some_vertices(w, r, obj), w.new_name("neighbour")
    modifier_name = modifier.name if modifier is not None else ""
    handlers = getattr(bpy.app.handlers, when)

    def act(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
        handlers.remove(act)
        meddle(bpy.data.objects[name], what, modifier_name, new, vertices)

    handlers.append(act)
    if when == "depsgraph_update_post":
        obj.update_tag()
        w.evaluate()
        # Objects touched before and again in a handler are compared at the next event.
        w.this_frame()
    else:
        # So are newly set ones, because that touches the mesh, too.
        w.evaluate()
        bpy.context.scene.frame_set(number)
        if what in ("move", "weights") and when == "frame_change_post":
            # Changes by another handler are visible at the next event after the update, and weights where
            # there is an upstream modifier (docs/guide.md).
            w.this_frame()
    if act in handlers:
        handlers.remove(act)


@operation(0.5)
def touch(w: Walker, r: random.Random) -> None:
    obj, what = w.one(r, [*w.meshes(), *w.armatures()]), r.choice(("object", "data", "all"))
    if what == "object":
        obj.update_tag()
    elif what == "data":
        obj.data.update_tag()
    else:
        obj.update_tag(refresh={"OBJECT", "DATA", "TIME"})


@operation(2)
def update(w: Walker, r: random.Random) -> None:
    w.evaluate()


@operation(0)
def says(w: Walker, r: random.Random) -> None:
    """For scripts: what Sinew has to say about a mesh."""
    obj = w.mesh(r)
    if w.side.is_sinew and not any(str(word) in obj.sinew.error for word in r.words):
        raise ValueError(f"{obj.name}: says {obj.sinew.error!r}")
    r.words.clear()
