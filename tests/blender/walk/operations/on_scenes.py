# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes and view layers."""

from __future__ import annotations

import random

import bpy
from walker import FRAMES, Walker, operation


@operation(0.5)
def scene(w: Walker, r: random.Random) -> None:
    w.object_mode()
    if len(bpy.data.scenes) == 1:
        made = bpy.data.scenes.new("Second")
        made.render.engine = "WALK_RENDER"
        made.render.resolution_x = made.render.resolution_y = 4
        made.render.filepath = bpy.context.scene.render.filepath
        made.camera = bpy.context.scene.camera
        made.frame_start, made.frame_end = FRAMES
        for obj in [*w.meshes(), *w.armatures()]:
            if r.random() < 0.7:
                made.collection.objects.link(obj)
        return
    other = next(s for s in bpy.data.scenes if s != bpy.context.scene)
    if r.random() < 0.3:
        other.frame_set(r.randint(*FRAMES))
    else:
        w.evaluate()
        bpy.context.window.scene = other
    w.this_scene()


@operation(0.5)
def simplify(w: Walker, r: random.Random) -> None:
    render = bpy.context.scene.render
    render.use_simplify = not render.use_simplify
    render.simplify_subdivision = render.simplify_subdivision_render = r.randint(0, 1)


@operation(0.3)
def edit_elsewhere(w: Walker, r: random.Random) -> None:
    """Edits an object of a scene that no window shows, and evaluates that."""
    others = [scene for scene in bpy.data.scenes if scene != bpy.context.scene]
    found = [o for scene in others for o in scene.objects if o.type == "MESH" and not w.side.is_helper(o)]
    obj = w.one(r, sorted(found, key=lambda o: o.name_full))
    w.skip_if(obj.library is not None or obj.data.library is not None or obj.data.is_editmode)
    for index in r.sample(range(len(obj.data.vertices)), min(3, len(obj.data.vertices))):
        obj.data.vertices[index].co.z += 0.1
    obj.data.update()
    others[0].view_layers[0].update()


@operation(0.3)
def rigid_body(w: Walker, r: random.Random) -> None:
    """Makes it one that reads its deformed mesh, or none again."""
    obj = w.mesh(r, lambda o: o.override_library is None and o.library is None)
    w.skip_if(not w.select(obj))
    if obj.rigid_body is not None:
        bpy.ops.rigidbody.object_remove()
        return
    if bpy.context.scene.rigidbody_world is None:
        bpy.ops.rigidbody.world_add()
        # It would move what comes into its collection, depending on how often Blender evaluates.
        bpy.context.scene.rigidbody_world.enabled = False
    bpy.ops.rigidbody.object_add(type="PASSIVE")
    body = obj.rigid_body
    body.kinematic, body.collision_shape, body.use_deform = True, "MESH", True
    body.mesh_source = r.choice(("DEFORM", "BASE"))


@operation(0.2)
def copy_scene(w: Walker, r: random.Random) -> None:
    """As the menu does, with all objects or copies of them."""
    whole = r.random() < 0.5
    w.skip_if(len(bpy.data.scenes) > 1 or (whole and len(w.objects("MESH")) > 5) or w.compared)
    w.object_mode()
    # Blender shows the new scene only by keys until something is added or removed in it, such as Sinew's
    # helper objects: then changes without keys are visible again.
    w.this_frame()
    bpy.ops.scene.new(type="FULL_COPY" if whole else "LINK_COPY")
    bpy.context.scene.name = "Second"
    # As a window does immediately.
    bpy.context.view_layer.update()


@operation(0.4)
def view_layer(w: Walker, r: random.Random) -> None:
    w.object_mode()
    layers = bpy.context.scene.view_layers
    if len(layers) == 1:
        layers.new("Second")
    other = next(layer for layer in layers if layer != bpy.context.view_layer)
    # As a window does: Blender sends no notification of a view layer's first evaluation.
    w.evaluate()
    bpy.context.window.view_layer = other
    # As a window does immediately.
    bpy.context.view_layer.update()
