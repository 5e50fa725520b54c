#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A Boolean modifier takes the other mesh's vertex groups by name with the solvers Exact and Manifold, and by number with
# Fast (4.5) or Float (5.x): parts then follow other bones, or none.
#
# Mesh A has the groups a, b; mesh B has b, c, a, and all of its vertices have weight 1 of a. After the union, which
# groups have B's vertices?
#
#   expected: a, whatever the solver
#   seen on 2026-11-29: bpy 4.5.15: Exact and Manifold a, Fast number 2, which A has not; 5.3.0: the same, with Float
#
# For characters that are joined or cut by Boolean before the Armature modifier. Needs python3.11, python3.13 and a
# registry of Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/shown.py" <<'PYTHON'
import bpy
from mathutils import Matrix


def cube(name: str, place: tuple[float, float, float], groups: str) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add()
    made = bpy.context.object
    made.data.transform(Matrix.Translation(place))
    for group in groups:
        made.vertex_groups.new(name=group)
    made.vertex_groups["a"].add(range(8), 1.0, "REPLACE")
    return made


def numbers(solver: str) -> set[int]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    one, other = cube("A", (0.0, 0.0, 0.0), "ab"), cube("B", (1.0, 0.5, 0.3), "bca")
    modifier = one.modifiers.new("Boolean", "BOOLEAN")
    modifier.object, modifier.operation, modifier.solver = other, "UNION", solver
    mesh = one.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    return {group.group for vertex in mesh.vertices if vertex.co.x > 1.5 for group in vertex.groups}


fast = "FLOAT" if bpy.app.version >= (5, 0) else "FAST"
seen = {solver: numbers(solver) for solver in ("EXACT", "MANIFOLD", fast)}
print(bpy.app.version_string, seen)
raise SystemExit(seen != {"EXACT": {0}, "MANIFOLD": {0}, fast: {2}})
PYTHON
for pair in 3.11:4.5.15 3.13:5.3.0; do
    "python${pair%%:*}" -m venv "$folder/${pair##*:}"
    "$folder/${pair##*:}/bin/pip" install --quiet "bpy==${pair##*:}"
    "$folder/${pair##*:}/bin/python" "$folder/shown.py"
done
echo "as seen on 2026-11-29"
