# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds what is wrong, or fragile, in the weights of a mesh: where, what it means, and what to do about
it."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from ...base.phrases import phrase
from ...skinning.influences import SMALLEST_WEIGHT_SUM, GroupWeights, Influences, owners_of
from ...skinning.rig import Weighting
from ...skinning.vectors import dots

# Below this sum, weights painted by accident decide how a vertex moves.
SMALL_WEIGHT_SUM = 0.01
# The limit of influences per vertex in most game engines.
USUAL_INFLUENCES = 4
# A bone rotated by 180 degrees against the others, within this tolerance, is about to change hemisphere.
DEGREES_FROM_180 = 5.0
# Bones with a smaller share of the weight move a vertex only slightly when they change hemisphere.
VISIBLE_SHARE = 0.05
# The number of orders of six influences. For more influences, this many random orders are tried.
MAX_ORDERS = 720


@dataclass(frozen=True)
class Finding:
    """One kind of fault.

    name      for programs
    title     for people
    vertices  int [n], sorted: the vertices that have it
    meaning   one sentence
    advice    one sentence, what to do
    groups    the vertex groups that have it, for faults of groups
    frames    the frames where it was seen, for faults that depend on the pose
    bone      the one that has it, for faults of one bone's weights
    """

    name: str
    title: str
    vertices: np.ndarray
    meaning: str
    advice: str
    groups: tuple[str, ...] = ()
    frames: tuple[float, ...] = ()
    bone: str = ""

    @property
    def key(self) -> str:
        """Tells it from all others of a mesh."""
        return f"{self.name} {self.bone}" if self.bone else self.name

    @property
    def count(self) -> int:
        """The number of vertices, or of groups for faults of groups."""
        return len(self.groups) or len(self.vertices)

    def to_dict(self) -> dict[str, object]:
        """For JSON."""
        return {
            "name": self.name,
            "title": self.title,
            "count": self.count,
            "vertices": self.vertices.tolist(),
            "groups": list(self.groups),
            "frames": list(self.frames),
            "bone": self.bone,
            "meaning": self.meaning,
            "advice": self.advice,
        }


def check_weights(
    weighting: Weighting,
    points: np.ndarray,
    weights: GroupWeights,
    group_names: Sequence[str],
    most_influences: int = USUAL_INFLUENCES,
    masks: Collection[str] = (),
) -> list[Finding]:
    """Returns the faults that do not depend on a pose and that the mesh has.

    points       [vertices, 3], rest points in armature space
    weights      the mesh's groups as stored
    group_names  of those groups
    masks        names of groups that a modifier or another feature uses, not a bone
    """
    counts, entries = weighting.influences(points).counts, weighting.entries
    painted = np.bincount(entries.vertices, weights=entries.weights, minlength=len(counts))
    small = (painted > 0.0) & (painted <= SMALL_WEIGHT_SUM)
    findings = [
        Finding(
            "no_weights",
            "Vertices without weights",
            np.flatnonzero((counts == 0) & ~small),
            "No bone moves these vertices: they stay at rest while the rest of the mesh leaves.",
            "Assign them to a bone's group, or parent the mesh again with automatic weights for them.",
        ),
        Finding(
            "small_sums",
            "Weights that sum to almost nothing",
            np.flatnonzero(small),
            f"Weights are scaled to a sum of 1, so a sum up to {SMALL_WEIGHT_SUM:g} lets remains of painting "
            f"decide; up to {SMALLEST_WEIGHT_SUM:g} the vertex stays at rest.",
            "Paint them properly, or use Weights > Normalize All in weight paint mode.",
        ),
        Finding(
            "many_influences",
            phrase("More than {count} influences", count=most_influences),
            np.flatnonzero(counts > most_influences),
            f"More than {most_influences} bones move these vertices; game engines drop the smallest weights, "
            "and the shape differs there.",
            phrase(
                "Use Weights > Limit Total with a limit of {count}, then Normalize All.",
                count=most_influences,
            ),
        ),
    ]
    boneless = [name for name in weighting.bones.groups_without_bone(group_names) if name not in masks]
    if boneless:
        numbers = [number for number, name in enumerate(group_names) if name in boneless]
        affected = owners_of(weights.counts)[np.isin(weights.groups, numbers) & (weights.weights > 0.0)]
        findings.append(
            Finding(
                "boneless_groups",
                "Groups without a bone",
                np.unique(affected),
                "No bone of the armature has the name of these groups, and nothing else uses them: their "
                "weights do nothing.",
                "Rename the group to its bone's name, or delete it.",
                groups=tuple(boneless),
            )
        )
    return [finding for finding in findings if finding.count]


# Faults that depend on the pose: title, meaning, advice.
_OF_POSES = {
    "order_of_groups": (
        "Dual quaternions depend on the order of groups",
        "Three or more bones are rotated so far apart that dual quaternion skinning rotates the other way "
        "where a vertex's groups were assigned in another order, as copied or mirrored weights may be.",
        "Take the bone with the largest rotation off these vertices, spread the rotation over more bones, or "
        "set Signs to Along the Chain.",
    ),
    "near_half_turn": (
        "Close to 180 degrees between bones",
        f"A bone is rotated by 180 degrees against the others, within {DEGREES_FROM_180:g} degrees. Both "
        "directions are equally short there: a small change of the pose makes dual quaternion skinning jump.",
        "Spread the rotation over twist bones, or keep these poses away from 180 degrees.",
    ),
    "jumps": (
        "Dual quaternions change hemisphere in the action",
        "A bone rotates past 180 degrees against the others: from one frame to the next, dual quaternion "
        "skinning jumps to the other direction of rotation.",
        "Spread the rotation over twist bones, keep it below 180 degrees, set Signs to Along the Chain, or "
        "use linear blend here.",
    ),
}


class PoseCheck:
    """Checks one pose after another for vertices whose dual quaternions are about to change hemisphere.

    A dual quaternion and its negative (its antipode) are the same rigid motion. Dual quaternion skinning
    gives each bone's dual quaternion the sign that brings it into the hemisphere of the sum of those before
    it, in the order of the vertex's groups.
    """

    def __init__(self, influences: Influences) -> None:
        """influences: over bones and joints of bendy bones, in stored order."""
        self._influences = influences
        self._vertices = owners_of(influences.counts)
        self._visible = self._visible_influences()
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self._seen: dict[str, tuple[np.ndarray, list[float]]] = {
            name: (np.zeros(len(influences.counts), dtype=bool), []) for name in _OF_POSES
        }

    def add_pose(self, rotations: np.ndarray, frame: float) -> None:
        """Checks one pose of an action; poses come in the order of time.

        rotations  unit quaternions [4, bones + joints] of posed_from_rest
        """
        if self._last is not None:
            # A bone's quaternion may come with either sign: take the one nearer to that of the last pose.
            rotations = rotations * np.where(dots(rotations, self._last[0]) < 0.0, -1.0, 1.0)
        terms = rotations.take(self._influences.bones, axis=1)
        signs, cosines, lengths = self._signs(terms)
        limit = np.sin(np.radians(0.5 * DEGREES_FROM_180))
        self._record("order_of_groups", self._depends_on_order(terms, signs), frame)
        near = self._vertices_with(self._visible & (cosines <= limit)) | (lengths <= limit)
        self._record("near_half_turn", near, frame)
        if self._last is not None:
            self._record("jumps", self._vertices_with(self._visible & (signs != self._last[1])), frame)
        self._last = (rotations, signs)

    def findings(self) -> list[Finding]:
        """The faults that were found in any of the poses."""
        return [
            Finding(name, title, np.flatnonzero(seen), meaning, advice, frames=tuple(frames))
            for name, (title, meaning, advice) in _OF_POSES.items()
            for seen, frames in [self._seen[name]]
            if frames
        ]

    def _record(self, name: str, now: np.ndarray, frame: float) -> None:
        seen, frames = self._seen[name]
        if now.any():
            seen |= now
            frames.append(frame)

    def _vertices_with(self, chosen: np.ndarray) -> np.ndarray:
        """bool [vertices]: those that have a chosen influence."""
        result = np.zeros(len(self._influences.counts), dtype=bool)
        result[self._vertices[chosen]] = True
        return result

    def _visible_influences(self) -> np.ndarray:
        """bool [influences]: those whose change of sign moves the vertex visibly: both their own weight and
        the sum of the weights before them are at least VISIBLE_SHARE of the vertex's."""
        weights = self._influences.weights.astype(np.float64)
        before = np.cumsum(weights) - weights
        before -= before[self._influences.offsets[self._vertices]]
        total = np.bincount(self._vertices, weights=weights, minlength=len(self._influences.counts))
        return np.minimum(weights, before) >= VISIBLE_SHARE * total[self._vertices]

    def _signs(self, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the sign of each influence (1 or -1) and the magnitude of its cosine with the sum of those
        before it, [influences]; and the length of each vertex's whole sum as a share of its weights,
        [vertices]."""
        influences = self._influences
        signs, cosines = np.ones((2, len(influences.bones)))
        sums = np.zeros((4, len(influences.counts)))
        totals = np.zeros(len(influences.counts))
        counts = influences.counts
        for rank in range(int(counts.max(initial=0))):
            vertices = np.flatnonzero(counts > rank)
            indices = influences.offsets[vertices] + rank
            own, before = terms.take(indices, axis=1), sums.take(vertices, axis=1)
            along = dots(own, before)
            if rank > 0:
                cosines[indices] = np.abs(along) / np.maximum(np.sqrt(dots(before, before)), 1e-12)
            sign = np.where(along < 0.0, -1.0, 1.0)
            signs[indices] = sign
            sums[:, vertices] = before + sign * influences.weights[indices] * own
            totals[vertices] += influences.weights[indices]
        shares = np.sqrt(dots(sums, sums)) / np.maximum(totals, 1e-12)
        return signs, cosines, np.where(totals > 0.0, shares, 1.0)

    def _depends_on_order(self, terms: np.ndarray, signs: np.ndarray) -> np.ndarray:
        """bool [vertices]: whether another order of the influences gives some of them other signs."""
        influences = self._influences
        result = np.zeros(len(influences.counts), dtype=bool)
        for count in range(3, int(influences.counts.max(initial=0)) + 1):
            vertices = np.flatnonzero(influences.counts == count)
            indices = influences.offsets[vertices][:, None] + np.arange(count)
            quaternions = terms[:, indices] * signs[indices]  # [4, vertices, count]
            products = np.einsum("ivj,ivk->vjk", quaternions, quaternions)
            # If all pairs are in one hemisphere, each is in the hemisphere of any sum of others.
            uncertain = np.flatnonzero((products < 0.0).any(axis=(1, 2)))
            if len(uncertain):
                weighted = products[uncertain] * influences.weights[indices[uncertain]][:, None, :]
                result[vertices[uncertain]] = _some_order_differs(weighted)
        return result


def _some_order_differs(products: np.ndarray) -> np.ndarray:
    """bool [n]: whether summing the terms in another order gives any of them another sign.

    products  [n, terms, terms]: dot products of row and column, times the column's weight; the terms have the
              signs of the stored order
    """
    count = products.shape[1]
    differs = np.zeros(len(products), dtype=bool)
    for order in _orders(count):
        signs = np.ones((len(products), count))
        for step in range(1, count):
            before = list(order[:step])
            along = (products[:, order[step], before] * signs[:, before]).sum(axis=1)
            signs[:, order[step]] = np.where(along < 0.0, -1.0, 1.0)
        differs |= (signs != signs[:, :1]).any(axis=1)
    return differs


def _orders(count: int) -> Iterator[Sequence[int]]:
    """Yields all orders of up to six influences, or MAX_ORDERS random orders of more."""
    if count <= 6:
        yield from permutations(range(count))
        return
    generator = np.random.default_rng(count)
    for _ in range(MAX_ORDERS):
        yield generator.permutation(count).tolist()
