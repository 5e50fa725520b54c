#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A Hook modifier that a script adds is not the last of the stack from 5.x on: Blender puts it behind the modifiers that
# only deform, in front of the first that does more, though a Hook only deforms itself.
#
# modifiers.new() adds a Hook, a Smooth, a Lattice to the stack Armature, Geometry Nodes, Subdivision.
#
#   expected: each at the end, number 3
#   seen on 2026-11-29: bpy 4.5.15: 3, 3, 3; 5.3.0: 1, 3, 3
#
# For scripts that add a Hook and go on with modifiers[-1], or expect it behind a Subdivision. Needs python3.11,
# python3.13 and a registry of Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/shown.py" <<'PYTHON'
import bpy


def place(kind: str) -> int:
    body = bpy.data.objects.new("Mesh", bpy.data.meshes.new("Mesh"))
    for each in ("ARMATURE", "NODES", "SUBSURF"):
        body.modifiers.new(each, each)
    body.modifiers.new("new", kind)
    return body.modifiers.find("new")


seen = [place(kind) for kind in ("HOOK", "SMOOTH", "LATTICE")]
print(bpy.app.version_string, seen)
raise SystemExit(seen != [1 if bpy.app.version >= (5, 0) else 3, 3, 3])
PYTHON
for pair in 3.11:4.5.15 3.13:5.3.0; do
    "python${pair%%:*}" -m venv "$folder/${pair##*:}"
    "$folder/${pair##*:}/bin/pip" install --quiet "bpy==${pair##*:}"
    "$folder/${pair##*:}/bin/python" "$folder/shown.py"
done
echo "as seen on 2026-11-29"
