# SPDX-License-Identifier: GPL-3.0-or-later
"""Helper bones that follow the pose in any animation: each rotates as a dual quaternion blend of the rig's
bones around it, with weights of its own. Its head moves by that blend, or by linear blending with the same
weights, as optimised centres of rotation do (Le and Hodgins 2016). In Blender these are Armature constraints
with and without Preserve Volume.

Such motions replace those that are independent in each frame (helper_bones.py): weights, and the position of
a centre, are found by damped Gauss-Newton (Levenberg, Marquardt), while everything else is fixed.
"""

from collections.abc import Generator
from dataclasses import dataclass, field, replace

import numpy as np
import sinew

from . import helper_bones
from .helper_bones import Blend, Errors, Helper, Motion, Solution, Solver, Wanted

# The largest number of bones that move a helper bone.
_MOST_BONES = 6
_STEPS, _TRIES = 4, 5
_DIFFERENCE = 1e-4
# A centre that moves by this share of the diagonal counts as a weight that changes by 1.
_UNIT = 0.1
_DAMPING = 1e-3
# Share of the squared error. Methods that are dual quaternion blends leave 1e-12, others 1e-2 and more.
_NEXT_TO_NOTHING = 1e-3
# The search ends when weights change by less.
_CLOSE = 1e-4


def solve(motion: Motion, wanted: Wanted, rest: np.ndarray) -> Generator[float, None, Solution]:
    """As helper_bones.solve(), with a blend for each helper bone.

    rest  float [bones, 4, 4], the rig's bones at rest, armature space
    """
    return helper_bones.solve(motion, wanted, lambda own, most: _PoseSolver(own, most, rest_bones=rest))


def errors_of(
    solution: Solution, motion: Motion, rest: np.ndarray
) -> tuple[Errors, Errors, np.ndarray, np.ndarray]:
    """Returns the errors of linear blend skinning with the original weights, and of a solution, in other
    poses than those it was made from; and the rms errors at each vertex, float32 [vertices], of the solution
    and of linear blend skinning."""
    solver = _PoseSolver(motion, solution.bones.shape[1], rest_bones=rest)
    before, errors_before = solver.errors(), solver.errors_of_vertices()
    return before, *solver.play(solution), errors_before


@dataclass
class _PoseSolver(Solver):
    """rest_bones: float [bones, 4, 4], armature space."""

    rest_bones: np.ndarray = field(kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        motions = np.zeros((*self.motion.bones.shape[:2], 4, 4))
        motions[:, :, :3], motions[:, :, 3, 3] = self.motion.bones, 1.0
        self._length = max(self.motion.diagonal, 1e-30) * _UNIT
        # Blender separates a bone's scale, and blends it separately.
        self._split = sinew.affine.split_scale(motions, np.asarray(self.rest_bones, dtype=np.float64))

    def play(self, solution: Solution) -> tuple[Errors, np.ndarray]:
        """Returns the errors of a solution made from other poses, and the rms of each vertex, float32."""
        nothing = np.empty(0)
        self.helpers = [
            Helper(self._blended(blend), int(parent), nothing, nothing, blend)
            for blend, parent in zip(solution.blends, solution.parents, strict=True)
        ]
        self.bones, self.weights = solution.bones[self.deformed], solution.weights[self.deformed]
        self.residual = self._residual_of(self.bones, self.weights)
        return self.errors(), self.errors_of_vertices()

    def _blended(self, blend: Blend) -> np.ndarray:
        """float64 [frames, 3, 4]"""
        used = blend.weights > 0.0
        bones, weights, head = blend.bones[used], blend.weights[used], blend.head
        rigid, scale = self._split.rigid[:, bones], self._split.scale[:, bones]
        linear = None
        if self._split.has_scale[:, bones].any():
            # Scale is about the head; how scale moves the head is part of the rigid motion.
            moved = scale[..., :3, :3] @ head + scale[..., :3, 3] - head
            rigid = rigid.copy()
            rigid[..., :3, 3] += (rigid[..., :3, :3] @ moved[..., None])[..., 0]
            linear = np.einsum("b,fbij->fij", weights / weights.sum(), scale[..., :3, :3])
        pairs = sinew.affine.to_dual_quat(rigid)
        blended = sinew.interpolate.blend(pairs, weights, "dlb", "running_sum")
        motion = np.array(sinew.dual_quat.to_affine(blended.transforms))[:, :3]
        if blend.is_centre:
            if linear is not None:
                motion[:, :, :3] = motion[:, :, :3] @ linear
            posed = self._linear(blend)
            motion[:, :, 3] = posed[:, :, :3] @ head + posed[:, :, 3] - motion[:, :, :3] @ head
        elif linear is not None:
            motion[:, :, 3] += (motion[:, :, :3] @ (head - linear @ head)[..., None])[..., 0]
            motion[:, :, :3] = motion[:, :, :3] @ linear
        return motion

    def _fitted(
        self, helper: Helper, vertices: np.ndarray, weights: np.ndarray, wanted: np.ndarray
    ) -> np.ndarray:
        rest = self.rest[vertices]
        rest = weights[:, None, None] * np.concatenate([rest, np.ones((*rest.shape[:2], 1))], axis=2)
        wanted = wanted.reshape(len(vertices), -1, 3)
        # Terms of the sum over vertices of |w T p - y|^2: [frames or 1, 4, 4] and [frames, 3, 4].
        squares = np.einsum("vfi,vfj->fij", rest, rest)
        if rest.shape[1] == 1:
            products = np.tensordot(wanted, rest[:, 0], axes=(0, 0))
        else:
            products = np.einsum("vfi,vfj->fij", wanted, rest)

        start = self._start(vertices, weights) if helper.blend is None else helper.blend
        helper.blend, motion = self._descended(start, squares, products)
        return motion

    def _descended(self, blend: Blend, squares: np.ndarray, products: np.ndarray) -> tuple[Blend, np.ndarray]:
        """Minimises the sum over vertices, starting from a blend. Returns the blend and its motion.

        squares, products  of the sum, as in _fitted()
        """

        def error(motion: np.ndarray) -> float:
            return float(((motion @ squares - 2.0 * products) * motion).sum())

        motion = self._blended(blend)
        least, damping = error(motion), _DAMPING
        for _step in range(_STEPS if len(blend.bones) > 1 else 0):
            numbers, slopes = self._numbers(blend), self._slopes(blend, motion)
            gradient = np.einsum("bfij,fij->b", slopes, motion @ squares - products)
            curvature = np.einsum("bfij,cfij->bc", slopes @ squares, slopes)
            size = np.trace(curvature) / len(gradient)
            if not size > 0.0:
                break
            for _try in range(_TRIES):
                step = np.linalg.solve(curvature + damping * size * np.identity(len(gradient)), -gradient)
                ahead = self._at(blend, numbers + step)
                moved = self._blended(ahead)
                now = error(moved)
                if now < least:
                    break
                damping *= 8.0
            else:
                break
            change = np.abs(self._numbers(ahead) - numbers).max()
            blend, motion, least, damping = ahead, moved, now, damping / 8.0
            if change < _CLOSE:
                break
        return blend, motion

    def _slopes(self, blend: Blend, motion: np.ndarray) -> np.ndarray:
        """float64 [n, frames, 3, 4]: derivatives of its motion with respect to each of its numbers."""
        slopes = []
        for at in range(len(blend.bones)):
            more = blend.weights.copy()
            more[at] += _DIFFERENCE
            slopes.append((self._blended(replace(blend, weights=more)) - motion) / _DIFFERENCE)
        if blend.is_centre:
            posed = self._linear(blend)
            for axis in range(3):
                slope = np.zeros_like(motion)
                slope[:, :, 3] = self._length * (posed[:, :, axis] - motion[:, :, axis])
                slopes.append(slope)
        return np.stack(slopes)

    def _linear(self, blend: Blend) -> np.ndarray:
        """float64 [frames, 3, 4]: the linear blend."""
        shares = blend.weights / blend.weights.sum()
        return np.einsum("b,fbij->fij", shares, self.motion.bones[:, blend.bones])

    def _numbers(self, blend: Blend) -> np.ndarray:
        """float64 [n]: the unknowns of a blend, weights and the position of a centre, scaled alike."""
        return np.concatenate([blend.weights, blend.head / self._length if blend.is_centre else []])

    def _at(self, blend: Blend, numbers: np.ndarray) -> Blend:
        """Returns the blend with other unknowns, as close to these as possible: weights not negative, of sum
        1."""
        weights, head = np.split(numbers, [len(blend.bones)])
        weights = np.maximum(weights, 0.0)
        total = weights.sum()
        return replace(
            blend,
            weights=weights / total if total > 0.0 else blend.weights,
            head=self._length * head if blend.is_centre else blend.head,
        )

    def _start(self, vertices: np.ndarray, weights: np.ndarray) -> Blend:
        """Returns the blend that moves the vertices together as their own weights do."""
        own = self.own[vertices]
        shares = self.own_weights[vertices] * weights[:, None]
        total = np.bincount(own[own >= 0], shares[own >= 0], minlength=self.motion.bones.shape[1])
        bones = np.argsort(-total, kind="stable")[:_MOST_BONES]
        bones = bones[total[bones] > 0.0]
        head = np.average(self.middle[vertices], axis=0, weights=weights + 1e-30)
        return Blend(bones, total[bones] / total[bones].sum(), head, not self._move_as_blends(vertices))

    def _move_as_blends(self, vertices: np.ndarray) -> bool:
        """Whether dual quaternion blending by the vertices' own weights leaves almost nothing of the error
        that linear blending has."""
        left = linear = 0.0
        for vertex in vertices:
            used = self.own[vertex] >= 0
            own = Blend(self.own[vertex][used], self.own_weights[vertex][used], self.middle[vertex])
            at = np.array([vertex])
            left += np.square(self._moved(self._blended(own), at) - self.targets[at]).sum()
            linear += np.square(self._moved(self._linear(own), at) - self.targets[at]).sum()
        return bool(left <= _NEXT_TO_NOTHING * linear)

    def _extrapolate(self, helper: Helper, old: Helper, further: float) -> None:
        assert helper.blend is not None
        assert old.blend is not None
        numbers = self._numbers(helper.blend)
        ahead = numbers + further * (numbers - self._numbers(old.blend))
        helper.blend = self._at(helper.blend, ahead)
        helper.motion = self._blended(helper.blend)
