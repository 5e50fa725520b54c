# SPDX-License-Identifier: GPL-3.0-or-later
"""Inverse kinematics over frames: the problem of Blender's constraints, solved by `future_work.ik`."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from sinew import affine, quat, quat_vec
from sinew_addon.base.errors import SinewError
from sinew_addon.skinning.vectors import unit

from . import ik

# Blender's own limit, which the solver never nearly reaches.
ITERATIONS = 500


@dataclass(frozen=True)
class Tree:
    """Bones that are solved together, parents first, and their constraints.

    bones        names; the first is the root
    parents      int32 [bones], -1 for the root
    rest         float64 [bones, 3, 3], each bone's axes at rest, relative to its parent's
    constraints  for each effector: the bone that has the constraint, and the constraint's name
    effectors    of future_work.ik
    """

    bones: tuple[str, ...]
    parents: np.ndarray
    rest: np.ndarray
    lengths: np.ndarray
    locked: np.ndarray
    limits: np.ndarray
    stiffness: np.ndarray
    constraints: tuple[tuple[str, str], ...]
    effectors: tuple[ik.Effector, ...]

    @property
    def has_pole(self) -> bool:
        return len(self.effectors) == 1 and self.effectors[0].has_pole

    def solver(self) -> ik.Solver:
        return ik.Solver(
            self.parents, self.effectors, locked=self.locked, limits=self.limits, stiffness=self.stiffness
        )


class Posed(NamedTuple):
    """A tree at one frame, or at several with a leading axis; armature space, matrices of column vectors as
    in Blender.

    bones       [bones, 4, 4], without the constraints
    parent      [4, 4], of the root's parent; the identity where it has none
    goals       [effectors, 4, 4]
    poles       [effectors, 3]
    influences  [effectors]
    """

    bones: np.ndarray
    parent: np.ndarray
    goals: np.ndarray
    poles: np.ndarray
    influences: np.ndarray


class Problem(NamedTuple):
    """Arguments of ik.Solver.solve(), and the scale of each bone's axes, [frames, bones, 3]."""

    rest: np.ndarray
    tips: np.ndarray
    goals: np.ndarray
    poles: np.ndarray
    rotations: np.ndarray
    root: np.ndarray
    scales: np.ndarray


def stack(frames: list[Posed]) -> Posed:
    return Posed(*(np.stack(part) for part in zip(*frames, strict=True)))


def problem_of(tree: Tree, posed: Posed) -> Problem:
    """Returns the problem of frames as Blender's solver defines it: bones rotate and keep their lengths as
    scaled; with an influence below 1, a goal is between the tip and the target, except with a pole, where the
    result is blended instead. Raises SinewError for mirrored bones."""
    mirrored = (np.linalg.det(posed.bones[..., :3, :3]) < 0.0).any(axis=0)
    if mirrored.any():
        names = ", ".join(name for name, is_it in zip(tree.bones, mirrored, strict=True) if is_it)
        raise SinewError(f"{names}: mirrored by a scale below 0, which no rotation undoes; make it positive")
    scales = np.linalg.norm(posed.bones[..., :3, :3], axis=-2)
    axes = _axes_of(posed.bones)
    heads = posed.bones[..., :3, 3].astype(np.float64)
    parent_axes, parent_heads = axes[:, tree.parents], heads[:, tree.parents]
    parent_axes[:, 0], parent_heads[:, 0] = _axes_of(posed.parent), heads[:, 0]
    to_parent = np.swapaxes(parent_axes, -1, -2)
    rest_axes = np.broadcast_to(tree.rest, axes.shape)
    rest = _rigid(rest_axes, (to_parent @ (heads - parent_heads)[..., None])[..., 0])
    own = np.swapaxes(tree.rest, -1, -2) @ to_parent @ axes
    tip_bones = [effector.bone for effector in tree.effectors]
    tips = np.zeros((*posed.goals.shape[:2], 3))
    tips[..., 1] = (tree.lengths * scales[..., 1])[:, tip_bones]
    goals = _rigid(_axes_of(posed.goals), posed.goals[..., :3, 3])
    if not tree.has_pole:
        reached = heads[:, tip_bones] + (axes[:, tip_bones] @ tips[..., None])[..., 0]
        goals = _between(_rigid(axes[:, tip_bones], reached), goals, posed.influences)
    return Problem(
        rest,
        tips,
        goals,
        posed.poles.astype(np.float64),
        _rigid(own, 0.0)[..., :4],
        _rigid(parent_axes[:, 0], heads[:, 0]),
        scales,
    )


def solve(tree: Tree, problem: Problem, iterations: int = ITERATIONS) -> ik.Solution:
    return tree.solver().solve(
        problem.rest,
        problem.tips,
        problem.goals,
        problem.poles if tree.has_pole else None,
        rotations=problem.rotations,
        root=problem.root,
        iterations=iterations,
    )


def blended(tree: Tree, problem: Problem, rotations: np.ndarray, influences: np.ndarray) -> np.ndarray:
    """[frames, bones, 4]: rotations blended with the unsolved pose, for a constraint with a pole and an
    influence below 1."""
    if not tree.has_pole or (influences == 1.0).all():
        return rotations
    start = np.pad(problem.rotations, ((0, 0), (0, 0), (0, 3)))
    end = np.pad(rotations, ((0, 0), (0, 0), (0, 3)))
    return _between(start, end, influences[:, :1])[..., :4]


def matrices_of(tree: Tree, problem: Problem, rotations: np.ndarray) -> np.ndarray:
    """float64 [frames, bones, 4, 4]: bones in armature space, with their original scale."""
    own = np.pad(rotations, ((0, 0), (0, 0), (0, 3)))
    relative = quat_vec.compose(problem.rest, own)
    poses = np.empty_like(relative)
    for bone, parent in enumerate(tree.parents):
        before = problem.root if parent < 0 else poses[:, parent]
        poses[:, bone] = quat_vec.compose(before, relative[:, bone])
    matrices = quat_vec.to_affine(poses)
    matrices[..., :3, :3] *= problem.scales[..., None, :]
    return matrices


def tip_errors(tree: Tree, problem: Problem, matrices: np.ndarray) -> np.ndarray:
    """[frames]: the largest distance of a tip from its goal, in lengths of the longest chain; `matrices` as
    from matrices_of()."""
    bones = [effector.bone for effector in tree.effectors]
    scaled = problem.tips / np.maximum(problem.scales[:, bones], 1e-30)
    tips = (matrices[:, bones][..., :3, :3] @ scaled[..., None])[..., 0] + matrices[:, bones][..., :3, 3]
    distances = np.linalg.norm(tips - problem.goals[..., 4:], axis=-1)
    counted = np.array([effector.position_weight > 0.0 for effector in tree.effectors])
    longest = np.array([_reach(tree, problem, effector.bone) for effector in tree.effectors]).max(axis=0)
    return distances[:, counted].max(axis=1, initial=0.0) / np.maximum(longest, 1e-30)


def _reach(tree: Tree, problem: Problem, bone: int) -> np.ndarray:
    reach = tree.lengths[bone] * problem.scales[:, bone, 1]
    while tree.parents[bone] >= 0:
        reach = reach + np.linalg.norm(problem.rest[:, bone, 4:], axis=-1)
        bone = tree.parents[bone]
    return reach


def _between(a: np.ndarray, b: np.ndarray, share: np.ndarray) -> np.ndarray:
    """From a to b, [.., 7]: rotations along the shortest arc, positions linear."""
    share = np.asarray(share, dtype=np.float64)
    positions = a[..., 4:] + share[..., None] * (b[..., 4:] - a[..., 4:])
    return np.concatenate([quat.slerp(a[..., :4], b[..., :4], share), positions], axis=-1)


def _axes_of(matrices: np.ndarray) -> np.ndarray:
    """Rotations: y is normalised, x made perpendicular to it; the identity where a matrix has no axes."""
    axes = np.asarray(matrices, dtype=np.float64)[..., :3, :3]
    y = unit(axes[..., 1])
    x = unit(axes[..., 0])
    x = unit(x - (x * y).sum(axis=-1, keepdims=True) * y)
    result = np.stack([x, y, np.cross(x, y)], axis=-1)
    has_axes = np.abs(np.linalg.det(result) - 1.0) < 1e-6
    return np.where(has_axes[..., None, None], result, np.eye(3))


def _rigid(axes: np.ndarray, heads: np.ndarray | float) -> np.ndarray:
    """[.., 7], in the layout of sinew.quat_vec, of axes [.., 3, 3] and heads [.., 3]."""
    matrices = np.zeros((*axes.shape[:-2], 4, 4))
    matrices[..., :3, :3], matrices[..., :3, 3], matrices[..., 3, 3] = axes, heads, 1.0
    return affine.to_quat_vec(matrices)
