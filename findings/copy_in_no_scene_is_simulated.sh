#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A Python copy of a rigid body takes part in the simulation, though it is linked to no collection and seen by nobody:
# Object.copy() puts it into the collection of the rigid body world.
#
# A passive box is copied by Object.copy(), and the copy is moved aside and linked nowhere. A ball of radius .3 falls
# where it would be. Where does the ball lie at frame 59?
#
#   expected: it falls on, as nothing is there
#   seen on 2026-11-29, bpy 4.5.15 (Python 3.11): at 1.30, on the copy, which is in no scene. 4.2.23 and 5.3.0 the same
#
# For tools that keep hidden copies of meshes: take a copy out of rigidbody_world.collection at once. Needs python3.11
# and a registry of Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet bpy==4.5.15
cat >"$folder/shown.py" <<'PYTHON'
import bpy

scene = bpy.context.scene
bpy.ops.rigidbody.world_add()
bpy.ops.mesh.primitive_cube_add()
box = bpy.context.object
bpy.ops.rigidbody.object_add()
box.rigid_body.type = "PASSIVE"
copy = box.copy()
copy.location = (5.0, 0.0, 0.0)
bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=(5.0, 0.0, 4.0))
ball = bpy.context.object
bpy.ops.rigidbody.object_add()
ball.rigid_body.collision_shape = "SPHERE"
for frame in range(1, 60):
    scene.frame_set(frame)
height = round(ball.matrix_world.translation.z, 2)
is_in_scene = copy.name in scene.objects
is_in_world = copy.name in scene.rigidbody_world.collection.objects
print(bpy.app.version_string, "ball at", height, "copy in the scene:", is_in_scene, "in the world:", is_in_world)
raise SystemExit((height, is_in_scene, is_in_world) != (1.3, False, True))
PYTHON
"$folder/venv/bin/python" "$folder/shown.py"
echo "as seen on 2026-11-29"
