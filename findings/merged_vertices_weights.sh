#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Merge by Distance gives a merged vertex the mean of the weights in 5.3, and in 4.5 those of one vertex alone; the
# operation of the same name in bmesh, which add-ons call, keeps one vertex's in both.
#
# Two vertices at one place, one with weight 1 of the group a, the other of b, are merged by mesh.remove_doubles, by
# bmesh.ops.remove_doubles and by a Weld modifier.
#
#   expected: the operator and bmesh do the same, in each version
#   seen on 2026-11-29: bpy 4.5.15: operator {a: 1}, bmesh {a: 1}, Weld .5 and .5; 5.3.0: operator .5 and .5, bmesh
#   {a: 1}, Weld .5 and .5
#
# For scripts that close seams of imported characters: weights at the seam depend on which they call, and on the
# version. Needs python3.11, python3.13 and a registry of Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/shown.py" <<'PYTHON'
import bpy
import bmesh  # part of bpy, and there once that is imported


def weights(how: str) -> dict[str, float]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    mesh = bpy.data.meshes.new("Mesh")
    points = [(0.0, 0.0, 0.0), (0.0001, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    mesh.from_pydata(points, [], [(0, 2, 3), (1, 3, 4)])
    body = bpy.data.objects.new("Mesh", mesh)
    bpy.context.scene.collection.objects.link(body)
    for vertex, name in enumerate(("a", "b")):
        body.vertex_groups.new(name=name).add([vertex], 1.0, "REPLACE")
    bpy.context.view_layer.objects.active = body
    if how == "Weld":
        body.modifiers.new("Weld", "WELD").merge_threshold = 0.01
        mesh = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    else:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        if how == "operator":
            bpy.ops.mesh.remove_doubles(threshold=0.01)
        else:
            edited = bmesh.from_edit_mesh(mesh)
            bmesh.ops.remove_doubles(edited, verts=edited.verts, dist=0.01)
        bpy.ops.object.mode_set(mode="OBJECT")
    return {"ab"[group.group]: round(group.weight, 3) for group in mesh.vertices[0].groups}


half, one = {"a": 0.5, "b": 0.5}, {"a": 1.0}
seen = [weights(how) for how in ("operator", "bmesh", "Weld")]
print(bpy.app.version_string, *seen)
raise SystemExit(seen != [half if bpy.app.version >= (5, 3) else one, one, half])
PYTHON
for pair in 3.11:4.5.15 3.13:5.3.0; do
    "python${pair%%:*}" -m venv "$folder/${pair##*:}"
    "$folder/${pair##*:}/bin/pip" install --quiet "bpy==${pair##*:}"
    "$folder/${pair##*:}/bin/python" "$folder/shown.py"
done
echo "as seen on 2026-11-29"
