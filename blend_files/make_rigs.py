"""Make the six example rigs of this folder, each saved as a compressed .blend file.

    python blend_files/make_rigs.py [--out DIR]

needs `bpy` as a module. Everything is computed here: no mesh, picture or motion comes from elsewhere.

A mesh starts as a `Cage`: patches of quads extruded one after the other, so that it is closed and its normals
point outward by construction. Each of its points carries a fourth number, `along`: how far, in metres, it
lies along the limb. Weights are computed from that number, which subdivision smooths with the positions.
"""

import argparse
import math
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Quaternion, Vector

SMALLEST_WEIGHT = 1e-3
"""Weights below this are dropped and the others normalised: they move nothing that can be seen."""

X, Y, Z = np.eye(3)

ARM_DOWN = np.array((math.sin(math.radians(20)), 0, -math.cos(math.radians(20))))
"""Direction of the hanging arm of the shoulder rig, 20 degrees off the side."""

LINK_COLOURS = (0.16, 0.3, 0.55), (0.65, 0.75, 0.85)

Point = tuple[float, float, float]
Weights = dict[str, np.ndarray]


# Meshes


class Cage:
    """A closed quad mesh that grows by extruding patches.

    points  rows of x, y, z, along, in metres
    faces   corner indices, anticlockwise seen from outside, by the set of those corners
    """

    def __init__(self, first: np.ndarray, second: np.ndarray) -> None:
        """Start as a box from the patch of points `first` to `second`, each [a + 1, b + 1, 4]."""
        self.points: list[np.ndarray] = []
        self.faces: dict[frozenset[int], tuple[int, ...]] = {}
        base = self._add_points(first)
        for cell in patch_cells(base):
            self._add_face(cell)
        self.layers = [base, self.extrude(base, second)]
        for cell in patch_cells(base):
            self._add_face(cell[::-1])

    def _add_points(self, patch: np.ndarray) -> np.ndarray:
        start = len(self.points)
        self.points.extend(patch.reshape(-1, patch.shape[-1]))
        return np.arange(start, len(self.points)).reshape(patch.shape[:2])

    def _add_face(self, corners: tuple[int, ...]) -> None:
        self.faces[frozenset(corners)] = corners

    def extrude(self, patch: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Move the faces of a patch (point indices) out to `target` with walls behind them; the new patch."""
        moved = self._add_points(target)
        new_index = dict(zip(patch.flat, moved.flat, strict=True))
        old_faces = [self.faces.pop(frozenset(cell)) for cell in patch_cells(patch)]
        edges = {edge for face in old_faces for edge in pairwise((*face, face[0]))}
        for face in old_faces:
            self._add_face(tuple(new_index[i] for i in face))
        for start, end in sorted(edges):
            if (end, start) not in edges:
                self._add_face((start, end, new_index[end], new_index[start]))
        return moved

    def grow(self, *targets: np.ndarray) -> None:
        """Extrude the far end through each target in turn, and remember the layers."""
        for target in targets:
            self.layers.append(self.extrude(self.layers[-1], target))

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Points [n, 4] and quads [m, 4], without the points that no face uses."""
        faces = np.array(list(self.faces.values()))
        used, faces = np.unique(faces, return_inverse=True)
        return np.array(self.points)[used], faces.reshape(-1, 4)


def patch_cells(patch: np.ndarray) -> list[tuple[int, ...]]:
    """Corners of each quad of a patch of point indices, anticlockwise about first axis x second axis."""
    corners = np.stack((patch[:-1, :-1], patch[1:, :-1], patch[1:, 1:], patch[:-1, 1:]), axis=-1)
    return [tuple(cell) for cell in corners.reshape(-1, 4).tolist()]


def disc(a: int, b: int, squareness: float = 0.0) -> np.ndarray:
    """Patch [a + 1, b + 1, 2] that fills the unit disc, or with squareness 1 the square around it.

    The map from square to disc is concentric (Shirley and Chiu 1997), which keeps the quads even.
    """
    square = np.stack(np.meshgrid(np.linspace(-1, 1, a + 1), np.linspace(-1, 1, b + 1), indexing="ij"), -1)
    u, v = square[..., 0], square[..., 1]
    wide = np.abs(u) > np.abs(v)
    radius = np.where(wide, u, v)
    ratio = np.divide(np.where(wide, v, u), radius, out=np.zeros_like(u), where=radius != 0)
    angle = np.where(wide, ratio * math.pi / 4, math.pi / 2 - ratio * math.pi / 4)
    round_patch = radius[..., None] * np.stack((np.cos(angle), np.sin(angle)), -1)
    return (1 - squareness) * round_patch + squareness * square


def section(shape, centre, first_axis, second_axis, radii, along, *, dome=0.0) -> np.ndarray:
    """Cross-section of a limb: the patch `shape` [.., .., 2] scaled by the two radii, with `along` added.

    A dome, in metres, pushes the inside of a disc out along first axis x second axis: a rounded end.
    """
    height = np.zeros((*shape.shape[:2], 1))
    if dome:
        angle = np.linalg.norm(shape, axis=-1, keepdims=True) * math.pi / 2
        shape = shape * np.sinc(angle / math.pi) * math.pi / 2
        height = dome * np.cos(angle)
    points = (
        np.asarray(centre)
        + shape[..., :1] * radii[0] * first_axis
        + shape[..., 1:] * radii[1] * second_axis
        + height * np.cross(first_axis, second_axis)
    )
    return np.concatenate((points, np.full_like(height, along)), axis=-1)


def tube(lengths, centres, axes, radii, sides: int, dome: float) -> tuple[np.ndarray, np.ndarray]:
    """Straight limb of one ring per length, with `4 * sides` points each and rounded ends; points and quads.

    lengths [n] along first axis x second axis of `axes`; centres [n, 3]; radii [n, 2]; `dome` times the mean
    radius is the height of the ends
    """
    shape = disc(sides, sides)
    domes = np.zeros(len(lengths))
    domes[0], domes[-1] = -dome * radii[0].mean(), dome * radii[-1].mean()
    rings = [
        section(shape, centre, *axes, radius, length, dome=height)
        for length, centre, radius, height in zip(lengths, centres, radii, domes, strict=True)
    ]
    cage = Cage(*rings[:2])
    cage.grow(*rings[2:])
    return in_face_order(*cage.arrays())


def smooth_profile(at: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Columns of `table` after its first, at the given values of the first: cubic Hermite, so no creases."""
    keys, values = table[:, 0], table[:, 1:]
    slopes = np.gradient(values, keys, axis=0)
    i = np.clip(np.searchsorted(keys, at, side="right") - 1, 0, len(keys) - 2)
    width = (keys[i + 1] - keys[i])[:, None]
    t = (at - keys[i])[:, None] / width
    start = (1 + 2 * t) * (1 - t) ** 2 * values[i] + t * (1 - t) ** 2 * width * slopes[i]
    end = t**2 * (3 - 2 * t) * values[i + 1] + t**2 * (t - 1) * width * slopes[i + 1]
    return start + end


def subdivided(points: np.ndarray, faces: np.ndarray, levels: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Catmull-Clark subdivision of a closed quad mesh, of positions and `along` alike."""
    for _ in range(levels):
        count = len(points)
        sides = np.sort(np.stack((faces, np.roll(faces, -1, axis=1)), axis=-1), axis=-1)
        edges, edge_of_side = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
        edge_of_side = edge_of_side.reshape(-1, 4)
        face_points = points[faces].mean(axis=1)
        middles = points[edges].mean(axis=1)
        edge_faces = np.zeros_like(middles)
        around_faces, around_edges = np.zeros_like(points), np.zeros_like(points)
        for side in range(4):
            np.add.at(edge_faces, edge_of_side[:, side], face_points / 2)
            np.add.at(around_faces, faces[:, side], face_points)
        for end in range(2):
            np.add.at(around_edges, edges[:, end], middles)
        valence = np.bincount(edges.ravel(), minlength=count)[:, None]
        corners = (around_faces / valence + 2 * around_edges / valence + (valence - 3) * points) / valence
        points = np.concatenate((corners, (middles + edge_faces) / 2, face_points))
        edge_index = count + edge_of_side
        face_index = count + len(edges) + np.arange(len(faces))
        quads = [(faces[:, k], edge_index[:, k], face_index, edge_index[:, k - 1]) for k in range(4)]
        faces = np.array(quads).transpose(2, 0, 1).reshape(-1, 4)
    return points, faces


def in_face_order(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number the points as the faces first use them, and round all to 1/65536 m: the file packs smaller."""
    _, first_use = np.unique(faces, return_index=True)
    order = np.argsort(first_use)
    return np.round(points[order] * 65536) / 65536, np.argsort(order)[faces]


def check_closed(points: np.ndarray, faces: np.ndarray) -> None:
    """Raise ValueError unless each edge joins two faces that agree and the volume inside is positive."""
    sides = {side for face in faces.tolist() for side in pairwise((*face, face[0]))}
    if len(sides) != faces.size or any((end, start) not in sides for start, end in sides):
        raise ValueError("the mesh is not closed")
    a, b, c, d = (points[faces[:, k], :3] for k in range(4))
    volume = (np.cross(b - a, c - a) * a + np.cross(c - a, d - a) * a).sum() / 6
    if volume <= 0:
        raise ValueError("the normals of the mesh point inward")


# Weights


def linear_weights(along: np.ndarray, bones: list["BoneSpec"], ends: np.ndarray) -> Weights:
    """Linear weighting of a chain, as in the report's Figure 3.9.

    With m_i the middle of bone i, w_i(s) = max(0, 1 - |s - m_i| / length): 1 in the middle of the bone, from
    there a straight line to 0 at the middles of its neighbours, 1/2 at a joint. The outer halves of the
    end bones have 1. `ends` [bones + 1] are the bones' ends along the chain.
    """
    middles = (ends[:-1] + ends[1:]) / 2
    return {
        bone.name: np.interp(along, middles, hat) for bone, hat in zip(bones, np.eye(len(bones)), strict=True)
    }


def spline_weights(along: np.ndarray, bones: list["BoneSpec"], ends: np.ndarray) -> Weights:
    """Cubic B-spline weighting of a chain of equal bones.

    w_i(s) = B((s - m_i) / length) with m_i the middle of bone i and B the uniform cubic B-spline:
    2/3 - x^2 + |x|^3 / 2 for |x| < 1, (2 - |x|)^3 / 6 for |x| < 2. At most four bones share a point, and the
    weights stay smooth up to their curvature. Near the ends, where bones are missing, `bind` makes the sum 1
    again.
    """
    middles = (ends[:-1] + ends[1:]) / 2
    inside = np.clip(along, ends[0], ends[-1])
    x = np.abs(inside[:, None] - middles) / (ends[1] - ends[0])
    values = np.where(x < 1, 2 / 3 - x**2 + x**3 / 2, np.clip(2 - x, 0, None) ** 3 / 6)
    return {bone.name: values[:, i] for i, bone in enumerate(bones)}


def smooth_step(value: np.ndarray, start: float, end: float) -> np.ndarray:
    """0 up to start, 1 from end, 3 t^2 - 2 t^3 between them: no crease where the blending begins."""
    t = np.clip((value - start) / (end - start), 0, 1)
    return t * t * (3 - 2 * t)


def joint_weights(along: np.ndarray, names: tuple[str, str], joint: float, width: float) -> Weights:
    """Weights of the two bones at a joint: w = smooth_step over `width` metres centred on it, and 1 - w."""
    second = smooth_step(along, joint - width / 2, joint + width / 2)
    return {names[0]: 1 - second, names[1]: second}


def shoulder_weights(points: np.ndarray, clavicle: "BoneSpec") -> Weights:
    """Weights of torso, clavicle and upper arm.

    arm       a = smooth_step(along, -0.08, 0.11), along being 0 at the arm's root and less inside the torso
    clavicle  c = (1 - a) (1 - smooth_step(d, 0.04, 0.17)) smooth_step(x, 0.02, 0.12), with d the distance to
              the clavicle's segment and x the one to the side: the neck stays with the torso
    torso     1 - a - c
    """
    head, tail = np.array(clavicle.head), np.array(clavicle.tail)
    position = points[:, :3]
    t = np.clip((position - head) @ (tail - head) / np.sum((tail - head) ** 2), 0, 1)
    distance = np.linalg.norm(position - head - t[:, None] * (tail - head), axis=1)
    arm = smooth_step(points[:, 3], -0.08, 0.11)
    near = (1 - arm) * (1 - smooth_step(distance, 0.04, 0.17)) * smooth_step(position[:, 0], 0.02, 0.12)
    return {"Torso": 1 - arm - near, "Clavicle": near, "Upper Arm": arm}


# Blender


class BoneSpec(NamedTuple):
    """A bone to make: head and tail in metres, in the armature's space."""

    name: str
    head: Point
    tail: Point
    parent: str | None = None


def chain_bones(prefix: str, ends: np.ndarray, axis: np.ndarray) -> list[BoneSpec]:
    """Bones one after the other along an axis, named 'prefix.01' and so on."""
    bones: list[BoneSpec] = []
    for number, (head, tail) in enumerate(pairwise(ends), start=1):
        parent = bones[-1].name if bones else None
        bones.append(BoneSpec(f"{prefix}.{number:02}", tuple(head * axis), tuple(tail * axis), parent))
    return bones


def new_scene(frame_end: int) -> None:
    """An empty file with a scene in metres, of frames 1 to `frame_end` at 24 a second."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.save_version = 0
    scene = bpy.context.scene
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.length_unit = "METERS"
    scene.frame_start, scene.frame_end = 1, frame_end
    scene.render.fps = 24
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.resolution_x, scene.render.resolution_y = 960, 720
    scene.display.shading.show_cavity = True
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (0.3, 0.3, 0.3)


def link(obj: bpy.types.Object) -> bpy.types.Object:
    """Put an object into the scene."""
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add_camera(position: Point, target: Point, height: float) -> None:
    """Orthographic camera that sees `height` metres around the target, and a sun by it.

    Without perspective, thickness before and after can be compared by eye.
    """
    camera = link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
    camera.data.type = "ORTHO"
    camera.data.sensor_fit = "VERTICAL"
    camera.data.ortho_scale = height
    camera.data.clip_start = 0.01
    camera.location = position
    camera.rotation_euler = (Vector(target) - Vector(position)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.camera = camera
    sun = link(bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN")))
    sun.data.energy = 3
    sun.location = position
    sun.rotation_euler = (camera.rotation_euler[0] - 0.5, 0, camera.rotation_euler[2] - 0.5)


def add_armature(name: str, bones: list[BoneSpec]) -> bpy.types.Object:
    """Armature object with the given bones, parents before children."""
    rig = link(bpy.data.objects.new(name, bpy.data.armatures.new(name)))
    rig.show_in_front = True
    rig.data.display_type = "STICK"
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for spec in bones:
        bone = rig.data.edit_bones.new(spec.name)
        bone.head, bone.tail = spec.head, spec.tail
        if spec.parent:
            bone.parent = rig.data.edit_bones[spec.parent]
            bone.use_connect = bone.parent.tail == bone.head
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def add_mesh(name: str, points: np.ndarray, faces: np.ndarray, *colours: Point) -> bpy.types.Object:
    """Smooth-shaded mesh object of points [n, 4], less `along`, and quads, with a material per colour."""
    check_closed(points, faces)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points[:, :3].tolist(), [], faces.tolist())
    mesh.shade_smooth()
    for colour in colours:
        material = bpy.data.materials.new(name)
        material.diffuse_color = (*colour, 1)
        material.roughness = 0.6
        mesh.materials.append(material)
    return link(bpy.data.objects.new(name, mesh))


def bind(skin: bpy.types.Object, rig: bpy.types.Object, weights: Weights, parent=False) -> None:
    """Write the weights as vertex groups and add the Armature modifier, linear as Blender has it at first.

    A parented mesh follows the armature object as artists' meshes mostly do; the rest stand by themselves, so
    that both cases are there to try.
    """
    table = np.stack(list(weights.values()), axis=1)
    table[table < SMALLEST_WEIGHT] = 0
    table /= table.sum(axis=1, keepdims=True)
    for name, column in zip(weights, table.T, strict=True):
        group = skin.vertex_groups.new(name=name)
        for index in np.flatnonzero(column).tolist():
            group.add([index], float(column[index]), "REPLACE")
    modifier = skin.modifiers.new("Armature", "ARMATURE")
    modifier.object = rig
    modifier.use_vertex_groups = True
    modifier.use_bone_envelopes = False
    modifier.use_deform_preserve_volume = False
    if parent:
        skin.parent = rig


def turns(axis: np.ndarray, keys) -> list[tuple[int, Quaternion]]:
    """Rotations about an axis as (frame, rotation), from (frame, degrees)."""
    return [(frame, Quaternion(axis, math.radians(degrees))) for frame, degrees in keys]


def key_quaternions(rig: bpy.types.Object, bone: str, keys: list[tuple[int, Quaternion]]) -> None:
    """Key rotations given in the armature's axes as (frame, rotation), keeping to one hemisphere."""
    pose_bone = rig.pose.bones[bone]
    pose_bone.rotation_mode = "QUATERNION"
    rest = pose_bone.bone.matrix_local.to_quaternion()
    previous = Quaternion()
    for frame, rotation in keys:
        local = rest.inverted() @ rotation @ rest
        local.make_compatible(previous)
        pose_bone.rotation_quaternion = previous = local
        pose_bone.keyframe_insert("rotation_quaternion", frame=frame, group=bone)


def key_angles(rig: bpy.types.Object, bone: str, keys: list[tuple[int, Point]]) -> None:
    """Key Euler angles in the bone's own axes as (frame, degrees); y, the bone's length, turns first.

    Euler angles count past 180 degrees, where quaternions start to take the short way round.
    """
    pose_bone = rig.pose.bones[bone]
    pose_bone.rotation_mode = "YXZ"
    for frame, degrees in keys:
        pose_bone.rotation_euler = [math.radians(angle) for angle in degrees]
        pose_bone.keyframe_insert("rotation_euler", frame=frame, group=bone)


# Rigs


def chain_colours(points: np.ndarray, faces: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Material 0 or 1 of each face of a chain along x: quarters of each link differ, so that a twist shows
    even where the shape does not change."""
    middles = points[faces].mean(axis=1)
    quarter = np.floor(np.arctan2(middles[:, 2], middles[:, 1]) / (math.pi / 2))
    number = np.clip(np.searchsorted(ends, middles[:, 3]) - 1, 0, len(ends) - 2)
    return ((quarter + number) % 2).astype(np.int32)


def make_report_mesh() -> None:
    """The report's test mesh: a straight tube of six links with a bone each and linear weighting.

    The root of the chain is the armature's origin, as in a hierarchy, so that what turns about the origin
    turns far from the joint. Frames 1 to 24 bend the middle joint by 120 degrees and back (Figure 3.10);
    frames 24 to 48 twist the same joint by 170 degrees about the tube's axis and back (Figure 3.11).
    """
    new_scene(48)
    ends = np.linspace(0, 1.5, 7)
    lengths = np.linspace(0, 1.5, 97)
    points, faces = tube(lengths, lengths[:, None] * X, (Y, Z), np.full((97, 2), 0.11), sides=7, dome=0.35)
    bones = chain_bones("Link", ends, X)
    rig = add_armature("Report Mesh Rig", bones)
    skin = add_mesh("Report Mesh", points, faces, *LINK_COLOURS)
    bind(skin, rig, linear_weights(points[:, 3], bones, ends))
    skin.data.polygons.foreach_set("material_index", chain_colours(points, faces, ends))
    bend, twist = ((1, 0), (9, 60), (16, 120), (20, 60), (24, 0)), ((32, 85), (40, 170), (44, 85), (48, 0))
    key_quaternions(rig, bones[3].name, [*turns(-Y, bend), *turns(X, twist)])
    add_camera((0.9, -3, 0.75), (0.8, 0, 0.18), 1.4)


def make_report_links() -> None:
    """A chain of six links that do not blend, each a closed body on a bone of its own (Figures 3.6 to 3.8).

    The two keyframes between which the report's methods differ are frames 12 and 36: all five joints turned
    by 45 degrees one way, and by 45 degrees the other.
    """
    new_scene(48)
    ends = np.linspace(0, 1.5, 7)
    bones = chain_bones("Link", ends, X)
    parts = []
    for head, tail in pairwise(ends):
        lengths = np.linspace(head + 0.02, tail - 0.02, 17)
        radii = np.interp(lengths, (head, tail), (0.075, 0.055))
        radii = np.stack((radii, radii), axis=1)
        parts.append(tube(lengths, lengths[:, None] * X, (Y, Z), radii, sides=5, dome=0.3))
    points = np.concatenate([part for part, _ in parts])
    firsts = np.cumsum([0] + [len(part) for part, _ in parts[:-1]])
    faces = np.concatenate([part + first for first, (_, part) in zip(firsts, parts, strict=True)])
    rig = add_armature("Report Links Rig", bones)
    skin = add_mesh("Report Links", points, faces, *LINK_COLOURS)
    number = np.repeat(np.arange(len(bones)), [len(part) for part, _ in parts])
    alone = np.eye(len(bones))[number]
    bind(skin, rig, {bone.name: alone[:, i] for i, bone in enumerate(bones)})
    skin.data.polygons.foreach_set("material_index", chain_colours(points, faces, ends))
    for bone in bones[1:]:
        key_quaternions(rig, bone.name, turns(-Y, ((1, 0), (12, -45), (36, 45), (48, 0))))
    add_camera((0.5, -3, 0), (0.5, 0, 0), 2.0)


def make_elbow() -> None:
    """Upper arm and forearm, straight at frame 1 and bent by 150 degrees at frame 24."""
    new_scene(24)
    # Length, height of the centre line, half the width, half the height: from the shoulder to the fist.
    shape = np.array(
        [
            (0.00, 0.000, 0.044, 0.050),
            (0.06, 0.001, 0.046, 0.052),
            (0.15, 0.005, 0.045, 0.053),
            (0.23, 0.001, 0.040, 0.043),
            (0.30, -0.001, 0.041, 0.038),
            (0.36, 0.002, 0.043, 0.040),
            (0.44, 0.001, 0.037, 0.034),
            (0.52, 0.000, 0.029, 0.024),
            (0.55, 0.000, 0.030, 0.024),
            (0.59, 0.002, 0.040, 0.034),
            (0.62, 0.003, 0.041, 0.037),
            (0.64, 0.003, 0.037, 0.034),
        ]
    )
    lengths = np.linspace(0, 0.64, 97)
    profile = smooth_profile(lengths, shape)
    centres = lengths[:, None] * X + profile[:, :1] * Z
    points, faces = tube(lengths, centres, (Y, Z), profile[:, 1:], sides=10, dome=0.6)
    bones = [
        BoneSpec("Upper Arm", (0, 0, 0), (0.3, 0, 0)),
        BoneSpec("Forearm", (0.3, 0, 0), (0.56, 0, 0), "Upper Arm"),
    ]
    rig = add_armature("Elbow Rig", bones)
    skin = add_mesh("Elbow", points, faces, (0.8, 0.58, 0.46))
    bind(skin, rig, joint_weights(points[:, 3], ("Upper Arm", "Forearm"), joint=0.3, width=0.11))
    key_quaternions(rig, "Forearm", turns(-Y, ((1, 0), (8, 50), (16, 100), (24, 150))))
    add_camera((0.5, -2, 0.5), (0.31, 0, 0.13), 0.58)


def add_digit(cage: Cage, root: np.ndarray, start, direction, first_axis, radii, lengths) -> None:
    """Grow a finger from a patch of the hand whose second axis is z, thinner towards its tip."""
    direction, first_axis = (np.array(axis) / np.linalg.norm(axis) for axis in (direction, first_axis))
    shape = disc(root.shape[0] - 1, root.shape[1] - 1)
    for length, thickness in zip(lengths, (1, 1.02, 0.98, 0.6), strict=True):
        centre = np.array(start) + length * direction
        target = section(shape, centre, first_axis, Z, np.array(radii) * thickness, centre[0])
        root = cage.extrude(root, target)


def hand_mesh() -> tuple[np.ndarray, np.ndarray]:
    """Forearm and open hand along x, the wrist at 0, the thumb towards y: points and quads."""
    # Length, half the width, half the thickness, squareness of the section.
    sections = (
        (-0.255, 0.030, 0.028, 0.0),
        (-0.245, 0.044, 0.042, 0.0),
        (-0.205, 0.048, 0.045, 0.0),
        (-0.165, 0.047, 0.043, 0.0),
        (-0.125, 0.043, 0.038, 0.0),
        (-0.090, 0.038, 0.032, 0.0),
        (-0.060, 0.034, 0.027, 0.0),
        (-0.035, 0.032, 0.024, 0.0),
        (-0.012, 0.031, 0.022, 0.0),
        (0.010, 0.033, 0.021, 0.2),
        (0.032, 0.039, 0.020, 0.4),
        (0.060, 0.043, 0.018, 0.5),
        (0.085, 0.044, 0.016, 0.5),
        (0.098, 0.043, 0.014, 0.5),
    )
    layers = [
        section(disc(4, 2, square), length * X, Y, Z, (width, thickness), length)
        for length, width, thickness, square in sections
    ]
    cage = Cage(*layers[:2])
    cage.grow(*layers[2:])
    spread = ((-0.0355, -0.16, 0.066), (-0.0125, -0.05, 0.084), (0.0115, 0.04, 0.092), (0.0355, 0.13, 0.082))
    for column, (across, slant, length) in enumerate(spread):
        add_digit(
            cage,
            cage.layers[-1][column : column + 2],
            (0.098, across, 0),
            (1, slant, 0),
            (-slant, 1, 0),
            (0.0122, 0.0125),
            length * np.array((0.12, 0.45, 0.85, 1)),
        )
    side = np.array([layer[-1] for layer in cage.layers[9:12]])
    add_digit(
        cage, side, (0.034, 0.034, 0), (1, 1, 0), (1, -1, 0), (0.0165, 0.0145), (0.02, 0.045, 0.074, 0.083)
    )
    return in_face_order(*subdivided(*cage.arrays()))


def make_wrist() -> None:
    """Forearm and hand; the hand twists by 180 degrees up to frame 24 and on to 270 at frame 36."""
    new_scene(36)
    points, faces = hand_mesh()
    bones = [
        BoneSpec("Forearm", (-0.25, 0, 0), (0, 0, 0)),
        BoneSpec("Hand", (0, 0, 0), (0.1, 0, 0), "Forearm"),
    ]
    rig = add_armature("Wrist Rig", bones)
    skin = add_mesh("Wrist", points, faces, (0.8, 0.58, 0.46))
    bind(skin, rig, joint_weights(points[:, 3], ("Forearm", "Hand"), joint=-0.025, width=0.1), parent=True)
    angles = ((1, 0), (8, 60), (16, 120), (24, 180), (30, 225), (36, 270))
    key_angles(rig, "Hand", [(frame, (0, angle, 0)) for frame, angle in angles])
    add_camera((0, -0.5, 2), (-0.03, 0, 0), 0.36)


def make_tentacle() -> None:
    """Tentacle of 20 bones, upright at frames 1 and 48, between them curling, waving and twisting."""
    new_scene(48)
    ends = np.linspace(0, 1.6, 21)
    lengths = np.linspace(0, 1.6, 121)
    radii = 0.115 * (1 - lengths / 1.6) ** 0.9 + 0.012
    radii = np.stack((radii, radii), axis=1)
    points, faces = tube(lengths, lengths[:, None] * Z, (X, Y), radii, sides=7, dome=0.6)
    bones = chain_bones("Tentacle", ends, Z)
    rig = add_armature("Tentacle Rig", bones)
    skin = add_mesh("Tentacle", points, faces, (0.55, 0.4, 0.62))
    bind(skin, rig, spline_weights(points[:, 3], bones, ends))
    for number, bone in enumerate(bones):
        place = number / (len(bones) - 1)
        keys = []
        for frame in (*range(1, 48, 4), 48):
            turn = 2 * math.pi * (frame - 1) / 47
            raised = (1 - math.cos(turn)) / 2
            curl = raised * (3 + 45 * place**1.6)
            wave = math.sin(turn / 2) * 13 * math.sin(2 * turn - 8 * place)
            keys.append((frame, (wave / 3, 2 * raised, curl + wave)))
        key_angles(rig, bone.name, keys)
    add_camera((0, -4, 1.2), (0, 0, 0.8), 1.9)


def add_arm(cage: Cage, root: np.ndarray, side: int, steps) -> None:
    """Grow an arm out of one side of the torso through steps of length, x, z, slope in degrees and radius."""
    for along, x, z, slope, radius in steps:
        angle = math.radians(slope)
        first_axis = math.sin(angle) * side * X + math.cos(angle) * Z
        centre = side * x * X + z * Z
        root = cage.extrude(root, section(disc(2, 2), centre, first_axis, Y, (radius, radius), along))


def torso_mesh(joint: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Upright torso with a neck, an arm that hangs 20 degrees off the side of x and a stump on the other.

    In the torso, `along` is the arm's radius less the distance to the shoulder joint: 0 near the arm's root.
    """
    # Height, half the width, half the depth.
    sections = (
        (0.00, 0.110, 0.080),
        (0.02, 0.140, 0.100),
        (0.08, 0.142, 0.102),
        (0.14, 0.150, 0.108),
        (0.20, 0.160, 0.116),
        (0.26, 0.168, 0.120),
        (0.31, 0.172, 0.116),
        (0.36, 0.172, 0.104),
        (0.41, 0.160, 0.086),
    )
    shape = disc(6, 2, 0.1)
    layers = [section(shape, z * Z, X, Y, (width, depth), 0) for z, width, depth in sections]
    layers[-1][..., 2] += 0.05 * (1 - np.abs(shape[..., 0]) ** 1.5)
    for layer in layers:
        layer[..., 3] = 0.06 - np.linalg.norm(layer[..., :3] - joint, axis=-1)
    cage = Cage(*layers[:2])
    cage.grow(*layers[2:])
    neck = cage.layers[-1][2:5]
    for z, radius in ((0.475, 0.066), (0.51, 0.056), (0.55, 0.054), (0.575, 0.04)):
        neck = cage.extrude(neck, section(disc(2, 2), z * Z, X, Y, (radius, radius), -0.2))
    sides = np.array(cage.layers[6:9])
    bend = [(0.01, 0.190, 0.365, 20, 0.066), (0.04, 0.212, 0.345, 45, 0.068)]
    thickness = ((0.08, 0.064), (0.13, 0.058), (0.18, 0.055), (0.24, 0.051), (0.3, 0.047), (0.312, 0.034))
    straight = [
        (along, 0.228 + (along - 0.08) * ARM_DOWN[0], 0.31 + (along - 0.08) * ARM_DOWN[2], 70, radius)
        for along, radius in thickness
    ]
    add_arm(cage, sides[:, -1], 1, [*bend, *straight])
    add_arm(cage, sides[:, 0], -1, [(-0.3, 0.182, 0.365, 10, 0.062), (-0.3, 0.205, 0.36, 15, 0.044)])
    return in_face_order(*subdivided(*cage.arrays()))


def make_shoulder() -> None:
    """Torso, clavicle and upper arm; the arm rises by 160 degrees up to frame 32, from hanging to overhead.

    The clavicle does 40 of them. The upper arm also turns by 50 degrees about itself, as a real one does.
    """
    new_scene(32)
    joint = np.array((0.185, 0, 0.36))
    points, faces = torso_mesh(joint)
    bones = [
        BoneSpec("Torso", (0, 0, 0), (0, 0, 0.4)),
        BoneSpec("Clavicle", (0.02, 0, 0.4), tuple(joint), "Torso"),
        BoneSpec("Upper Arm", tuple(joint), tuple(joint + 0.31 * ARM_DOWN), "Clavicle"),
    ]
    rig = add_armature("Shoulder Rig", bones)
    skin = add_mesh("Shoulder", points, faces, (0.8, 0.58, 0.46))
    bind(skin, rig, shoulder_weights(points, bones[1]), parent=True)
    upper_arm = []
    for frame, part in ((1, 0.0), (8, 0.2), (16, 0.5), (24, 0.8), (32, 1.0)):
        raised, twisted = (
            Quaternion(-Y, math.radians(120 * part)),
            Quaternion(ARM_DOWN, math.radians(50 * part)),
        )
        upper_arm.append((frame, raised @ twisted))
    clavicle = turns(-Y, ((1, 0), (8, 8), (16, 20), (24, 32), (32, 40)))
    key_quaternions(rig, "Clavicle", clavicle)
    key_quaternions(rig, "Upper Arm", upper_arm)
    add_camera((0.5, -3, 0.8), (0.06, 0, 0.37), 0.92)


RIGS = {
    "report_mesh": make_report_mesh,
    "report_links": make_report_links,
    "elbow": make_elbow,
    "wrist": make_wrist,
    "tentacle": make_tentacle,
    "shoulder": make_shoulder,
}


def main() -> None:
    """Make and save all rigs."""
    parser = argparse.ArgumentParser(description="Make the example rigs.")
    here = Path(__file__).resolve().parent
    parser.add_argument("--out", type=Path, default=here, help="folder to save them in; default: this one")
    out = parser.parse_args().out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    for name, make in RIGS.items():
        make()
        bpy.context.scene.frame_set(1)
        bpy.ops.wm.save_as_mainfile(filepath=str(out / f"{name}.blend"), compress=True)


if __name__ == "__main__":
    main()
