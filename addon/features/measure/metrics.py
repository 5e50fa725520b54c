# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of a deformed mesh against its rest shape; docs/metrics.md defines each.

Bind a Gauge to a mesh, set each frame's rest shape and bones, then measure any number of shapes:

    gauge = Gauge(surface, influences)
    gauge.set_frame(frame)
    measured = gauge.measure(points, other)
    measured.summary(), measured.field("stretch")
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ...skinning.influences import Influences, owners_of
from ...skinning.rig import Bones
from ...skinning.surface import Parts, Surface
from ...skinning.vectors import cross, distances_from_axes, dots, rotated, rotations_of


@dataclass(frozen=True)
class Metric:
    """A measure with a value at each vertex, which a heat map can show.

    name   for programs, such as Measured.field
    label  for people
    unit   "length" (that of the points), "ratio" or "share"
    scale  how values become colours: "linear" from 0, "signed" around 0, "log" around 1
    worst  the entry of a summary by which frames are compared: the largest magnitude is the worst
    text   one sentence
    """

    name: str
    label: str
    unit: str
    scale: str
    worst: str
    text: str


METRICS = {
    metric.name: metric
    for metric in (
        Metric(
            "distance",
            "Distance",
            "length",
            "linear",
            "distance_max",
            "The distance of each vertex from its position under the reference method.",
        ),
        Metric(
            "bulge",
            "Bulge",
            "length",
            "signed",
            "bulge_worst",
            "How much farther from its bone's axis a vertex lies than at rest: above zero the limb swells, "
            "below zero it collapses.",
        ),
        Metric(
            "stretch",
            "Edge stretch",
            "ratio",
            "log",
            "stretch_rms",
            "The length of a vertex's most changed edge, as a part of its length at rest.",
        ),
        Metric(
            "area",
            "Area",
            "ratio",
            "log",
            "area_rms",
            "The area of the faces around a vertex, as a part of their area at rest.",
        ),
        Metric(
            "flips",
            "Flipped faces",
            "share",
            "linear",
            "flipped_area",
            "The share of a vertex's faces that are flipped against the bones that move them.",
        ),
    )
}


# The squared length of a blend of rotations, below which its vertex is bent: halves of two that are 13
# degrees apart, or a tenth of one that is 22 degrees from the rest.
BENT = 0.9968
# Limbs of less volume count as having this share of all.
LEAST_LIMB = 1e-3
# Rings of a joint: parts of equal width of the way from one bone to the other, the first and the last of
# which are no rings; the least weights of both bones together; the fewest vertices.
RINGS = 5
OF_TWO = 0.7
LEAST_IN_RING = 6
# A ring that is a little narrower is hardly seen.
NARROW = 0.8


@dataclass(frozen=True)
class FrameOfRig:
    """The rest shape and the bones of one frame, all in one space, in whose unit lengths are measured.

    rest        [vertices, 3], the shape that the bones deform
    rest_axes   [bones, 2, 3], head and tail of each bone that an influence has, at rest
    posed_axes  [bones, 2, 3], the same in the pose
    motions     [bones, 3, 3], linear part of posed_from_rest
    """

    rest: np.ndarray
    rest_axes: np.ndarray
    posed_axes: np.ndarray
    motions: np.ndarray

    @classmethod
    def of(cls, rest: np.ndarray, rigs: Iterable[tuple[Bones, np.ndarray, np.ndarray]]) -> FrameOfRig:
        """rigs: the bones of each mesh, with their matrices [bones + joints, 4, 4] at rest and posed."""
        rest_axes, posed_axes, motions = [], [], []
        for bones, at_rest, posed in rigs:
            rest_axes.append(bone_axes(bones, at_rest))
            posed_axes.append(bone_axes(bones, posed))
            # An armature whose scale is zero or no number moves nothing that could be measured.
            is_finite = np.isfinite(at_rest).all(axis=(1, 2), keepdims=True)
            motions.append(posed[:, :3, :3] @ np.linalg.pinv(np.where(is_finite, at_rest, 0.0)[:, :3, :3]))
        return cls(rest, *map(np.concatenate, (rest_axes, posed_axes, motions)))

    @cached_property
    def rotations(self) -> np.ndarray:
        """Unit quaternions, float64 [4, bones]."""
        return rotations_of(self.motions)


@dataclass(frozen=True)
class Summary:
    """The measures of one shape as numbers; docs/metrics.md defines each. Lengths in the unit of the
    points."""

    distance_max: float
    distance_rms: float
    volume: float
    volume_change: float
    limb_change: float
    area: float
    area_change: float
    area_rms: float
    area_min: float
    area_max: float
    stretch_min: float
    stretch_max: float
    stretch_rms: float
    flipped_faces: int
    flipped_area: float
    bulge_min: float
    bulge_max: float

    @property
    def bulge_worst(self) -> float:
        return max(self.bulge_max, -self.bulge_min)

    def extremes(self, metric: str) -> tuple[float, float]:
        """Returns the bounds of one of METRICS over all vertices."""
        if metric == "distance":
            return 0.0, self.distance_max
        if metric == "flips":
            return 0.0, float(self.flipped_faces > 0)
        return getattr(self, f"{metric}_min"), getattr(self, f"{metric}_max")


class Gauge:
    """Measures shapes of one mesh against its rest shape."""

    def __init__(self, surface: Surface, influences: Influences) -> None:
        """influences: of every vertex of the surface, over the bones of FrameOfRig's arrays."""
        self.surface = surface
        self._rest: Shape | None = None
        self._skin = Skin(surface, influences)
        self._pose: Pose | None = None

    def set_frame(self, frame: FrameOfRig) -> None:
        """Sets the frame of the shapes to be measured next."""
        self._pose = self.pose_of(frame)

    def pose_of(self, frame: FrameOfRig) -> Pose:
        """Returns what measures of a frame share, for Measured; the frame that is set stays."""
        # The rest shape changes only with shape keys or the object's transform.
        same = self._pose is not None and frame.rest is self._pose.frame.rest
        rest = self._rest
        if rest is None or not (same or np.array_equal(frame.rest.T, rest.points)):
            rest = Shape(self.surface, frame.rest)
        self._rest = rest
        return Pose(self._skin, rest, frame)

    @property
    def rest(self) -> Shape:
        """The rest shape of the frame set last."""
        assert self._pose is not None, "set_frame() comes first"
        return self._pose.rest

    def measure(
        self, points: np.ndarray, other: np.ndarray | Callable[[], np.ndarray] | None = None
    ) -> Measured:
        """Measures a shape [vertices, 3] in the frame set last. Distances are to the shape `other`, or to the
        one that it returns.

        Each measure is computed when it is first read.
        """
        assert self._pose is not None, "set_frame() comes first"
        return Measured(self._pose, Shape(self.surface, points), other)


class Skin:
    """Which bones move which vertices.

    weighted  int [weighted], the vertices that have influences
    starts    int64 [weighted], the index of the first influence of each
    heaviest  int [weighted], the bone with the largest weight of each, the first of equals
    """

    def __init__(self, surface: Surface, influences: Influences) -> None:
        self.surface, self.influences = surface, influences
        self.weighted = np.flatnonzero(influences.counts)
        self.starts = influences.offsets[self.weighted].astype(np.int64)
        self.heaviest = _heaviest_bones(influences, self.weighted, self.starts)

    def distances_from_axes(self, points: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """float64 [weighted]: distances of points [3, vertices] from the axis of each vertex's heaviest
        bone."""
        heads = np.ascontiguousarray(axes[:, 0].T, dtype=np.float64)
        bones = np.ascontiguousarray((axes[:, 1] - axes[:, 0]).T, dtype=np.float64)
        heads, along = (each.take(self.heaviest, axis=1) for each in (heads, bones))
        return distances_from_axes(points.take(self.weighted, axis=1), heads, along)

    @cached_property
    def limbs(self) -> Parts:
        """The triangles that follow each bone."""
        return Parts.of(self.surface, self.limb_of_triangles)

    @cached_property
    def limb_of_vertices(self) -> np.ndarray:
        """int64 [vertices]: the heaviest bone of each; -1 for none."""
        of_vertices = np.full(self.surface.vertex_count, -1)
        of_vertices[self.weighted] = self.heaviest
        return of_vertices

    @cached_property
    def limb_of_triangles(self) -> np.ndarray:
        """int64 [triangles]: that of two of their corners, or of one where all differ."""
        return np.sort(self.limb_of_vertices[self.surface.triangles], axis=1)[:, 1]

    @cached_property
    def sole_bones(self) -> np.ndarray:
        """int32 [triangles]: the bone that alone moves all corners of each; -1 for none."""
        sole = np.where(self.influences.counts == 1, self.limb_of_vertices, -1).astype(np.int32)
        of_corners = sole[self.surface.triangles]
        return np.where((of_corners == of_corners[:, :1]).all(axis=1), of_corners[:, 0], np.int32(-1))

    @cached_property
    def rings(self) -> tuple[np.ndarray, np.ndarray]:
        """The rings of vertices around joints that two bones share alike.

        int64 [vertices], the ring of each, -1 for none; int64 [rings, 2], the bones of each.
        """
        of_vertices = np.full(self.surface.vertex_count, -1)
        owners = owners_of(self.influences.counts)
        order = np.lexsort((-self.influences.weights, owners))
        first = self.starts[self.influences.counts[self.weighted] > 1]
        two = order[first[:, None] + np.arange(2)]
        bones, weights = self.influences.bones[two], self.influences.weights[two]
        both = weights.sum(axis=1)
        is_first = bones[:, 0] < bones[:, 1]
        share = np.where(is_first, weights[:, 0], weights[:, 1]) / np.maximum(both, 1e-30)
        step = np.floor(share * RINGS).astype(np.int64)
        keys, ring, members = np.unique(
            np.column_stack([np.sort(bones, axis=1), step]), axis=0, return_inverse=True, return_counts=True
        )
        ring = ring.ravel()
        taken = (both > OF_TWO) & (step > 0) & (step < RINGS - 1) & (members >= LEAST_IN_RING)[ring]
        of_vertices[owners[first[taken]]] = ring[taken]
        return of_vertices, keys[:, :2]

    def ring_widths(self, points: np.ndarray) -> np.ndarray:
        """float64 [rings]: how wide each is where it is narrow: the standard deviation of its points, of all
        [3, vertices], along the second of the principal axes."""
        of_vertices, bones = self.rings
        members = np.flatnonzero(of_vertices >= 0)
        ring, count = of_vertices[members], len(bones)
        own, sizes = points[:, members], np.maximum(np.bincount(ring, minlength=count), 1)
        means = np.array([np.bincount(ring, each, count) for each in own]) / sizes
        offsets = own - means[:, ring]
        products = np.einsum("im,jm->mij", offsets, offsets).reshape(-1, 9)
        sums = np.column_stack([np.bincount(ring, each, count) for each in products.T])
        return np.sqrt(np.linalg.eigvalsh((sums / sizes[:, None]).reshape(-1, 3, 3))[:, 1].clip(min=0.0))

    def blended(self, rotations: np.ndarray) -> np.ndarray:
        """float32 [4, vertices]: the weighted sums of the bones' rotations, shorter where these differ.

        rotations  unit quaternions [4, bones]
        """
        # Only the sign of a dot product is needed: single precision is enough.
        rotations = rotations.astype(np.float32)
        blended = np.zeros((4, self.surface.vertex_count), dtype=np.float32)
        blended[0] = 1.0
        bones, weights = self.influences.bones, self.influences.weights
        heaviest = np.repeat(self.heaviest, self.influences.counts[self.weighted])
        terms = rotations.take(bones, axis=1)
        # All are brought into the hemisphere of the heaviest: a sum of two then never cancels.
        terms *= np.where(dots(terms, rotations.take(heaviest, axis=1)) < 0.0, -weights, weights)
        blended[:, self.weighted] = np.add.reduceat(terms, self.starts, axis=1)
        return blended

    def by_weights(self, of_limbs: np.ndarray) -> np.ndarray:
        """float64 [vertices]: values of limbs, blended by each vertex's weights of their bones."""
        bones = np.unique(self.limb_of_triangles)
        bones, influences = bones[bones >= 0], self.influences
        of_bones = np.zeros(max(influences.bones.max(initial=-1), bones.max(initial=-1)) + 1)
        of_bones[bones] = of_limbs
        terms = influences.weights * of_bones[influences.bones]
        return np.bincount(owners_of(influences.counts), terms, self.surface.vertex_count)

    def rotated_normals(self, normals: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """float32 [3, triangles]: normals, of any length, rotated by the bones of their corners.

        rotations  unit quaternions [4, bones]
        """
        vertex_rotations = self.blended(rotations)
        vertex_rotations /= np.maximum(np.sqrt(dots(vertex_rotations, vertex_rotations)), np.float32(1e-12))
        first, second, third = (vertex_rotations.take(corner, axis=1) for corner in self.surface.corners)
        one = np.float32(1.0)
        total = first + np.where(dots(first, second) < 0.0, -one, one) * second
        total += np.where(dots(first, third) < 0.0, -one, one) * third
        with np.errstate(over="ignore"):
            normals = normals.astype(np.float32)
        # A face with a non-finite coordinate has no normal.
        normals[~np.isfinite(normals)] = 0.0
        return rotated(total, normals)


class Pose:
    """What all measures of one frame share; each value is computed when it is first read."""

    def __init__(self, skin: Skin, rest: Shape, frame: FrameOfRig) -> None:
        self.skin, self.rest, self.frame = skin, rest, frame

    @cached_property
    def rest_distances(self) -> np.ndarray:
        """float64 [weighted]: distances from the axes at rest."""
        return self.skin.distances_from_axes(self.rest.points, self.frame.rest_axes)

    @cached_property
    def rotated_normals(self) -> np.ndarray:
        """float32 [3, triangles]: rest normals rotated by the bones."""
        return self.skin.rotated_normals(self.rest.normals, self.frame.rotations)

    @cached_property
    def rest_ring_widths(self) -> np.ndarray:
        """float64 [rings]"""
        return self.skin.ring_widths(self.rest.points)

    @cached_property
    def rest_limbs(self) -> np.ndarray:
        """float64 [limbs]: their volumes at rest."""
        return self.skin.limbs.volumes(self.rest.points, self.rest.normals)

    @cached_property
    def is_bent(self) -> np.ndarray:
        """bool [vertices]: those that bones move which rotate apart, and those whose neighbours other bones
        rotate otherwise."""
        blended = self.skin.blended(self.frame.rotations)
        squares, (first, second) = dots(blended, blended), self.skin.surface.ends
        cosines = dots(blended.take(first, axis=1), blended.take(second, axis=1))
        apart = cosines * cosines < BENT * squares[first] * squares[second]
        is_bent = squares < BENT
        is_bent[first[apart]] = is_bent[second[apart]] = True
        return is_bent

    @property
    def bone_count(self) -> int:
        return len(self.frame.motions)

    @cached_property
    def bent_areas(self) -> np.ndarray:
        """float64 [bones]: how much of the surface that follows each bone most is bent."""
        limbs = self.skin.limb_of_triangles
        taken = self.bent_triangles & (limbs >= 0)
        return np.bincount(limbs[taken], self.rest.areas[taken], self.bone_count)

    @cached_property
    def bent_edges(self) -> np.ndarray:
        """bool [edges]"""
        return self.is_bent[self.skin.surface.edges].any(axis=1)

    @cached_property
    def bent_triangles(self) -> np.ndarray:
        """bool [triangles]"""
        return self.is_bent[self.skin.surface.triangles].any(axis=1)


class Shape:
    """A surface at given points; each property is computed once, when it is first read.

    points  float64 [3, vertices]
    """

    def __init__(self, surface: Surface, points: np.ndarray) -> None:
        """points: [vertices, 3]."""
        self.surface = surface
        self.points = _by_axis(points)

    @cached_property
    def normals(self) -> np.ndarray:
        """float64 [3, triangles], pointing outwards, with a length of twice the triangle's area."""
        a, b, c = (self.points.take(corner, axis=1) for corner in self.surface.corners)
        return cross(b - a, c - a)

    @cached_property
    def areas(self) -> np.ndarray:
        """float64 [triangles]"""
        return 0.5 * np.sqrt(dots(self.normals, self.normals))

    @cached_property
    def lengths(self) -> np.ndarray:
        """float64 [edges]"""
        first, second = (self.points.take(end, axis=1) for end in self.surface.ends)
        along = second - first
        return np.sqrt(dots(along, along))

    @cached_property
    def folded(self) -> np.ndarray:
        """bool [triangles]: those more than 120 degrees from a neighbour."""
        first, second = self.surface.neighbours
        normals = self.normals / np.maximum(2.0 * self.areas, 1e-30)
        sharp = dots(normals.take(first, axis=1), normals.take(second, axis=1)) < -0.5
        found = np.zeros(len(self.surface.triangles), dtype=bool)
        found[first[sharp]] = found[second[sharp]] = True
        return found

    @cached_property
    def bends(self) -> np.ndarray:
        """float64 [pairs of neighbours]: the angles between their normals, in radians; 0 beside a triangle
        without area."""
        first, second = (self.normals.take(side, axis=1) for side in self.surface.neighbours)
        across = cross(first, second)
        return np.arctan2(np.sqrt(dots(across, across)), dots(first, second))

    @cached_property
    def volume(self) -> float:
        """In cubed units of the points; positive where faces point outwards. The sum of signed tetrahedra
        (divergence theorem); holes are closed by fans to the mean of their border."""
        if len(self.surface.triangles) == 0:
            return 0.0
        # Relative to the mean: far from the origin, the terms of a small mesh would be large and cancel.
        points = self.points - self.points.mean(axis=1, keepdims=True)
        inside = np.einsum("ij,ij->", points.take(self.surface.corners[0], axis=1), self.normals)
        return (float(inside) + float(self.surface.caps.volumes(points).sum())) / 6.0

    @cached_property
    def area(self) -> float:
        return float(self.areas.sum())

    @cached_property
    def diagonal(self) -> float:
        """The diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.points, axis=1))) if self.surface.vertex_count else 0.0


class Measured:
    """The measures of one shape: numbers, and the fields of METRICS."""

    def __init__(self, pose: Pose, shape: Shape, other: np.ndarray | Callable[[], np.ndarray] | None) -> None:
        """other: [vertices, 3], or a function that returns it: the shape that distances are measured to."""
        self.rest, self.shape = pose.rest, shape
        self.pose, self._other = pose, other

    @cached_property
    def distance(self) -> np.ndarray:
        """float64 [vertices]: distance to the other shape, in the unit of the points; 0 without one."""
        if self._other is None:
            return np.zeros(self.shape.surface.vertex_count)
        other = self._other() if callable(self._other) else self._other
        offset = self.shape.points - _by_axis(other)
        return np.sqrt(dots(offset, offset))

    @cached_property
    def bulge(self) -> np.ndarray:
        """float64 [vertices]: how much farther each is from its bone's axis than at rest, in the unit of the
        points; 0 without weights."""
        bulge, pose = np.zeros(self.shape.surface.vertex_count), self.pose
        skin = pose.skin
        bulge[skin.weighted] = skin.distances_from_axes(self.shape.points, pose.frame.posed_axes)
        bulge[skin.weighted] -= pose.rest_distances
        return bulge

    @cached_property
    def flipped(self) -> np.ndarray:
        """bool [triangles]: those that are inside out against the bones that move them."""
        return dots(self.shape.normals, self.pose.rotated_normals) < 0.0

    @cached_property
    def _limb_changes(self) -> np.ndarray:
        """float64 [limbs]: the volume that each loses or gains."""
        after = self.pose.skin.limbs.volumes(self.shape.points, self.shape.normals)
        return np.abs(after - self.pose.rest_limbs)

    @cached_property
    def limb_change(self) -> float:
        """The volume that limbs lose or gain, as a part of all; NaN where they have none at rest."""
        whole = float(np.abs(self.pose.rest_limbs).sum())
        return float(self._limb_changes.sum()) / whole if whole > 0.0 else float("nan")

    @cached_property
    def limb_losses(self) -> np.ndarray:
        """float64 [vertices]: the volume that the limbs around each lose or gain, as a part of their own, at
        most 1."""
        skin, at_rest = self.pose.skin, self.pose.rest_limbs
        change = self._limb_changes
        # Flat parts have hardly any.
        own = np.maximum(np.abs(at_rest), LEAST_LIMB * np.abs(at_rest).sum())
        return skin.by_weights(np.divide(change, own, out=np.zeros_like(own), where=own > 0.0).clip(max=1.0))

    @property
    def rest_distances(self) -> np.ndarray:
        """float64 [vertices]: how far each is from the axis of its heaviest bone at rest; 0 without one."""
        distances = np.zeros(self.shape.surface.vertex_count)
        distances[self.pose.skin.weighted] = self.pose.rest_distances
        return distances

    @cached_property
    def stretch(self) -> np.ndarray:
        """float64 [edges]: lengths as parts of those at rest; 1 for an edge without length there."""
        return _ratios(self.shape.lengths, self.rest.lengths)

    @cached_property
    def area_ratios(self) -> np.ndarray:
        """float64 [triangles]: areas as parts of those at rest; 1 for a triangle without area there."""
        return _ratios(self.shape.areas, self.rest.areas)

    def entry(self, name: str) -> float:
        """Returns one entry of the summary, or `bulge_worst`, without computing the others."""
        return self._ENTRIES[name](self)

    def by_limb(self) -> dict[str, np.ndarray]:
        """Returns measures of what is bent, float64 [bones], each of the part of the mesh that follows a bone
        most; NaN for a bone that has nothing bent:

        stretch  of edges, RMS
        volume   that the limb gains or loses, as a part of its own
        folded   the share of area that is folded against a neighbour, and is not at rest
        bulge    above zero, RMS
        crease   by how many radians more an edge is bent than at rest, in the mean over that bend: an even
                 bend is spread over many edges
        pinch    by how much the narrowest ring of its joints is narrower than NARROW of its width at rest
        """
        pose, rest, surface = self.pose, self.rest, self.shape.surface
        count, bones = pose.bone_count, pose.skin.limb_of_vertices
        bent = np.flatnonzero(pose.is_bent & (bones >= 0))
        ends = surface.ends[:, pose.bent_edges]
        of_edges = bones[ends].ravel()
        taken, lengths = of_edges >= 0, np.tile(rest.lengths[pose.bent_edges], 2)
        squares = lengths * np.tile((self.stretch - 1.0)[pose.bent_edges] ** 2, 2)
        sums, wholes = (np.bincount(of_edges[taken], each[taken], count) for each in (squares, lengths))
        of_triangles, areas = pose.skin.limb_of_triangles, rest.areas
        taken = pose.bent_triangles & (of_triangles >= 0)
        folded = areas * (self.shape.folded & ~rest.folded)
        folds, of_all = (np.bincount(of_triangles[taken], each[taken], count) for each in (folded, areas))
        squares = np.bincount(bones[bent], self.bulge[bent].clip(min=0.0) ** 2, count)
        swollen = squares / np.maximum(np.bincount(bones[bent], minlength=count), 1)
        volume, changes = np.zeros(count), self._limb_changes
        numbers = np.unique(of_triangles[of_triangles >= 0])
        volume[numbers] = np.divide(
            changes, np.abs(pose.rest_limbs), out=np.zeros_like(changes), where=pose.rest_limbs != 0.0
        )
        (_of_vertices, owners), pinch = pose.skin.rings, np.zeros(count)
        before, widths = pose.rest_ring_widths, pose.skin.ring_widths(self.shape.points)
        ratios = np.divide(widths, before, out=np.ones_like(before), where=before > 0.0)
        for bones_of_rings in owners.T:
            np.maximum.at(pinch, bones_of_rings, NARROW - ratios)
        found = {
            "pinch": pinch,
            "crease": self._creases(),
            "stretch": np.sqrt(np.divide(sums, wholes, out=np.zeros(count), where=wholes > 0.0)),
            "volume": volume,
            "folded": np.divide(folds, of_all, out=np.zeros(count), where=of_all > 0.0),
            "bulge": np.sqrt(swollen),
        }
        return {name: np.where(pose.bent_areas > 0.0, values, np.nan) for name, values in found.items()}

    def _creases(self) -> np.ndarray:
        """float64 [bones], see by_limb(); 0 for a bone that bends nothing."""
        pose, sides = self.pose, self.shape.surface.neighbours
        taken = pose.bent_triangles[sides].any(axis=0)
        more = np.tile((self.shape.bends - self.rest.bends)[taken].clip(min=0.0), 2)
        limbs = pose.skin.limb_of_triangles[sides[:, taken]].ravel()
        # A triangle counts by its size, or a dense part of the mesh would decide.
        more, limbs, widths = (
            each[limbs >= 0] for each in (more, limbs, np.sqrt(self.rest.areas)[sides[:, taken]].ravel())
        )
        squares, sums = (np.bincount(limbs, widths * each, pose.bone_count) for each in (more * more, more))
        return np.divide(squares, sums, out=np.zeros(pose.bone_count), where=sums > 0.0)

    def summary(self) -> Summary:
        entries: dict[str, Any] = {field.name: self.entry(field.name) for field in fields(Summary)}
        return Summary(**entries)

    _ENTRIES: ClassVar[dict[str, Callable[[Measured], float]]] = {
        "distance_max": lambda m: float(m.distance.max(initial=0.0)),
        "distance_rms": lambda m: _rms(m.distance),
        "volume": lambda m: m.shape.volume,
        "volume_change": lambda m: _change(m.shape.volume, m.rest.volume),
        "limb_change": lambda m: m.limb_change,
        "area": lambda m: m.shape.area,
        "area_change": lambda m: _change(m.shape.area, m.rest.area),
        "area_min": lambda m: float(m.area_ratios.min(initial=1.0)),
        "area_max": lambda m: float(m.area_ratios.max(initial=1.0)),
        "area_rms": lambda m: _rms(m.area_ratios - 1.0, m.rest.areas),
        "stretch_min": lambda m: float(m.stretch.min(initial=1.0)),
        "stretch_max": lambda m: float(m.stretch.max(initial=1.0)),
        "stretch_rms": lambda m: _rms(m.stretch - 1.0, m.rest.lengths),
        "bulge_min": lambda m: float(m.bulge.min(initial=0.0)),
        "bulge_max": lambda m: float(m.bulge.max(initial=0.0)),
        "bulge_worst": lambda m: float(np.abs(m.bulge).max(initial=0.0)),
        "flipped_faces": lambda m: int(m.flipped.sum()),
        "flipped_area": lambda m: _share(float(m.rest.areas[m.flipped].sum()), m.rest.area),
    }

    def field(self, name: str) -> np.ndarray:
        """float64 [vertices]: one of METRICS at each vertex."""
        if name == "distance":
            return self.distance
        if name == "bulge":
            return self.bulge
        if name == "stretch":
            return self._most_changed_edges()
        if name == "area":
            return self._around_vertices(self.shape.areas, self.rest.areas, 1.0)
        if name == "flips":
            return self._around_vertices(self.flipped.astype(np.float64), np.ones(len(self.flipped)), 0.0)
        raise ValueError(f"field: expected one of {', '.join(METRICS)}, got {name!r}")

    def _around_vertices(self, values: np.ndarray, wholes: np.ndarray, otherwise: float) -> np.ndarray:
        """float64 [vertices]: the sum of [triangles] around each, as a part of that of `wholes`; `otherwise`
        where that is 0."""
        parts, sums = (_sums(self.shape.surface, each) for each in (values, wholes))
        return np.divide(parts, sums, out=np.full(len(parts), otherwise), where=sums > 0.0)

    def _most_changed_edges(self) -> np.ndarray:
        around = self.shape.surface.edges_around
        longest, shortest = np.ones((2, self.shape.surface.vertex_count))
        stretch = self.stretch.take(around.edges)
        longest[around.vertices] = np.maximum.reduceat(stretch, around.starts)
        shortest[around.vertices] = np.minimum.reduceat(stretch, around.starts)
        longest, shortest = np.maximum(longest, 1.0), np.minimum(shortest, 1.0)
        return np.where(longest * shortest >= 1.0, longest, shortest)


def bone_axes(bones: Bones, matrices: np.ndarray) -> np.ndarray:
    """float64 [bones + joints, 2, 3]: the start and the end of each axis, in the space of `matrices`.

    matrices  [bones + joints, 4, 4], of the bones at rest or posed

    The axis of a bendy bone's joint ends at the next joint; that of the last joint ends at the previous one.
    """
    matrices = matrices.astype(np.float64)
    heads, count = matrices[:, :3, 3], len(bones.names)
    tails = heads.copy()
    tails[:count] = bones.limb_ends(matrices)
    for bone in np.flatnonzero(bones.segments > 1):
        joints = slice(bones.first_joints[bone], bones.first_joints[bone] + bones.segments[bone] + 1)
        tails[joints] = np.concatenate([heads[joints][1:], heads[joints][-2:-1]])
    return np.stack([heads, tails], axis=1)


def _by_axis(points: np.ndarray) -> np.ndarray:
    """float64 [3, n] of [n, 3]: numpy is several times faster on contiguous coordinates."""
    return np.ascontiguousarray(points.T, dtype=np.float64)


def _heaviest_bones(influences: Influences, weighted: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """int [weighted]: the bone with the largest weight of each vertex, the first of equals."""
    largest = np.repeat(np.maximum.reduceat(influences.weights, starts), influences.counts[weighted])
    indices = np.where(influences.weights == largest, np.arange(len(largest)), len(largest))
    return influences.bones[np.minimum.reduceat(indices, starts)].astype(np.int64)


def _ratios(values: np.ndarray, at_rest: np.ndarray) -> np.ndarray:
    """Ratios of `values` to those at rest; 1 where the value at rest is 0."""
    return np.divide(values, at_rest, out=np.ones_like(values), where=at_rest > 0.0)


def _rms(values: np.ndarray, weights: np.ndarray | None = None) -> float:
    if weights is None:
        weights = np.ones_like(values)
    # Not with `@`: starting BLAS's threads takes longer than the sum.
    return float(np.sqrt(_share(float((weights * values * values).sum()), float(weights.sum()))))


def _share(part: float, whole: float) -> float:
    return part / whole if whole != 0.0 else 0.0


def _change(value: float, at_rest: float) -> float:
    """The relative change; NaN where the value at rest is 0."""
    return value / at_rest - 1.0 if at_rest != 0.0 else float("nan")


def _sums(surface: Surface, values: np.ndarray) -> np.ndarray:
    """float64 [vertices]: `values` of triangles, summed at each of their corners."""
    at_corners = [
        np.bincount(corner, weights=values, minlength=surface.vertex_count) for corner in surface.corners
    ]
    return np.sum(at_corners, axis=0)
