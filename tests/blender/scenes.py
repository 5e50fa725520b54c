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
from sinew_addon.attach import attach, stack
from sinew_addon.attach.updates import updates_suspended
from sinew_addon.deform import session

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


def key_shape(obj: bpy.types.Object) -> None:
    """A first shape key that lifts all vertices, keyed: off at frame 1, on at frame 11."""
    obj.shape_key_add(name="Basis")
    made = obj.shape_key_add(name="Key")
    for point in made.data:
        point.co.z += 0.2
    key(made, "value", ((1, 0.0), (11, 1.0)))


def modifiers(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Its modifiers without those that keep texture coordinates (attach/undeformed.py)."""
    own = (stack.mark_modifier(obj), stack.neutral_modifier(obj))
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
    """float64 [bones, 4, 4] of the evaluated pose; name: matrix_basis for that of the channels"""
    return np.array([getattr(bone, name) for bone in evaluated(armature).pose.bones])


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


def save(path: Path) -> Path:
    """Saves the open file there, in a folder that may be new."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
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


def states_of(obj: bpy.types.Object) -> list:
    """An object that Sinew deforms, and its state at this frame, for measuring."""
    return session.states_of([obj], bpy.context.evaluated_depsgraph_get())


def worst(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a.astype(np.float64) - b).max())


def bend(armature: bpy.types.Object, degrees: float, bone: int = 1) -> None:
    """Sets poses without keys."""
    pose_bone = armature.pose.bones[bone]
    pose_bone.rotation_mode = "QUATERNION"
    pose_bone.rotation_quaternion = Quaternion(Vector((1.0, 0.3, 0.2)).normalized(), math.radians(degrees))


def forget_keys(armature: bpy.types.Object) -> None:
    armature.animation_data_clear()


def write_slow_file(path: Path, vertices: int, iterations: int) -> Path:
    """Writes an arm, and a grid of `vertices` squared that Geometry Nodes smooth this many times when
    Blender evaluates it, as it does when it opens the file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    make_arm(sides=6, rings=5)
    group = bpy.data.node_groups.new("Slow", "GeometryNodeTree")
    group.is_modifier = True
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    grid, blur, position, set_position, out = (
        group.nodes.new(kind)
        for kind in (
            "GeometryNodeMeshGrid",
            "GeometryNodeBlurAttribute",
            "GeometryNodeInputPosition",
            "GeometryNodeSetPosition",
            "NodeGroupOutput",
        )
    )
    grid.inputs["Vertices X"].default_value = grid.inputs["Vertices Y"].default_value = vertices
    blur.data_type = "FLOAT_VECTOR"
    blur.inputs["Iterations"].default_value = iterations
    value = next(socket for socket in blur.inputs if socket.enabled and socket.name == "Value")
    group.links.new(position.outputs["Position"], value)
    group.links.new(grid.outputs["Mesh"], set_position.inputs["Geometry"])
    group.links.new(next(s for s in blur.outputs if s.enabled), set_position.inputs["Position"])
    group.links.new(set_position.outputs["Geometry"], out.inputs[0])
    obj = added("Slow", bpy.data.meshes.new("Slow"))
    obj.modifiers.new("Slow", "NODES").node_group = group
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
    """Offsets, bones and weights, read one by one, without Sinew's code."""
    bones = [bone.name for bone in attach.armature_of(obj).data.bones]
    offsets, indices, weights = [0], [], []
    for vertex in obj.data.vertices:
        for entry in vertex.groups:
            indices.append(bones.index(obj.vertex_groups[entry.group].name))
            weights.append(entry.weight)
        offsets.append(len(indices))
    return np.int32(offsets), np.int32(indices), np.float32(weights)


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
