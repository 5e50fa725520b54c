# SPDX-License-Identifier: GPL-3.0-or-later
"""Small rigs, and functions that read them."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import ClassVar

import bpy
import numpy as np
from mathutils import Quaternion, Vector
from sinew_addon.attach import attach, layout, node_group, properties
from sinew_addon.attach.updates import updates_suspended
from sinew_addon.deform import session
from sinew_addon.features.measure import live
from sinew_addon.skinning import sdef

# Documented tolerance against the Armature modifier, relative to the bounding box's diagonal.
TOLERANCE = 1e-5


def make_arm(
    bones: int = 2, sides: int = 12, rings: int = 21, weights: str = "smooth", name: str = "Arm"
) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A tube along X, 1 unit for each bone, bent and twisted by `bones` bones; keyed at frames 1 and 11.

    Returns the mesh object and the armature object.
    """
    length = float(bones)
    armature = added(f"{name} Rig", bpy.data.armatures.new(f"{name} Rig"))
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for index in range(bones):
        bone = armature.data.edit_bones.new(f"bone.{index}")
        bone.head, bone.tail = (index, 0.0, 0.0), (index + 1.0, 0.0, 0.0)
        bone.parent, bone.use_connect = parent, parent is not None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")

    points, faces = [], []
    for ring in range(rings):
        x = length * ring / (rings - 1)
        for side in range(sides):
            angle = 2 * math.pi * side / sides
            points.append((x, 0.25 * math.cos(angle), 0.25 * math.sin(angle)))
    for ring in range(rings - 1):
        for side in range(sides):
            here, beside = ring * sides + side, ring * sides + (side + 1) % sides
            faces.append((here, beside, beside + sides, here + sides))
    faces += [tuple(range(sides))[::-1], tuple(range((rings - 1) * sides, rings * sides))]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    obj = added(name, mesh)
    for index in range(bones):
        group = obj.vertex_groups.new(name=f"bone.{index}")
        for vertex, point in enumerate(points):
            distance = abs(point[0] - (index + 0.5))
            weight = max(0.0, 1.0 - distance) if weights == "smooth" else float(distance <= 0.5)
            if weight > 0.0:
                group.add([vertex], weight, "REPLACE")
    modifier = obj.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    key_pose(armature)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 11
    bpy.context.scene.frame_set(1)
    return obj, armature


def stand_across(armature: bpy.types.Object, seed: int | None = None) -> None:
    """Bones keep their heads, as files from other programs bring them: all upright, or each where a seed
    says."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        bone.use_connect = False
    for number, bone in enumerate(armature.data.edit_bones):
        rng = np.random.default_rng((seed, number)) if seed is not None else None
        direction = Vector((0.0, 0.0, 0.5) if rng is None else rng.normal(0.0, 1.0, 3))
        bone.tail = bone.head + direction * bone.length
        bone.roll = 0.0 if rng is None else rng.uniform(-np.pi, np.pi)
    bpy.ops.object.mode_set(mode="OBJECT")


def rotate_in_armature(bone: bpy.types.PoseBone, rotation: Quaternion) -> None:
    """Rotates a bone against its parent, by a rotation in armature space at rest."""
    rest = bone.bone.matrix_local.to_quaternion()
    bone.rotation_mode = "QUATERNION"
    bone.rotation_quaternion = rest.inverted() @ rotation @ rest


def key_pose(armature: bpy.types.Object, degrees: float = 100.0) -> None:
    """Rest at frame 1; at frame 11 every bone but the first is bent and twisted."""
    for index, bone in enumerate(armature.pose.bones):
        bone.rotation_mode = "QUATERNION"
        bone.keyframe_insert("rotation_quaternion", frame=1)
        if index:
            turn = math.radians(degrees)
            bone.rotation_quaternion = Quaternion((1, 0, 0), turn) @ Quaternion((0, 1, 0), 0.8 * turn)
        bone.location = (0.0, 0.1 * index, 0.0)
        bone.keyframe_insert("rotation_quaternion", frame=11)


def key(owner: bpy.types.bpy_struct, path: str, values: Iterable[tuple[int, object]]) -> None:
    """Keys a property: (frame, value) of each key."""
    for frame, value in values:
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)


def key_shape(obj: bpy.types.Object, scale: tuple[float, float, float] | None = None) -> None:
    """A first shape key that scales the mesh, or else lifts all vertices, keyed: off at frame 1, on at 11."""
    obj.shape_key_add(name="Basis")
    made = obj.shape_key_add(name="Key")
    for point in made.data:
        point.co = point.co + Vector((0.0, 0.0, 0.2)) if scale is None else point.co * Vector(scale)
    key(made, "value", ((1, 0.0), (11, 1.0)))


def mark(obj: bpy.types.Object) -> bpy.types.Modifier | None:
    """Sinew's modifier that marks the mesh (attach/undeformed.py)."""
    return obj.modifiers.get(layout.read(obj).mark)


def neutral(obj: bpy.types.Object) -> bpy.types.Modifier | None:
    """The one that changes nothing."""
    return obj.modifiers.get(layout.read(obj).neutral)


def modifiers(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Its modifiers without those that keep texture coordinates (attach/undeformed.py)."""
    own = (mark(obj), neutral(obj))
    return [modifier for modifier in obj.modifiers if modifier not in own]


def put_in_front(obj: bpy.types.Object, kind: str = "SUBSURF", name: str = "Front") -> bpy.types.Modifier:
    """A modifier before all others; by default a subdivision."""
    modifier = obj.modifiers.new(name, kind)
    if kind == "SUBSURF":
        modifier.levels = 1
    obj.modifiers.move(len(obj.modifiers) - 1, 0)
    return modifier


def points_of(vertices: bpy.types.bpy_prop_collection, name: str = "co") -> np.ndarray:
    """float32 [vertices, 3] of a mesh or a shape key, read without Sinew's code."""
    points = np.empty((len(vertices), 3), dtype=np.float32)
    vertices.foreach_get(name, points.ravel())
    return points


def evaluated(obj: bpy.types.Object) -> bpy.types.Object:
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get())


def final_points(obj: bpy.types.Object, name: str = "co") -> np.ndarray:
    """float32 [vertices, 3]: the final evaluated mesh, object space.

    name  undeformed_co for its Generated texture coordinates, if hair or the like has Blender make them
    """
    return points_of(evaluated(obj).data.vertices, name)


def pose_of(armature: bpy.types.Object, name: str = "matrix") -> np.ndarray:
    """float64 [bones, 4, 4] of the evaluated pose.

    name  matrix_basis for that of the channels
    """
    return np.array([getattr(bone, name) for bone in evaluated(armature).pose.bones])


def pixels_of(path: Path, are_numbers: bool = False) -> np.ndarray:
    """float32 [height, width, 4] of a picture, the lowest row first.

    are_numbers  they are no colours
    """
    image = bpy.data.images.load(str(path))
    if are_numbers:
        image.colorspace_settings.name = "Non-Color"
    found = np.empty((image.size[1], image.size[0], 4), dtype=np.float32)
    image.pixels.foreach_get(found.ravel())
    bpy.data.images.remove(image)
    return found


def rest_points(obj: bpy.types.Object) -> np.ndarray:
    return points_of(obj.data.vertices)


def diagonal(obj: bpy.types.Object) -> float:
    return float(np.linalg.norm(np.ptp(rest_points(obj), axis=0)))


def at_frames(frames: Iterable[float], read: Callable[[], np.ndarray]) -> np.ndarray:
    """[frames, ...]: what is read at each frame."""
    result = []
    for frame in frames:
        bpy.context.scene.frame_set(math.floor(frame), subframe=frame - math.floor(frame))
        result.append(read())
    return np.stack(result)


def shapes(obj: bpy.types.Object, frames: Iterable[float]) -> np.ndarray:
    """float32 [frames, vertices, 3]."""
    return at_frames(frames, lambda: final_points(obj))


def world_points(obj: bpy.types.Object) -> np.ndarray:
    """float64 [vertices, 3]: the final evaluated mesh, in the world."""
    world = np.array(evaluated(obj).matrix_world)
    return final_points(obj) @ world[:3, :3].T + world[:3, 3]


def world_shapes(obj: bpy.types.Object, frames: Iterable[float]) -> np.ndarray:
    """float64 [frames, vertices, 3]."""
    return at_frames(frames, lambda: world_points(obj))


def modifier_shapes(obj: bpy.types.Object, frames: list[float], preserve_volume: bool) -> np.ndarray:
    """The shapes by Blender's own Armature modifiers, for an object that Sinew does not deform."""
    modifiers = [modifier for modifier in obj.modifiers if modifier.type == "ARMATURE"]
    before = [modifier.use_deform_preserve_volume for modifier in modifiers]
    for modifier in modifiers:
        modifier.use_deform_preserve_volume = preserve_volume
    result = shapes(obj, frames)
    for modifier, flag in zip(modifiers, before, strict=True):
        modifier.use_deform_preserve_volume = flag
    return result


def add_sinew(obj: bpy.types.Object, method: str | None = None) -> None:
    attach.add(obj, method)
    session.refresh(bpy.context)


def rebind(obj: bpy.types.Object) -> None:
    """As the panel's Rebind, of one object that need not be selected."""
    with updates_suspended():
        session.read_again(obj)
    session.refresh(bpy.context)


def skinned_arm(method: str | None = None, **options: object) -> tuple[bpy.types.Object, bpy.types.Object]:
    """make_arm() with Sinew."""
    obj, armature = make_arm(**options)
    add_sinew(obj, method)
    return obj, armature


def placed_arm(bones: int = 3) -> tuple[bpy.types.Object, bpy.types.Object]:
    """make_arm() below its armature, which is moved, rotated and scaled."""
    obj, armature = make_arm(bones)
    obj.parent = armature
    armature.location, armature.rotation_euler = (0.3, -0.4, 0.2), (0.5, 0.2, -0.3)
    armature.scale = (1.3, 1.3, 1.3)
    bpy.context.view_layer.update()
    return obj, armature


def paint(obj: bpy.types.Object, name: str, shares: Iterable[float]) -> None:
    """A new vertex group: a share for each vertex, at most 1, and none where it is not positive."""
    group = obj.vertex_groups.new(name=name)
    for vertex, share in enumerate(shares):
        if share > 0.0:
            group.add([vertex], min(float(share), 1.0), "REPLACE")


def shares_of(obj: bpy.types.Object, name: str) -> np.ndarray:
    """float64 [vertices] of a vertex group, read one by one."""
    index = obj.vertex_groups[name].index
    return np.array([sum(g.weight for g in v.groups if g.group == index) for v in obj.data.vertices])


def set_stage(obj: bpy.types.Object, name: str, **values: object) -> None:
    """Sets parameters of a stage, and switches it on."""
    stage = getattr(properties.of(obj), name)
    for parameter, value in {**values, "enabled": True}.items():
        setattr(stage, parameter, value)


def bone_motions(armature: bpy.types.Object) -> np.ndarray:
    """float64 [bones, 4, 4]: from the rest pose to this frame's, in the armature's space."""
    rest = np.array([bone.matrix_local for bone in armature.data.bones])
    return pose_of(armature) @ np.linalg.inv(rest)


def move_to(collection: bpy.types.Collection, *objects: bpy.types.Object) -> None:
    """Out of the scene's own collection."""
    for obj in objects:
        bpy.context.scene.collection.objects.unlink(obj)
        collection.objects.link(obj)


def deform_by_parent(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """By a parent of type Armature, in the place of the object's modifiers."""
    obj.modifiers.clear()
    obj.parent, obj.parent_type = armature, "ARMATURE"


def copied(obj: bpy.types.Object, name: str = "", linked: bool = False) -> bpy.types.Object:
    """linked  with the same mesh"""
    copy = obj.copy()
    if not linked:
        copy.data = obj.data.copy()
    copy.name = name or copy.name
    bpy.context.scene.collection.objects.link(copy)
    return copy


def added(name: str, data: bpy.types.ID | None) -> bpy.types.Object:
    """A new object in the scene."""
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def save(path: Path, **options: object) -> Path:
    """Saves the open file there, in a folder that may be new."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), **options)
    return path


def opened(path: Path | str) -> bpy.types.Object | None:
    """Opens a file; returns its arm, if it has one of make_arm()'s name."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.data.objects.get("Arm")


def reopened(path: Path) -> bpy.types.Object | None:
    """The same, after the current file was saved there."""
    return opened(save(path))


def enter(obj: bpy.types.Object, mode: str) -> None:
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode=mode)


@contextlib.contextmanager
def handler(event: str, function: Callable, first: bool = False) -> Iterator[None]:
    """Like another add-on's, after Sinew's or before it."""
    functions = getattr(bpy.app.handlers, event)
    functions.insert(0 if first else len(functions), function)
    try:
        yield
    finally:
        functions.remove(function)


def deformed_now(obj: bpy.types.Object) -> list:
    """An object that Sinew deforms, and its state at this frame, for measuring."""
    return session.deformed_now([obj], bpy.context.evaluated_depsgraph_get())


def measure(obj: bpy.types.Object, other: str = "blender") -> live.Subject:
    """What the panel measures of it at this frame, against another method."""
    return live.measure(deformed_now(obj), other, bpy.context.evaluated_depsgraph_get())


def worst(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a.astype(np.float64) - b).max())


def assert_as_without(obj: bpy.types.Object, shown: np.ndarray | None = None) -> None:
    """Removes Sinew. The shape that it showed, by default that of now, is the modifier's."""
    shown = final_points(obj) if shown is None else shown
    attach.remove(obj)
    expected = final_points(obj)
    assert shown.shape == expected.shape
    assert worst(shown, expected) <= 1e-5


def bend(armature: bpy.types.Object, degrees: float, bone: int = 1) -> None:
    """Sets poses without keys."""
    pose_bone = armature.pose.bones[bone]
    pose_bone.rotation_mode = "QUATERNION"
    pose_bone.rotation_quaternion = Quaternion(Vector((1.0, 0.3, 0.2)).normalized(), math.radians(degrees))


def forget_keys(armature: bpy.types.Object) -> None:
    armature.animation_data_clear()


Made = bpy.types.Node | bpy.types.NodeSocket


def nodes(make: Callable[[bpy.types.NodeTree, bpy.types.Node], Made]) -> bpy.types.NodeTree:
    """A group of Geometry Nodes.

    make  gets the group and the node of its input; returns what has the geometry of its output
    """
    group = bpy.data.node_groups.new("Made", "GeometryNodeTree")
    group.is_modifier = True
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    source = node_group.add(group, "NodeGroupInput")
    node_group.add(group, "NodeGroupOutput", {0: make(group, source)})
    return group


def write_slow_file(path: Path, vertices: int, iterations: int) -> Path:
    """Writes an arm, and a grid of `vertices` squared that Geometry Nodes smooth this many times when
    Blender evaluates it, as it does when it opens the file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    make_arm(sides=6, rings=5)

    def slow(group: bpy.types.NodeTree, _source: bpy.types.Node) -> Made:
        size = {"Vertices X": vertices, "Vertices Y": vertices}
        grid = node_group.add(group, "GeometryNodeMeshGrid", size)
        position = node_group.add(group, "GeometryNodeInputPosition")
        values = {"Value": position, "Iterations": iterations}
        blur = node_group.add(group, "GeometryNodeBlurAttribute", values, data_type="FLOAT_VECTOR")
        return node_group.add(group, "GeometryNodeSetPosition", {"Geometry": grid, "Position": blur})

    obj = added("Slow", bpy.data.meshes.new("Slow"))
    obj.modifiers.new("Slow", "NODES").node_group = nodes(slow)
    path.parent.mkdir(parents=True, exist_ok=True)
    # Saving the open file would evaluate it.
    bpy.data.libraries.write(str(path), {bpy.context.scene}, compress=True)
    bpy.data.objects.remove(obj)
    return path


def link(path: Path | str, *names: str, link: bool = True) -> list[bpy.types.Object]:
    """Objects of another file, linked, or appended, into an empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return link_here(path, *names, link=link)


def link_here(
    path: Path | str, *names: str, link: bool = True, relative: bool = False
) -> list[bpy.types.Object]:
    """The same into the current scene."""
    with bpy.data.libraries.load(str(path), link=link, relative=relative) as (_there, here):
        here.objects = list(names)
    for obj in here.objects:
        bpy.context.scene.collection.objects.link(obj)
    return here.objects


def weights_of(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offsets, bones and weights, read one by one, without Sinew's code. Groups of no bone are left out."""
    armature = next(modifier.object for modifier in obj.modifiers if modifier.type == "ARMATURE")
    numbers = [armature.data.bones.find(group.name) for group in obj.vertex_groups]
    offsets, indices, weights = [0], [], []
    for vertex in obj.data.vertices:
        for entry in vertex.groups:
            if numbers[entry.group] >= 0:
                indices.append(numbers[entry.group])
                weights.append(entry.weight)
        offsets.append(len(indices))
    return np.int32(offsets), np.int32(indices), np.float32(weights)


def add_spheres(obj: bpy.types.Object, vertices: Iterable[int], seed: int) -> None:
    """The shape keys of mmd_tools that sdef reads, with C, R0 and R1 of these vertices."""
    rng = np.random.default_rng(seed)
    obj.shape_key_add(name="Basis")
    keys = [obj.shape_key_add(name=name) for name in sdef.KEYS]
    for made in keys:
        # They are not meant as shapes: in Blender 5.2 a new key has the value 1.
        made.value = 0.0
    for vertex in vertices:
        centre = np.array([round(obj.data.vertices[vertex].co.x), 0.02, -0.03])
        for made, point in zip(keys, (centre, *(centre + rng.uniform(-0.2, 0.2, (2, 3)))), strict=True):
            made.data[vertex].co = point


def triangles_of(obj: bpy.types.Object) -> np.ndarray:
    """int32 [triangles, 3]"""
    obj.data.calc_loop_triangles()
    return np.int32([triangle.vertices[:] for triangle in obj.data.loop_triangles])


class KeepingEngine(bpy.types.RenderEngine):
    """Draws nothing, and stores the data that it is given for each mesh."""

    bl_idname = "SINEW_KEEPING"
    bl_label = "Keeping"
    shapes: ClassVar[dict[str, np.ndarray]] = {}
    undeformed: ClassVar[dict[str, np.ndarray]] = {}
    attributes: ClassVar[dict[str, list[str]]] = {}

    def render(self, depsgraph):
        for obj in depsgraph.objects:
            if obj.type != "MESH":
                continue
            for name, kept in (("co", self.shapes), ("undeformed_co", self.undeformed)):
                kept[obj.name] = points_of(obj.data.vertices, name)
            self.attributes[obj.name] = obj.data.attributes.keys()
        self.end_result(self.begin_result(0, 0, 4, 4))


@contextlib.contextmanager
def rendering() -> Iterator[Callable[[bpy.types.Object], np.ndarray]]:
    """Context with a function that renders, and returns float32 [vertices, 3]: what a render receives for an
    object at this frame. KeepingEngine has the rest."""
    bpy.utils.register_class(KeepingEngine)

    def render(obj: bpy.types.Object) -> np.ndarray:
        scene = bpy.context.scene
        if scene.camera is None:
            scene.camera = added("Camera", bpy.data.cameras.new("Camera"))
        scene.render.engine = KeepingEngine.bl_idname
        scene.render.resolution_x = scene.render.resolution_y = 4
        KeepingEngine.shapes.clear()
        bpy.ops.render.render()
        return KeepingEngine.shapes[obj.name]

    try:
        yield render
    finally:
        bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
        bpy.utils.unregister_class(KeepingEngine)
