# SPDX-License-Identifier: GPL-3.0-or-later
"""A closed tube of two bones, whose measures are known in closed form."""

import numpy as np
import sinew
import tube
from rigs import influences, transform
from sinew_addon.features.measure.metrics import FrameOfRig, Gauge
from sinew_addon.skinning.influences import Influences
from sinew_addon.skinning.surface import Surface

SIDES, RINGS, RADIUS, LENGTH = 24, 81, 0.25, 2.0
IDENTITY = np.eye(4)


def influences_of(weights):
    """weights [vertices, bones]"""
    return Influences(*influences(weights))


class Tube:
    """A closed tube along X from -LENGTH / 2 to LENGTH / 2. Two bones meet in its middle; the second
    bone's weight increases linearly from 0 to 1 from one end to the other."""

    def __init__(self):
        open_tube = tube.Tube(RINGS, SIDES)
        x, y, z = open_tube.points.T
        around = 0.5 * np.stack([z - 2.0, x, y], axis=1)
        self.rest = np.concatenate([around, [[-LENGTH / 2, 0, 0], [LENGTH / 2, 0, 0]]])
        first, last, top = len(around), len(around) + 1, (RINGS - 1) * SIDES
        side = np.arange(SIDES)
        beside = (side + 1) % SIDES
        lids = [(np.full(SIDES, first), beside, side), (np.full(SIDES, last), top + side, top + beside)]
        triangles = np.concatenate([open_tube.triangles, *(np.stack(lid, axis=1) for lid in lids)])
        # Only edges along the tube: their stretch is known.
        edges = open_tube.quads[:, [0, 3]]
        self.surface = Surface(len(self.rest), triangles.astype(np.int32), edges.astype(np.int32))
        second = self.rest[:, 0] / LENGTH + 0.5
        self.second = second
        self.influences = influences_of(np.stack([1.0 - second, second], axis=1))

    def deform(self, method, motion):
        deformer = sinew.Deformer(
            self.rest.astype(np.float32),
            self.influences.offsets,
            self.influences.bones,
            self.influences.weights,
            method,
        )
        return deformer.deform(np.stack([IDENTITY, motion]).astype(np.float32))

    def frame_of(self, motion):
        head, tail = LENGTH / 2 * np.array([[-1, 0, 0], [1, 0, 0]])
        rest_axes = np.array([[head, [0, 0, 0]], [[0, 0, 0], tail]])
        posed_axes = rest_axes.copy()
        posed_axes[1] = transform(motion, rest_axes[1])
        return FrameOfRig(self.rest, rest_axes, posed_axes, np.stack([IDENTITY, motion])[:, :3, :3])

    def measure(self, method, motion, other=None):
        gauge = Gauge(self.surface, self.influences)
        gauge.set_frame(self.frame_of(motion))
        return gauge.measure(self.deform(method, motion), other)
