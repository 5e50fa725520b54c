# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what metrics and diagnostics need from the open file: surfaces, weights, rest shapes, bones, shapes.

Shapes are the results of skinning, in world space, before the downstream modifiers: so every method has the
same vertices. The open file's frame and methods are changed: use it only for files that are not saved
afterwards.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Self

import bpy
import numpy as np

from ...attach import attach, group_uses, layout, stack
from ...attach.modifier_options import ModifierOptions
from ...base.errors import SinewError
from ...deform import characters, session
from ...io import armature_io, mesh_io, spaces
from ...skinning.influences import GroupWeights, Influences, entries_of_bones
from ...skinning.influences import joined as influences_of_all
from ...skinning.rig import Bones, Weighting
from ...skinning.surface import joined
from ...skinning.vectors import SAME_SPACE, transformed
from .diagnostics import Finding, PoseCheck, check_weights
from .metrics import FrameOfRig, Gauge, Summary

# Shapes are kept for as many frames as fit into this, as each method plays all of them.
MOST_BYTES = 256_000_000


@dataclass
class Edited:
    """A mesh as it is edited, and its poses so far; points in armature space."""

    obj: bpy.types.Object
    weighting: Weighting
    weights: GroupWeights
    rest_points: np.ndarray
    pose_check: PoseCheck

    @classmethod
    def read(cls, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Self:
        armature = attach.armature_of(obj)
        bones = armature_io.read_bones(armature.evaluated_get(depsgraph))
        weights = mesh_io.read_group_weights(obj.data)
        points = _in_armature_space(obj, armature, obj.data, depsgraph)
        weighting = _weighting(obj, obj, weights, bones).with_skin(points, SAME_SPACE)
        return cls(obj, weighting, weights, points, PoseCheck(weighting.influences_over_joints(points)))

    def findings(self, most_influences: int) -> list[Finding]:
        """The faults of its weights, and those that were found in the poses."""
        names = [group.name for group in self.obj.vertex_groups]
        masks = group_uses.used(self.obj, self.weighting.bones.groups_without_bone(names))
        found = check_weights(self.weighting, self.rest_points, self.weights, names, most_influences, masks)
        return [*found, *self.pose_check.findings()]


@dataclass
class Part:
    """One of the meshes.

    vertex_count  of the mesh that the Armature modifier gets
    influences    of that mesh, over bones and joints
    """

    obj: bpy.types.Object
    armature: bpy.types.Object
    edited: Edited
    vertex_count: int
    influences: Influences

    @property
    def bones(self) -> Bones:
        return self.edited.weighting.bones


@dataclass
class Subject:
    """The meshes that are measured as one, with concatenated vertices."""

    scene: bpy.types.Scene
    parts: list[Part]
    gauge: Gauge

    @property
    def meshes(self) -> list[bpy.types.Object]:
        return [part.obj for part in self.parts]

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Splits values of all vertices by mesh."""
        return np.split(values, np.cumsum([part.vertex_count for part in self.parts])[:-1])

    def owner_of(self, vertex: int) -> tuple[str, int]:
        """Returns the mesh that a vertex of all belongs to, and its index there."""
        for part in self.parts:
            if vertex < part.vertex_count:
                return part.obj.name, vertex
            vertex -= part.vertex_count
        raise IndexError(vertex)

    def character_of(self, vertex: int, points: np.ndarray) -> np.ndarray:
        """[n, 3]: those of `points` [vertices, 3] that belong to meshes with the same armature as a vertex's
        mesh."""
        ends = np.cumsum([part.vertex_count for part in self.parts])
        armature = self.parts[int(np.searchsorted(ends, vertex, side="right"))].armature
        own = zip(self.parts, self.split(points), strict=True)
        return np.concatenate([shape for part, shape in own if part.armature == armature])


@dataclass
class Measurements:
    """Measures of each frame, by method.

    times  milliseconds that Blender took for the whole frame
    own    the milliseconds of this that Sinew took; 0 for the Armature modifier
    """

    summaries: dict[str, list[Summary]]
    times: dict[str, list[float]]
    own: dict[str, list[float]]

    @classmethod
    def of(cls, methods: Sequence[str]) -> Self:
        return cls(*({method: [] for method in methods} for _ in range(3)))


def gather(scene: bpy.types.Scene, meshes: Sequence[bpy.types.Object]) -> Subject:
    """Reads meshes that an armature deforms."""
    with skinning_alone(meshes):
        characters.use_method_on(meshes, characters.BLENDER)
        for obj in meshes:
            _show(attach.armature_of(obj))
        with characters.at_rest(map(attach.armature_of, meshes)):
            depsgraph = bpy.context.evaluated_depsgraph_get()
            parts = [_read_part(obj, depsgraph) for obj in meshes]
            surface = joined([mesh_io.read_surface(obj.evaluated_get(depsgraph).data) for obj in meshes])
    bone_counts = [len(part.bones.rest) for part in parts]
    influences = influences_of_all([part.influences for part in parts], bone_counts)
    return Subject(scene, parts, Gauge(surface, influences))


def batches(subject: Subject, frames: Sequence[float], methods: int) -> list[Sequence[float]]:
    """Returns the frames in groups whose shapes, for this number of methods, are small enough to keep."""
    bytes_a_frame = 24 * max(subject.gauge.surface.vertex_count, 1) * (methods + 1)
    size = int(np.clip(MOST_BYTES // bytes_a_frame, 1, 64))
    return [frames[first : first + size] for first in range(0, len(frames), size)]


def measure(
    subject: Subject, methods: Sequence[str], reference: str, frames: Sequence[float], result: Measurements
) -> None:
    """Adds to the result the measures of shapes under each method at each frame.

    reference  the method that distances are measured to
    """
    played = list(dict.fromkeys([*methods, reference]))
    with skinning_alone(subject.meshes):
        rests = _play_rest(subject, frames)
        shapes = {method: _play(subject, method, frames, result) for method in played[1:]}
        poses: list[list[np.ndarray]] = []
        shapes[played[0]] = _play(subject, played[0], frames, result, poses)
    for index, (rest, pose) in enumerate(zip(rests, poses, strict=True)):
        rig = _frame_of_rig(subject, rest, pose)
        subject.gauge.set_frame(rig)
        _check_pose(subject, rig, frames[index])
        for method in methods:
            measured = subject.gauge.measure(shapes[method][index], shapes[reference][index])
            result.summaries[method].append(measured.summary())


def shapes_at(subject: Subject, methods: Sequence[str], frame: float) -> dict[str, np.ndarray]:
    """Returns world points under each method at one frame, and sets the gauge to it."""
    with skinning_alone(subject.meshes):
        rest = _play_rest(subject, [frame])[0]
        poses: list[list[np.ndarray]] = []
        shapes = {method: _play(subject, method, [frame], poses=poses)[0] for method in methods}
    subject.gauge.set_frame(_frame_of_rig(subject, rest, poses[0]))
    return shapes


@contextmanager
def skinning_alone(meshes: Sequence[bpy.types.Object]) -> Iterator[None]:
    """Context in which modifiers behind the skinning are switched off."""
    hidden = []
    for obj in meshes:
        now = layout.read(obj)
        kept = {*now.replaced, *now.own, *(each.name for each in now.ahead)}
        hidden += [obj.modifiers[m.name] for m in now.modifiers if m.name not in kept and m.shown[0]]
    for modifier in hidden:
        modifier.show_viewport = False
    try:
        yield
    finally:
        for modifier in hidden:
            modifier.show_viewport = True


def _play(
    subject: Subject,
    method: str,
    frames: Sequence[float],
    result: Measurements | None = None,
    poses: list[list[np.ndarray]] | None = None,
) -> list[np.ndarray]:
    """Returns world points [vertices, 3] at each frame.

    result  receives the times, if it contains the method
    poses   receives each frame's matrices of each mesh's bones in world space
    """
    characters.use_method_on(subject.meshes, method)
    # Before the first frame: binding is not part of a frame's time, and a frame has to change to be timed.
    characters.set_frame(subject.scene, frames[0] - 1)
    shapes = []
    for frame in frames:
        started = time.perf_counter()
        characters.set_frame(subject.scene, frame)
        taken = 1000.0 * (time.perf_counter() - started)
        shapes.append(_world_points(subject, frame))
        if poses is not None:
            poses.append([_bone_matrices(part) for part in subject.parts])
        if result is not None and method in result.times:
            result.times[method].append(taken)
            states = [session.skinned_of(obj) for obj in subject.meshes if method != characters.BLENDER]
            result.own[method].append(sum(state.shown.milliseconds for state in states if state is not None))
    return shapes


def _play_rest(subject: Subject, frames: Sequence[float]) -> list[tuple[np.ndarray, list[np.ndarray]]]:
    """Returns world points at each frame without any bone's effect, with the matrices of each mesh's
    bones."""
    characters.use_method_on(subject.meshes, characters.BLENDER)
    rests = []
    with characters.at_rest(map(attach.armature_of, subject.meshes)):
        for frame in frames:
            characters.set_frame(subject.scene, frame)
            rests.append((_world_points(subject, frame), [_bone_matrices(part) for part in subject.parts]))
    return rests


def _world_points(subject: Subject, frame: float) -> np.ndarray:
    points = characters.world_points(subject.meshes)
    if len(points) != subject.gauge.surface.vertex_count:
        names = ", ".join(obj.name for obj in subject.meshes)
        raise SinewError(
            f"{names}: {len(points)} vertices at frame {frame}, {subject.gauge.surface.vertex_count} at "
            "first; a modifier in front of the Armature modifier changes the topology, apply it"
        )
    return points


def _bone_matrices(part: Part) -> np.ndarray:
    """float64 [bones + joints, 4, 4] of the pose, in world space."""
    armature = part.armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array(armature.matrix_world) @ armature_io.read_pose(armature, part.bones)


def _frame_of_rig(
    subject: Subject, rest: tuple[np.ndarray, list[np.ndarray]], pose: list[np.ndarray]
) -> FrameOfRig:
    points, at_rest = rest
    bones = [part.bones for part in subject.parts]
    return FrameOfRig.of(points, zip(bones, at_rest, pose, strict=True))


def _check_pose(subject: Subject, rig: FrameOfRig, frame: float) -> None:
    first = 0
    for part in subject.parts:
        count = len(part.bones.rest)
        part.edited.pose_check.add_pose(rig.rotations[:, first : first + count], frame)
        first += count


def _show(armature: bpy.types.Object) -> None:
    """Shows an armature: Blender does not evaluate poses that nothing visible needs."""
    armature.hide_viewport = False
    if armature.name in bpy.context.view_layer.objects:
        armature.hide_set(False)


def _read_part(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Part:
    armature, edited = attach.armature_of(obj), Edited.read(obj, depsgraph)
    weighting, points = edited.weighting, edited.rest_points
    shown = obj.evaluated_get(depsgraph)
    if layout.read(obj).changes_ahead:
        weighting = _weighting(obj, shown, mesh_io.read_group_weights(shown.data), weighting.bones)
        points = _in_armature_space(obj, armature, shown.data, depsgraph)
    influences = weighting.influences_over_joints(points)
    return Part(obj, armature, edited, len(shown.data.vertices), influences)


def _weighting(
    obj: bpy.types.Object, shown: bpy.types.Object, weights: GroupWeights, bones: Bones
) -> Weighting:
    """shown: the object whose mesh has the weights, evaluated or not."""
    names = shown.vertex_groups.keys()
    modifier = stack.armature_modifier(obj)
    if modifier is not None:
        return ModifierOptions.read(modifier).weighting(names, weights, bones)
    # The parent type Armature deforms by groups, and by envelopes where there are none.
    entries = entries_of_bones(weights, bones.of_groups(names))
    return Weighting(bones, entries, use_envelopes=True)


def _in_armature_space(
    obj: bpy.types.Object, armature: bpy.types.Object, mesh: bpy.types.Mesh, depsgraph: bpy.types.Depsgraph
) -> np.ndarray:
    points = mesh_io.read_points(mesh)
    space = spaces.bones_from_model_in(depsgraph, obj, armature)
    return points if space is None else transformed(points, space)
