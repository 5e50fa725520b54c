# SPDX-License-Identifier: GPL-3.0-or-later
"""A tube that bends and twists between two bones, and the effect of methods on it."""

import numpy as np
import sinew
from rigs import LINEAR, about, influences, transform, translation

# The radius of ddm's smoothing.
RADIUS = 0.26


class Tube:
    """Length 4, radius 0.5, along z. Two bones meet in its middle; weights change over the length `over`
    about `middle`."""

    def __init__(self, rings=81, around=32, middle=2.0, over=1.0):
        self.rings, self.around = rings, around
        along = np.repeat(np.linspace(0.0, 4.0, rings), around)
        angle = np.tile(np.linspace(0.0, 2.0 * np.pi, around, endpoint=False), rings)
        self.points = np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), along])
        t = np.clip((along - middle) / over + 0.5, 0.0, 1.0)
        self.weights = np.column_stack([1.0 - t * t * (3.0 - 2.0 * t), t * t * (3.0 - 2.0 * t)])
        ring, i = np.divmod(np.arange((rings - 1) * around), around)
        near, far = ring * around + i, ring * around + (i + 1) % around
        self.quads = np.column_stack([near, far, far + around, near + around])
        self.triangles = np.concatenate([self.quads[:, [0, 1, 2]], self.quads[:, [0, 2, 3]]]).astype(np.int32)

    @property
    def mesh(self):
        return self.points.astype(np.float32), *influences(self.weights)

    def centres(self, **options):
        return sinew.centres_of_rotation(*self.mesh, self.triangles, **options).result()

    def bones(self, axis, degrees):
        joint = translation([0.0, 0.0, 2.0])
        return np.array([np.eye(4), joint @ about(axis, degrees) @ np.linalg.inv(joint)])

    def vertex_data(self, method):
        """The method's vertex data for the tube, as sinew.Binding takes it."""
        if method == "cor":
            return {method: self.centres()}
        if method == "ddm":
            return {method: sinew.direct_delta_mush(*self.mesh, self.triangles, RADIUS).result()}
        return LINEAR

    def deformed(self, method, axis, degrees):
        bones = self.bones(axis, degrees)
        deformer = sinew.Deformer(*self.mesh, method, vertex_data=self.vertex_data(method))
        return deformer.deform(bones.astype(np.float32)).astype(np.float64), bones

    def volume(self, points):
        around, end = self.around, len(points)
        points = np.vstack([points, points[:around].mean(axis=0), points[-around:].mean(axis=0)])
        i = np.arange(around)
        next_i, last = (i + 1) % around, (self.rings - 1) * around
        lids = [np.column_stack([np.full(around, end), next_i, i])]
        lids.append(np.column_stack([np.full(around, end + 1), last + i, last + next_i]))
        a, b, c = (points[corner] for corner in np.concatenate([self.triangles, *lids]).T)
        return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0

    def longest_edge(self, points):
        """Relative to its length at rest."""
        edges = np.concatenate([self.quads[:, [k, (k + 1) % 4]] for k in range(4)]).T
        posed, rest = (np.linalg.norm(p[edges[0]] - p[edges[1]], axis=1) for p in (points, self.points))
        return (posed / rest).max()


def three_bones():
    """A tube with three bones whose weights change along it and around it."""
    tube = Tube(21, 12)
    x, _y, z = tube.points.T
    raw = np.column_stack([np.exp(-((z - c - 0.6 * x) ** 2)) for c in (0.7, 2.1, 3.3)])
    raw[raw < 0.15] = 0.0
    tube.weights = (raw / raw.sum(axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    return tube


def bulge(points, bones):
    """The largest distance from the nearer bone, relative to the radius."""
    joint = np.array([0.0, 0.0, 2.0])
    ends = np.zeros(3), transform(bones[1], np.array([0.0, 0.0, 4.0]))
    distances = []
    for end in ends:
        along = np.clip((points - joint) @ (end - joint) / 4.0, 0.0, 1.0)
        distances.append(np.linalg.norm(points - joint - along[:, None] * (end - joint), axis=1))
    return np.minimum(*distances).max() / 0.5


def numbers(tube, deformed):
    """Volume and bulge bent by 90 degrees, bulge bent by 130, the longest edge bent by 90, volume and
    smallest radius twisted by 170; each is 1 at rest.

    deformed  takes an axis and an angle in degrees; returns points and bones, as Tube.deformed
    """
    bent, bones = deformed((1, 0, 0), 90)
    bent_far, bones_far = deformed((1, 0, 0), 130)
    twisted, _bones = deformed((0, 0, 1), 170)
    volume = tube.volume(tube.points)
    return (
        tube.volume(bent) / volume,
        bulge(bent, bones),
        bulge(bent_far, bones_far),
        tube.longest_edge(bent),
        tube.volume(twisted) / volume,
        np.hypot(*twisted[:, :2].T).min() / 0.5,
    )


# Computed independently of this code, in numpy.
TABLE = {
    "lbs": (0.967, 1.010, 1.003, 1.77, 0.872, 0.09),
    "dq": (1.000, 1.088, 1.105, 2.24, 0.998, 1.0),
    "cor": (0.998, 1.053, 1.033, 2.00, 0.998, 1.0),
}
