#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Normalize All of groups that deform scales masks as well, where a mesh is deformed by parenting (type Armature)
# alone. Any modifier on the object, also one that is off and has nothing to do with it, and masks stay.
#
# A vertex has weights .5 and .2 of two bones, and .8 of a mask that is no bone's. vertex_group_normalize_all is called
# with group_select_mode="BONE_DEFORM" and lock_active=False, once as it is, once with a Triangulate modifier that is off.
#
#   expected: .714, .286, .8 both times
#   seen on 2026-11-29, bpy 4.5.15 (Python 3.11): .333, .133, .533; with the modifier .714, .286, .8. 4.2.23 and 5.3.0
#   the same
#
# For scripts that clean weights: give the mesh an Armature modifier first. Needs python3.11 and a registry of Python
# packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet bpy==4.5.15
cat >"$folder/shown.py" <<'PYTHON'
import bpy


def weights(with_modifier: bool) -> list[float]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for number, name in enumerate(("a", "b")):
        bone = rig.data.edit_bones.new(name)
        bone.head, bone.tail = (0.0, 0.0, number), (0.0, 0.0, number + 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], [], [(0, 1, 2)])
    body = bpy.data.objects.new("Mesh", mesh)
    scene.collection.objects.link(body)
    body.parent, body.parent_type = rig, "ARMATURE"
    for name, weight in (("a", 0.5), ("b", 0.2), ("mask", 0.8)):
        body.vertex_groups.new(name=name).add(range(3), weight, "REPLACE")
    if with_modifier:
        body.modifiers.new("Triangulate", "TRIANGULATE").show_viewport = False
    bpy.context.view_layer.objects.active = body
    body.select_set(True)
    bpy.ops.object.vertex_group_normalize_all(group_select_mode="BONE_DEFORM", lock_active=False)
    return [round(group.weight, 3) for group in mesh.vertices[0].groups]


seen = weights(False), weights(True)
print(bpy.app.version_string, *seen)
raise SystemExit(seen != ([0.333, 0.133, 0.533], [0.714, 0.286, 0.8]))
PYTHON
"$folder/venv/bin/python" "$folder/shown.py"
echo "as seen on 2026-11-29"
