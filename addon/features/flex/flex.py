# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads characters for this folder, and bends them without their bones: no action, control or driver takes
part, and the file stays as it is."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import bpy
import numpy as np

from ...attach import properties
from ...base.errors import SinewError
from ...skinning.rig import Bones
from ...skinning.variants import is_key, parse
from ..measure import battery, live
from ..measure.character import Character
from ..measure.crossings import crossing_triangles
from ..measure.limits import Table
from ..measure.measured_on import OWN as OWN_METHOD
from ..measure.measured_on import MeasuredOn
from ..measure.metrics import FrameOfRig
from ..measure.rigs import Rig, posed, rig_in, skeleton_of
from .verdict import OWN, Pose, Verdict, judge


@dataclass(frozen=True)
class Result:
    """
    poses    by armature, joint and name: rotations of bones, as of battery.Pose, by the bones' names
    methods  those that were tried beside the objects' own
    own      the methods that the verdict is on, by the names of the objects
    basis    what was measured
    """

    verdict: Verdict
    poses: Mapping[tuple[str, str, str], Mapping[str, np.ndarray]]
    methods: Sequence[str]
    own: Mapping[str, str]
    basis: MeasuredOn


@dataclass(frozen=True)
class _Posed:
    """See features.flex.verdict.Posed. own: the methods of the meshes, as of live.Moment.points()."""

    moment: live.Moment
    own: Sequence[str | None]

    @property
    def frame(self) -> FrameOfRig:
        return self.moment.pose.frame

    def points(self, method: str) -> np.ndarray:
        if is_key(method):
            return self.moment.points_under([parse(method)] * len(self.own))
        return self.moment.points(self.own if method == OWN else [method] * len(self.own))


def flex(
    objects: Sequence[bpy.types.Object],
    methods: Sequence[str],
    table: Table,
    own: Mapping[bpy.types.Object, str | None],
) -> Generator[float, None, Result]:
    """Yields the progress; returns the verdict on the objects' own methods.

    objects  those that Sinew deforms
    methods  others to try, or keys of variants
    own      as of live.Moment.points(), for objects that are to be judged otherwise than they are shown

    Raises SinewError where there is nothing to bend.
    """
    subject = live.measure_now(objects, properties.BLENDER, "bend")
    basis = MeasuredOn.of(bpy.context.scene, objects, OWN_METHOD)
    now = live.Moment.of(subject)
    rigs = _rigs(now)
    own_methods = [own.get(part.obj) for part in subject.parts]
    poses: list[Pose] = []
    rotations: dict[tuple[str, str, str], Mapping[str, np.ndarray]] = {}
    for rig, bones, pose in _poses(rigs, table):
        make: Callable[[], _Posed] = partial(_posed, now, rig.bones, pose, own_methods)
        poses.append(Pose(pose.name, tuple(bone + rig.first for bone in bones), make))
        names = rig.bones.names
        of_names = {names[bone]: rotation for bone, rotation in pose.rotations.items()}
        rotations |= {(rig.armature.name, names[bone], pose.name): of_names for bone in bones}
    tried = [OWN, *methods]
    verdict = yield from judge(_character(now, rigs), poses, tried, table.limits, crossing_triangles)
    of_objects = {
        part.obj.name: method or properties.of(part.obj).method
        for part, method in zip(subject.parts, own_methods, strict=True)
    }
    return Result(verdict, rotations, methods, of_objects, basis)


def _rigs(now: live.Moment) -> list[Rig]:
    found: dict[int, Rig] = {}
    for part, world in zip(now.subject.parts, now.armatures, strict=True):
        armature, deformer = properties.of(part.obj).armature, part.bound.first_deformer
        if armature is None:
            raise SinewError(f"{part.obj.name}: its armature is missing")
        rig_in(found, armature, deformer.bones, world).moving.update(deformer.moving_bones)
    return list(found.values())


def _character(now: live.Moment, rigs: Sequence[Rig]) -> Character:
    columns = []
    for part in now.subject.parts:
        rig = next(each for each in rigs if each.armature == properties.of(part.obj).armature)
        columns.append(rig.bones.owners + rig.first)
    surface, rest = now.subject.gauge.surface, now.pose.rest
    return Character(
        surface,
        np.ascontiguousarray(rest.points.T),
        now.pose.skin.influences,
        np.concatenate(columns),
        skeleton_of(rigs),
        [(part.obj.name, part.surface.vertex_count) for part in now.subject.parts],
    )


def _poses(rigs: Sequence[Rig], table: Table) -> Iterator[tuple[Rig, tuple[int, ...], battery.Pose]]:
    """Yields each pose with the bones that it bends."""
    for rig in rigs:
        for bone, pose in rig.battery.of_joints(table.joints):
            yield rig, (bone,), pose
        for pose in rig.battery.combined():
            yield rig, tuple(pose.rotations), pose


def _posed(now: live.Moment, bones: Bones, pose: battery.Pose, own: Sequence[str | None]) -> _Posed:
    return _Posed(posed(now, {bones.names: pose}), own)
