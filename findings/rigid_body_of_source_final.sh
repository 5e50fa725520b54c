#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A rigid body with Deforming on follows an armature for the mesh sources Base and Deform, and stays in its rest pose
# for Final, the one whose name promises the deformed mesh.
#
# A plate skinned to one bone is a passive, animated body of shape Mesh, Deforming. The bone lifts it by 1 during
# frames 1 to 6. A ball of radius .3 falls on it from a height of 3; where does it lie at frame 49?
#
#   expected: 1.3 for all three sources
#   seen on 2026-11-28, bpy 4.5.15 (Python 3.11): Base 1.300, Deform 1.300, Final 0.300; 4.2.23 and 5.3.0 the same
#
# For characters as obstacles: choose Deform. Needs python3.11 and a registry of Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet bpy==4.5.15
cat >"$folder/shown.py" <<'PYTHON'
import bpy


def height_of_the_ball(source: str) -> float:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("bone").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = bpy.data.meshes.new("Plate")
    mesh.from_pydata([(x, y, 0.0) for x in (-4.0, 4.0) for y in (-4.0, 4.0)], [], [(0, 2, 3, 1)])
    plate = bpy.data.objects.new("Plate", mesh)
    scene.collection.objects.link(plate)
    plate.vertex_groups.new(name="bone").add(range(4), 1.0, "REPLACE")
    plate.modifiers.new("Armature", "ARMATURE").object = rig
    bone = rig.pose.bones["bone"]
    for frame, up in ((1, 0.0), (6, 1.0)):
        bone.location = (0.0, up, 0.0)
        bone.keyframe_insert("location", frame=frame)
    bpy.ops.rigidbody.world_add()
    bodies = scene.rigidbody_world.collection = bpy.data.collections.new("Bodies")
    bodies.objects.link(plate)
    body = plate.rigid_body
    body.type, body.kinematic, body.collision_shape = "PASSIVE", True, "MESH"
    body.mesh_source, body.use_deform = source, True
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=(0.0, 0.0, 3.0))
    ball = bpy.context.object
    bodies.objects.link(ball)
    ball.rigid_body.collision_shape = "SPHERE"
    for frame in range(1, 50):
        scene.frame_set(frame)
    return ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation.z


seen = {source: round(height_of_the_ball(source), 1) for source in ("BASE", "DEFORM", "FINAL")}
print(bpy.app.version_string, seen)
raise SystemExit(seen != {"BASE": 1.3, "DEFORM": 1.3, "FINAL": 0.3})
PYTHON
"$folder/venv/bin/python" "$folder/shown.py"
echo "as seen on 2026-11-28"
