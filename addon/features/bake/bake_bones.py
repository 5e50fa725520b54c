# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake to bones: helper bones in addition to a rig's own, and weights, which Blender's Armature modifier
and every engine can play. Helper bones have plain keys, or follow the pose by Blender's constraints."""

from collections.abc import Generator, Sequence
from contextlib import nullcontext
from dataclasses import replace

import bpy
import numpy as np

from ...attach import properties, stack, upstream_proxy
from ...core import helper_bones, pose_helpers, pose_samples
from ...core.errors import SinewError
from ...core.helper_bones import POSE, HelperOptions, Motion, Report
from ...core.influences import Influences, joined
from ...core.skin_stack import SkinStack, SkinStageFrame
from ...core.stages import StageValues
from ...core.vectors import transformed
from ...deform import characters
from ...deform.skinned_object import SkinnedObject
from ...io import helper_bones_io, mesh_io
from . import bake_state, shape_animation
from .bake_state import Started, take_off

# Share of the time that reading the frames takes.
_SAMPLING = 0.2
# Envelopes' weights, which are computed again in each frame, may differ by this.
_SAME_WEIGHT = 1e-3
# The number of random poses, besides the frames, for which helper bones are solved, and of those for testing.
_POSES, _UNSEEN_POSES = 64, 32

# The inputs of a mesh's shape at a frame: its rest points, its pose, the values of its stages.
Shape = tuple[np.ndarray, SkinStageFrame, StageValues]


class BoneBake(Started):
    """A bake in which the meshes of each armature share helper bones.

    reports  of each armature, after sample()
    """

    def __init__(
        self, meshes: list[bpy.types.Object], frames: Sequence[float], options: HelperOptions
    ) -> None:
        rigs: dict[bpy.types.Object, list[bpy.types.Object]] = {}
        with characters.kept_frame(bpy.context.scene):
            characters.set_frame(bpy.context.scene, frames[0])
            for obj in meshes:
                _check_bones(obj, bake_state.posed_state_of(obj))
                rigs.setdefault(_rig_of(obj), []).append(obj)
        self.frames, self.options, self.what = frames, options, ", ".join(obj.name for obj in meshes)
        self._rigs = [_Rig(rig, own) for rig, own in rigs.items()]
        self.reports: list[Report] = []

    def sample(self) -> Generator[float, None, None]:
        scene = bpy.context.scene
        with characters.kept_frame(scene):
            for number, frame in enumerate(self.frames):
                characters.set_frame(scene, frame)
                for rig in self._rigs:
                    rig.take()
                yield _SAMPLING * (number + 1) / len(self.frames)
        for number, rig in enumerate(self._rigs):
            for share in _naming(rig.meshes, rig.solve(self.options)):
                yield _SAMPLING + (1.0 - _SAMPLING) * (number + share) / len(self._rigs)
        self.reports = [rig.report for rig in self._rigs]

    def place(self) -> None:
        for rig in self._rigs:
            rig.place(self.frames)

    def discard(self) -> None:
        self._rigs.clear()


class _Rig:
    """An armature, and those of its meshes that are baked."""

    def __init__(self, rig: bpy.types.Object, meshes: list[bpy.types.Object]) -> None:
        self.rig, self.meshes = rig, meshes
        self._targets: list[np.ndarray] = []
        self._rest: list[np.ndarray] = []
        self._poses: list[np.ndarray] = []
        self._influences: list[Influences] = []
        # For each mesh, the stack that deforms it in other poses; for each frame, the shapes of all meshes.
        self._stacks: list[SkinStack] = []
        self._shapes: list[list[Shape]] = []

    def take(self) -> None:
        """Records the evaluated frame."""
        states = [bake_state.posed_state_of(obj) for obj in self.meshes]
        frames = [state.shown.frames[0] for state in states]
        deformers = [state.bound.first_deformer for state in states]
        targets, rest = [], []
        for state, frame in zip(states, frames, strict=True):
            targets.append(transformed(state.points, frame.bones_from_model))
            rest.append(transformed(state.shown.rest_points, frame.bones_from_model))
        influences = [b.weighting.influences(p) for b, p in zip(deformers, rest, strict=True)]
        if self._poses:
            self._check_same(influences)
        else:
            self._bones, self._influences = deformers[0].bones, influences
            scale = np.array(self.rig.matrix_world, dtype=np.float64)[:3, :3]
            self._unit = float(np.cbrt(abs(np.linalg.det(scale))))
            self._stacks = [state.bound.skin_stack.another() for state in states]
        self._poses.append(frames[0].pose.astype(np.float64))
        self._targets.append(np.concatenate(targets).astype(np.float32))
        together = np.concatenate(rest).astype(np.float32)
        if not np.isfinite(self._targets[-1]).all() or not np.isfinite(self._poses[-1]).all():
            raise SinewError(
                f"{self.rig.name}: frame {bpy.context.scene.frame_current} has points that are none"
            )
        if len(together) != len(self._targets[0]):
            raise SinewError(f"{self.rig.name}: the number of vertices changes; bake to alembic or usd")
        # While only the armature moves the meshes, all frames share one array.
        is_same = bool(self._rest) and np.array_equal(together, self._rest[-1])
        self._rest.append(self._rest[-1] if is_same else together)
        points = [
            self._shapes[-1][number][0] if is_same else state.shown.rest_points.copy()
            for number, state in enumerate(states)
        ]
        values = [state.shown.stage_values for state in states]
        self._shapes.append(list(zip(points, frames, values, strict=True)))

    def _check_same(self, influences: list[Influences]) -> None:
        """Raises SinewError where other bones move the vertices than at the first frame."""
        for obj, own, first in zip(self.meshes, influences, self._influences, strict=True):
            if own is not first and own.distance_from(first) > _SAME_WEIGHT:
                raise SinewError(
                    f"{obj.name}: the envelopes of its bones reach other vertices from frame to frame; bake "
                    "to mdd or pc2"
                )

    def solve(self, options: HelperOptions) -> Generator[float, None, None]:
        at_frames = self._motion(self._rest, self._targets, self._poses)
        diagonal = self._unit * at_frames.diagonal
        if options.motion != POSE:
            self._targets.clear()
            self._solution = yield from helper_bones.solve(at_frames, options.of(at_frames))
            self.report = Report.of(self.rig.name, self._solution, self._unit, diagonal)
            return
        rest = self._bones.rest
        motion = self._with(at_frames, _POSES, seed=1)
        solution = yield from pose_helpers.solve(motion, options.of(motion), rest)
        before, after, errors, errors_before = pose_helpers.errors_of(solution, at_frames, rest)
        self._solution = replace(
            solution, before=before, after=after, errors=errors, errors_before=errors_before
        )
        unseen = pose_helpers.errors_of(solution, self._with(None, _UNSEEN_POSES, seed=2), rest)
        self.report = Report.of(self.rig.name, self._solution, self._unit, diagonal, unseen[:2])
        self._targets.clear()

    def _motion(self, rest: list[np.ndarray], targets: list[np.ndarray], poses: list[np.ndarray]) -> Motion:
        from_rest = np.linalg.inv(self._bones.rest.astype(np.float64))
        moves = any(each is not rest[0] for each in rest)
        return Motion(
            np.array(rest if moves else rest[:1]),
            np.array(targets),
            np.array([(pose @ from_rest)[:, :3] for pose in poses]),
            joined(self._influences, [0] * len(self._influences)),
            np.stack([self._bones.envelopes.heads, self._bones.envelopes.tails], axis=1).astype(np.float64),
        )

    def _with(self, at_frames: Motion | None, count: int, seed: int) -> Motion:
        """Adds random poses, after those of the frames if these are given."""
        joints = helper_bones_io.read_joints(self.rig, self._bones)
        frames, bones = len(self._poses), len(joints.parents)
        seen = np.array(self._poses)
        poses = seen[np.arange(count) % frames]
        poses[:, :bones] = pose_samples.sampled(seen[:, :bones], joints, count, seed)
        rest = [self._rest[number % frames] for number in range(count)]
        targets = [self._shape_in(pose, number % frames) for number, pose in enumerate(poses)]
        if at_frames is None:
            return self._motion(rest, targets, list(poses))
        return self._motion([*self._rest, *rest], [*self._targets, *targets], [*self._poses, *poses])

    def _shape_in(self, pose: np.ndarray, frame: int) -> np.ndarray:
        """float32 [vertices, 3], armature space: Sinew's shape of all meshes in a pose, with everything else
        as at one of the frames."""
        points = []
        for skin_stack, (rest, at_frame, values) in zip(self._stacks, self._shapes[frame], strict=True):
            skin_stack.deform(rest, [replace(at_frame, pose=pose.astype(np.float32))], values=values)
            points.append(transformed(skin_stack.points, at_frame.bones_from_model))
        return np.concatenate(points).astype(np.float32)

    def place(self, frames: Sequence[float]) -> None:
        solution, bones = self._solution, self._bones
        own = [bones.names[bone] for bone in solution.parents]
        follows_pose = bool(solution.blends)
        # Only visible objects can be edited.
        with nullcontext() if self.rig.visible_get() else characters.shown([self.rig]):
            helper_bones_io.use_copy_of_armature(self.rig)
            names = helper_bones_io.add_bones(self.rig, own, solution.heads, hanging=not follows_pose)
            if follows_pose:
                helper_bones_io.add_constraints(self.rig, names, solution.blends, bones.names)
        if not follows_pose:
            motions = np.zeros((*solution.motions.shape[:2], 4, 4))
            motions[:, :, :3], motions[:, :, 3, 3] = solution.motions, 1.0
            parents = np.array(self._poses)[:, solution.parents]
            times = shape_animation.key_times(frames)
            helper_bones_io.write_keys(self.rig, names, motions, parents, times)
        first = 0
        for obj in self.meshes:
            count = len(obj.data.vertices)
            rows = slice(first, first + count)
            first += count
            _use_armature_modifier(obj, self.rig)
            helper_bones_io.write_weights(
                obj, bones, [*bones.names, *names], solution.bones[rows], solution.weights[rows]
            )
            for name, errors in (
                (helper_bones_io.ERRORS, solution.errors),
                (helper_bones_io.ERRORS_BEFORE, solution.errors_before),
            ):
                mesh_io.write_values(obj.data, name, self._unit * errors[rows])


def _naming(
    meshes: Sequence[bpy.types.Object], steps: Generator[float, None, None]
) -> Generator[float, None, None]:
    """The steps; errors name the meshes, which the solver does not know."""
    try:
        yield from steps
    except SinewError as error:
        raise SinewError(f"{', '.join(obj.name for obj in meshes)}: {error}") from error


def _use_armature_modifier(obj: bpy.types.Object, rig: bpy.types.Object) -> None:
    """Takes Sinew off, and sets the Armature modifier to linear blending by vertex groups."""
    take_off(obj)
    modifier = stack.armature_modifier(obj)
    modifier.object = rig
    modifier.use_deform_preserve_volume = modifier.use_bone_envelopes = False
    modifier.use_multi_modifier = modifier.invert_vertex_group = False
    modifier.use_vertex_groups, modifier.vertex_group = True, ""
    bake_state.use_copy_of_mesh(obj)


def _rig_of(obj: bpy.types.Object) -> bpy.types.Object:
    """Returns the armature object that deforms a mesh. Raises SinewError where bones cannot reproduce the
    deformation."""
    replaced = properties.of(obj).replaced_modifiers
    if len(replaced) != 1:
        raise SinewError(
            f"{obj.name}: has several Armature modifiers; bones reproduce one: bake to mdd or pc2"
        )
    rig = replaced[0].armature
    for each in (obj, rig):
        if each.override_library is not None or each.library is not None:
            raise SinewError(f"{each.name}: is linked, and can not have bones of its own; make it local")
    upstream_proxy.check_not_needed(obj, "which has no weights of its own; bake to mdd or pc2")
    animation = rig.animation_data
    if animation is not None and animation.use_tweak_mode:
        raise SinewError(f"{rig.name}: a strip of its NLA is being edited; leave tweak mode first")
    if rig.name not in bpy.context.view_layer.objects:
        raise SinewError(f"{rig.name}: is not in this view layer, where bones could be added")
    return rig


def _check_bones(obj: bpy.types.Object, state: SkinnedObject) -> None:
    """Raises SinewError for bendy bones, which no engine has."""
    deformer = state.bound.first_deformer
    bendy = [name for name, n in zip(deformer.bones.names, deformer.bones.segments, strict=True) if n > 1]
    found = [name for name in bendy if name in deformer.moving_bones]
    if found:
        raise SinewError(f"{obj.name}: {', '.join(found)} bends in segments; bake to mdd or pc2")
