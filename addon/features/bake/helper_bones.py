# SPDX-License-Identifier: GPL-3.0-or-later
"""Any deformation as linear blend skinning: finds helper bones in addition to a rig's own, their motions and
all weights.

After B. H. Le and Z. Deng, *Smooth skinning decomposition with rigid bones* (2012): motions and weights are
solved alternately, each exactly while the other is fixed, so that the error falls with every step. Unlike
there, the rig's bones keep their motions, and a helper bone starts where the error is largest.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.errors import SinewError
from ...base.options import option
from ...base.phrases import Phrase, phrase
from ...skinning.influences import Influences
from ...skinning.vectors import distances_from_axes
from . import simplex
from .segment_bones import SegmentReport

# At most this many of the rig's bones, and of the helper bones, are tried for a vertex.
OWN_CANDIDATES, HELPER_CANDIDATES = 8, 8
# Vertices are weighted in chunks with this many numbers, to limit the memory.
_NUMBERS_AT_ONCE = 2**21
# The least scale of helper bones, for bones that are scaled to zero.
_SMALLEST_SCALE = 1e-3
_SEED_STEPS = 4
_SEED_VERTICES = 24
_LAST_SWEEPS = 24
# The last sweeps end when this many gain less than this share of the error.
_SWEEPS_WITHOUT_GAIN, _SMALL_GAIN = 4, 0.01
_SMALLEST_WEIGHT = 1e-4
_ROUNDING = 5e-7
# What is less is not written as a number.
_SHORTEST = 1e-4


@dataclass(frozen=True)
class Motion:
    """The deformation to be reproduced, in armature space.

    rest        float32 [frames or 1, vertices, 3]: the points that the armature deforms
    targets     float32 [frames, vertices, 3]: the deformed points
    bones       float64 [frames, bones, 3, 4]: each bone's motion from rest
    influences  of bones; vertices without influences stay at rest
    segments    float64 [bones, 2, 3], heads and tails at rest
    owners      int [bones]: each bone itself, or the bendy bone that it stands for; None where none is
    """

    rest: np.ndarray
    targets: np.ndarray
    bones: np.ndarray
    influences: Influences
    segments: np.ndarray
    owners: np.ndarray | None = None

    @property
    def diagonal(self) -> float:
        """Of the bounding box at rest."""
        return float(np.linalg.norm(np.ptp(self.rest[0], axis=0))) if self.rest.shape[1] else 0.0


@dataclass(frozen=True)
class Wanted:
    """The limits of a solution.

    helpers     the largest number of helper bones
    error       the rms error in scene units at which no more helper bones are added
    influences  the largest number per vertex
    """

    helpers: int
    error: float = 0.0
    influences: int = 4


@dataclass(frozen=True)
class Errors:
    """Errors over all vertices and frames, in scene units."""

    rms: float
    worst: float

    def times(self, unit: float) -> Errors:
        return Errors(unit * self.rms, unit * self.worst)

    @property
    def texts(self) -> tuple[str, str]:
        return _short(self.rms), _short(self.worst)


def _short(value: float) -> str:
    """Without an exponent."""
    return f"{value:.2g}" if value >= _SHORTEST or value == 0.0 else f"< {_SHORTEST:g}"


@dataclass(frozen=True)
class Blend:
    """How a helper bone follows the pose: it rotates as the dual quaternion blend of some of the rig's bones.

    bones      int [n]
    weights    float64 [n], not negative, of sum 1
    head       float64 [3], of the helper bone at rest, about which bones scale
    is_centre  linear blending moves the head, as it does optimised centres of rotation; otherwise the dual
               quaternion blend moves it
    """

    bones: np.ndarray
    weights: np.ndarray
    head: np.ndarray
    is_centre: bool = False


@dataclass(frozen=True)
class Solution:
    """The helper bones and all weights.

    motions  float64 [frames, helpers, 3, 4]: rigid except for the parent's scale
    parents  int [helpers], bones
    heads    float64 [helpers, 3]: the middle of the vertices that each moves
    bones    int [vertices, influences]: helpers are numbered after the rig's bones; -1 for none
    weights  float64 [vertices, influences], of sum 1 where there are any
    before   errors of linear blend skinning by the rig's bones with the original weights
    errors   float32 [vertices]: the rms error of each with the solution, over all frames
    errors_before  the same with the original weights
    blends   of the helper bones, where they follow the pose; otherwise empty
    """

    motions: np.ndarray
    parents: np.ndarray
    heads: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    before: Errors
    after: Errors
    errors: np.ndarray
    errors_before: np.ndarray
    blends: tuple[Blend, ...] = ()


KEYS, POSE = "keys", "pose"


@dataclass(frozen=True)
class HelperOptions:
    """What the user chooses.

    error  in percent of the diagonal, to be reached with as few as possible
    """

    motion: str = option(
        KEYS,
        "Motion",
        "What moves helper bones",
        choices=(
            (KEYS, "Keys", "Plain keys over these frames, of bones that do not change size: for any engine"),
            (POSE, "Pose", "Constraints by which they follow the pose: other animation has them, too"),
        ),
    )
    helpers: int = option(
        0, "Helper Bones", "How many each armature gets at most; 0: two a joint", soft_most=200
    )
    error: float = option(
        0.0,
        "Enough at Error",
        "No more helper bones are added once the error (RMS) is this much of the character's size; 0: all of "
        "them",
        kind="percent",
    )
    influences: int = option(
        4,
        "Influences",
        "How many bones move a vertex at most; most engines take four",
        least=1,
        soft_most=8,
    )

    def of(self, motion: Motion) -> Wanted:
        # Each weighted bone except the first has a joint with another.
        bones = motion.influences.bones
        joints = max(len(np.unique(bones if motion.owners is None else motion.owners[bones])) - 1, 0)
        return Wanted(self.helpers or 2 * joints, self.error / 100.0 * motion.diagonal, self.influences)


DEFAULT_HELPERS = HelperOptions()


@dataclass(frozen=True)
class Report:
    """The result for the user; lengths in scene units.

    diagonal                     of the meshes' bounding box at rest
    before, after                over the frames
    unseen_before, unseen_after  where helper bones follow the pose: over poses that they were not solved for
    segments                     of bendy bones, where there are any
    """

    armature: str
    helpers: int
    influences: int
    diagonal: float
    before: Errors
    after: Errors
    unseen_before: Errors | None = None
    unseen_after: Errors | None = None
    segments: SegmentReport | None = None

    @classmethod
    def of(
        cls,
        armature: str,
        solution: Solution,
        unit: float,
        diagonal: float,
        unseen: tuple[Errors, Errors] | None = None,
    ) -> Report:
        """Converts a solution to scene units.

        unit    of armature space, in scene units
        unseen  before and after, over poses that the solution was not made from
        """
        most = int((solution.weights > 0.0).sum(axis=1).max(initial=0))
        errors = (each.times(unit) for each in (solution.before, solution.after, *(unseen or ())))
        return cls(armature, len(solution.parents), most, diagonal, *errors)

    def sentences(self, unit: str) -> list[Phrase]:
        """unit: the name of a scene unit."""
        said = [self._sentence(unit)]
        if self.segments is not None:
            said.insert(0, self.segments.sentence(unit))
        if self.unseen_before is not None and self.unseen_after is not None:
            (rms, worst), (rms_before, worst_before) = self.unseen_after.texts, self.unseen_before.texts
            said.append(
                phrase(
                    "In other poses, which they were not made from: {rms} {unit} rms, {worst} at most; "
                    "linear blending has {rms_before} and {worst_before}",
                    unit=unit,
                    rms=rms,
                    worst=worst,
                    rms_before=rms_before,
                    worst_before=worst_before,
                )
            )
        return said

    def _sentence(self, unit: str) -> Phrase:
        (rms, worst), (rms_before, worst_before) = self.after.texts, self.before.texts
        size = self.diagonal or 1.0
        shares = (f"{_short(100.0 * each / size)} %" for each in (self.after.rms, self.after.worst))
        return phrase(
            "{name}: {count} helper bones; error {rms} {unit} rms, {worst} at most ({shares} of the diagonal)"
            "; linear blending had {rms_before} and {worst_before}",
            name=self.armature,
            count=self.helpers,
            unit=unit,
            rms=rms,
            worst=worst,
            shares=" / ".join(shares),
            rms_before=rms_before,
            worst_before=worst_before,
        )


def solve(
    motion: Motion, wanted: Wanted, solver_of: Callable[[Motion, int], Solver] | None = None
) -> Generator[float, None, Solution]:
    """Yields the progress, 0 to 1; returns the helper bones and the weights of all bones.

    solver_of  Solver, or a subclass that is restricted to motions of one kind

    Raises SinewError where helper bones are wanted for a shape that moves and no vertex has weights.
    """
    solver = (solver_of or Solver)(motion, wanted.influences)
    before = solver.errors(), solver.errors_of_vertices()
    for _part in solver.weigh():
        yield 0.0
    rounds = _rounds(wanted.helpers)
    steps = len(rounds) + _LAST_SWEEPS
    for number, count in enumerate(rounds):
        if solver.errors().rms <= max(wanted.error, solver.rounding):
            break
        if not len(solver.own):
            raise SinewError(
                "no bone has weights here, so helper bones would have none to hang under; add weights, or "
                "bake to mdd or pc2"
            )
        for _helper in range(count):
            solver.add_helper()
            yield (number + 0.3) / steps
        solver.move()
        for share in solver.weigh():
            yield (number + 0.3 + 0.7 * share) / steps
    if solver.helpers:
        for share in solver.refine():
            yield (len(rounds) + share * _LAST_SWEEPS) / steps
    yield 1.0
    return solver.solution(*before)


def _rounds(helpers: int) -> list[int]:
    """Returns how many are added in each round: half of the existing number."""
    rounds, count = [], 0
    while count < helpers:
        rounds.append(min(max(2, count // 2), helpers - count))
        count += rounds[-1]
    return rounds


@dataclass
class Helper:
    """One helper bone while it is solved.

    motion    float64 [frames, 3, 4]
    scale     float64 [frames], of its parent
    may_move  bool [vertices]
    blend     of the rig's bones that moves it; None for an independent motion
    """

    motion: np.ndarray
    parent: int
    scale: np.ndarray
    may_move: np.ndarray
    blend: Blend | None = None


@dataclass
class Solver:
    """Solves motions and weights alternately. Its vertices are those with weights; only errors are over all.

    targets         float32 [vertices, frames * 3]
    residual        float32 [vertices, frames * 3]: the current blend minus the targets
    bones, weights  [vertices, slots] of the current blend; -1 and 0 for none
    """

    motion: Motion
    most: int
    helpers: list[Helper] = field(default_factory=list)

    def __post_init__(self) -> None:
        influences = self.motion.influences
        self.deformed = np.flatnonzero(influences.counts > 0)
        own, weights = influences.padded()
        self.own, self.own_weights = own[self.deformed], weights[self.deformed]
        self.own_weights /= self.own_weights.sum(axis=1, keepdims=True)
        self.rest = np.ascontiguousarray(self.motion.rest[:, self.deformed].transpose(1, 0, 2), np.float64)
        frames = len(self.motion.targets)
        self.targets = np.ascontiguousarray(self.motion.targets[:, self.deformed].transpose(1, 0, 2))
        self.targets = self.targets.reshape(len(self.deformed), 3 * frames)
        self.middle = self.rest.mean(axis=1)
        # Errors of vertices without weights, which stay at rest in every pose.
        still = np.ones(len(influences.counts), dtype=bool)
        still[self.deformed] = False
        self.still = np.flatnonzero(still)
        apart = np.square(self.motion.rest[:, still] - self.motion.targets[:, still].astype(np.float64))
        self.still_squares = apart.sum(axis=2).T
        # What float32 leaves of an exact solution.
        self.rounding = _ROUNDING * float(np.abs(self.targets).max(initial=0.0))
        self.bones, self.weights = self.own, self.own_weights
        self.residual = self._residual_of(self.bones, self.weights)

    def errors(self) -> Errors:
        squares = np.square(self.residual).reshape(-1, 3).sum(axis=1)
        squares = np.concatenate([squares, self.still_squares.ravel()])
        if not len(squares):
            return Errors(0.0, 0.0)
        return Errors(float(np.sqrt(squares.mean(dtype=np.float64))), float(np.sqrt(squares.max())))

    def errors_of_vertices(self) -> np.ndarray:
        """float32 [vertices], rms over all frames."""
        squares = np.zeros(len(self.motion.influences.counts))
        squares[self.deformed] = np.square(self.residual).sum(axis=1)
        squares[self.still] = self.still_squares.sum(axis=1)
        return np.sqrt(squares / max(len(self.motion.targets), 1)).astype(np.float32)

    def refine(self) -> Generator[float, None, None]:
        """Solves motions and weights alternately, until little is gained; yields the progress, 0 to 1.

        Alone, these steps take hundreds of sweeps. Continuing in the direction of the last sweep takes far
        fewer; it goes further as long as that helps.
        """
        further, errors = 1.0, [self.errors().rms]
        for sweep in range(_LAST_SWEEPS):
            before = self._state
            self.move()
            if sweep:
                for helper, old in zip(self.helpers, before[0], strict=True):
                    self._extrapolate(helper, old, further)
            for share in self.weigh():
                yield (sweep + share) / _LAST_SWEEPS
            errors.append(self.errors().rms)
            if errors[-1] > errors[-2]:
                self._state, further, errors[-1] = before, 0.0, errors[-2]
            else:
                further += 0.5
            long_ago = errors[-1 - _SWEEPS_WITHOUT_GAIN :][0]
            if sweep >= _SWEEPS_WITHOUT_GAIN and errors[-1] > (1.0 - _SMALL_GAIN) * long_ago:
                break

    @property
    def _state(self) -> tuple[list[Helper], np.ndarray, np.ndarray, np.ndarray]:
        return [replace(helper) for helper in self.helpers], self.bones, self.weights, self.residual.copy()

    @_state.setter
    def _state(self, state: tuple[list[Helper], np.ndarray, np.ndarray, np.ndarray]) -> None:
        self.helpers, self.bones, self.weights, self.residual = state

    def _extrapolate(self, helper: Helper, old: Helper, further: float) -> None:
        """Moves a helper bone beyond its new motion, by `further` times its last change."""
        ahead = helper.motion + further * (helper.motion - old.motion)
        helper.motion = np.concatenate(
            [helper.scale[:, None, None] * _rotation_near(ahead[:, :, :3]), ahead[:, :, 3:]], axis=2
        )

    # --- Motions

    def add_helper(self) -> None:
        """Adds a helper bone where the error is largest; its weights are provisional until weigh()."""
        energy = np.square(self.residual).sum(axis=1)
        seed = int(energy.argmax())
        own = self.own[seed][self.own[seed] >= 0]
        may_move = np.asarray(np.isin(self.own, own).any(axis=1))
        eligible = np.flatnonzero(may_move)
        distances = np.square(self.middle[eligible] - self.middle[seed]).sum(axis=1)
        near = eligible[np.argsort(distances, kind="stable")[:_SEED_VERTICES]]
        middle = np.average(self.middle[near], axis=0, weights=energy[near] + 1e-30)
        parent = self._nearest_bone(middle, np.unique(own))
        motion = self.motion.bones[:, parent]
        scale = np.maximum(np.cbrt(np.abs(np.linalg.det(motion[:, :, :3]))), _SMALLEST_SCALE)
        helper = Helper(motion, parent, scale, may_move)
        # At first it moves only the vertices around the seed, rigidly.
        helper.motion = self._fitted(helper, near, np.ones(len(near)), self.targets[near].astype(np.float64))
        for _step in range(_SEED_STEPS):
            shares = self._best_shares(helper, eligible)
            taken = shares > _SMALLEST_WEIGHT
            if taken.sum() < 3:
                break
            vertices, weights = eligible[taken], shares[taken]
            others = (1.0 - weights)[:, None] * (self.residual[vertices] + self.targets[vertices])
            helper.motion = self._fitted(helper, vertices, weights, self.targets[vertices] - others)
        shares = self._best_shares(helper, eligible)
        change = self._moved(helper.motion, eligible) - self.targets[eligible] - self.residual[eligible]
        self.residual[eligible] += (shares[:, None] * change).astype(np.float32)
        self.helpers.append(helper)

    def move(self) -> None:
        """Finds the best motion of each helper bone, one after another, while weights and the other bones are
        fixed."""
        first = self.motion.bones.shape[1]
        for number, helper in enumerate(self.helpers):
            vertices, slots = np.nonzero(self.bones == first + number)
            if len(vertices) < 3:
                continue
            weights = self.weights[vertices, slots]
            was = weights[:, None] * self._moved(helper.motion, vertices)
            helper.motion = self._fitted(helper, vertices, weights, was - self.residual[vertices])
            now = weights[:, None] * self._moved(helper.motion, vertices)
            self.residual[vertices] += (now - was).astype(np.float32)

    def _nearest_bone(self, point: np.ndarray, bones: np.ndarray) -> int:
        heads, tails = self.motion.segments[bones].transpose(1, 2, 0)
        return int(bones[distances_from_axes(point[:, None], heads, tails - heads).argmin()])

    def _best_shares(self, helper: Helper, vertices: np.ndarray) -> np.ndarray:
        """float64 [vertices]: the best weight of the helper bone for each vertex, while the rest of the blend
        is scaled to sum 1."""
        residual = self.residual[vertices]
        change = self._moved(helper.motion, vertices) - self.targets[vertices] - residual
        return _share(residual, change)[0]

    def _fitted(
        self, helper: Helper, vertices: np.ndarray, weights: np.ndarray, wanted: np.ndarray
    ) -> np.ndarray:
        """float64 [frames, 3, 4]: the motion that, times `weights`, is nearest to `wanted` [vertices, frames
        * 3]; Le and Deng's equation 9, with the bone's scale."""
        rest = self.rest[vertices]
        frames = len(helper.scale)
        wanted = wanted.reshape(len(vertices), frames, 3)
        total = np.square(weights).sum()
        rest_middle = np.einsum("v,vfi->fi", np.square(weights), rest) / total
        middle = np.einsum("v,vfi->fi", weights, wanted) / total
        from_middle = (rest - rest_middle) * weights[:, None, None]
        aside = wanted - weights[:, None, None] * middle
        # cross[f, i, k]: products of the wanted position along i and the rest point along k.
        if rest.shape[1] == 1:
            cross = np.tensordot(aside, from_middle[:, 0], axes=(0, 0))
        else:
            cross = np.einsum("vfi,vfk->fik", aside, from_middle)
        # Keeps the previous motion where the vertices do not determine it.
        linear = helper.motion[:, :, :3] / helper.scale[:, None, None]
        cross += 1e-7 * np.square(from_middle).sum() * linear
        rotation = _rotation_near(cross)
        linear = helper.scale[:, None, None] * rotation
        translation = middle - np.einsum("fik,fk->fi", linear, np.broadcast_to(rest_middle, (frames, 3)))
        return np.concatenate([linear, translation[:, :, None]], axis=2)

    def _moved(self, motion: np.ndarray, vertices: np.ndarray) -> np.ndarray:
        """float64 [vertices, frames * 3]: moved by one bone's motion [frames, 3, 4]."""
        rest = self.rest[vertices]
        if rest.shape[1] == 1:
            # Not with numpy's product: see vectors.transformed().
            x, y, z = motion[:, :, :3].reshape(-1, 3).T
            moved = rest[:, 0, :1] * x
            moved += rest[:, 0, 1:2] * y
            moved += rest[:, 0, 2:] * z
        else:
            moved = np.einsum("vfk,fik->vfi", rest, motion[:, :, :3]).reshape(len(vertices), -1)
        moved += motion[:, :, 3].ravel()
        return moved

    # --- Weights

    def weigh(self) -> Generator[float, None, None]:
        """Finds the best weights of each vertex while all motions are fixed; yields the progress, 0 to 1."""
        parts, width = [], self.targets.shape[1] * (OWN_CANDIDATES + HELPER_CANDIDATES)
        chunk = max(_NUMBERS_AT_ONCE // max(width, 1), 32)
        for start in range(0, len(self.own), chunk):
            end = min(start + chunk, len(self.own))
            parts.append(self._weigh(np.arange(start, end)))
            yield end / len(self.own)
        if parts:
            self.bones = np.concatenate([bones for bones, _weights in parts])
            self.weights = np.concatenate([weights for _bones, weights in parts])

    def _weigh(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns bones and weights [vertices, most], and updates the residual."""
        candidates = self._candidates(vertices)
        errors = np.zeros((len(vertices), candidates.shape[1], self.targets.shape[1]))
        for bone in np.unique(candidates[candidates >= 0]):
            rows, slots = np.nonzero(candidates == bone)
            at = vertices[rows]
            errors[rows, slots] = self._moved(self._motion_of(int(bone)), at) - self.targets[at]
        grams = errors @ errors.transpose(0, 2, 1)
        weights = simplex.sparse_weights(grams, candidates >= 0, self.most)
        weights[weights < _SMALLEST_WEIGHT] = 0.0
        weights /= weights.sum(axis=1, keepdims=True)
        before = self._weights_of(vertices, candidates)
        # After the limit of influences, the result can be worse than that of the last round. Weights that are
        # exact stay as they are, to the last digit.
        exact = self.targets.shape[1] / 3 * self.rounding**2
        is_better = simplex.objective(grams, before) < np.maximum(simplex.objective(grams, weights), exact)
        is_better &= ((before > 0.0).sum(axis=1) <= self.most) & (before.sum(axis=1) > 0.999)
        weights = np.where(is_better[:, None], before, weights)
        self.residual[vertices] = (weights[:, None] @ errors)[:, 0]
        order = np.argsort(-weights, axis=1, kind="stable")[:, : self.most]
        weights = np.take_along_axis(weights, order, axis=1)
        return np.where(weights > 0.0, np.take_along_axis(candidates, order, axis=1), -1), weights

    def _candidates(self, vertices: np.ndarray) -> np.ndarray:
        """int [vertices, candidates], -1 for none: each vertex's bones of the rig, its helper bones, and the
        helper bones that reduce its error most."""
        own = self.own[vertices, : max(OWN_CANDIDATES, self.most)]
        if not self.helpers:
            return own
        first = self.motion.bones.shape[1]
        gains = np.zeros((len(vertices), len(self.helpers)))
        for number, helper in enumerate(self.helpers):
            rows = np.flatnonzero(helper.may_move[vertices])
            at = vertices[rows]
            residual = self.residual[at]
            gains[rows, number] = _share(
                residual, self._moved(helper.motion, at) - self.targets[at] - residual
            )[1]
        present = self.bones[vertices]
        rows, slots = np.nonzero(present >= first)
        gains[rows, present[rows, slots] - first] = np.inf
        count = min(max(HELPER_CANDIDATES, self.most), len(self.helpers))
        best = np.argpartition(-gains, count - 1, axis=1)[:, :count]
        is_of_use = np.take_along_axis(gains, best, axis=1) > 0.0
        return np.concatenate([own, np.where(is_of_use, first + best, -1)], axis=1)

    def _weights_of(self, vertices: np.ndarray, candidates: np.ndarray) -> np.ndarray:
        """float64 [vertices, candidates]: the current weights of those bones that are candidates."""
        weights = np.zeros(candidates.shape)
        for bones, own in zip(self.bones[vertices].T, self.weights[vertices].T, strict=True):
            is_it = (candidates == bones[:, None]) & (bones >= 0)[:, None]
            weights += np.where(is_it, own[:, None], 0.0)
        return weights

    def _motion_of(self, bone: int) -> np.ndarray:
        count = self.motion.bones.shape[1]
        return self.motion.bones[:, bone] if bone < count else self.helpers[bone - count].motion

    def _residual_of(self, bones: np.ndarray, weights: np.ndarray) -> np.ndarray:
        residual = -self.targets.astype(np.float64)
        for bone in np.unique(bones[bones >= 0]):
            rows, slots = np.nonzero(bones == bone)
            residual[rows] += weights[rows, slots][:, None] * self._moved(self._motion_of(int(bone)), rows)
        return residual.astype(np.float32)

    # --- The result

    def solution(self, before: Errors, errors_before: np.ndarray) -> Solution:
        first = self.motion.bones.shape[1]
        used = np.unique(self.bones[self.bones >= first]) - first
        numbers = np.full(first + len(self.helpers), -1)
        numbers[:first] = np.arange(first)
        numbers[first + used] = first + np.arange(len(used))
        helpers = [self.helpers[number] for number in used]
        vertices = len(self.motion.influences.counts)
        bones, weights = np.full((vertices, self.most), -1), np.zeros((vertices, self.most))
        slots = slice(0, self.bones.shape[1])
        bones[self.deformed, slots] = np.where(self.bones >= 0, numbers[self.bones], -1)
        weights[self.deformed, slots] = self.weights
        frames = len(self.motion.targets)
        return Solution(
            np.array([helper.motion for helper in helpers]).reshape(-1, frames, 3, 4).swapaxes(0, 1),
            np.array([helper.parent for helper in helpers], dtype=int),
            np.array([self._head(first + number) for number in used]).reshape(-1, 3),
            bones,
            weights,
            before,
            self.errors(),
            self.errors_of_vertices(),
            errors_before,
            tuple(helper.blend for helper in helpers if helper.blend is not None),
        )

    def _head(self, bone: int) -> np.ndarray:
        blend = self.helpers[bone - self.motion.bones.shape[1]].blend
        if blend is not None:
            return blend.head
        vertices, slots = np.nonzero(self.bones == bone)
        return np.average(self.middle[vertices], axis=0, weights=self.weights[vertices, slots])


def _rotation_near(matrices: np.ndarray) -> np.ndarray:
    """float64 [n, 3, 3]: the rotation R with the largest trace of R^T M, for each matrix M."""
    u, _sizes, v = np.linalg.svd(matrices)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
    return u @ v


def _share(residual: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """float64 [rows]: the share of a change, 0 to 1, that minimises a residual, and the decrease of its
    square."""
    toward = -np.einsum("vx,vx->v", residual, change)
    length = np.einsum("vx,vx->v", change, change)
    share = np.clip(toward / np.maximum(length, 1e-30), 0.0, 1.0)
    return share, share * (2.0 * toward - share * length)
