#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A bone that is renamed to the name of another vertex group loses its skin: from 4.5 on the groups keep their names,
# and a line on the console says so; in 4.2 the mesh has two groups of one name.
#
# A mesh has the groups "arm", with weight 1 and of the bone "arm", and "hand", empty and of no bone. The bone is renamed
# to "hand", and moved by 5. How are the groups called, and does the mesh follow?
#
#   expected: the bone's group is renamed with it, perhaps to hand.001, or the bone is; the mesh follows
#   seen on 2026-11-29: bpy 4.5.15 and 5.3.0: groups arm and hand, the mesh stays; 4.2.23: hand and hand, it follows
#
# For scripts that rename bones, as to another rig's names: rename vertex groups that are in the way first. Needs
# python3.11, python3.13 and a registry of Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/shown.py" <<'PYTHON'
import bpy

scene = bpy.context.scene
rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
scene.collection.objects.link(rig)
bpy.context.view_layer.objects.active = rig
bpy.ops.object.mode_set(mode="EDIT")
rig.data.edit_bones.new("arm").tail = (0.0, 0.0, 1.0)
bpy.ops.object.mode_set(mode="OBJECT")
mesh = bpy.data.meshes.new("Mesh")
mesh.from_pydata([(1.0, 0.0, 0.0)], [], [])
body = bpy.data.objects.new("Mesh", mesh)
scene.collection.objects.link(body)
body.vertex_groups.new(name="arm").add([0], 1.0, "REPLACE")
body.vertex_groups.new(name="hand")
body.modifiers.new("Armature", "ARMATURE").object = rig
rig.data.bones["arm"].name = "hand"
rig.pose.bones["hand"].location = (0.0, 5.0, 0.0)
evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
groups, moved = [group.name for group in body.vertex_groups], round(evaluated.data.vertices[0].co.z)
print(bpy.app.version_string, groups, "moved by", moved)
is_old = bpy.app.version < (4, 5)
raise SystemExit((groups, moved) != ((["hand", "hand"], 5) if is_old else (["arm", "hand"], 0)))
PYTHON
for pair in 3.11:4.2.23 3.11:4.5.15 3.13:5.3.0; do
    "python${pair%%:*}" -m venv "$folder/${pair##*:}"
    "$folder/${pair##*:}/bin/pip" install --quiet "bpy==${pair##*:}"
    "$folder/${pair##*:}/bin/python" "$folder/shown.py"
done
echo "as seen on 2026-11-29"
