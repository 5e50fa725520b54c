# SPDX-License-Identifier: GPL-3.0-or-later
"""Random rigs in random poses: Sinew compared with Blender's Armature modifier.

Methods that Blender lacks, and stages, are compared with the float64 reference.

    python tests/blender/programs/fuzz_parity.py --rigs 10000 [--first 0] [--route both] [--keep DIR]

Each rig is tested by both routes: within Blender's evaluation, as far as the rig allows, and after the
update, as in safe mode. A shape that Sinew did not make is a failure.

A rig is made from its seed and a set of features, each with its own random numbers, so that leaving one out
changes nothing else. A failing rig is reduced by leaving out all features that the failure does not need,
then saved as DIR/seed-N.blend.

The comparison leaves out vertices at a discontinuity of the modifier itself, where rounding decides: dual
quaternions that are within MARGIN of perpendicular (where the sign of a term flips), and weights whose sum
is within MARGIN of the modifier's threshold. It also leaves out vertices that a change of the input by its
rounding moves by the tolerance, directly or by a later modifier; for stages, a change of their input. All of
these are computed from the input. Behind several modifiers it also leaves out vertices where Sinew is
within the tolerance of the float64 reference: the rest of the difference is Blender's own rounding.

Generated texture coordinates must be Blender's, in renders, and in the viewport where hair needs them, but
for those that docs/parity.md names: where nodes in front make another mesh. Sinew must refuse a rig that it
cannot deform as Blender does: with a sentence, and nothing of it stays. Vertices that a seam split, as files
of engines have them, must stay together.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector
from sinew_addon.attach import attach, layout, node_group, properties, stage_settings, undeformed
from sinew_addon.base.errors import SinewError
from sinew_addon.deform import session
from sinew_addon.skinning import skin_stack

sys.path.append(str(Path(__file__).resolve().parents[2] / "support"))
import fuzz_reference
import reference
import routes
import scenes
import sinew
import whole_file

MARGIN = 1e-3
# For float32 numbers after a few operations, relative to the diagonal.
ROUNDING = 1e-6
# Blender's own rounding behind several modifiers, relative to the diagonal: never more than this.
ROUNDING_OF_BLENDER = 1e-4
# Of the input of stages. A smoothed island can be smaller than rounding, which then turns it as a whole: few
# roundings by chance move each of its vertices. So vertices with an error are looked at with more of them.
ROUNDINGS = 2
MORE_ROUNDINGS = 32
FEATURES = (
    "object transforms",
    "parenting",
    "scale",
    "mirror",
    "inherit scale",
    "bendy",
    "envelopes",
    "envelope multiply",
    "mask",
    "shape keys",
    "undeforming bones",
    "messy weights",
    "modifier behind",
    "modifier in front",
    "further armatures",
    "bone parent",
    "parent deforms",
    "absolute keys",
    "faces",
    "surface",
    "sdef keys",
    "stages",
    "first multi",
    "refused behind",
    "seams",
    "hair",
    "across",
    "pinned key",
    "simplify",
    "keyed options",
)
# Blender's own methods, and whether each has Preserve Volume.
ORACLES = (("lbs", False), ("dq", True))
OTHERS = tuple(m.name for m in sinew.methods() if m.name not in dict(ORACLES))
# Blender needs the mesh itself in front of these.
REFUSED_BEHIND = ("MULTIRES", "SOFT_BODY")
# A Multi Modifier directly behind one of these mixes with what it got, not with what it made.
MIXED_BY_MULTI_MODIFIERS = ("LATTICE", "MESH_DEFORM")
# How many vertices of a rig the reference computes: it takes a hundredth of a second for each.
REFERENCE_VERTICES = 12
# float32 compared with exact numbers; Blender's own results have the same rounding.
REFERENCE_TOLERANCE = 2 * scenes.TOLERANCE
# Results of stages: the mix of two methods, and all stages after the blend.
MIX, AFTER = "mix", "stages after"
# The distance between vertices that a seam split.
TORN = "seams"
# The points that Generated texture coordinates are made from.
COORDINATES = "coordinates"
COORDINATES_IN_VIEWPORT = "coordinates in the viewport"
# Vertex groups that stages use.
PAINTED = ("painted", "painted too")
NAMES = {routes.EVALUATION: "within Blender's evaluation", routes.UPDATE: "after the update"}


@dataclass
class Outcome:
    """The results for one rig.

    errors    the largest by (requested route, method or MIX, AFTER, TORN or COORDINATES), relative to the
              diagonal
    taken     the actual route for each requested one
    refused   Sinew has to refuse it; the errors are then those of Blender's shape afterwards
    reason    why a shape was not made by Sinew, if so
    left_out  the number of vertices left out
    compared  the number of vertices compared with the reference, over all methods, and of those undecided by
              rounding
    staged    the same for stages
    """

    seed: int
    errors: dict[tuple[str, str], float] = field(default_factory=dict)
    taken: dict[str, str] = field(default_factory=dict)
    refused: bool = False
    reason: str = ""
    left_out: int = 0
    compared: int = 0
    undecided: int = 0
    staged: int = 0
    undecided_stages: int = 0
    vertices: int = 0

    @property
    def failed(self) -> bool:
        limits = {method: scenes.TOLERANCE for method, _preserve_volume in ORACLES}
        return not all(
            error <= limits.get(what, REFERENCE_TOLERANCE) for (_route, what), error in self.errors.items()
        )


def numbers(seed: int, feature: str) -> np.random.Generator:
    return np.random.default_rng([seed, zlib.crc32(feature.encode())])


def has(seed: int, feature: str, features: set[str], share: float = 0.4) -> bool:
    return feature in features and numbers(seed, "has " + feature).random() < share


def random_rotation(rng: np.random.Generator) -> Matrix:
    return Euler(rng.uniform(-np.pi, np.pi, 3)).to_matrix().to_4x4()


def make_armature(seed: int, features: set[str]) -> bpy.types.Object:
    rng = numbers(seed, "bones")
    armature = scenes.added("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = armature.data.edit_bones
    for index in range(int(rng.integers(1, 13))):
        bone = bones.new(f"bone.{index}")
        parent = bones[int(rng.integers(0, index))] if index and rng.random() < 0.85 else None
        connected = parent is not None and rng.random() < 0.6
        bone.head = parent.tail if connected else Vector(rng.uniform(-1, 1, 3))
        bone.tail = bone.head + Vector(rng.normal(0, 1, 3)).normalized() * rng.uniform(0.2, 0.8)
        bone.roll = rng.uniform(-np.pi, np.pi)
        bone.parent, bone.use_connect = parent, connected
    bpy.ops.object.mode_set(mode="OBJECT")
    if has(seed, "across", features, share=0.2):
        scenes.stand_across(armature, seed if numbers(seed, "across").random() < 0.5 else None)
    set_bone_options(seed, features, armature.data.bones)
    return armature


def set_bone_options(seed: int, features: set[str], bones: bpy.types.bpy_prop_collection) -> None:
    if has(seed, "inherit scale", features):
        rng = numbers(seed, "inherit scale")
        modes = ("FULL", "FIX_SHEAR", "ALIGNED", "AVERAGE", "NONE")
        for bone in bones:
            bone.inherit_scale = modes[int(rng.integers(len(modes)))]
    if has(seed, "undeforming bones", features):
        rng = numbers(seed, "undeforming bones")
        for bone in bones:
            bone.use_deform = bool(rng.random() < 0.8)
    if has(seed, "bendy", features):
        rng = numbers(seed, "bendy")
        for bone in bones:
            if rng.random() < 0.5:
                bone.bbone_segments = int(rng.integers(2, 9))
                bone.bbone_curveinx, bone.bbone_curveoutz = rng.uniform(-0.3, 0.3, 2)
                if rng.random() < 0.4:
                    bone.bbone_mapping_mode = "CURVED"
    set_envelopes(seed, features, bones)


def set_envelopes(seed: int, features: set[str], bones: bpy.types.bpy_prop_collection) -> None:
    if has(seed, "envelopes", features) or has(seed, "envelope multiply", features):
        rng = numbers(seed, "envelopes")
        for bone in bones:
            bone.head_radius, bone.tail_radius, bone.envelope_distance = rng.uniform(0.05, 0.6, 3)
            bone.envelope_weight = rng.uniform(0.1, 1.0)
    if has(seed, "envelope multiply", features):
        rng = numbers(seed, "envelope multiply")
        for bone in bones:
            bone.use_envelope_multiply = bool(rng.random() < 0.4)


def make_mesh(seed: int, features: set[str], armature: bpy.types.Object) -> bpy.types.Object:
    rng = numbers(seed, "mesh")
    count = int(rng.integers(20, 120))
    mesh = bpy.data.meshes.new("Mesh")
    points = rng.uniform(-1.2, 1.2, (count, 3))
    if has(seed, "surface", features):
        faces = make_surface(numbers(seed, "surface"), points)
    else:
        faces = faces_of(seed, features, count)
    origins: list[int] = []
    if has(seed, "seams", features, share=0.2):
        faces, origins = split_at_seams(numbers(seed, "seams"), faces, count)
    mesh.from_pydata([*points.tolist(), *points[origins].tolist()], [], faces)
    obj = scenes.added("Mesh", mesh)
    groups = [obj.vertex_groups.new(name=bone.name) for bone in armature.data.bones]
    messy = has(seed, "messy weights", features)
    if messy:
        groups.append(obj.vertex_groups.new(name="no bone of that name"))
    weights = numbers(seed, "weights")
    for vertex in range(count):
        for group in weights.permutation(len(groups))[: int(weights.integers(1, 7))]:
            groups[group].add([vertex], float(weights.uniform(0.05, 1.0)), "REPLACE")
    if messy:
        make_weights_messy(numbers(seed, "messy weights"), count, groups)
    for copy, origin in enumerate(origins, count):
        for entry in [(entry.group, entry.weight) for entry in mesh.vertices[origin].groups]:
            groups[entry[0]].add([copy], entry[1], "REPLACE")
    if has(seed, "shape keys", features):
        add_shape_keys(seed, features, obj)
    if has(seed, "sdef keys", features):
        add_sdef_keys(numbers(seed, "sdef keys"), obj)
    return obj


def faces_of(seed: int, features: set[str], count: int) -> list[tuple[int, ...]]:
    """Numbers of vertices for a mesh of `count` vertices: two, or about as many as vertices."""
    if not has(seed, "faces", features):
        return [(0, 1, 2), (3, 4, 5)]
    rng = numbers(seed, "faces")
    return [tuple(rng.choice(count, 3, replace=False).tolist()) for _face in range(count)]


def make_surface(rng: np.random.Generator, points: np.ndarray) -> list[tuple[int, ...]]:
    """Moves most of `points` onto a rough sheet, and returns its faces: triangles, quads, hexagons and
    holes, and one at an edge that already has others."""
    width = int(rng.integers(3, 8))
    height = len(points) // width
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, width), np.linspace(-1.2, 1.2, height), indexing="xy")
    bent = np.stack([x, y, 0.5 * np.sin(2.0 * x + y)], axis=-1).reshape(-1, 3)
    points[: width * height] = bent + rng.normal(0.0, 0.03, bent.shape)
    faces: list[tuple[int, ...]] = []
    for row in range(height - 1):
        column = 0
        while column < width - 1:
            a, fate = row * width + column, rng.random()
            b, c, d = a + 1, a + width + 1, a + width
            if fate < 0.2:
                faces += [(a, b, c), (a, c, d)]
            elif fate < 0.3 and column + 2 < width:
                faces.append((a, b, b + 1, c + 1, c, d))
                column += 1
            elif fate < 0.9:
                faces.append((a, b, c, d))
            column += 1
    return [*faces, (0, 1, len(points) - 1)]


def split_at_seams(
    rng: np.random.Generator, faces: list[tuple[int, ...]], count: int
) -> tuple[list[tuple[int, ...]], list[int]]:
    """Gives about half of the faces vertices of their own, where they meet the others. Returns the faces, and
    the origin of each vertex behind the first `count`."""
    is_beyond = rng.random(len(faces)) < 0.5
    before = {vertex for face, beyond in zip(faces, is_beyond, strict=True) if not beyond for vertex in face}
    copies: dict[int, int] = {}
    split = [
        tuple(copies.setdefault(v, count + len(copies)) if v in before else v for v in face)
        if beyond
        else face
        for face, beyond in zip(faces, is_beyond, strict=True)
    ]
    return split, list(copies)


def make_weights_messy(rng: np.random.Generator, count: int, groups: list[bpy.types.VertexGroup]) -> None:
    for vertex in range(count):
        fate, group = rng.random(), groups[int(rng.integers(len(groups)))]
        if fate < 0.1:
            for each in groups:
                each.remove([vertex])
        elif fate < 0.2:
            group.add([vertex], 0.0, "REPLACE")
        elif fate < 0.3:
            group.add([vertex], float(10 ** rng.uniform(-6, -2)), "REPLACE")


def add_shape_keys(seed: int, features: set[str], obj: bpy.types.Object) -> None:
    rng = numbers(seed, "shape keys")
    obj.shape_key_add(name="Basis")
    for index in range(int(rng.integers(1, 4))):
        key = obj.shape_key_add(name=f"key {index}")
        points = scenes.rest_points(obj)
        moved = points + rng.normal(0, 0.1, points.shape).astype(np.float32)
        key.data.foreach_set("co", moved.ravel())
        key.slider_min, key.slider_max = -1.0, 2.0
        key.value, key.mute = rng.uniform(-0.5, 1.2), bool(rng.random() < 0.2)
        if rng.random() < 0.3:
            key.vertex_group = obj.vertex_groups[0].name
        if index and rng.random() < 0.3:
            key.relative_key = obj.data.shape_keys.key_blocks[1]
    if has(seed, "pinned key", features, share=0.2):
        obj.active_shape_key_index = int(
            numbers(seed, "pinned key").integers(len(obj.data.shape_keys.key_blocks))
        )
        obj.show_only_shape_key = True
    if has(seed, "absolute keys", features, share=0.2):
        obj.data.shape_keys.use_relative = False
        obj.data.shape_keys.eval_time = rng.uniform(0.0, 30.0)


def add_sdef_keys(rng: np.random.Generator, obj: bpy.types.Object) -> None:
    """Data for about half of the vertices, as mmd_tools stores it."""
    points = scenes.rest_points(obj)
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis")
    used = rng.random(len(points)) < 0.5
    for name in ("mmd_sdef_c", "mmd_sdef_r0", "mmd_sdef_r1"):
        key = obj.shape_key_add(name=name, from_mix=False)
        moved = points + used[:, None] * rng.normal(0.0, 0.3, points.shape).astype(np.float32)
        key.data.foreach_set("co", moved.ravel())
        key.mute = True


def make_rig(seed: int, features: set[str]) -> tuple[bpy.types.Object, bpy.types.Object]:
    """The mesh object and its armature for one seed, posed, in an empty file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    armature = make_armature(seed, features)
    obj = make_mesh(seed, features, armature)
    add_modifiers(seed, features, obj, armature)
    place(seed, features, obj, armature)
    pose(seed, features, armature)
    if has(seed, "stages", features):
        paint(numbers(seed, "painted"), obj)
    if has(seed, "simplify", features, share=0.2):
        render = bpy.context.scene.render
        render.use_simplify, render.simplify_subdivision, render.simplify_subdivision_render = True, 0, 0
    if has(seed, "keyed options", features, share=0.2):
        for modifier in (each for each in obj.modifiers if each.type == "ARMATURE"):
            value = modifier.invert_vertex_group
            scenes.key(modifier, "invert_vertex_group", ((0, not value), (1, value)))
        bpy.context.scene.frame_set(bpy.context.scene.frame_current)
    bpy.context.view_layer.update()
    return obj, armature


def add_modifiers(seed: int, features: set[str], obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    modifier = obj.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    modifier.use_multi_modifier = has(seed, "first multi", features, share=0.2)
    if has(seed, "envelopes", features):
        modifier.use_bone_envelopes = True
        modifier.use_vertex_groups = bool(numbers(seed, "use groups").random() < 0.7)
    if has(seed, "mask", features):
        rng = numbers(seed, "mask")
        modifier.vertex_group = obj.vertex_groups[int(rng.integers(len(obj.vertex_groups)))].name
        modifier.invert_vertex_group = bool(rng.random() < 0.5)
    if has(seed, "modifier behind", features):
        obj.modifiers.new("Cast", "CAST").factor = 0.3
    if has(seed, "modifier in front", features, share=0.3):
        add_modifier_in_front(numbers(seed, "modifier in front"), obj)
    if has(seed, "further armatures", features, share=0.3):
        add_further_armatures(seed, features, obj, armature)
    if has(seed, "refused behind", features, share=0.03):
        kind = str(numbers(seed, "refused behind").choice(REFUSED_BEHIND))
        obj.modifiers.new("Refused", kind)
    if has(seed, "hair", features, share=0.3):
        settings = obj.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
        settings.type, settings.count = "HAIR", 2


def place(seed: int, features: set[str], obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    if has(seed, "object transforms", features):
        rng = numbers(seed, "object transforms")
        for each in (obj, armature):
            scale = rng.uniform(0.5, 2.0, 3) * rng.choice((1, 1, 1, -1), 3)
            each.matrix_basis = (
                Matrix.Translation(rng.uniform(-2, 2, 3))
                @ random_rotation(rng)
                @ Matrix.Diagonal((*scale, 1))
            )
    if has(seed, "parenting", features):
        obj.parent = armature
    if has(seed, "bone parent", features, share=0.1):
        bones = armature.data.bones
        obj.parent, obj.parent_type = armature, "BONE"
        obj.parent_bone = bones[int(numbers(seed, "bone parent").integers(len(bones)))].name
    elif has(seed, "parent deforms", features, share=0.1):
        obj.parent, obj.parent_type = armature, "ARMATURE"


def paint(rng: np.random.Generator, obj: bpy.types.Object) -> None:
    """The vertex groups for stages, with weights of 0, 1 or between."""
    for name in PAINTED:
        group = obj.vertex_groups.new(name=name)
        for vertex in range(len(obj.data.vertices)):
            fate = rng.random()
            if fate < 0.75:
                group.add([vertex], 1.0 if fate < 0.2 else float(rng.random()), "REPLACE")


def add_modifier_in_front(rng: np.random.Generator, obj: bpy.types.Object) -> None:
    kinds = ("SUBSURF", "MIRROR", "CAST", "SOLIDIFY", "LATTICE", "VERTEX_WEIGHT_EDIT", "MESH_DEFORM", "NODES")
    kind = str(rng.choice(kinds))
    modifier = obj.modifiers.new("In Front", kind)
    if kind == "CAST":
        modifier.factor = rng.uniform(-0.5, 0.8)
    elif kind == "LATTICE":
        lattice = scenes.added("Lattice", bpy.data.lattices.new("Lattice"))
        lattice.scale = rng.uniform(2.0, 4.0, 3)
        for point in lattice.data.points:
            point.co_deform += Vector(rng.normal(0, 0.1, 3))
        modifier.object = lattice
    elif kind == "VERTEX_WEIGHT_EDIT":
        modifier.vertex_group = obj.vertex_groups[0].name
        modifier.use_add, modifier.default_weight = True, rng.uniform(0.1, 1.0)
    elif kind == "NODES":
        modifier.node_group = make_nodes(rng, obj)
    obj.modifiers.move(len(obj.modifiers) - 1, 0)
    if kind == "MESH_DEFORM":
        bind_to_cage(rng, obj, modifier)


def make_nodes(rng: np.random.Generator, obj: bpy.types.Object) -> bpy.types.NodeTree:
    """A group of one to three nodes, which move, add and weight vertices, or take them from another mesh."""
    group = bpy.data.node_groups.new("In Front", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    last = node_group.add(group, "NodeGroupInput").outputs[0]
    kinds = ("move", "subdivide", "join", "weight", "remove", "another")
    for kind in rng.choice(kinds, int(rng.integers(1, 4)), replace=False):
        if kind == "move":
            inputs = {"Geometry": last, "Offset": node_group.add(group, "GeometryNodeInputNormal")}
            node = node_group.add(group, "GeometryNodeSetPosition", inputs)
        elif kind == "subdivide":
            node = node_group.add(group, "GeometryNodeSubdivideMesh", {"Mesh": last})
        elif kind == "join":
            node = node_group.add(group, "GeometryNodeJoinGeometry", {"Geometry": last})
            group.links.new(node_group.add(group, "GeometryNodeMeshCube").outputs[0], node.inputs[0])
        elif kind == "weight":
            name, weight = obj.vertex_groups[0].name, rng.uniform(0.1, 1.0)
            inputs = {"Geometry": last, "Name": name, "Value": weight}
            node = node_group.add(group, "GeometryNodeStoreNamedAttribute", inputs)
        elif kind == "remove":
            inputs = {"Geometry": last, "Name": node_group.REST_POSITION}
            node = node_group.add(group, "GeometryNodeRemoveAttribute", inputs)
        else:
            node = node_group.add(group, "GeometryNodeObjectInfo", {"Object": another_object(rng, obj)})
        last = next(output for output in node.outputs if output.type == "GEOMETRY")
    node_group.add(group, "NodeGroupOutput", {0: last})
    return group


def another_object(rng: np.random.Generator, obj: bpy.types.Object) -> bpy.types.Object:
    """Its vertex groups have another order."""
    other = scenes.copied(obj, "Other")
    other.modifiers.clear()
    other.shape_key_clear()
    for vertex in other.data.vertices:
        vertex.co += Vector(rng.normal(0, 0.1, 3))
    other.vertex_groups.active_index = 0
    with bpy.context.temp_override(object=other):
        bpy.ops.object.vertex_group_move(direction="DOWN")
    return other


def bind_to_cage(
    rng: np.random.Generator, obj: bpy.types.Object, modifier: bpy.types.MeshDeformModifier
) -> None:
    corners = [(x, y, z) for x in (-3.0, 3.0) for y in (-3.0, 3.0) for z in (-3.0, 3.0)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new("Cage")
    mesh.from_pydata(corners, [], sides)
    modifier.object, modifier.precision = scenes.added("Cage", mesh), 3
    # The command works on what is visible, in object mode.
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    bpy.ops.object.meshdeform_bind(modifier=modifier.name)
    for vertex in mesh.vertices:
        vertex.co += Vector(rng.normal(0, 0.4, 3))


def add_further_armatures(
    seed: int, features: set[str], obj: bpy.types.Object, armature: bpy.types.Object
) -> None:
    """One or two more Armature modifiers after the first, with a copy of its armature in another pose."""
    rng = numbers(seed, "further armatures")
    other = scenes.copied(armature)
    other.location = rng.uniform(-0.5, 0.5, 3)
    pose(seed + 1, features, other)
    place = list(obj.modifiers).index(obj.modifiers["Armature"])
    for number in range(int(rng.integers(1, 3))):
        modifier = obj.modifiers.new(f"Further {number}", "ARMATURE")
        modifier.object = other if number == 0 else armature
        modifier.use_multi_modifier = bool(rng.random() < 0.6)
        modifier.show_viewport = bool(rng.random() < 0.9)
        if rng.random() < 0.7:
            modifier.vertex_group = obj.vertex_groups[int(rng.integers(len(obj.vertex_groups)))].name
            modifier.invert_vertex_group = bool(rng.random() < 0.5)
        obj.modifiers.move(len(obj.modifiers) - 1, place + 1 + number)


def pose(seed: int, features: set[str], armature: bpy.types.Object) -> None:
    rng, turning = numbers(seed, "pose"), numbers(seed, "turns")
    scaled, mirrored = has(seed, "scale", features), has(seed, "mirror", features, share=0.2)
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
        bone.rotation_quaternion = rng.normal(0, 1, 4)
        bone.rotation_quaternion.normalize()
        if turning.random() < 0.2:
            bone.rotation_mode = str(turning.choice(["XYZ", "ZYX", "AXIS_ANGLE"]))
            bone.rotation_euler = turning.uniform(-4, 4, 3)
            bone.rotation_axis_angle = turning.uniform(-6, 6), *turning.normal(0, 1, 3)
        bone.location = rng.normal(0, 0.2, 3)
        scale, sign, chosen = rng.uniform(0.5, 1.8, 3), rng.choice((1, -1), 3), rng.random()
        if scaled and chosen < 0.6:
            bone.scale = scale
        if mirrored and chosen < 0.3:
            bone.scale = Vector(sign * np.array(bone.scale))
        bone.bbone_rollin, bone.bbone_curveoutx = rng.uniform(-1, 1), rng.uniform(-0.3, 0.3)


def undecided(obj: bpy.types.Object) -> np.ndarray:
    """bool [vertices]: those at a discontinuity of a modifier, for an object that was just deformed."""
    skinned = session.skinned_of(obj)
    deformers = [
        skin.deformer for skin in skinned.bound.skin_stack.skins if skin.deformer.last_frame is not None
    ]
    return np.logical_or.reduce([undecided_by(deformer) for deformer in deformers])


def undecided_by(deformer: skin_stack.SkinDeformer) -> np.ndarray:
    frame = deformer.last_frame
    space = frame.bones_from_model
    points = deformer.rest_points @ space[:3, :3].T + space[:3, 3]
    influences = deformer.weighting.influences_over_joints(points)
    motions = frame.pose.astype(np.float64) @ np.linalg.inv(deformer.bones.rest.astype(np.float64))
    rest_axes = deformer.bones.rest_axes.astype(np.float64)
    quaternions = np.array(
        [
            reference.skin.quaternion(reference.rotation_of_bone(motion, rest))
            for motion, rest in zip(motions, rest_axes, strict=True)
        ]
    )
    result = np.zeros(len(points), dtype=bool)
    for vertex in range(len(points)):
        total = np.zeros(4)
        span = slice(influences.offsets[vertex], influences.offsets[vertex + 1])
        for bone, weight in zip(influences.bones[span], influences.weights[span], strict=True):
            meeting = float(quaternions[bone] @ total)
            length = float(np.linalg.norm(total))
            result[vertex] |= length > 0.0 and abs(meeting) < MARGIN * length
            total += (
                np.copysign(weight, meeting) * quaternions[bone] if length else weight * quaternions[bone]
            )
    entries = deformer.weighting.entries
    sums = np.bincount(entries.vertices, weights=entries.weights, minlength=len(points))
    return result | (np.abs(sums - 1e-4) < MARGIN * 1e-4)


def unstable(obj: bpy.types.Object, extent: float) -> np.ndarray:
    """bool [vertices]: those that a change of the input by its rounding moves by the tolerance, such as
    by curved mapping far inside a bend, or by several modifiers in sequence."""
    skinned = session.skinned_of(obj)
    rest_points = skinned.shown.rest_points.astype(np.float64)
    moved = numbers(len(rest_points), "rounding").uniform(-1.0, 1.0, rest_points.shape) * ROUNDING * extent
    shapes = []
    for points in (rest_points, rest_points + moved):
        skins = []
        for known in skinned.bound.skin_stack.skins:
            own = known.deformer
            deformer = skin_stack.SkinDeformer(own.weighting, own.mix_weights, own.vertex_data)
            skins.append(skin_stack.ModifierSkin(deformer, known.mask, known.multi))
        chain = skin_stack.SkinStack(skins)
        chain.deform(points.astype(np.float32), skinned.shown.frames)
        shapes.append(chain.points)
    moved = np.abs(shapes[1] - shapes[0]).max(axis=1) > scenes.TOLERANCE * extent
    return moved | magnified_behind(obj, shapes[0])


def magnified_behind(obj: bpy.types.Object, points: np.ndarray) -> np.ndarray:
    """bool [vertices]: those so near to the centre of the sphere onto which the next modifier casts them
    that rounding decides the direction.

    points  [vertices, 3], object space: the modifier's input
    """
    distances = np.linalg.norm(points, axis=1)
    cast = obj.modifiers.get("Cast")
    reach = 0.0 if cast is None else cast.factor * distances.mean()
    return distances * scenes.TOLERANCE < reach * ROUNDING


def check(seed: int, features: set[str], wanted: Sequence[str] = routes.ROUTES) -> Outcome:
    """wanted  the requested routes"""
    obj, armature = make_rig(seed, features)
    expected = {}
    for method, preserve_volume in ORACLES:
        for modifier in obj.modifiers:
            if modifier.type == "ARMATURE":
                modifier.use_deform_preserve_volume = preserve_volume
        bpy.context.view_layer.update()
        expected[method] = scenes.final_points(obj)
    outcome = Outcome(seed, vertices=len(expected["lbs"]), refused=must_be_refused(obj))
    expected |= coordinates_of(obj)
    is_split = has(seed, "seams", features, share=0.2)
    for route in wanted:
        routes.force(route)
        if outcome.refused:
            check_refusal(obj, expected, outcome, route)
            continue
        scenes.add_sinew(obj)
        for method, _preserve_volume in ORACLES:
            try:
                error = error_of(obj, armature, method, expected[method], outcome, route)
            except routes.NotBySinewError as why:
                error, outcome.reason = float("inf"), str(why)
            outcome.errors[route, method] = error
        check_coordinates(obj, expected, outcome, route)
        settings = properties.of(obj)
        settings.sdef.interpolation = str(numbers(seed, "sdef").choice(["nlerp", "slerp"]))
        signs = str(numbers(seed, "signs").choice(["blender", "hierarchy"]))
        settings.cor.signs = settings.sbs.signs = settings.dib.signs = signs
        for method in OTHERS:
            try:
                error = error_to_reference(obj, armature, method, seed, outcome, route)
            except routes.NotBySinewError as why:
                error, outcome.reason = float("inf"), str(why)
            outcome.errors[route, method] = error
            if is_split:
                torn = outcome.errors.get((route, TORN), 0.0)
                outcome.errors[route, TORN] = max(torn, distance_at_seams(obj))
        if has(seed, "stages", features):
            check_stages(obj, armature, seed, outcome, route)
        attach.remove(obj)
        session.forget()
    routes.release()
    return outcome


def coordinates_of(obj: bpy.types.Object) -> dict[str, np.ndarray]:
    """float32 [vertices, 3], object space, by kind"""
    with scenes.rendering() as render:
        render(obj)
    found = {COORDINATES: scenes.KeepingEngine.undeformed[obj.name]}
    if "Hair" in obj.modifiers:
        found[COORDINATES_IN_VIEWPORT] = scenes.final_points(obj, "undeformed_co")
    return found


def check_coordinates(
    obj: bpy.types.Object, expected: dict[str, np.ndarray], outcome: Outcome, route: str
) -> None:
    if undeformed.loses_marks(obj, layout.read(obj)):
        return
    for kind, points in coordinates_of(obj).items():
        is_alike = points.shape == expected[kind].shape
        error = scenes.worst(points, expected[kind]) if is_alike else float("inf")
        outcome.errors[route, kind] = error / scenes.diagonal(obj)


def must_be_refused(obj: bpy.types.Object) -> bool:
    kinds = [modifier.type for modifier in obj.modifiers]
    place = kinds.index("ARMATURE")
    is_mixed = obj.parent_type == "ARMATURE" or (place and kinds[place - 1] in MIXED_BY_MULTI_MODIFIERS)
    # Blender puts a Multiresolution in front of a subdivision that is in front, where it is no obstacle. A
    # Soft Body is one everywhere, as a simulation.
    is_obstacle = "SOFT_BODY" in kinds or "MULTIRES" in kinds[place:]
    return is_obstacle or bool(obj.modifiers[place].use_multi_modifier and is_mixed)


def check_refusal(
    obj: bpy.types.Object, expected: dict[str, np.ndarray], outcome: Outcome, route: str
) -> None:
    before, sentence = whole_file.content(), ""
    try:
        scenes.add_sinew(obj)
    except SinewError as error:
        sentence = str(error)
    (method, _preserve_volume) = ORACLES[-1]
    error = scenes.worst(scenes.final_points(obj), expected[method])
    if not sentence.startswith(f"{obj.name}: "):
        error, outcome.reason = float("inf"), f"not refused with a sentence: {sentence!r}"
    elif stays := whole_file.differences(before, whole_file.content()):
        error, outcome.reason = float("inf"), f"of what was refused stays: {stays[0]}"
    outcome.errors[route, method] = error / scenes.diagonal(obj)


def distance_at_seams(obj: bpy.types.Object) -> float:
    """The largest distance between vertices that are one at rest, relative to the diagonal. They have the
    same point, weights and other data. Those where rounding decides are left out."""
    state = session.skinned_of(obj)
    source, shown = state.bound.source, state.points
    ends = np.cumsum(source.weights.counts)[:-1]
    rows = [np.split(each, ends) for each in (source.weights.groups, source.weights.weights)]
    rows.append(state.shown.rest_points)
    rows += [] if source.sdef_keys is None else list(source.sdef_keys)
    alike: dict[tuple[bytes, ...], list[int]] = {}
    for vertex, row in enumerate(zip(*rows, strict=True)):
        alike.setdefault(tuple(each.tobytes() for each in row), []).append(vertex)
    distances = {
        max(found): np.ptp(shown[found], axis=0).max() / scenes.diagonal(obj) for found in alike.values()
    }
    torn = [vertex for vertex, distance in distances.items() if distance > scenes.TOLERANCE]
    if torn:
        _exact, decided = fuzz_reference.deform(
            state.bound.skin_stack, state.shown.rest_points, state.shown.frames, np.array(torn)
        )
        for vertex in np.array(torn)[~decided]:
            del distances[vertex]
    return float(max(distances.values(), default=0.0))


def check_stages(
    obj: bpy.types.Object, armature: bpy.types.Object, seed: int, outcome: Outcome, route: str
) -> None:
    """Checks a mix of two random methods, then random stages after it; records the errors."""
    rng = numbers(seed, "stages")
    known = [m.name for m in sinew.methods()]
    method, second = rng.choice(known, 2, replace=False).tolist()
    mix = properties.of(obj).mix
    mix.method, mix.group = second, PAINTED[0]
    try:
        outcome.errors[route, MIX] = error_to_reference(obj, armature, method, seed, outcome, route)
        choose_stages_after(rng, properties.of(obj), scenes.diagonal(obj))
        outcome.errors[route, AFTER] = error_of_stages(obj, armature, method, outcome, route)
    except routes.NotBySinewError as why:
        outcome.errors[route, AFTER], outcome.reason = float("inf"), str(why)


def choose_stages_after(rng: np.random.Generator, settings: bpy.types.PropertyGroup, diagonal: float) -> None:
    """One or several of the stages, with random parameters."""
    which = int(rng.integers(3))
    spread, limit, mush = settings.twist_spread, settings.bulge_limit, settings.delta_mush
    spread.enabled, spread.amount = bool(rng.random() < 0.5), rng.uniform(0.1, 1.0)
    spread.turns = bool(rng.random() < 0.8)
    limit.enabled, mush.enabled = which != 1, which != 0
    limit.strength = rng.uniform(0.1, 1.0)
    limit.form = str(rng.choice(["continuous", "kim_han"]))
    mush.iterations, mush.factor = int(rng.integers(0, 25)), rng.uniform(0.05, 1.0)
    mush.radius = rng.uniform(0.02, 0.1) * diagonal if rng.random() < 0.3 else 0.0
    mush.smooth_type = str(rng.choice(["simple", "length_weighted"]))
    mush.pin_boundary, mush.invert_group = bool(rng.random() < 0.3), bool(rng.random() < 0.4)
    mush.weld = bool(rng.random() < 0.7)
    mush.scale = rng.uniform(-1.0, 2.0) if rng.random() < 0.5 else 1.0
    for stage in (spread, limit, mush):
        stage.group = str(rng.choice(["", *PAINTED]))


def error_of_stages(
    obj: bpy.types.Object, armature: bpy.types.Object, method: str, outcome: Outcome, route: str
) -> float:
    """As error_of(), compared with the float64 reference of the enabled stages after the blend. It starts
    from the shape without them, so that the error of the method does not count."""
    settings = properties.of(obj)
    groups = {name: getattr(settings, name) for name in stage_settings.names_on(settings) if name != MIX}
    values = {name: stage_settings.values_of(settings, name) for name in groups}
    values = {name: {k: v for k, v in of.items() if k != "enabled"} for name, of in values.items()}
    with without_modifiers_behind(obj):
        for group in groups.values():
            group.enabled = False
        before = shape_of(obj, armature, method, outcome, route)
        for group in groups.values():
            group.enabled = True
        shown = shape_of(obj, armature, method, outcome, route)
    state = session.skinned_of(obj)
    extent = max(scenes.diagonal(obj), float(np.linalg.norm(np.ptp(shown, axis=0))))
    rng = numbers(len(before), "rounding")

    def exact(rounding: np.ndarray | float) -> np.ndarray:
        stack, shape = state.bound.skin_stack, state.shown
        return fuzz_reference.stages_after(stack, before, shape.rest_points, shape.frames, values, rounding)

    expected = exact(0.0)
    errors = np.abs(shown - expected).max(axis=1)
    decided = np.ones(len(before), dtype=bool)
    for number in range(ROUNDINGS + MORE_ROUNDINGS):
        if number >= ROUNDINGS and errors[decided].max(initial=0.0) <= REFERENCE_TOLERANCE * extent:
            break
        moved = exact(rng.uniform(-1.0, 1.0, before.shape) * ROUNDING * extent) - expected
        decided &= np.abs(moved).max(axis=1) <= scenes.TOLERANCE * extent
    outcome.staged += len(shown)
    outcome.undecided_stages += int((~decided).sum())
    return float(errors[decided].max(initial=0.0)) / extent


@contextlib.contextmanager
def without_modifiers_behind(obj: bpy.types.Object) -> Iterator[None]:
    """Modifiers after the replaced ones are off, because the reference does not know them."""
    place = list(obj.modifiers).index(attach.sinew_modifier(obj))
    behind = [m for m in list(obj.modifiers)[place:] if m.type not in ("ARMATURE", "NODES")]
    for modifier in behind:
        modifier.show_viewport = False
    try:
        yield
    finally:
        for modifier in behind:
            modifier.show_viewport = True


def error_of(
    obj: bpy.types.Object,
    armature: bpy.types.Object,
    method: str,
    expected: np.ndarray,
    outcome: Outcome,
    route: str,
) -> float:
    """The largest error of a rig under one method, relative to the diagonal; records the actual route.

    Raises routes.NotBySinewError.
    """
    shown = shape_of(obj, armature, method, outcome, route)
    if shown.shape != expected.shape:
        return float("inf")
    # A pose with scale makes the mesh larger, and its rounding as well.
    extent = max(scenes.diagonal(obj), float(np.linalg.norm(np.ptp(expected, axis=0))))
    left_out = undecided(obj) | unstable(obj, extent)
    errors = np.abs(shown - expected).max(axis=1) / extent
    far = np.flatnonzero(~left_out & (errors > scenes.TOLERANCE) & (errors < ROUNDING_OF_BLENDER))
    if len(far) > 0 and len(session.skinned_of(obj).bound.skin_stack.skins) > 1:
        with without_modifiers_behind(obj):
            before = shape_of(obj, armature, method, outcome, route)
        left_out[far] = is_nearly_exact(obj, far, before[far], extent)
    outcome.left_out = int(left_out.sum())
    return float(errors[~left_out].max(initial=0.0))


def is_nearly_exact(
    obj: bpy.types.Object, vertices: np.ndarray, points: np.ndarray, extent: float
) -> np.ndarray:
    """bool [of `vertices`]: those where Sinew is within the tolerance of the float64 reference, so that the
    rest is Blender's rounding: modifiers in sequence magnify the rounding of those before.

    points  Sinew's, before the modifiers that follow
    """
    state = session.skinned_of(obj)
    exact, _decided = fuzz_reference.deform(
        state.bound.skin_stack, state.shown.rest_points, state.shown.frames, vertices
    )
    return np.abs(points - exact).max(axis=1) <= scenes.TOLERANCE * extent


def error_to_reference(
    obj: bpy.types.Object, armature: bpy.types.Object, method: str, seed: int, outcome: Outcome, route: str
) -> float:
    """As error_of(), for some vertices, compared with the float64 reference."""
    with without_modifiers_behind(obj):
        shown = shape_of(obj, armature, method, outcome, route)
        state = session.skinned_of(obj)
        count = min(REFERENCE_VERTICES, len(shown))
        chosen = np.sort(numbers(seed, "reference").choice(len(shown), count, replace=False))
        expected, decided = fuzz_reference.deform(
            state.bound.skin_stack, state.shown.rest_points, state.shown.frames, chosen
        )
        extent = max(scenes.diagonal(obj), float(np.linalg.norm(np.ptp(shown, axis=0))))
        decided &= ~unstable(obj, extent)[chosen]
    outcome.compared += count
    outcome.undecided += int((~decided).sum())
    return float(np.abs(shown[chosen] - expected)[decided].max(initial=0.0)) / extent


def shape_of(
    obj: bpy.types.Object, armature: bpy.types.Object, method: str, outcome: Outcome, route: str
) -> np.ndarray:
    """The final points, computed again with `method`; records the actual route.

    Raises routes.NotBySinewError.
    """
    obj.sinew.method = method
    # Changes the pose and restores it, so that the shape is computed again.
    before = [bone.location.copy() for bone in armature.pose.bones]
    for bone in armature.pose.bones:
        bone.location.x += 1.0
    bpy.context.view_layer.update()
    state = session.skinned_of(obj)
    shapes = state.shown.number if state is not None else 0
    for bone, location in zip(armature.pose.bones, before, strict=True):
        bone.location = location
    bpy.context.view_layer.update()
    shown = scenes.final_points(obj)
    outcome.taken[route] = routes.taken(obj, shapes)
    return shown


def shrink(seed: int, wanted: Sequence[str]) -> set[str]:
    """The features that the failure of a seed needs."""
    features = set(FEATURES)
    for feature in FEATURES:
        if check(seed, features - {feature}, wanted).failed:
            features.discard(feature)
    return features


def run(first: int, count: int, keep: Path, wanted: Sequence[str] = routes.ROUTES) -> list[Outcome]:
    """Checks `count` seeds from `first`; reduces those that fail, and saves them in `keep`."""
    outcomes = []
    for seed in range(first, first + count):
        outcome = check(seed, set(FEATURES), wanted)
        outcomes.append(outcome)
        if outcome.failed:
            features = shrink(seed, wanted)
            make_rig(seed, features)
            keep.mkdir(parents=True, exist_ok=True)
            scenes.save(keep / f"seed-{seed}.blend")
            needed = sorted(f for f in features if has(seed, f, features) or f == "mirror")
            errors = {f"{route} {method}": error for (route, method), error in outcome.errors.items()}
            why = outcome.reason or "another shape"
            print(f"seed {seed} fails: {errors}; {why}; needs {needed}; saved in {keep}", flush=True)
        if len(outcomes) % 100 == 0 and len(outcomes) < count:
            failed = sum(each.failed for each in outcomes)
            print(f"{len(outcomes)} of {count} rigs, {failed} failed", file=sys.stderr, flush=True)
    return outcomes


def summarise(outcomes: list[Outcome]) -> str:
    keys = dict.fromkeys(key for o in outcomes for key in o.errors)
    worst = {key: max((o for o in outcomes if key in o.errors), key=lambda o: o.errors[key]) for key in keys}
    left_out = sum(o.left_out for o in outcomes)
    vertices = sum(o.vertices for o in outcomes)
    touched = sum(o.left_out > 0 for o in outcomes)
    compared, undecided = sum(o.compared for o in outcomes), sum(o.undecided for o in outcomes)
    staged, undecided_stages = sum(o.staged for o in outcomes), sum(o.undecided_stages for o in outcomes)
    errors = ", ".join(f"{m} by {r} {o.errors[r, m]:.1e} (seed {o.seed})" for (r, m), o in worst.items())
    return (
        f"{len(outcomes)} rigs, {sum(o.failed for o in outcomes)} failed; worst error as a part of the "
        f"diagonal: {errors}; {left_out} of {vertices} vertices on {touched} rigs left out at a "
        f"discontinuity, with the reference {undecided} of {compared}, after the blend {undecided_stages} of "
        f"{staged}\n" + "\n".join(routes_taken(outcomes))
    )


def routes_taken(outcomes: list[Outcome]) -> list[str]:
    """A line for each requested route: the routes by which the rigs were deformed."""
    lines = []
    for route in dict.fromkeys(route for o in outcomes for route, _method in o.errors):
        taken = Counter(o.taken.get(route, "none of Sinew's") for o in outcomes)
        counts = ", ".join(f"{count} {NAMES.get(name, name)}" for name, count in taken.most_common())
        lines.append(f"wanted {NAMES[route]}: {counts}")
    return lines


def main() -> int:
    import sinew_addon

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--route", choices=("both", *routes.ROUTES), default="both")
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"), help="folder for rigs that fail")
    args = parser.parse_args()
    sinew_addon.register()
    try:
        wanted = routes.ROUTES if args.route == "both" else (args.route,)
        outcomes = run(args.first, args.rigs, args.keep, wanted)
    finally:
        sinew_addon.unregister()
    print(f"Blender {bpy.app.version_string}: {summarise(outcomes)}")
    return int(any(outcome.failed for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
