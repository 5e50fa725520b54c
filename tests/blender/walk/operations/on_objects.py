# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects, and where they are shown."""

from __future__ import annotations

import random

import bpy
from walker import Walker, and_undo, operation


@operation(1)
def rename_object(w: Walker, r: random.Random) -> None:
    obj = w.one(r, [*w.meshes(), *w.armatures()])
    w.skip_if(obj.override_library is not None)
    obj.name = w.new_name("object")


def _delete(w: Walker, obj: bpy.types.Object, by_script: bool) -> None:
    w.object_mode()
    if by_script:
        bpy.data.objects.remove(obj)
    else:
        w.skip_if(not w.select(obj))
        bpy.ops.object.delete()


@operation(0.6)
def delete_object(w: Walker, r: random.Random) -> None:
    obj, by_script = w.mesh(r), r.random() < 0.5
    w.skip_if(len(w.meshes()) <= 2)
    _delete(w, obj, by_script)


@operation(0.2)
def delete_armature(w: Walker, r: random.Random) -> None:
    rig, by_script = w.armature(r), r.random() < 0.4
    # A comparison's copies keep it in the file.
    w.skip_if(len(w.armatures()) < 2 or w.compared)
    # So does being on an object with Sinew, if the command does not remove that from the file itself.
    by_script |= any(w.side.has_sinew(obj) for obj in w.objects("MESH"))
    _delete(w, rig, by_script)


@operation(0.3)
def unlink_armature(w: Walker, r: random.Random) -> None:
    """It is then in no collection, as a deleted one is while Sinew knows it. Sinew has to say so. Undone, as
    Blender does not save such an armature where no other data has it."""
    rig = w.armature(r)
    w.skip_if(rig.override_library is not None or w.compared)

    def act() -> None:
        bpy.context.view_layer.update()
        meshes = [o for o in w.objects("MESH") if o.library is None and w.side.is_on(o)]
        for collection in rig.users_collection:
            collection.objects.unlink(rig)
        bpy.context.view_layer.update()
        w.side.check_said_gone(meshes, rig)

    and_undo(w, r, act)


@operation(1.5)
def duplicate(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.override_library is None and o.data.library is None)
    linked, by_script = r.random() < 0.4, r.random() < 0.4
    w.skip_if(len(w.meshes()) > 6)
    if by_script:
        w.object_mode()
        made = obj.copy()
        if not linked:
            made.data = obj.data.copy()
        if made.animation_data is not None and made.animation_data.action is not None:
            # As Blender's own operator does: keys of a method are keys of other things on the other side.
            slot = getattr(made.animation_data, "action_slot", None)
            made.animation_data.action = made.animation_data.action.copy()
            if slot is not None:
                made.animation_data.action_slot = made.animation_data.action.slots[slot.identifier]
        bpy.context.scene.collection.objects.link(made)
    else:
        w.skip_if(not w.select(obj))
        bpy.ops.object.duplicate(linked=linked)
        made = bpy.context.view_layer.objects.active
    made.name = w.new_name("object")
    if not linked:
        made.data.name = w.new_name("mesh")


@operation(0.5)
def duplicate_armature(w: Walker, r: random.Random) -> None:
    rig, linked = w.armature(r), r.random() < 0.5
    w.skip_if(len(w.armatures()) > 4 or rig.override_library is not None)
    w.object_mode()
    made = rig.copy()
    if not linked:
        made.data = rig.data.copy()
        made.data.name = w.new_name("armature")
    bpy.context.scene.collection.objects.link(made)
    made.name = w.new_name("object")
    made.location.y += 0.5


@operation(0.5)
def single_user(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: w.users(o.data) > 1 and o.override_library is None)
    w.skip_if(not w.select(obj))
    bpy.ops.object.make_single_user(type="SELECTED_OBJECTS", object=True, obdata=True)
    obj = bpy.context.view_layer.objects.active
    obj.data.name = w.new_name("mesh")


@operation(1.5)
def hide(w: Walker, r: random.Random) -> None:
    obj, how = w.one(r, [*w.meshes(), *w.armatures()]), r.choice(("viewport", "render", "eye", "eye"))
    if how == "eye":
        hidden = not obj.hide_get()
        if obj.mode != "OBJECT":
            w.object_mode()
        obj.hide_set(hidden)
    else:
        name = f"hide_{how}"
        hidden = not getattr(obj, name)
        w.object_mode()
        setattr(obj, name, hidden)


@operation(1)
def hide_collection(w: Walker, r: random.Random) -> None:
    layers = [c for c in bpy.context.view_layer.layer_collection.children if not c.name.startswith("Sinew")]
    layer, how = w.one(r, sorted(layers, key=lambda c: c.name)), r.choice(("exclude", "eye", "viewport"))
    w.object_mode()
    if how == "exclude":
        layer.exclude = not layer.exclude
    elif how == "eye":
        layer.hide_viewport = not layer.hide_viewport
    else:
        layer.collection.hide_viewport = not layer.collection.hide_viewport


@operation(0.7)
def move_to_collection(w: Walker, r: random.Random) -> None:
    obj, collection = w.mesh(r), w.one(r, w.collections())
    w.skip_if(obj.mode != "OBJECT")
    if collection in list(obj.users_collection):
        w.skip_if(len([c for c in obj.users_collection if not c.name.startswith("Sinew")]) == 1)
        collection.objects.unlink(obj)
    else:
        collection.objects.link(obj)


@operation(0.5)
def show_all(w: Walker, r: random.Random) -> None:
    w.object_mode()
    for layer in bpy.context.view_layer.layer_collection.children:
        if not layer.name.startswith("Sinew"):
            layer.exclude = layer.hide_viewport = layer.collection.hide_viewport = False
    for obj in [*w.meshes(), *w.armatures()]:
        obj.hide_set(False)
        obj.hide_viewport = False
