#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Two sibling bones whose names differ by a dot alone cost a USD file its whole skeleton: the exporter writes two joints of
# one path and says FINISHED, and from 4.5 on Blender's own importer makes an armature without any bone.
#
# The bones "arm.L" and "arm_L", each with its own triangle, are exported and imported again. How many bones are there?
#
#   expected: two, the second renamed, as objects and materials are; at worst both triangles follow one bone
#   seen on 2026-11-29, bpy 4.5.15 (Python 3.11): joints arm_L and arm_L, a warning, no bone, the mesh at rest; 5.3.0
#   the same; 4.2.23: arm_L and arm_L.001, the mesh at rest
#
# For rigs that come from several tools: names in USD have only letters, digits and underscores; rename before. Needs
# python3.11 and a registry of Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet bpy==4.5.15
cat >"$folder/shown.py" <<'PYTHON'
import tempfile
from pathlib import Path

import bpy

scene = bpy.context.scene
rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
scene.collection.objects.link(rig)
bpy.context.view_layer.objects.active = rig
bpy.ops.object.mode_set(mode="EDIT")
for place, name in enumerate(("arm.L", "arm_L")):
    bone = rig.data.edit_bones.new(name)
    bone.head, bone.tail = (2.0 * place, 0.0, 0.0), (2.0 * place, 0.0, 1.0)
bpy.ops.object.mode_set(mode="OBJECT")
mesh = bpy.data.meshes.new("Mesh")
triangle = [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.5, 0.0, 0.0)]
mesh.from_pydata([*triangle, *((x + 2.0, y, z) for x, y, z in triangle)], [], [(0, 1, 2), (3, 4, 5)])
body = bpy.data.objects.new("Mesh", mesh)
scene.collection.objects.link(body)
body.parent = rig
body.vertex_groups.new(name="arm.L").add(range(3), 1.0, "REPLACE")
body.vertex_groups.new(name="arm_L").add(range(3, 6), 1.0, "REPLACE")
body.modifiers.new("Armature", "ARMATURE").object = rig
path = Path(tempfile.mkdtemp(), "rig.usda")
done = bpy.ops.wm.usd_export(filepath=str(path))
joints = next(line.strip() for line in path.read_text().splitlines() if "token[] joints" in line)
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.wm.usd_import(filepath=str(path))
bones = [bone.name for armature in bpy.data.armatures for bone in armature.bones]
print(bpy.app.version_string, done, joints, "imported:", bones)
raise SystemExit((joints, bones) != ('uniform token[] joints = ["arm_L", "arm_L"]', []))
PYTHON
"$folder/venv/bin/python" "$folder/shown.py"
echo "as seen on 2026-11-29"
