# SPDX-License-Identifier: GPL-3.0-or-later
"""The motion of an armature's bones, sampled at even times."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sinew import interpolate, quat_vec

from ...base.errors import SinewError
from ...io.poses import Poses

# How far the last pose of a cycle may be from the first: radians, and a share of the rig's size.
SAME_ANGLE, SAME_PLACE = 0.06, 0.02


@dataclass(frozen=True)
class Rig:
    """The bones of an armature at rest; parents come before their children.

    names    [bones]
    parents  int [bones], -1 for a bone without one
    rest     float64 [bones, 7]: parent_from_bone in the layout of sinew.quat_vec, armature_from_bone where
             there is no parent; Y along the bone
    lengths  float64 [bones]
    """

    names: tuple[str, ...]
    parents: np.ndarray
    rest: np.ndarray
    lengths: np.ndarray

    def to_armature(self, relative: np.ndarray) -> np.ndarray:
        """[.., bones, 7] armature_from_bone, from bones relative to their parents and rests; rigid parts
        only."""
        posed = quat_vec.compose(self.rest, relative)
        for bone, parent in enumerate(self.parents):
            if parent >= 0:
                posed[..., bone, :] = quat_vec.compose(posed[..., parent, :], posed[..., bone, :])
        return posed

    def points(self, armature: np.ndarray) -> np.ndarray:
        """[.., bones, 2, 3]: heads and tails of bones as to_armature() returns them, unscaled."""
        ends = np.zeros((len(self.names), 2, 3))
        ends[:, 1, 1] = self.lengths
        return quat_vec.transform_point(armature[..., None, :], ends)

    @property
    def size(self) -> float:
        """The diagonal of the bounding box of the bones at rest; 1 for a rig without extent."""
        rest = self.points(self.to_armature(np.broadcast_to(quat_vec.identity(), self.rest.shape)))
        return float(np.linalg.norm(np.ptp(rest.reshape(-1, 3), axis=0))) or 1.0

    def index(self, name: str) -> int:
        if name not in self.names:
            raise SinewError(f"There is no bone {name!r}; choose one of this armature")
        return self.names.index(name)

    def below(self, bone: int) -> np.ndarray:
        """bool [bones]: `bone` and all its descendants."""
        found = np.zeros(len(self.names), dtype=bool)
        found[bone] = True
        for each, parent in enumerate(self.parents):
            found[each] |= parent >= 0 and found[parent]
        return found


@dataclass(frozen=True)
class Clip:
    """A motion of a rig's bones.

    poses      [samples, bones, ..], each bone relative to its parent and rest, at even times
    length     frames from the first sample to the last; 0 for a single pose
    is_cyclic  the last pose equals the first, and is followed by the second
    """

    name: str
    rig: Rig
    poses: Poses
    length: float
    is_cyclic: bool = False

    def at(self, times: np.ndarray) -> Poses:
        """Returns the poses [times, bones, ..] at times in frames after the first: between samples by the
        shortest rotation at constant speed; outside of the clip its repetition, or its first or last pose."""
        last = len(self.poses.rigid) - 1
        if last == 0 or self.length == 0.0:
            nothing = np.zeros(len(times), dtype=int)
            return Poses(self.poses.rigid[nothing], self.poses.scale[nothing])
        times = np.asarray(times, dtype=np.float64)
        # Times that miss a sample only by rounding are that sample.
        places = times * (last / self.length)
        whole = np.round(places)
        places = np.where(np.abs(places - whole) < 1e-9 * last, whole, places)
        if self.is_cyclic:
            # The first and the last pose are equal; here the last one ends a cycle, so that a blend of one
            # clip is that clip.
            places = np.where(places == 0.0, 0.0, places - last * (np.ceil(places / last) - 1.0))
        else:
            places = np.clip(places, 0.0, last)
        before = np.minimum(places.astype(int), last - 1)
        part = (places - before)[:, None]
        rigid, scale = self.poses
        between = interpolate.between(rigid[before], rigid[before + 1], part, "qv_slerp").transforms
        part = part[..., None]
        exact = (part == 0.0) | (part == 1.0)
        between = np.where(exact, np.where(part == 0.0, rigid[before], rigid[before + 1]), between)
        return Poses(between, (1.0 - part) * scale[before] + part * scale[before + 1])

    @property
    def moves(self) -> np.ndarray:
        """bool [bones]: those whose pose changes, by more than rounding."""
        rigid, scale = self.poses
        nearest = np.where((rigid[..., :4] * rigid[:1, :, :4]).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        change = np.abs(rigid[..., :4] * nearest - rigid[:1, :, :4]).max(axis=(0, 2))
        travel = np.ptp(rigid[..., 4:], axis=0).max(axis=1) / self.rig.size
        return (change > 1e-5) | (travel > 1e-5) | (np.ptp(scale, axis=0).max(axis=1) > 1e-5)


def closes(rig: Rig, first: np.ndarray, last: np.ndarray) -> bool:
    """Whether two poses [bones, 7] are equal, as the ends of a cycle are; root motion has to be removed
    before."""
    apart = quat_vec.rigid_distance(first, last)
    return bool(apart.angle.max(initial=0.0) < SAME_ANGLE) and bool(
        apart.translation.max(initial=0.0) < SAME_PLACE * rig.size
    )


def common_rig(clips: Sequence[Clip]) -> Rig:
    """Returns the rig of all clips. Raises SinewError where there is no clip, or where rigs differ."""
    if not clips:
        raise SinewError("Nothing to blend: choose two actions or more")
    for clip in clips[1:]:
        if clip.rig.names != clips[0].rig.names:
            raise SinewError(f"{clip.name} and {clips[0].name} move other bones: blend clips of one armature")
    return clips[0].rig
