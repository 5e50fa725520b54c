# SPDX-License-Identifier: GPL-3.0-or-later
"""Random rigs and meshes in the arrays that sinew.Deformer takes."""

import sys
import threading
from dataclasses import dataclass, replace

import numpy as np
import reference
import sinew
from reference import methods

METHODS = {method.name for method in sinew.methods()}

# Relative to the size of the scene: float32's 6e-8 after some tens of operations.
TOLERANCE = 4e-6
# Nearer to a tie between q and -q than this, both signs are right, and their results far apart.
NO_TIE = 1e-4

# As vertex data: methods blend linearly that keep some.
LINEAR = {method.name: None for method in sinew.methods() if method.vertex_floats}


def random_rotation(rng):
    q = rng.normal(size=4)
    return methods.rotation_of(q)


def about(axis, degrees):
    """float64 [4, 4]: the rotation by `degrees` about `axis` through the origin."""
    half = np.radians(degrees) / 2
    axis = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    matrix = np.eye(4)
    matrix[:3, :3] = methods.rotation_of([np.cos(half), *(np.sin(half) * axis)])
    return matrix


def translation(vector):
    matrix = np.eye(4)
    matrix[:3, 3] = vector
    return matrix


def random_motion(rng, extent=1.0):
    matrix = translation(rng.uniform(-extent, extent, 3))
    matrix[:3, :3] = random_rotation(rng)
    return matrix


def influences(weights):
    """Offsets, bones and weights of the influences, from weights [vertices, bones]."""
    weighted = weights > 0.0
    offsets = np.concatenate([[0], np.cumsum(weighted.sum(axis=1))]).astype(np.int32)
    return offsets, np.nonzero(weighted)[1].astype(np.int32), weights[weighted].astype(np.float32)


def transform(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


@dataclass(frozen=True)
class Rig:
    rest_points: np.ndarray
    offsets: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    transforms: np.ndarray
    rest_bones: np.ndarray
    centres: np.ndarray  # any point for each vertex, about which cor and sdef rotate it

    @property
    def mesh(self):
        return self.rest_points, self.offsets, self.bones, self.weights

    @property
    def vertex_data(self):
        # For every tenth vertex sdef must ignore its data.
        used = np.arange(len(self.centres))[:, None] % 10 != 9
        ends = (self.centres[::-1], np.roll(self.centres, 1, axis=0))
        spheres = np.hstack([self.centres, *ends, used]).astype(np.float32)
        data = {"cor": self.centres.copy(), "sdef": spheres, "ddm": self.moments}
        return {name: values for name, values in data.items() if name in METHODS}

    @property
    def moments(self):
        """The vertex data for ddm: each vertex's own weights, as if all of its neighbourhood were at its
        centre."""
        vertices = np.repeat(np.arange(len(self.centres)), np.diff(self.offsets))
        totals = np.bincount(vertices, self.weights.astype(np.float64), len(self.centres))
        counts = totals[vertices] > 0.0
        order = np.lexsort((self.bones, vertices))
        order = order[counts[order]]
        of = vertices[order]
        weights = (self.weights[order] / totals[of])[:, None]
        seconds = np.zeros((len(of), 6))
        rows = np.hstack([of[:, None], self.bones[order, None], weights, weights * self.centres[of], seconds])
        return rows.astype(np.float32)

    def binding(self):
        return sinew.Binding(*self.mesh, self.rest_bones, self.vertex_data)

    def deformer(self, method):
        return sinew.Deformer(*self.mesh, method, self.rest_bones, self.vertex_data)

    def reference(self, method, parameters=None):
        return reference.deform(
            method, *self.mesh, self.transforms, self.rest_bones, self.vertex_data, parameters
        )

    def deform(self, method, **options):
        return self.deformer(method).deform(self.transforms, **options)

    def with_(self, **fields):
        return replace(self, **{name: np.ascontiguousarray(value) for name, value in fields.items()})

    def with_motions(self, transforms, **fields):
        return self.with_(transforms=np.asarray(transforms, np.float32), **fields)


def random_rig(seed, vertices=200, bones=15, extent=1.0, most_influences=12, scaled=False):
    """Bones with random rotations, and 1 to `most_influences` bones for each vertex. `scaled`: every
    second bone is stretched along its axes, and every second one of those is mirrored."""
    rng = np.random.default_rng(seed)
    rest_bones = np.array([random_motion(rng, extent) for _ in range(bones)])
    transforms = np.array([random_motion(rng, extent) for _ in range(bones)])
    if scaled:
        for bone in range(1, bones, 2):
            factors = rng.uniform(0.4, 2.0, 3)
            if bone % 4 == 3:
                factors[rng.integers(3)] *= -1.0
            rest = rest_bones[bone]
            transforms[bone] = transforms[bone] @ rest @ np.diag([*factors, 1.0]) @ np.linalg.inv(rest)
    counts = rng.integers(1, most_influences + 1, vertices)
    return Rig(
        rest_points=rng.uniform(-extent, extent, (vertices, 3)).astype(np.float32),
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
        bones=np.concatenate([rng.permutation(bones)[:n] for n in counts] or [[]]).astype(np.int32),
        weights=rng.uniform(0.05, 1.0, counts.sum()).astype(np.float32),
        transforms=transforms.astype(np.float32),
        rest_bones=rest_bones.astype(np.float32),
        centres=rng.uniform(-extent, extent, (vertices, 3)).astype(np.float32),
    )


def lets_others_run(call, times):
    """Whether a thread that waits for the GIL gets it during one of so many calls. Python itself never takes
    it away within this time: who works must release it."""
    gate, ready, progress = threading.Lock(), threading.Event(), []

    def work():
        ready.set()
        with gate:
            progress.append(True)

    gate.acquire()
    thread = threading.Thread(target=work)
    thread.start()
    ready.wait()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    try:
        gate.release()
        for _ in range(times):
            call()
            if progress:
                break
        return bool(progress)
    finally:
        sys.setswitchinterval(interval)
        thread.join()
