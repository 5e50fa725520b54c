# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the files that players are measured with, by Blender: a tube on six bones, in each file one property
that players treat differently, and beside it what Blender showed.

python tools/players/make_files.py FOLDER
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from glb import Glb

RATE, LAST, FRAMES = 30, 24, (0, 5, 12, 19, 23)
BONES, RINGS, SIDES = 6, 13, 8
# Positions are multiples of this, in metres, and weights of a 255th: so small integers have them exactly.
STEP, STEPS = 2.0**-12, 255
DEGREES, OTHER_DEGREES = 25.0, -10.0


@dataclass(frozen=True)
class File:
    """
    set_up    changes the scene before it is keyed
    change    changes the .glb that Blender wrote
    most      influences of a vertex
    clip      of the file's, whose shape is compared
    others    the other endings that have this property
    """

    set_up: Callable[[bpy.types.Object, bpy.types.Object], None] = lambda _tube, _rig: None
    change: Callable[[Glb], None] = lambda _file: None
    most: int = 4
    clip: int = 0
    others: tuple[str, ...] = (".usdc", ".fbx")


def influences(most: int) -> np.ndarray:
    """Weights [vertices, bones]: of the nearest four bones, and of the nearest `most` at the fifth ring."""
    heights = np.repeat(np.linspace(0.0, 1.0, RINGS), SIDES) * BONES
    apart = np.abs(heights[:, None] - (np.arange(BONES) + 0.5))
    weights = np.exp(-(apart**2) / 1.5)
    kept = np.where(np.arange(len(weights)) // SIDES == 4, most, 4)
    order = np.argsort(np.argsort(-weights, axis=1), axis=1)
    weights[order >= kept[:, None]] = 0.0
    if most > 4:
        # So far apart that the last ones matter.
        weights[4 * SIDES : 5 * SIDES] = np.linspace(0.3, 0.1, BONES)
    whole = np.floor(STEPS * weights / weights.sum(axis=1, keepdims=True))
    whole[np.arange(len(whole)), whole.argmax(axis=1)] += STEPS - whole.sum(axis=1)
    return whole / STEPS


def make_tube(most: int) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A tube of 6 m along Z, narrower towards its end, and its armature."""
    data = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for number in range(BONES):
        bone = data.edit_bones.new(f"Bone{number}")
        bone.head, bone.tail = (0.0, 0.0, number), (0.0, 0.0, number + 1)
        if number:
            bone.parent, bone.use_connect = data.edit_bones[number - 1], True
    bpy.ops.object.mode_set(mode="OBJECT")
    angles = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False) + 0.1
    points = [
        (radius * np.cos(angle), 0.7 * radius * np.sin(angle), height)
        for height, radius in zip(np.linspace(0, BONES, RINGS), np.linspace(0.5, 0.3, RINGS), strict=True)
        for angle in angles
    ]
    faces = [
        (
            ring * SIDES + k,
            ring * SIDES + (k + 1) % SIDES,
            (ring + 1) * SIDES + (k + 1) % SIDES,
            (ring + 1) * SIDES + k,
        )
        for ring in range(RINGS - 1)
        for k in range(SIDES)
    ]
    faces += [tuple(reversed(range(SIDES))), tuple(range((RINGS - 1) * SIDES, RINGS * SIDES))]
    mesh = bpy.data.meshes.new("Tube")
    mesh.from_pydata((STEP * np.round(np.array(points) / STEP)).tolist(), [], faces)
    tube = bpy.data.objects.new("Tube", mesh)
    bpy.context.scene.collection.objects.link(tube)
    tube.parent = rig
    tube.modifiers.new("Armature", "ARMATURE").object = rig
    for number, weights in enumerate(influences(most).T):
        group = tube.vertex_groups.new(name=f"Bone{number}")
        for vertex in np.flatnonzero(weights):
            group.add([int(vertex)], weights[vertex], "REPLACE")
    return tube, rig


def key(rig: bpy.types.Object, degrees: float) -> None:
    """Each bone bends by so much from the first frame to the last, at even speed."""
    for bone in list(rig.pose.bones)[1:]:
        bone.rotation_mode = "XYZ"
        for frame, share in ((0, 0.0), (LAST, 1.0)):
            bone.rotation_euler.z = share * np.radians(degrees)
            bone.keyframe_insert("rotation_euler", frame=frame)
            bone.keyframe_insert("scale", frame=frame)
    even(rig)


def even(owner: bpy.types.ID) -> None:
    """Straight lines between the keys of an object or of shape keys."""
    (bag,) = owner.animation_data.action.layers[0].strips[0].channelbags
    for curve in bag.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def scale_bone(scale: tuple[float, float, float]) -> Callable[[bpy.types.Object, bpy.types.Object], None]:
    def set_up(_tube: bpy.types.Object, rig: bpy.types.Object) -> None:
        rig.pose.bones["Bone2"].scale = scale

    return set_up


def scale_rig(_tube: bpy.types.Object, rig: bpy.types.Object) -> None:
    rig.scale = (0.5, 0.5, 0.5)


def add_shape(tube: bpy.types.Object, _rig: bpy.types.Object) -> None:
    tube.shape_key_add(name="Basis")
    shape = tube.shape_key_add(name="Wide")
    for point in shape.data:
        point.co.x *= 1.5
    for frame, value in ((0, 0.0), (LAST, 1.0)):
        shape.value = value
        shape.keyframe_insert("value", frame=frame)
    even(tube.data.shape_keys)


def add_clip(_tube: bpy.types.Object, rig: bpy.types.Object) -> None:
    """A first clip; what is keyed next is the second."""
    key(rig, OTHER_DEGREES)
    rig.animation_data.action.name = "A first"
    track = rig.animation_data.nla_tracks.new()
    track.name = "A first"
    track.strips.new("A first", 0, rig.animation_data.action)
    track.mute = True
    rig.animation_data.action = None


def attributes_of(file: Glb) -> dict[str, int]:
    (mesh,) = file.header["meshes"]
    (primitive,) = mesh["primitives"]
    return primitive["attributes"]


def loosen(file: Glb) -> None:
    """Weights of every other ring sum to a half."""
    attributes = attributes_of(file)
    weights = file.array(attributes["WEIGHTS_0"]).copy()
    heights = file.array(attributes["POSITION"])[:, 1]
    weights[np.round(2 * heights).astype(int) % 2 == 1] *= 0.5
    attributes["WEIGHTS_0"] = file.add(weights)


def keep_two_keys(file: Glb) -> None:
    for animation in file.header["animations"]:
        for sampler in animation["samplers"]:
            times, values = file.array(sampler["input"]), file.array(sampler["output"])
            ends = times[[0, -1]]
            sampler["input"] = file.add(ends, min=[float(ends[0, 0])], max=[float(ends[1, 0])])
            sampler["output"] = file.add(values[[0, -1]])
            sampler["interpolation"] = "LINEAR"


def to_bytes(file: Glb) -> None:
    """Weights of eight bits."""
    attributes = attributes_of(file)
    weights = np.round(STEPS * file.array(attributes["WEIGHTS_0"])).astype("u1")
    attributes["WEIGHTS_0"] = file.add(weights, normalized=True)


def to_shorts(file: Glb) -> None:
    """Weights and positions of 16 bits, by KHR_mesh_quantization: the steps are in the bind matrices, as the
    node of a skinned mesh has no effect."""
    attributes = attributes_of(file)
    weights = np.round(65535 * file.array(attributes["WEIGHTS_0"])).astype("<u2")
    attributes["WEIGHTS_0"] = file.add(weights, normalized=True)
    whole = np.round(file.array(attributes["POSITION"]) / STEP).astype("<i2")
    about = {"min": whole.min(axis=0).tolist(), "max": whole.max(axis=0).tolist()}
    attributes["POSITION"] = file.add(whole, **about)
    (skin,) = file.header["skins"]
    binds = file.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).copy()
    # Rows are columns of the matrices.
    binds[:, :3] *= STEP
    skin["inverseBindMatrices"] = file.add(binds.reshape(-1, 16))
    for name in ("extensionsUsed", "extensionsRequired"):
        file.header.setdefault(name, []).append("KHR_mesh_quantization")


FILES = {
    "plain": File(),
    "six": File(most=6),
    "loose": File(change=loosen, others=()),
    "unequal": File(scale_bone((1.0, 1.8, 0.6))),
    "mirrored": File(scale_bone((-1.0, 1.0, 1.0))),
    "scaled_above": File(scale_rig),
    "two_keys": File(change=keep_two_keys),
    "two_clips": File(add_clip, clip=1, others=(".fbx",)),
    "morph": File(add_shape),
    "bytes": File(change=to_bytes, others=()),
    "shorts": File(change=to_shorts, others=()),
}


def shown_at(tube: bpy.types.Object, frame: int) -> np.ndarray:
    """float64 [vertices, 3], world"""
    bpy.context.scene.frame_set(frame)
    evaluated = tube.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.empty(3 * len(evaluated.data.vertices), np.float32)
    evaluated.data.vertices.foreach_get("co", points)
    matrix = np.array(evaluated.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def keep_two_samples(path: Path) -> None:
    bpy.utils.expose_bundled_modules()
    from pxr import Usd

    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        for attribute in prim.GetAttributes():
            for time in attribute.GetTimeSamples()[1:-1]:
                attribute.ClearAtTime(time)
    stage.GetRootLayer().Save()


def make(name: str, file: File, folder: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = RATE, 0, LAST
    tube, rig = make_tube(file.most)
    file.set_up(tube, rig)
    key(rig, DEGREES)
    rig.animation_data.action.name = "B second"
    modifier = tube.modifiers[0]
    shown = [shown_at(tube, frame) for frame in FRAMES]
    modifier.show_viewport = False
    if tube.data.shape_keys is not None:
        tube.show_only_shape_key = True
    rest = shown_at(tube, 0)
    modifier.show_viewport, tube.show_only_shape_key = True, False
    tube.data.calc_loop_triangles()
    triangles = np.array([each.vertices[:] for each in tube.data.loop_triangles])
    scene.frame_set(0)
    target = folder / f"{name}.glb"
    bpy.ops.export_scene.gltf(
        filepath=str(target),
        export_format="GLB",
        export_all_influences=True,
        export_optimize_animation_size=False,
        # What all objects play now as one clip, but where the file is to have several.
        export_animation_mode="ACTIONS" if file.clip else "ACTIVE_ACTIONS",
    )
    changed = Glb(target)
    file.change(changed)
    changed.write(target)
    if ".usdc" in file.others:
        target = folder / f"{name}.usdc"
        bpy.ops.wm.usd_export(filepath=str(target), export_animation=True, export_armatures=True)
        if name == "two_keys":
            keep_two_samples(target)
    if ".fbx" in file.others:
        bpy.ops.export_scene.fbx(
            filepath=str(folder / f"{name}.fbx"),
            add_leaf_bones=False,
            bake_anim_simplify_factor=0.0,
            bake_anim_step=LAST if name == "two_keys" else 1.0,
            bake_anim_use_nla_strips=False,
        )
    times = np.array(FRAMES) / RATE
    np.savez(folder / f"{name}.npz", rest=rest, shown=shown, times=times, triangles=triangles, clip=file.clip)


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, file in FILES.items():
        make(name, file, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
