#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A driver that reads an add-on's property of a pose bone keeps the old value through all frames, although the
# armature is animated and Blender poses it anew in each of them: unless the property has an update callback, which may
# do nothing.
#
# Two properties of pose bones, one without a callback and one whose callback is empty, each read by a driver of a
# shape key. A script sets the first to 0.5. Which value has its shape key after an update, and after two more frames?
# Then it sets the second: which values have both?
#
#   expected: 0.5 at the next frame at the latest, as the armature is evaluated there; then 0.5 and 0.5
#   seen on 2026-11-30, bpy 4.5.15 (Python 3.11): 0, 0, 0, though the bone is elsewhere in each frame; then 0.5 and 0.5.
#   4.2.23 and 5.3.0 the same
#
# For rigs whose add-on has controls: give each property an update callback, or tag the armature. A callback has its
# price: Blender then poses the armature and deforms its meshes again each time. Needs python3.11 and a registry of
# Python packages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet bpy==4.5.15
cat >"$folder/shown.py" <<'PYTHON'
import bpy

bpy.types.PoseBone.bare = bpy.props.FloatProperty()
bpy.types.PoseBone.watched = bpy.props.FloatProperty(update=lambda _self, _context: None)
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
scene = bpy.context.scene
rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
scene.collection.objects.link(rig)
bpy.context.view_layer.objects.active = rig
bpy.ops.object.mode_set(mode="EDIT")
rig.data.edit_bones.new("b").tail = (0.0, 0.0, 1.0)
bpy.ops.object.mode_set(mode="OBJECT")
bone = rig.pose.bones["b"]
for frame in (1, 9):
    bone.location.y = frame
    bone.keyframe_insert("location", frame=frame)
mesh = bpy.data.meshes.new("Mesh")
mesh.from_pydata([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], [], [(0, 1, 2)])
obj = bpy.data.objects.new("Face", mesh)
scene.collection.objects.link(obj)
obj.shape_key_add(name="Basis")
for name in ("bare", "watched"):
    driver = obj.shape_key_add(name=name).driver_add("value").driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = rig, f'pose.bones["b"].{name}'
scene.frame_set(1)


def values() -> tuple[float, ...]:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    keys = obj.evaluated_get(depsgraph).data.shape_keys.key_blocks
    return tuple(round(keys[name].value, 3) for name in ("bare", "watched"))


def height() -> float:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return round(rig.evaluated_get(depsgraph).pose.bones["b"].matrix.translation.z, 3)


bone.bare = 0.5
bpy.context.view_layer.update()
seen, heights = [values()], [height()]
for frame in (3, 5):
    scene.frame_set(frame)
    seen.append(values())
    heights.append(height())
bone.watched = 0.5
bpy.context.view_layer.update()
seen.append(values())
del bpy.types.PoseBone.bare, bpy.types.PoseBone.watched
print(bpy.app.version_string, "without and with a callback:", seen, "heights of the bone:", heights)
are_posed = len(set(heights)) == 3
raise SystemExit(not are_posed or seen != [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.5, 0.5)])
PYTHON
"$folder/venv/bin/python" "$folder/shown.py"
echo "as seen on 2026-11-30"
