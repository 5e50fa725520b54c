# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake to bones: helper bones in addition to a rig's own, and weights, which Blender's Armature modifier
and every engine can play. Helper bones have plain keys, or follow the pose by Blender's constraints."""

from collections.abc import Generator, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace

import bpy
import numpy as np

from ...attach import properties, stack, upstream_proxy
from ...base.errors import SinewError, about
from ...deform import characters, session
from ...io import mesh_io
from ...skinning.influences import Influences, joined
from ...skinning.skin_stack import ModifierFrame, SkinDeformer, SkinStack
from ...skinning.stages import StageValues
from ...skinning.vectors import transformed
from . import bake_state, helper_bones, helper_bones_io, kept, pose_helpers, pose_samples, shape_animation
from .bake_state import Started, take_off
from .helper_bones import POSE, Errors, HelperOptions, Motion, Report
from .segment_bones import SegmentErrors, SegmentReport

# Share of the time that reading the frames takes.
_SAMPLING = 0.2
# Envelopes' weights, which are computed again in each frame, may differ by this.
_SAME_WEIGHT = 1e-3
_SAME_SIZE = 1e-4
# The number of random poses, besides the frames, for which helper bones are solved, and of those for testing.
_POSES, _UNSEEN_POSES = 64, 32

# The inputs of a mesh's shape at a frame: its rest points, its pose, the values of its stages.
Shape = tuple[np.ndarray, ModifierFrame, StageValues]


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
                bake_state.posed_now(obj)
                rigs.setdefault(_rig_of(obj), []).append(obj)
        self.frames, self.options, self.what = frames, options, ", ".join(obj.name for obj in meshes)
        self._rigs = [_Rig(rig, own, options) for rig, own in rigs.items()]
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
            # The solver does not know the meshes.
            with about(", ".join(obj.name for obj in rig.meshes)):
                for share in rig.solve():
                    yield _SAMPLING + (1.0 - _SAMPLING) * (number + share) / len(self._rigs)
        self.reports = [rig.report for rig in self._rigs]

    def place(self) -> None:
        for rig in self._rigs:
            rig.place(self.frames)

    def discard(self) -> None:
        self._rigs.clear()


class _Rig:
    """An armature, and those of its meshes that are baked."""

    def __init__(self, rig: bpy.types.Object, meshes: list[bpy.types.Object], options: HelperOptions) -> None:
        self.rig, self.meshes, self._options = rig, meshes, options
        self._targets: list[np.ndarray] = []
        self._rest: list[np.ndarray] = []
        self._poses: list[np.ndarray] = []
        self._influences: list[Influences] = []
        # For each mesh, the stack that deforms it in other poses; for each frame, the shapes of all meshes.
        self._stacks: list[SkinStack] = []
        self._shapes: list[list[Shape]] = []
        # Names of the plain bones for joints.
        self.segments: dict[int, str] = {}

    def take(self) -> None:
        """Records the evaluated frame."""
        states = [bake_state.posed_now(obj) for obj in self.meshes]
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
            self._from_rest = np.linalg.inv(self._bones.rest.astype(np.float64))
            self._segments = SegmentErrors(
                self._bones, _over_joints(deformers, rest), self._options.influences
            )
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
        if len(self._segments.bendy):
            motions = self._poses[-1] @ self._from_rest
            plain = helper_bones_io.without_shear(motions, self._bones, self._segments.joints)
            now = None if self._rest[-1] is self._rest[0] else _over_joints(deformers, rest)
            self._segments.take(self._targets[-1], self._rest[-1], motions, plain, now)
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

    def solve(self) -> Generator[float, None, None]:
        options = self._options
        at_frames = self._motion(self._rest, self._targets, self._poses)
        diagonal = self._unit * at_frames.diagonal
        if options.motion != POSE:
            self._targets.clear()
            self._solution = yield from helper_bones.solve(at_frames, options.of(at_frames))
            self._report(diagonal)
            return
        rest = self._bones.rest_axes
        motion = self._with(at_frames, _POSES, seed=1)
        solution = yield from pose_helpers.solve(motion, options.of(motion), rest)
        before, after, errors, errors_before = pose_helpers.errors_of(solution, at_frames, rest)
        self._solution = replace(
            solution, before=before, after=after, errors=errors, errors_before=errors_before
        )
        unseen = pose_helpers.errors_of(solution, self._with(None, _UNSEEN_POSES, seed=2), rest)
        self._report(diagonal, unseen[:2])
        self._targets.clear()

    def _report(self, diagonal: float, unseen: tuple[Errors, Errors] | None = None) -> None:
        self.report = Report.of(self.rig.name, self._solution, self._unit, diagonal, unseen)
        if len(self._segments.bendy):
            self.report = replace(self.report, segments=self._segments.report(self.rig.name, self._unit))

    def _motion(self, rest: list[np.ndarray], targets: list[np.ndarray], poses: list[np.ndarray]) -> Motion:
        moves = any(each is not rest[0] for each in rest)
        return Motion(
            np.array(rest if moves else rest[:1]),
            np.array(targets),
            np.array([(pose @ self._from_rest)[:, :3] for pose in poses]),
            self._segments.influences,
            self._heads_and_tails(),
            self._bones.owners,
        )

    def _heads_and_tails(self) -> np.ndarray:
        """float64 [bones + joints, 2, 3]: heads and tails; a joint's tail is the next joint's head."""
        envelopes, heads = self._bones.envelopes, self._bones.rest[:, :3, 3]
        tails = np.append(heads[1:], heads[-1:], axis=0)
        last = np.diff(self._bones.owners, append=-1) != 0
        tails[last] = heads[last]
        tails[: len(envelopes.tails)] = envelopes.tails
        return np.stack([heads, tails], axis=1).astype(np.float64)

    def _with(self, at_frames: Motion | None, count: int, seed: int) -> Motion:
        """Adds random poses, after those of the frames if these are given."""
        joints = helper_bones_io.read_joints(self.rig, self._bones)
        frames, bones = len(self._poses), len(joints.parents)
        seen = np.array(self._poses)
        poses = seen[np.arange(count) % frames]
        poses[:, :bones] = pose_samples.sampled(seen[:, :bones], joints, count, seed)
        # A bendy bone's joints move along with it, bent as at the frame.
        owners, at_frames_of = self._bones.owners[bones:], seen[np.arange(count) % frames]
        poses[:, bones:] = (
            poses[:, owners] @ np.linalg.pinv(at_frames_of[:, owners]) @ at_frames_of[:, bones:]
        )
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
        poses, follows_pose = np.array(self._poses), self._options.motion == POSE
        # Only visible objects can be edited.
        with nullcontext() if self.rig.visible_get() else characters.shown([self.rig]):
            helper_bones_io.use_copy_of_armature(self.rig)
            bendy = self._segments.bendy
            hanging = None if follows_pose else [_has_one_size(poses[:, bone]) for bone in bendy]
            segments = helper_bones_io.add_segments(self.rig, bones, bendy, hanging)
            movers = bones.names_with(segments)
            own = [movers[bone] for bone in solution.parents]
            helpers = helper_bones_io.add_bones(self.rig, own, solution.heads, not follows_pose)
            if follows_pose:
                helper_bones_io.add_constraints(self.rig, helpers, solution.blends, movers)
        if not follows_pose:
            joints = np.array(list(segments), dtype=int)
            motions = np.zeros((len(poses), len(joints) + len(helpers), 4, 4))
            motions[:, : len(joints)] = poses[:, joints] @ self._from_rest[joints]
            motions[:, len(joints) :, :3], motions[:, len(joints) :, 3, 3] = solution.motions, 1.0
            parents = poses[:, [*bones.owners[joints], *solution.parents]]
            times = shape_animation.key_times(frames)
            helper_bones_io.write_keys(self.rig, [*segments.values(), *helpers], motions, parents, times)
        for obj, rows in self._rows():
            _use_armature_modifier(obj, self.rig)
            helper_bones_io.write_weights(
                obj, bones, [*movers, *helpers], solution.bones[rows], solution.weights[rows]
            )
            for name, errors in (
                (helper_bones_io.ERRORS, solution.errors),
                (helper_bones_io.ERRORS_BEFORE, solution.errors_before),
            ):
                mesh_io.write_values(obj.data, name, self._unit * errors[rows])
            kept.note_sentences(obj, self.report.sentences(characters.length_unit(bpy.context.scene)))

    def _rows(self) -> Iterator[tuple[bpy.types.Object, slice]]:
        """The meshes, each with its vertices among those of all."""
        first = 0
        for obj in self.meshes:
            end = first + len(obj.data.vertices)
            yield obj, slice(first, end)
            first = end

    def replace_bendy_bones(self) -> list[SegmentReport]:
        """Has plain bones that follow the joints of bendy bones move the meshes, which Sinew still deforms;
        empty where none bends."""
        if not len(self._segments.bendy):
            return []
        with nullcontext() if self.rig.visible_get() else characters.shown([self.rig]):
            helper_bones_io.use_copy_of_armature(self.rig)
            names = helper_bones_io.add_segments(self.rig, self._bones, self._segments.bendy)
        self.segments = names
        movers, (slots, weights) = self._bones.names_with(names), self._segments.influences.padded()
        for obj, rows in self._rows():
            if obj.data.users > 1:
                bake_state.use_copy_of_mesh(obj)
            helper_bones_io.write_weights(obj, self._bones, movers, slots[rows], weights[rows])
            # These weights have the envelopes in them.
            stack.armature_modifier(obj).use_bone_envelopes = False
        return [self._segments.report(self.rig.name, self._unit)]


def joint_counts(meshes: Sequence[bpy.types.Object]) -> list[int]:
    """Returns how many joints move vertices, for each armature; empty where Sinew deforms none."""
    found: dict[bpy.types.Object, set[int]] = {}
    for obj, state in session.deformed_now(meshes, bpy.context.evaluated_depsgraph_get()):
        influences = state.bound.first_deformer.weighting.influences(state.shown.rest_points)
        found.setdefault(properties.of(obj).armature, set()).update(influences.bones.tolist())
    return [max(len(bones) - 1, 0) for bones in found.values()]


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
    if rig.data.pose_position == "REST":
        raise SinewError(f"{rig.name}: is in Rest Position, where no bone moves; switch to Pose Position")
    if rig.name not in bpy.context.view_layer.objects:
        raise SinewError(f"{rig.name}: is not in this view layer, where bones could be added")
    return rig


def _over_joints(deformers: Sequence[SkinDeformer], rest: Sequence[np.ndarray]) -> Influences:
    """The influences of meshes of one armature, of its bones and of the joints of bendy bones.

    rest  float [vertices, 3] of each, armature space
    """
    found = [d.weighting.influences_over_joints(points) for d, points in zip(deformers, rest, strict=True)]
    return joined(found, [0] * len(found))


def _has_one_size(poses: np.ndarray) -> bool:
    """Whether a bone's axes have one length and are perpendicular in all poses [frames, 4, 4], so that its
    children are not sheared."""
    axes = poses[:, :3, :3]
    products = axes.transpose(0, 2, 1) @ axes
    sizes = products[:, :1, :1]
    return bool((np.abs(products - sizes * np.identity(3)) <= _SAME_SIZE * sizes).all())


def replace_bendy_bones(
    meshes: Sequence[bpy.types.Object], frames: Sequence[float], influences: int
) -> tuple[list[SegmentReport], dict[str, dict[int, str]], list[str]]:
    """Puts plain bones in place of bendy ones, for an exporter. They follow the joints by constraints, so
    that all actions move them. Returns, for each armature, what that leaves of the shapes at the frames; the
    plain bones' names for each mesh, by the index of the joint; and a sentence for each mesh that keeps its
    bendy bones.

    influences  of a vertex, at most, that will be exported; 0 for all
    """
    found: dict[bpy.types.Object, list[bpy.types.Object]] = {}
    kept: list[str] = []
    for obj, state in session.deformed_now(meshes, bpy.context.evaluated_depsgraph_get()):
        try:
            if state.shown.frames[0] is not None and state.bound.first_deformer.bends:
                found.setdefault(_rig_of(obj), []).append(obj)
        except SinewError as error:
            kept.append(f"{error}; its bendy bones are exported as straight ones")
    scene, reports = bpy.context.scene, []
    rigs = [_Rig(rig, own, HelperOptions(influences=influences)) for rig, own in found.items()]
    with characters.kept_frame(scene):
        for frame in frames if rigs else ():
            characters.set_frame(scene, frame)
            for rig in rigs:
                rig.take()
    for rig in rigs:
        reports += rig.replace_bendy_bones()
    session.refresh(bpy.context)
    return reports, {obj.name: rig.segments for rig in rigs for obj in rig.meshes}, kept
