# SPDX-License-Identifier: GPL-3.0-or-later
"""Root motion: how a clip carries its root bone over the ground, apart from the root's pose.

A ground frame is a rotation about the vertical and a horizontal translation, in armature space. For a cycle
it moves at constant speed along the screw from the first pose to the last: sway and bounce stay in the pose.
For another clip it is under the root at every sample. Without their ground frames, clips are in place and can
be compared and blended; of the ground frames, the changes from frame to frame are blended and accumulated.
"""

from dataclasses import dataclass, replace

import numpy as np
from sinew import quat_vec

from ...io.poses import Poses
from .clip import Clip, Rig, closes


@dataclass(frozen=True)
class Grounded:
    """A clip in place, and its travel.

    clip    its root is over the origin and faces as at rest
    start   [7], the ground frame at the beginning
    twist   [6] of the screw of a whole cycle in armature space; None for a clip that is no cycle
    frames  [samples, 7], the ground frames of such a clip; otherwise None
    """

    clip: Clip
    start: np.ndarray
    twist: np.ndarray | None
    frames: np.ndarray | None

    def at(self, times: np.ndarray) -> np.ndarray:
        """[times, 7]: the ground frames at times in frames after the clip's first; a cycle continues without
        end."""
        if self.twist is not None:
            share = np.asarray(times) / self.clip.length if self.clip.length else np.zeros(len(times))
            return quat_vec.compose(quat_vec.from_twist(share[:, None] * self.twist), self.start)
        assert self.frames is not None
        scale = np.ones((len(self.frames), 1, 3))
        return replace(self.clip, poses=Poses(self.frames[:, None], scale)).at(times).rigid[:, 0]


def main_root(rig: Rig, clips: list[Clip]) -> int:
    """The bone that carries the others: of those without parent the one with most descendants, or its first
    descendant that moves."""
    sizes = np.array([rig.below(bone).sum() for bone in range(len(rig.names))])
    moving = np.any([clip.moves for clip in clips], axis=0)
    found = int(np.argmax(np.where(rig.parents < 0, sizes, 0)))
    while not moving[found] and (rig.parents == found).any() and (moving & rig.below(found)).any():
        found = int(np.argmax(np.where(rig.parents == found, sizes, 0)))
    return found


def ground_frames(rig: Rig, root: int, posed: np.ndarray, up: np.ndarray) -> np.ndarray:
    """[samples, 7]: from posed bones [samples, bones, 7] in armature space, the root's rotation from its rest
    about `up`, a unit vector, and its position without its height."""
    rest = rig.to_armature(np.broadcast_to(quat_vec.identity(), rig.rest.shape))[root]
    turned = quat_vec.compose(posed[:, root], quat_vec.inverse(rest))[:, :4]
    # The part of a rotation about an axis: without the other components of the quaternion. A rotation by 180
    # degrees about a horizontal axis has none.
    about = np.column_stack([turned[:, 0], turned[:, 1:] @ up])
    about = np.where(np.hypot(*about.T)[:, None] > 1e-9, about, (1.0, 0.0))
    place = posed[:, root, 4:]
    flat = place - (place @ up)[:, None] * up
    return quat_vec.normalized(np.column_stack([about[:, 0], about[:, 1:] * up, flat]))


def grounded(clip: Clip, root: int, up: np.ndarray, is_cyclic: bool | None = None) -> Grounded:
    """Returns the clip without its travel; it is a cycle if it closes then, or as `is_cyclic` says."""
    rig, relative = clip.rig, clip.poses.rigid
    frames = ground_frames(rig, root, rig.to_armature(relative), up)
    whole = quat_vec.compose(frames[-1], quat_vec.inverse(frames[0]))
    twist = quat_vec.to_twist(whole)
    shares = np.linspace(0.0, 1.0, len(frames)) if len(frames) > 1 else np.zeros(1)
    screws = quat_vec.from_twist(shares[:, None] * twist)
    # The mean sway of the root about the screw, which does not depend on the step where the cycle begins.
    around = quat_vec.compose(quat_vec.inverse(screws), frames)[: max(len(frames) - 1, 1)]
    middle = _mean_ground(around)
    rigid = carried(rig, root, relative, quat_vec.inverse(quat_vec.compose(screws, middle)))
    if is_cyclic is None:
        is_cyclic = closes(rig, rigid[0], rigid[-1])
    if not is_cyclic:
        rigid = carried(rig, root, relative, quat_vec.inverse(frames))
    placed = replace(clip, poses=Poses(rigid, clip.poses.scale), is_cyclic=is_cyclic)
    return Grounded(placed, middle, twist, None) if is_cyclic else Grounded(placed, frames[0], None, frames)


def as_keyed(clip: Clip, _root: int, _up: np.ndarray, is_cyclic: bool | None = None) -> Grounded:
    """Returns the clip as it is keyed, as one that does not travel; is_cyclic as in grounded()."""
    if is_cyclic is None:
        is_cyclic = closes(clip.rig, clip.poses.rigid[0], clip.poses.rigid[-1])
    return Grounded(replace(clip, is_cyclic=is_cyclic), quat_vec.identity(), np.zeros(6), None)


def carried(rig: Rig, root: int, relative: np.ndarray, ground: np.ndarray) -> np.ndarray:
    """Returns poses [frames, bones, 7], with the root and its descendants carried by ground frames [frames,
    7]."""
    posed, parent = rig.to_armature(relative), rig.parents[root]
    above = quat_vec.compose(posed[:, parent], rig.rest[root]) if parent >= 0 else rig.rest[root]
    found = relative.copy()
    found[:, root] = quat_vec.compose(quat_vec.inverse(above), quat_vec.compose(ground, posed[:, root]))
    return found


def accumulated(start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """[steps + 1, 7]: `start` [7], then after each of the steps [7], each in the frame before it."""
    found = [start]
    for step in steps:
        found.append(quat_vec.compose(found[-1], step))
    return np.array(found)


def _mean_ground(frames: np.ndarray) -> np.ndarray:
    signs = np.where(frames[:, :4] @ frames[0, :4] < 0.0, -1.0, 1.0)[:, None]
    return quat_vec.normalized(
        np.concatenate([(signs * frames[:, :4]).sum(axis=0), frames[:, 4:].mean(axis=0)])
    )
