# SPDX-License-Identifier: GPL-3.0-or-later
"""A tree at one frame, within Blender's evaluation.

core.ik solves any bones and many frames at once, and its arrays take a millisecond of Python per frame. Bones
that inherit rotation and uniform scale, as nearly all do, need little of that: the solver's inputs and
outputs are then their own channels.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector
from sinew import affine

from ...core import ik as core
from ...io import ik_io

# Tolerance of a uniform scale, relative to its size.
_EVEN = 1e-5


class OneFrame:
    """Solves an evaluated armature's tree; keeps nothing of a frame. Only one thread at a time may use it."""

    def __init__(self, armature: bpy.types.Object, tree: core.Tree) -> None:
        self.tree = tree
        self._solver = tree.solver()
        self._tips = [effector.bone for effector in tree.effectors]
        bones = [armature.pose.bones[name].bone for name in tree.bones]
        self._inherits_all = all(
            bone.use_inherit_rotation and bone.inherit_scale == "FULL" and bone.use_local_location
            for bone in bones
        )
        self._to_parent = [
            bone.parent.matrix_local.inverted() @ bone.matrix_local
            if bone.parent
            else bone.matrix_local.copy()
            for bone in bones
        ]
        rest = np.zeros((len(bones), 4, 4))
        rest[:, :3, :3], rest[:, 3, 3] = tree.rest, 1.0
        self._rest = affine.to_quat_vec(rest)

    def solve(self, armature: bpy.types.Object, method: core.ik.Method, iterations: int) -> np.ndarray:
        """[bones, 4]: the rotations of the bones' channels. Raises SinewError for mirrored bones, and where a
        target cannot be read."""
        found = self._solve_plain(armature, method, iterations) if self._inherits_all else None
        return self._solve_any(armature, method, iterations) if found is None else found

    def _solve_plain(
        self, armature: bpy.types.Object, method: core.ik.Method, iterations: int
    ) -> np.ndarray | None:
        """Returns None where a scale is not uniform or negative."""
        tree, pose = self.tree, armature.pose.bones
        above = pose[tree.bones[0]].parent
        before = above.matrix if above is not None else Matrix()
        scale_above = _even_scale(before.to_scale())
        if scale_above is None or before.is_negative or not before.to_3x3().is_orthogonal_axis_vectors:
            return None
        rest, own = self._rest.copy(), []
        scales, matrices = [], []
        for number, parent in enumerate(tree.parents.tolist()):
            bone = pose[tree.bones[number]]
            scale = _even_scale(bone.scale)
            if scale is None:
                return None
            local = self._to_parent[number] @ bone.matrix_basis
            scale_before = scales[parent] if parent >= 0 else scale_above
            if parent >= 0:
                rest[number, 4:] = local.translation * scale_before
            scales.append(scale * scale_before)
            matrices.append((matrices[parent] if parent >= 0 else before) @ local)
            own.append(bone.matrix_basis.to_quaternion())
        wanted = ik_io.read_wanted(armature, tree)
        goals = []
        for number, (matrix, influence) in enumerate(zip(wanted.goals, wanted.influences, strict=True)):
            place, rotation = matrix.translation, matrix.to_quaternion()
            if influence != 1.0 and not tree.has_pole:
                tip = self._tips[number]
                now = matrices[tip].to_quaternion()
                at = matrices[tip] @ Vector((0.0, tree.lengths[tip], 0.0))
                place, rotation = at.lerp(place, influence), now.slerp(rotation, influence)
            goals.append((*rotation, *place))
        solution = self._solver.solve(
            rest,
            [(0.0, tree.lengths[tip] * scales[tip], 0.0) for tip in self._tips],
            goals,
            [tuple(pole) for pole in wanted.poles] if tree.has_pole else None,
            rotations=[tuple(rotation) for rotation in own],
            root=(*before.to_quaternion(), *matrices[0].translation),
            method=method,
            iterations=iterations,
        )
        rotations = solution.rotations
        if tree.has_pole and wanted.influences[0] != 1.0:
            share = wanted.influences[0]
            rotations = np.array(
                [start.slerp(Quaternion(end), share) for start, end in zip(own, rotations, strict=True)]
            )
        return rotations

    def _solve_any(self, armature: bpy.types.Object, method: core.ik.Method, iterations: int) -> np.ndarray:
        tree = self.tree
        posed = core.stack([ik_io.read_unsolved(armature, tree)])
        problem = core.problem_of(tree, posed)
        solution = core.solve(tree, problem, method, iterations)
        rotations = core.blended(tree, problem, solution.rotations, posed.influences)
        matrices = core.matrices_of(tree, problem, rotations)
        found = []
        for number, (name, parent) in enumerate(zip(tree.bones, tree.parents.tolist(), strict=True)):
            above = posed.parent if parent < 0 else matrices[:, parent]
            bone = armature.pose.bones[name]
            found.append(ik_io.local_rotations(bone, matrices[:, number], above)[0])
        return np.array(found)


def _even_scale(scale: Vector) -> float | None:
    x, y, z = scale
    return x if x > 0.0 and abs(y - x) + abs(z - x) <= _EVEN * x else None
