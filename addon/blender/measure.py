# SPDX-License-Identifier: GPL-3.0-or-later
"""What metrics and diagnostics need from the open file: surfaces, weights, rest shapes, bones, shapes.

Shapes are those that skinning leaves, in world space, before the modifiers behind it: every method has the
same vertices. The open file's frame and methods are changed: for files that are opened only to be looked at.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.diagnostics import Finding, PoseCheck, check_weights
from ..core.influences import GroupWeights, Influences
from ..core.metrics import FrameOfRig, Gauge, Summary, bone_axes
from ..core.rig import Weighting
from ..core.surface import Surface, joined, same_places
from . import armature_io, drive, evaluate, handlers, mesh_io
from .modifier_options import ModifierOptions

# Shapes of as many frames are kept as fit into this: methods take turns on them.
MOST_BYTES = 256_000_000


@dataclass
class Part:
    """One of the meshes: its weights, and its place among the bones of all."""

    obj: bpy.types.Object
    armature: bpy.types.Object
    weighting: Weighting
    weights: GroupWeights
    rest_points: np.ndarray  # armature space
    influences: Influences  # over bones and joints
    pose_check: PoseCheck

    def check_weights(self, most_influences: int) -> list[Finding]:
        names = [group.name for group in self.obj.vertex_groups]
        return check_weights(self.weighting, self.rest_points, self.weights, names, most_influences)


@dataclass
class Subject:
    """The meshes that are measured as one, their vertices one after the other."""

    scene: bpy.types.Scene
    parts: list[Part]
    gauge: Gauge

    @property
    def meshes(self) -> list[bpy.types.Object]:
        return [part.obj for part in self.parts]

    def owner_of(self, vertex: int) -> tuple[str, int]:
        """The mesh that a vertex of all is in, and its index there."""
        for part in self.parts:
            count = len(part.obj.data.vertices)
            if vertex < count:
                return part.obj.name, vertex
            vertex -= count
        raise IndexError(vertex)


@dataclass
class Measurements:
    """Of each frame, by method.

    times  milliseconds that Blender took for the whole frame
    own    milliseconds of these that Sinew took; 0 for the Armature modifier
    """

    summaries: dict[str, list[Summary]]
    times: dict[str, list[float]]
    own: dict[str, list[float]]


def gather(scene: bpy.types.Scene, meshes: Sequence[bpy.types.Object]) -> Subject:
    """Reads meshes that an armature deforms."""
    parts = [_read_part(obj) for obj in meshes]
    surface = joined([read_surface(obj.data) for obj in meshes])
    return Subject(scene, parts, Gauge(surface, _joined_influences(parts)))


def read_surface(mesh: bpy.types.Mesh) -> Surface:
    mesh.calc_loop_triangles()
    triangles = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    edges = np.empty((len(mesh.edges), 2), dtype=np.int32)
    mesh.edges.foreach_get("vertices", edges.ravel())
    points = mesh_io.read_points(mesh.vertices)
    return Surface(len(mesh.vertices), triangles, edges, same_places(points))


def batches(subject: Subject, frames: Sequence[float], methods: int) -> list[Sequence[float]]:
    """The frames in groups whose shapes, under as many methods, are small enough to keep."""
    bytes_a_frame = 24 * max(subject.gauge.surface.vertex_count, 1) * (methods + 1)
    size = int(np.clip(MOST_BYTES // bytes_a_frame, 1, 64))
    return [frames[first : first + size] for first in range(0, len(frames), size)]


def measure(
    subject: Subject, methods: Sequence[str], reference: str, frames: Sequence[float]
) -> Measurements:
    """Measures shapes under each method at each frame.

    reference  the method that distances are measured to
    """
    result = Measurements(*({method: [] for method in methods} for _ in range(3)))
    played = dict.fromkeys([*methods, reference])
    with skinning_alone(subject.meshes):
        rigs = _play_rest(subject, frames)
        shapes = {method: _play(subject, method, frames, result) for method in played}
    for index, rig in enumerate(rigs):
        subject.gauge.set_frame(rig)
        _look_at_pose(subject, rig, frames[index])
        for method in methods:
            measured = subject.gauge.measure(shapes[method][index], shapes[reference][index])
            result.summaries[method].append(measured.summary())
    return result


def shapes_at(subject: Subject, methods: Sequence[str], frame: float) -> dict[str, np.ndarray]:
    """World points under each method at one frame, which the gauge is set to."""
    with skinning_alone(subject.meshes):
        subject.gauge.set_frame(_play_rest(subject, [frame])[0])
        return {method: _play(subject, method, [frame])[0] for method in methods}


@contextmanager
def skinning_alone(meshes: Sequence[bpy.types.Object]) -> Iterator[None]:
    """Inside, modifiers behind the skinning are switched off."""
    hidden = []
    for obj in meshes:
        kept = (drive.armature_modifier(obj), drive.sinew_modifier(obj))
        hidden += [m for m in obj.modifiers if m not in kept and m.show_viewport]
    for modifier in hidden:
        modifier.show_viewport = False
    try:
        yield
    finally:
        for modifier in hidden:
            modifier.show_viewport = True


def _play(
    subject: Subject, method: str, frames: Sequence[float], result: Measurements | None = None
) -> list[np.ndarray]:
    """World points [vertices, 3] at each frame; times go into `result` where it holds the method."""
    evaluate.use_method_on(subject.meshes, method)
    # Binding happens once and is no part of a frame's time; nor is a frame timed that was there already.
    evaluate.set_frame(subject.scene, frames[0] - 1)
    points = []
    for frame in frames:
        started = time.perf_counter()
        evaluate.set_frame(subject.scene, frame)
        taken = 1000.0 * (time.perf_counter() - started)
        points.append(evaluate.world_points(subject.meshes))
        if result is not None and method in result.times:
            result.times[method].append(taken)
            states = [handlers.state_of(obj) for obj in subject.meshes if method != evaluate.BLENDER]
            result.own[method].append(sum(state.milliseconds for state in states if state is not None))
    return points


def _play_rest(subject: Subject, frames: Sequence[float]) -> list[FrameOfRig]:
    """What each frame is measured against: shapes with no bone at work, shape keys as at that frame."""
    evaluate.use_method_on(subject.meshes, evaluate.BLENDER)
    shown = [m for obj in subject.meshes for m in obj.modifiers if m.show_viewport]
    for modifier in shown:
        modifier.show_viewport = False
    rigs = []
    for frame in frames:
        evaluate.set_frame(subject.scene, frame)
        rigs.append(_read_rig(subject))
    for modifier in shown:
        modifier.show_viewport = True
    return rigs


def _read_rig(subject: Subject) -> FrameOfRig:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    rest_axes, posed_axes, motions = [], [], []
    for part in subject.parts:
        bones = part.weighting.bones
        armature = part.armature.evaluated_get(depsgraph)
        world = np.array(armature.matrix_world, dtype=np.float64)
        pose = world @ armature_io.read_pose(armature, bones)
        rest = world @ bones.rest
        rest_axes.append(bone_axes(bones, rest))
        posed_axes.append(bone_axes(bones, pose))
        # An armature of no size moves nothing that could be measured.
        motions.append(pose[:, :3, :3] @ np.linalg.pinv(rest[:, :3, :3]))
    return FrameOfRig(
        evaluate.world_points(subject.meshes), *map(np.concatenate, (rest_axes, posed_axes, motions))
    )


def _look_at_pose(subject: Subject, rig: FrameOfRig, frame: float) -> None:
    first = 0
    for part in subject.parts:
        count = len(part.weighting.bones.rest)
        part.pose_check.look(rig.rotations[:, first : first + count], frame)
        first += count


def _read_part(obj: bpy.types.Object) -> Part:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    armature = drive.armature_of(obj)
    # Blender evaluates no pose that nothing visible needs, and while bones are read no modifier may be.
    armature.hide_viewport = False
    if armature.name in bpy.context.view_layer.objects:
        armature.hide_set(False)
    evaluated = armature.evaluated_get(depsgraph)
    bones = armature_io.read_bones(evaluated)
    weights = mesh_io.read_group_weights(obj.data)
    options = ModifierOptions.read(drive.armature_modifier(obj))
    weighting = options.weighting(obj, weights, bones)
    points = mesh_io.read_points(obj.data.vertices)
    space = armature_io.bones_from_model(obj.evaluated_get(depsgraph), evaluated)
    if space is not None:
        points = points @ space[:3, :3].T + space[:3, 3]
    influences = weighting.influences_over_joints(points)
    return Part(obj, armature, weighting, weights, points, influences, PoseCheck(influences))


def _joined_influences(parts: Sequence[Part]) -> Influences:
    offsets, bones, first_influence, first_bone = [np.zeros(1, np.int32)], [], 0, 0
    for part in parts:
        offsets.append(part.influences.offsets[1:] + first_influence)
        bones.append(part.influences.bones + first_bone)
        first_influence += len(part.influences.bones)
        first_bone += len(part.weighting.bones.rest)
    weights = [part.influences.weights for part in parts]
    return Influences(np.concatenate(offsets), np.concatenate(bones), np.concatenate(weights))
