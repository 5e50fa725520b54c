# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong, or fragile, in the weights of a mesh: where, what it means and what to do about it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from .influences import SMALLEST_WEIGHT_SUM, GroupWeights, Influences
from .rig import Weighting
from .vectors import dots

# Below this sum of weights what was painted by accident decides where a vertex goes.
SMALL_WEIGHT_SUM = 0.01
# What game engines take without a loss of speed or of influences.
USUAL_INFLUENCES = 4
# A bone turned by 180 degrees against the others, give or take this, is about to change sides.
DEGREES_FROM_HALF_TURN = 5.0
# Bones of less weight than this do not move a vertex far when they change sides.
WEIGHT_THAT_SHOWS = 0.05
# All that six influences can come in; of more, as many are tried.
MOST_ORDERS = 720


@dataclass(frozen=True)
class Finding:
    """One kind of fault.

    name      what programs say
    title     what people read
    vertices  int [n], sorted: the vertices that have it
    meaning   one sentence
    advice    one sentence, what to do
    groups    the vertex groups that have it, where it is theirs
    frames    where it was seen, for faults that depend on the pose
    """

    name: str
    title: str
    vertices: np.ndarray
    meaning: str
    advice: str
    groups: tuple[str, ...] = ()
    frames: tuple[float, ...] = ()

    @property
    def count(self) -> int:
        """Of the vertices, or of the groups where there are any."""
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
    """What is found without looking at a pose; only what there is.

    points       [vertices, 3], rest points in armature space
    weights      the mesh's groups as stored
    group_names  of those groups
    masks        names of groups that something else than a bone uses
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
            f"More than {most_influences} influences",
            np.flatnonzero(counts > most_influences),
            f"More than {most_influences} bones move these vertices; game engines drop the smallest weights, "
            "and the shape differs there.",
            f"Use Weights > Limit Total with a limit of {most_influences}, then Normalize All.",
        ),
    ]
    boneless = [name for name in weighting.bones.without_one(group_names) if name not in masks]
    if boneless:
        numbers = [number for number, name in enumerate(group_names) if name in boneless]
        vertices = np.repeat(np.arange(len(weights.counts)), weights.counts)
        held = vertices[np.isin(weights.groups, numbers) & (weights.weights > 0.0)]
        findings.append(
            Finding(
                "boneless_groups",
                "Groups without a bone",
                np.unique(held),
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
        "Three or more bones are turned so far apart that dual quaternion skinning goes another way round "
        "where a vertex's groups were assigned in another order, as copied or mirrored weights may be.",
        "Take the bone that is turned farthest out of these vertices, or spread the turn over more bones.",
    ),
    "near_half_turn": (
        "Close to a half turn between bones",
        f"A bone is within {DEGREES_FROM_HALF_TURN:g} degrees of a half turn against the others, where both "
        "ways round are as short: a small change of the pose makes dual quaternion skinning jump.",
        "Spread the turn over twist bones, or keep these poses away from a half turn.",
    ),
    "jumps": (
        "Dual quaternions change sides in the action",
        "A bone turns past a half turn against the others: from one frame to the next dual quaternion "
        "skinning jumps to the other way round.",
        "Spread the turn over twist bones, keep it below a half turn, or use linear blend here.",
    ),
}


class PoseCheck:
    """Looks at poses, one after the other, for vertices whose dual quaternions are about to change sides.

    A dual quaternion and its negative are one motion. Dual quaternion skinning takes each bone's on the side
    of the sum of those before it, in the order of the vertex's groups.
    """

    def __init__(self, influences: Influences) -> None:
        """influences  over bones and joints, in stored order"""
        self._influences = influences
        self._vertices = np.repeat(np.arange(len(influences.counts)), influences.counts)
        self._shows = self._weighs_enough()
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self._seen: dict[str, tuple[np.ndarray, list[float]]] = {
            name: (np.zeros(len(influences.counts), dtype=bool), []) for name in _OF_POSES
        }

    def look(self, rotations: np.ndarray, frame: float) -> None:
        """One pose of an action, in the order of time.

        rotations  unit quaternions [4, bones + joints] of posed_from_rest
        """
        if self._last is not None:
            # A bone's quaternion may come on either side: here it goes on from where it was.
            rotations = rotations * np.where(dots(rotations, self._last[0]) < 0.0, -1.0, 1.0)
        terms = rotations.take(self._influences.bones, axis=1)
        sides, cosines, lengths = self._sides(terms)
        half_turn = np.sin(np.radians(0.5 * DEGREES_FROM_HALF_TURN))
        self._note("order_of_groups", self._depends_on_order(terms, sides), frame)
        near = self._with(self._shows & (cosines <= half_turn)) | (lengths <= half_turn)
        self._note("near_half_turn", near, frame)
        if self._last is not None:
            self._note("jumps", self._with(self._shows & (sides != self._last[1])), frame)
        self._last = (rotations, sides)

    def findings(self) -> list[Finding]:
        """What was seen in all poses; only what there is."""
        return [
            Finding(name, title, np.flatnonzero(seen), meaning, advice, frames=tuple(frames))
            for name, (title, meaning, advice) in _OF_POSES.items()
            for seen, frames in [self._seen[name]]
            if frames
        ]

    def _note(self, name: str, now: np.ndarray, frame: float) -> None:
        seen, frames = self._seen[name]
        if now.any():
            seen |= now
            frames.append(frame)

    def _with(self, chosen: np.ndarray) -> np.ndarray:
        """bool [vertices]: those that have a chosen influence."""
        result = np.zeros(len(self._influences.counts), dtype=bool)
        result[self._vertices[chosen]] = True
        return result

    def _weighs_enough(self) -> np.ndarray:
        """bool [influences]: those that are heavy enough, and come behind enough, to show on either side."""
        weights = self._influences.weights.astype(np.float64)
        before = np.cumsum(weights) - weights
        before -= before[self._influences.offsets[self._vertices]]
        whole = np.bincount(self._vertices, weights=weights, minlength=len(self._influences.counts))
        return np.minimum(weights, before) >= WEIGHT_THAT_SHOWS * whole[self._vertices]

    def _sides(self, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The side of each influence (1 or -1) and the size of its cosine with the sum of those before it,
        [influences]; the length of each vertex's whole sum as a part of its weights, [vertices]."""
        influences = self._influences
        sides, cosines = np.ones((2, len(influences.bones)))
        sums = np.zeros((4, len(influences.counts)))
        wholes = np.zeros(len(influences.counts))
        counts = influences.counts
        for rank in range(int(counts.max(initial=0))):
            vertices = np.flatnonzero(counts > rank)
            places = influences.offsets[vertices] + rank
            own, before = terms.take(places, axis=1), sums.take(vertices, axis=1)
            along = dots(own, before)
            if rank > 0:
                cosines[places] = np.abs(along) / np.maximum(np.sqrt(dots(before, before)), 1e-12)
            side = np.where(along < 0.0, -1.0, 1.0)
            sides[places] = side
            sums[:, vertices] = before + side * influences.weights[places] * own
            wholes[vertices] += influences.weights[places]
        shares = np.sqrt(dots(sums, sums)) / np.maximum(wholes, 1e-12)
        return sides, cosines, np.where(wholes > 0.0, shares, 1.0)

    def _depends_on_order(self, terms: np.ndarray, sides: np.ndarray) -> np.ndarray:
        """bool [vertices]: another order of the influences puts some on other sides of the others."""
        influences = self._influences
        result = np.zeros(len(influences.counts), dtype=bool)
        for count in range(3, int(influences.counts.max(initial=0)) + 1):
            vertices = np.flatnonzero(influences.counts == count)
            places = influences.offsets[vertices][:, None] + np.arange(count)
            quaternions = terms[:, places] * sides[places]  # [4, vertices, count]
            products = np.einsum("ivj,ivk->vjk", quaternions, quaternions)
            # Where all agree in pairs, each lies on the side of any sum of others.
            unsure = np.flatnonzero((products < 0.0).any(axis=(1, 2)))
            if len(unsure):
                weighted = products[unsure] * influences.weights[places[unsure]][:, None, :]
                result[vertices[unsure]] = _some_order_differs(weighted)
        return result


def _some_order_differs(products: np.ndarray) -> np.ndarray:
    """bool [n]: whether taking terms in another order gives one another side.

    products  [n, terms, terms]: of row and column, times the column's weight; with all on the sides that the
              first order gives
    """
    count = products.shape[1]
    differs = np.zeros(len(products), dtype=bool)
    for order in _orders(count):
        sides = np.ones((len(products), count))
        for step in range(1, count):
            before = list(order[:step])
            along = (products[:, order[step], before] * sides[:, before]).sum(axis=1)
            sides[:, order[step]] = np.where(along < 0.0, -1.0, 1.0)
        differs |= (sides != sides[:, :1]).any(axis=1)
    return differs


def _orders(count: int) -> Iterator[Sequence[int]]:
    """All orders, or MOST_ORDERS from anywhere among them."""
    if count <= 6:
        yield from permutations(range(count))
        return
    generator = np.random.default_rng(count)
    for _ in range(MOST_ORDERS):
        yield generator.permutation(count).tolist()
