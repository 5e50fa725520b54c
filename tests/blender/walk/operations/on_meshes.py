# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights and meshes."""

from __future__ import annotations

import random

import bmesh
import bpy
from mathutils import Vector
from walker import SHAPED, Walker, operation, some_vertices

# --- Weights


def _show_weights(obj: bpy.types.Object) -> None:
    """If weights and names of groups are changed through an object that Blender does not evaluate, the
    change is not shown on other objects with the mesh (seen on 4.2 and 5.2)."""
    if not obj.visible_get():
        obj.data.update()


@operation(8)
def weights(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and o.mode != "EDIT" and o.data.override_library is None)
    group = w.one(r, obj.vertex_groups)
    vertices = some_vertices(w, r, obj)
    if r.random() < 0.3:
        group.remove(vertices)
        _show_weights(obj)
        return
    group.add(vertices, r.uniform(0.0, 1.0), r.choice(("REPLACE", "ADD", "SUBTRACT")))
    if r.random() < 0.2:
        obj.data.update()
    _show_weights(obj)


@operation(3)
def paint_weights(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(not obj.vertex_groups or not w.select(obj))
    # Under a parent of type Armature, Blender normalizes the groups of bones alone if the object has any
    # modifier, such as Sinew's that are off, and all groups if it has none.
    w.skip_if(obj.parent_type == "ARMATURE" and not w.modifiers(obj))
    w.push_undo()
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    # As in a window: tools need the armature of the modifiers, which Sinew restores meanwhile.
    w.evaluate()
    obj.vertex_groups.active_index = r.randrange(len(obj.vertex_groups))
    what = r.choice(("smooth", "normalize_all", "invert", "levels"))
    if what == "smooth":
        bpy.ops.object.vertex_group_smooth(group_select_mode="ACTIVE", factor=0.5, repeat=2)
    elif what == "normalize_all":
        bpy.ops.object.vertex_group_normalize_all(lock_active=False)
    elif what == "invert":
        bpy.ops.object.vertex_group_invert(group_select_mode="ACTIVE")
    else:
        bpy.ops.object.vertex_group_levels(group_select_mode="ACTIVE", offset=0.1)
    if r.random() < 0.7:
        bpy.ops.object.mode_set(mode="OBJECT")


@operation(2)
def groups(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and o.mode != "EDIT" and o.override_library is None)
    group, what = w.one_or_none(r, obj.vertex_groups), r.choice(("new", "rename", "delete", "move", "bone"))
    if what == "new" or group is None:
        made = obj.vertex_groups.new(name=w.new_name("group"))
        made.add(some_vertices(w, r, obj), r.random(), "REPLACE")
        _show_weights(obj)
        return
    if what == "rename":
        group.name = w.new_name("group")
        _show_weights(obj)
        return
    if what == "bone":
        bones = [b.name for a in w.armatures() for b in a.data.bones]
        taken = {g.name for g in obj.vertex_groups}
        group.name = w.one(r, [b for b in dict.fromkeys(bones) if b not in taken])
        _show_weights(obj)
        return
    if what == "delete":
        obj.vertex_groups.remove(group)
        # Blender 4.2 by itself continues with the old groups.
        obj.data.update()
        return
    w.skip_if(not w.select(obj))
    obj.vertex_groups.active_index = group.index
    bpy.ops.object.vertex_group_sort(sort_type="NAME")


# --- Meshes


@operation(4)
def edit_mesh(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(not w.select(obj))
    what = r.choice(("move", "move", "delete", "extrude", "subdivide", "nothing"))
    w.edit_mode()
    mesh = bmesh.from_edit_mesh(obj.data)
    mesh.verts.ensure_lookup_table()
    count = len(mesh.verts)
    if what == "move" and count:
        for index in r.sample(range(count), max(1, count // 5)):
            mesh.verts[index].co += Vector([r.uniform(-0.1, 0.1) for _axis in range(3)])
    elif what == "delete" and count > 12:
        gone = [mesh.verts[index] for index in r.sample(range(count), 2)]
        bmesh.ops.delete(mesh, geom=gone, context="VERTS")
    elif what == "extrude" and len(mesh.faces) and count < 150:
        mesh.faces.ensure_lookup_table()
        face = mesh.faces[r.randrange(len(mesh.faces))]
        made = bmesh.ops.extrude_discrete_faces(mesh, faces=[face])
        for new in made["faces"]:
            bmesh.ops.translate(mesh, verts=new.verts, vec=(0.0, 0.1, 0.1))
    elif what == "subdivide" and len(mesh.edges) and count < 150:
        mesh.edges.ensure_lookup_table()
        edges = [mesh.edges[i] for i in r.sample(range(len(mesh.edges)), min(4, len(mesh.edges)))]
        bmesh.ops.subdivide_edges(mesh, edges=edges, cuts=1)
    bmesh.update_edit_mesh(obj.data)
    if r.random() < 0.75:
        bpy.ops.object.mode_set(mode="OBJECT")


@operation(2)
def leave_mode(w: Walker, r: random.Random) -> None:
    w.object_mode()


@operation(0.5)
def sculpt_mode(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(not w.select(obj))
    w.push_undo()
    bpy.ops.object.mode_set(mode="SCULPT")
    if r.random() < 0.5:
        bpy.ops.object.mode_set(mode="OBJECT")


@operation(4)
def move_vertices(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None and not o.data.is_editmode)
    for index in some_vertices(w, r, obj):
        obj.data.vertices[index].co += Vector([r.uniform(-0.1, 0.1) for _axis in range(3)])
    obj.data.update()


@operation(0.7)
def rename_mesh(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.data.library is None)
    obj.data.name = w.new_name("mesh")


@operation(0.8)
def swap_mesh(w: Walker, r: random.Random) -> None:
    obj = w.mesh(r, lambda o: o.mode == "OBJECT" and o.override_library is None and not o.data.is_editmode)
    w.skip_if(obj.data.library is not None)
    mesh = obj.data.copy()
    mesh.name = w.new_name("mesh")
    obj.data = mesh


@operation(0.5)
def share_mesh(w: Walker, r: random.Random) -> None:
    meshes = [
        o for o in w.meshes() if o.mode == "OBJECT" and o.override_library is None and not o.data.is_editmode
    ]
    w.skip_if(len(meshes) < 2 or not w.select(*r.sample(meshes, 2)))
    bpy.ops.object.make_links_data(type="OBDATA")


@operation(0.4)
def join(w: Walker, r: random.Random) -> None:
    """Joins an object that Sinew does not deform to another one."""
    others = [o for o in w.meshes() if not w.side.has_sinew(o) and o.override_library is None]
    obj = w.mesh(r, lambda o: o.override_library is None and o.data.library is None)
    other = w.one(r, [o for o in others if o != obj and w.users(o.data) == 1])
    is_shaped = bool(other.data.get(SHAPED))
    w.skip_if(is_shaped and any(modifier.type == "DECIMATE" for modifier in obj.modifiers))
    w.skip_if(len(obj.data.vertices) > 200 or not w.select(other, obj))
    bpy.ops.object.join()
    if is_shaped:
        obj.data[SHAPED] = True


@operation(0.4)
def separate(w: Walker, r: random.Random) -> None:
    """Separates a part of a mesh into a new object that keeps all of the old object's data."""
    obj = w.editable(r)
    w.skip_if(len(w.meshes()) > 6 or w.users(obj.data) > 1 or len(obj.data.vertices) < 20)
    w.skip_if(not w.select(obj))
    before = set(bpy.data.objects)
    w.edit_mode()
    mesh = bmesh.from_edit_mesh(obj.data)
    mesh.select_mode = {"FACE"}
    for number, face in enumerate(mesh.faces):
        face.select_set(number < 6)
    bmesh.update_edit_mesh(obj.data)
    bpy.ops.mesh.separate(type="SELECTED")
    bpy.ops.object.mode_set(mode="OBJECT")
    made = next(o for o in bpy.data.objects if o not in before and not w.side.is_helper(o))
    made.name, made.data.name = w.new_name("object"), w.new_name("mesh")


@operation(0.2)
def remesh(w: Walker, r: random.Random) -> None:
    """Another mesh without weights."""
    obj = w.editable(r)
    is_plain = w.users(obj.data) == 1 and obj.data.shape_keys is None
    w.skip_if(not is_plain or w.compared or bool(obj.data.get(SHAPED)) or not w.select(obj))
    obj.data.remesh_voxel_size = 0.15
    bpy.ops.object.voxel_remesh()


@operation(0.3)
def replace_mesh(w: Walker, r: random.Random) -> None:
    """Changes it in all that have it, like scripts that update a mesh."""
    obj = w.editable(r)
    w.skip_if(obj.data.is_editmode or obj.mode != "OBJECT")
    old = obj.data
    new = old.copy()
    old.user_remap(new)
    bpy.data.meshes.remove(old)
    new.name = w.new_name("mesh")


@operation(0.5)
def apply_transform(w: Walker, r: random.Random) -> None:
    obj = w.editable(r)
    w.skip_if(w.users(obj.data) > 1 or w.compared or not w.select(obj))
    # As the window offers where Sinew evaluates upstream modifiers separately: two objects have the mesh
    # then.
    bpy.ops.object.transform_apply(isolate_users=True)
    obj.data.name = w.new_name("mesh")
