# SPDX-License-Identifier: GPL-3.0-or-later
"""The measures of one joint: of the part of the surface that a joint bends, in one pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...skinning.surface import Surface
from ..measure.character import Character, Place
from ..measure.metrics import LEAST_IN_RING, FrameOfRig, Gauge, Measured, Shape

Crossings = Callable[[np.ndarray, np.ndarray], set[tuple[int, int]]]
"""Of points [vertices, 3] and triangles [n, 3]: the pairs that cross and share no vertex."""

# A vertex is bent where what moves with the joint has more than this share of its weights, and less than all
# but this.
BENT = 0.02
# Rings of the surface, by the share of what moves with the joint.
RINGS = (0.2, 0.4, 0.6, 0.8)
# In girths; vertices at a seam may all be at one place.
LEAST_SPREAD = 0.2
# Edges that are shorter than this part of the girth count as so long: of a short one, any change is large.
SHORT = 0.2
# Fewer bent triangles are a hinge between rigid parts.
LEAST_TRIANGLES = 8
# Of fewer, one that is flipped is a large share.
ENOUGH_FOR_SHARES = 24


class Region:
    """The part of a character that one joint bends.

    vertices, triangles  int, their numbers in the whole
    """

    def __init__(self, character: Character, bone: int) -> None:
        self.character, self.bone = character, bone
        surface = character.surface
        carried = character.skeleton.carried[bone]
        shares = character.weights[:, carried].sum(axis=1)
        of_corners = shares[surface.triangles]
        is_bent = (of_corners.max(axis=1) > BENT) & (of_corners.min(axis=1) < 1.0 - BENT)
        self.triangles = np.flatnonzero(is_bent)
        self.vertices, corners = np.unique(surface.triangles[is_bent], return_inverse=True)
        self._corners = corners.reshape(-1, 3).astype(np.int32)
        self.shares = shares[self.vertices]
        # Otherwise it moves flesh, as a breast's, and no limb.
        self._has_limb = bool(shares.max(initial=0.0) >= 1.0 - BENT)

    @property
    def is_empty(self) -> bool:
        return len(self.triangles) < LEAST_TRIANGLES

    @cached_property
    def surface(self) -> Surface:
        whole, count = self.character.surface, len(self.vertices)
        number = np.full(whole.vertex_count, -1, np.int32)
        number[self.vertices] = np.arange(count)
        edges = number[whole.edges]
        edges = edges[(edges >= 0).all(axis=1)]
        bent = self.shares[edges]
        edges = edges[(bent.max(axis=1) > BENT) & (bent.min(axis=1) < 1.0 - BENT)]
        coincident = None
        if whole.coincident is not None:
            _places, first, index = np.unique(
                whole.coincident[self.vertices], return_index=True, return_inverse=True
            )
            coincident = first[index]
        return Surface(count, self._corners, edges, coincident)

    @cached_property
    def gauge(self) -> Gauge:
        return Gauge(self.surface, self.character.influences.of_vertices(self.vertices))

    @cached_property
    def rest(self) -> Shape:
        return Shape(self.surface, self.character.points[self.vertices])

    @cached_property
    def girth(self) -> float:
        """The mean distance of the bent vertices from the axes of their bones at rest, in the unit of the
        points."""
        bones = self.character.heaviest[self.vertices]
        known = np.flatnonzero(bones >= 0)
        distances = self.character.skeleton.distances(
            self.character.points[self.vertices[known]], bones[known]
        )
        size = float(np.ptp(self.rest.points, axis=1).max(initial=0.0))
        return max(float(distances.mean()) if len(known) else 0.0, 0.05 * size, 1e-9)

    @cached_property
    def rings(self) -> list[np.ndarray]:
        """Each int [n], vertices of the region."""
        edges = zip((0.0, *RINGS), (*RINGS, 1.0), strict=True)
        taken = [np.flatnonzero((self.shares > a) & (self.shares <= b)) for a, b in edges][1:-1]
        return [
            ring
            for ring in taken
            if len(ring) >= LEAST_IN_RING and _spread(self.rest, ring) > LEAST_SPREAD * self.girth
        ]

    def pivot(self, left_out: np.ndarray | None = None) -> float:
        """How far the bone's head is from the middle of what it bends, in spreads of that; 0 where no vertex
        follows the bone alone.

        left_out  bool [vertices of the character] that do not count; None for none
        """
        weights = self.shares * (1.0 - self.shares)
        if left_out is not None:
            weights = np.where(left_out[self.vertices], 0.0, weights)
        total = float(weights.sum())
        if total < 1.0 or not self._has_limb:
            return 0.0
        points = self.rest.points
        middle = (points * weights).sum(axis=1) / total
        spread = np.sqrt((((points.T - middle) ** 2).sum(axis=1) * weights).sum() / total)
        head = self.character.skeleton.heads[self.bone]
        return float(np.linalg.norm(head - middle) / max(spread, 1e-12))

    def crossing(self, points: np.ndarray, crossings: Crossings) -> set[tuple[int, int]]:
        """Pairs of the region's triangles that cross, for its points [vertices of the region, 3]."""
        surface = self.surface
        first = surface.coincident
        # Parts that only a seam divides do not cross.
        return crossings(points, surface.triangles if first is None else first[surface.triangles])

    def measure(
        self,
        frame: FrameOfRig,
        points: np.ndarray,
        crossings: Crossings,
        at_rest: set[tuple[int, int]],
    ) -> dict[str, tuple[float, Place]]:
        """Returns each measure that depends on the pose and that the region has, with its place, in the units
        of limits.LIMITS: volumes, flips and crossings are shares of the region, `radius` and `stretch`
        ratios, `bulge` is in girths.

        frame      of the whole character
        points     float [vertices, 3] of the whole, posed
        crossings  finds triangles that cross
        at_rest    its pairs at rest, which do not count
        """
        own = points[self.vertices]
        if not np.isfinite(own).all():
            lost = int(np.flatnonzero(~np.isfinite(own).all(axis=1))[0])
            return {"stretch": (float("inf"), self._place(lost))}
        pose = self.gauge.pose_of(replace(frame, rest=self.rest.points.T))
        shape = Shape(self.surface, own)
        measured = Measured(pose, shape, None)
        found: dict[str, tuple[float, Place]] = {}
        rest = self.rest
        # All that does not bend is rigid, so the whole changes as the region does; of a tube, half the area
        # times the girth is the volume.
        whole = Shape(self.character.surface, points).volume - self.character.rest.volume
        change = whole / max(0.5 * rest.area * self.girth, 1e-30)
        # What is turned inside out has lost all, and no more.
        found["volume_loss"] = min(max(-change, 0.0), 1.0), self.middle
        found["volume_gain"] = max(change, 0.0), self.middle
        ratios = [_spread(shape, ring) / max(_spread(rest, ring), 1e-12) for ring in self.rings]
        if ratios:
            least = int(np.argmin(ratios))
            found["radius"] = (ratios[least], self._place(int(self.rings[least][0])))
        if len(self.surface.edges):
            grown = (shape.lengths - rest.lengths) / np.maximum(rest.lengths, SHORT * self.girth)
            edge = int(grown.argmax())
            found["stretch"] = (1.0 + float(grown[edge]), self._place(int(self.surface.edges[edge, 0])))
        bulge = measured.bulge / self.girth
        found["bulge"] = (float(bulge.max(initial=0.0)), self._place(int(bulge.argmax())))
        if len(self.triangles) < ENOUGH_FOR_SHARES:
            return found
        found["flips"] = self._share(measured.flipped)
        pairs = np.array(list(self.crossing(own, crossings) - at_rest), np.int64).reshape(-1, 2)
        crossed = np.zeros(len(self.triangles), bool)
        crossed[pairs.ravel()] = True
        found["crossings"] = self._share(crossed)
        return found

    @cached_property
    def middle(self) -> Place:
        return self._place(int(np.argmin(np.abs(self.shares - 0.5))))

    def _share(self, triangles: np.ndarray) -> tuple[float, Place]:
        """triangles: bool [triangles of the region]."""
        areas = self.rest.areas
        numbers = np.flatnonzero(triangles)
        worst = int(numbers[areas[numbers].argmax()]) if len(numbers) else 0
        return float(areas[numbers].sum() / max(areas.sum(), 1e-30)), self._place(
            int(self.surface.triangles[worst, 0])
        )

    def _place(self, vertex: int) -> Place:
        number = int(self.vertices[vertex])
        return Place(number, self.character.points[number])


def _spread(shape: Shape, ring: np.ndarray) -> float:
    points = shape.points[:, ring]
    offsets = points - points.mean(axis=1, keepdims=True)
    return float(np.sqrt((offsets * offsets).sum(axis=0).mean()))
