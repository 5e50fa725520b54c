# SPDX-License-Identifier: GPL-3.0-or-later
"""What the weights and bones of a character tell before anything is posed, joint by joint."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...skinning.surface import components
from .character import Character, Place
from .limits import LIMITS

# A weight that is no more than this moves a vertex by too little to be seen.
SEEN = 0.03
# A vertex is on a bone's other side where it is farther from the middle than this share of the bone.
BEYOND = 0.5
# A mesh is the same on both sides where so many of its vertices have a mirror image, as near as this share of
# the diagonal.
SYMMETRIC, NEAR = 0.9, 1e-3
# Of a rig's pairs of bones, so many are rolled alike, within as many degrees.
CUSTOM, ROLLED = 0.8, 10.0


class Value(NamedTuple):
    """What one check measures at one bone.

    vertices  int [n], those that are concerned
    """

    name: str
    bone: int
    value: float
    place: Place | None = None
    vertices: np.ndarray = np.zeros(0, int)


class _Sides(NamedTuple):
    """Of a rig with bones of two sides.

    left, right  int [pairs], bones
    across       [3], from the right to the left, of length 1
    middle       [3], a point of the plane between
    """

    left: np.ndarray
    right: np.ndarray
    across: np.ndarray
    middle: np.ndarray


class WeightCheck:
    def __init__(self, character: Character) -> None:
        self._character, self._skeleton = character, character.skeleton
        self._moving = np.flatnonzero(character.moving)

    def stray(self) -> Iterator[Value]:
        """Weights of bones where these should have none."""
        if len(self._moving):
            yield from self._bleeding()
            yield from self._astray()
        for sides in map(self._sides_of, np.unique(self._skeleton.rig)):
            if sides is not None:
                yield from self._other_side(sides)

    def values(self) -> Iterator[Value]:
        yield from self._unweighted()
        yield from self._inert()
        if len(self._moving):
            yield from self._astray()
            yield from self._bleeding()
        for sides in map(self._sides_of, np.unique(self._skeleton.rig)):
            if sides is not None:
                yield from self._rolls(sides)
                yield from self._other_side(sides)
                yield from self._asymmetry(sides)

    @cached_property
    def _distances(self) -> np.ndarray:
        """float32 [vertices, bones]: from the axes of the bones that move vertices; infinite from others."""
        points = self._character.points
        found = np.full((len(points), len(self._skeleton.names)), np.inf, np.float32)
        for bone in self._moving:
            found[:, bone] = self._skeleton.distances(points, np.full(len(points), bone))
        return found

    @cached_property
    def _sizes(self) -> np.ndarray:
        """float64 [bones]: the girth of what is around each bone, whatever it follows, or a part of its
        length."""
        nearest = self._distances.argmin(axis=1)
        found = 0.3 * self._skeleton.lengths
        for bone in self._moving:
            around = self._distances[nearest == bone, bone]
            if not len(around):
                around = self._distances[self._character.heaviest == bone, bone]
            if len(around):
                found[bone] = max(found[bone], float(np.median(around)))
        return np.maximum(found, 1e-9)

    def _place(self, vertex: int) -> Place:
        return Place(int(vertex), self._character.points[vertex])

    def _unweighted(self) -> Iterator[Value]:
        """How many vertices no bone moves, by the bone that is nearest."""
        bare = np.flatnonzero(self._character.heaviest < 0)
        if not len(bare):
            return
        bones = self._moving if len(self._moving) else np.flatnonzero(self._skeleton.deform)
        if not len(bones):
            return
        points = self._character.points[bare]
        apart = [self._skeleton.distances(points, np.full(len(bare), bone)) for bone in bones]
        nearest = bones[np.argmin(apart, axis=0)]
        for bone in np.unique(nearest):
            own = bare[nearest == bone]
            yield Value("unweighted", int(bone), float(len(own)), self._place(own[0]), own)

    def _inert(self) -> Iterator[Value]:
        """Bones without weights whose other side has some."""
        moving, mirror = self._character.moving, self._skeleton.mirror
        for bone in np.flatnonzero(~moving & (mirror >= 0)):
            if moving[mirror[bone]]:
                yield Value("inert", int(bone), 1.0)

    @cached_property
    def _beyond(self) -> np.ndarray:
        """float64 [vertices]: how much farther each is from the bone that it follows most than from the
        nearest, in girths of that bone, times how much more it follows it: two that share a vertex alike are
        both right."""
        character = self._character
        weighted = np.flatnonzero(character.heaviest >= 0)
        heaviest, nearest = character.heaviest[weighted], self._distances[weighted].argmin(axis=1)
        beyond = self._distances[weighted, heaviest] - self._distances[weighted, nearest]
        beyond *= character.weights[weighted, heaviest] - character.weights[weighted, nearest]
        found = np.zeros(len(character.points))
        found[weighted] = beyond / self._sizes[heaviest]
        return found

    def _astray(self) -> Iterator[Value]:
        """Vertices that follow a bone most though others are much nearer."""
        heaviest = self._character.heaviest
        for bone in np.unique(heaviest[heaviest >= 0]):
            core = np.flatnonzero(heaviest == bone)
            values = self._beyond[core]
            worst = int(values.argmax())
            patch = core[values > 0.5 * values[worst]]
            yield Value("astray", int(bone), float(values[worst]), self._place(core[worst]), patch)

    def _bleeding(self) -> Iterator[Value]:
        """How far over the surface vertices are from those that follow a bone most, without weights of that
        bone on the way; in sizes of the bone."""
        character, skeleton = self._character, self._skeleton
        pairs, astray = character.joined, LIMITS["astray"].value
        for bone in self._moving:
            weights = character.weights[:, bone]
            core = (character.heaviest == bone) & (weights > SEEN) & (self._beyond <= astray)
            some = weights > SEEN
            if not core.any() or core.all():
                continue
            inner = pairs[some[pairs].all(axis=1)]
            of_part = components(len(some), inner)
            far = np.flatnonzero(some & ~np.isin(of_part, np.unique(of_part[core])))
            if not len(far):
                continue
            size = max(float(skeleton.lengths[bone]), float(self._sizes[bone]))
            apart = _nearest(character.points[far], character.points[core])
            suspect = far[apart > 0.5 * size]
            if not len(suspect):
                continue
            over = _over_surface(character.points, pairs, core, suspect)
            # Another shell is as far as it is through the air.
            over = np.where(np.isfinite(over), over, apart[apart > 0.5 * size]) / size
            seen = over * np.minimum(weights[suspect] / 0.1, 1.0)
            worst = int(seen.argmax())
            yield Value("bleed", int(bone), float(seen[worst]), self._place(suspect[worst]), suspect)

    def _sides_of(self, rig: int) -> _Sides | None:
        """None where no bones have another side."""
        skeleton = self._skeleton
        left = np.flatnonzero((skeleton.rig == rig) & (skeleton.mirror >= 0) & (skeleton.side > 0))
        right = skeleton.mirror[left]
        across = (skeleton.heads[left] - skeleton.heads[right]).sum(axis=0)
        if not np.linalg.norm(across) > 0.0:
            return None
        middle = (0.5 * (skeleton.heads[left] + skeleton.heads[right])).mean(axis=0)
        return _Sides(left, right, across / np.linalg.norm(across), middle)

    def _other_side(self, sides: _Sides) -> Iterator[Value]:
        """The share of a bone's weights that is on the figure's other side."""
        character, skeleton = self._character, self._skeleton
        offsets = (character.points - sides.middle) @ sides.across
        for bone, sign in (*((b, 1.0) for b in sides.left), *((b, -1.0) for b in sides.right)):
            place = 0.5 * (skeleton.heads[bone] + skeleton.tails[bone]) - sides.middle
            own, weights = sign * float(place @ sides.across), character.weights[:, bone]
            total = float(weights.sum())
            if total > 0.0 and own > 0.0:
                wrong = sign * offsets < -BEYOND * own
                share = float(weights[wrong].sum()) / total
                if share > 0.0:
                    worst = int(np.argmax(np.where(wrong, weights, 0.0)))
                    there = np.flatnonzero(wrong & (weights > SEEN))
                    yield Value("other_side", int(bone), share, self._place(worst), there)

    def _rolls(self, sides: _Sides) -> Iterator[Value]:
        """By how much a bone is rolled against the mirror image of its other side, in degrees. Rigs whose
        axes are not mirrored are all rolled alike: what most pairs have counts as none."""
        skeleton = self._skeleton
        left, right, across, _middle = sides
        mirrored = np.identity(3) - 2.0 * np.outer(across, across)
        found: list[tuple[int, float]] = []
        for bone, other in zip(left, right, strict=True):
            own, image = skeleton.rest[bone, :3, :3], mirrored @ skeleton.rest[other, :3, :3]
            alike = own[:, 1] @ image[:, 1] > 0.99 * np.linalg.norm(own[:, 1]) * np.linalg.norm(image[:, 1])
            if alike and self._character.moving[bone]:
                # A mirror image of X points to the other side.
                angle = np.degrees(np.arctan2(-image[:, 0] @ own[:, 2], -image[:, 0] @ own[:, 0]))
                found.append((int(bone), float(angle)))
        steps = np.round([angle / 90.0 for _bone, angle in found]).astype(int) % 4
        usual = 90.0 * np.bincount(steps, minlength=4).argmax()
        rolled = [abs((angle - usual + 180.0) % 360.0 - 180.0) for _bone, angle in found]
        # Importers choose axes as they like: a rig without a custom has no bone that breaks it.
        if sum(each < ROLLED for each in rolled) >= CUSTOM * max(len(rolled), 1):
            for (bone, _angle), each in zip(found, rolled, strict=True):
                yield Value("roll", bone, each)

    def _asymmetry(self, sides: _Sides) -> Iterator[Value]:
        """The share of a bone's weights that differs from those of its other side, where the mesh is the same
        on both."""
        character, points = self._character, self._character.points
        left, right, across, middle = sides
        image = _matches(
            points, points - 2.0 * np.outer((points - middle) @ across, across), character.diagonal
        )
        first = character.surface.coincident
        first = np.arange(len(points)) if first is None else first
        # In folds of the skin, the nearest vertex may be the image of another.
        is_image = (image >= 0) & (first[image[image]] == first)
        moved = np.flatnonzero(character.weights[:, np.r_[left, right]].any(axis=1))
        known = moved[is_image[moved]]
        if len(known) < SYMMETRIC * len(moved) or not len(moved):
            return
        for bone, other in zip(left, right, strict=True):
            # Of vertices at one place, as of boxes that touch, any may be the image.
            weights = character.weights[:, [bone, other]]
            sums = np.stack([np.bincount(first, each, len(first)) for each in weights.T])
            means = (sums / np.maximum(np.bincount(first, minlength=len(first)), 1))[:, first]
            own, there = means[0, known], means[1, image[known]]
            differs = np.abs(own - there)
            total = max(float(own.sum()), float(there.sum()))
            if total > 0.0:
                worst = int(differs.argmax())
                yield Value(
                    "asymmetry",
                    int(bone),
                    float(differs.sum()) / total,
                    self._place(known[worst]),
                    known[differs > 0.1],
                )


def _nearest(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """float64 [n]: the distance of each of points [n, 3] from the nearest of the others."""
    found = np.empty(len(points))
    step = max(1, 2_000_000 // max(len(others), 1))
    squares = (others * others).sum(axis=1)
    for first in range(0, len(points), step):
        own = points[first : first + step]
        apart = squares - 2.0 * np.einsum("ik,jk->ij", own, others) + (own * own).sum(axis=1)[:, None]
        found[first : first + step] = np.sqrt(np.maximum(apart.min(axis=1), 0.0))
    return found


def _over_surface(points: np.ndarray, pairs: np.ndarray, core: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """float64 [wanted]: the length of the shortest way along edges to one of `core`, infinite without.

    core    bool [vertices]
    wanted  int, numbers of vertices
    """
    ends = np.concatenate([pairs, pairs[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    offsets = points[ends[:, 0]] - points[ends[:, 1]]
    lengths, others = np.sqrt(np.einsum("ij,ij->i", offsets, offsets)), ends[:, 1]
    counts = np.bincount(ends[:, 0], minlength=len(points))
    firsts = np.cumsum(counts) - counts
    found = np.where(core, 0.0, np.inf)
    changed = np.flatnonzero(core)
    # What is farther than all that are wanted shortens the way of none.
    while len(changed) and found[changed].min() < found[wanted].max():
        own = counts[changed]
        edges = np.repeat(firsts[changed] - (np.cumsum(own) - own), own) + np.arange(own.sum())
        through = np.repeat(found[changed], own) + lengths[edges]
        shorter = through < found[others[edges]]
        reached = others[edges[shorter]]
        np.minimum.at(found, reached, through[shorter])
        changed = np.unique(reached)
    return found[wanted]


def _matches(points: np.ndarray, wanted: np.ndarray, diagonal: float) -> np.ndarray:
    """int [n]: for each of `wanted` [n, 3] one of `points` at the same place, -1 for none."""
    size = max(NEAR * diagonal, 1e-12)
    least = np.minimum(points.min(axis=0), wanted.min(axis=0)) - 2.0 * size
    cells = np.array([1, 1 << 20, 1 << 40], np.int64)

    def keys(of: np.ndarray, shift: np.ndarray) -> np.ndarray:
        return (((of - least) / size).astype(np.int64) + shift) @ cells

    own = keys(points, np.zeros(3, np.int64))
    order = np.argsort(own, kind="stable")
    ordered = own[order]
    found = np.full(len(wanted), -1)
    best = np.full(len(wanted), size * size)
    for shift in np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3):
        at = np.searchsorted(ordered, keys(wanted, shift)).clip(max=len(ordered) - 1)
        candidate = order[at]
        offsets = points[candidate] - wanted
        squares = np.einsum("ij,ij->i", offsets, offsets)
        nearer = (ordered[at] == keys(wanted, shift)) & (squares < best)
        found[nearer], best[nearer] = candidate[nearer], squares[nearer]
    return found
